//! `report.html`: one file that shows the answer and everything it stands on. It needs no script and nothing beside it.

mod axis;
mod batch;
mod card;
mod comparison;
mod convergence;
mod datasheet;
mod diagnosis;
mod figure;
mod model;
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

pub use batch::batch_page;
pub use comparison::comparison_page;
pub use datasheet::datasheet_page;
pub use diagnosis::page;
