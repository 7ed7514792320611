//! Servo-valve identification with the Bees Algorithm.

mod error;
pub mod evaluate;
pub mod model;
pub mod record;
pub mod report;
pub mod search;

pub use error::{Error, Result};
