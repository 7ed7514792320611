//! Servo-valve identification with the Bees Algorithm.

pub mod diagnose;
mod error;
pub mod evaluate;
pub mod model;
pub mod record;
pub mod report;
pub mod search;

pub use error::{Error, Result};
