//! For whom pages and the terminal tell a result. Files for programs know nothing of it.

mod in_units;
mod language;
mod units;

pub use language::Language;
pub use units::Units;

use super::html_text;

/// How a result is told to people.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Edition {
    /// The units of its numbers.
    pub units: Units,
    /// The language of its pages; the terminal speaks English.
    pub language: Language,
}

impl Edition {
    /// A whole `page` for this edition, which was written in English and, but for its tables and plots, in the units that are
    /// kept.
    pub(super) fn of_page(&self, page: &str) -> String {
        html_text::map(page, |text| self.text(text))
    }

    /// The same for a `text` of it.
    pub(super) fn text(&self, text: &str) -> String {
        self.language.text(&self.units.text(text))
    }
}
