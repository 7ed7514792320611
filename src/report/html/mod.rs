//! `report.html`: one file that shows the answer and everything it stands on. It needs no script and nothing beside it.

mod axis;
mod card;
mod convergence;
mod datasheet;
mod diagnosis;
mod figure;
mod page;
mod plot;
mod ranking;
mod role;
mod rows;
mod signature;
mod spectrum;
mod tables;
mod time;
mod words;

pub use datasheet::datasheet_page;
pub use diagnosis::page;
