//! A diagnosis with all that belongs to it.

use super::files::{model_toml, residual_csv};
use crate::Result;
use crate::card::Card;
use crate::diagnose::Identified;
use crate::report::{Document, Edition, OutputFolder, page};
use std::path::Path;

/// A diagnosis with all that belongs to it.
#[derive(Debug)]
pub struct Diagnosed {
    /// What was found.
    pub identified: Identified,
    /// The valve card of the result.
    pub card: Card,
    /// The report: `report.json`.
    pub document: Document,
    /// The units and the language of the page.
    pub edition: Edition,
}

impl Diagnosed {
    /// The page: `report.html`.
    pub fn page(&self) -> String {
        page(&self.identified, &self.document, &self.card, &self.edition)
    }

    /// The files of the result, each with its name: report, page, model, and every row measured and simulated.
    pub fn files(&self) -> Vec<(String, String)> {
        let mut files = self.report_files();
        files.push(("residual.csv".into(), residual_csv(&self.identified)));
        files
    }

    /// Those of them that are no longer with a longer record.
    pub fn report_files(&self) -> Vec<(String, String)> {
        vec![
            ("report.json".into(), self.document.to_json()),
            ("report.html".into(), self.page()),
            ("model.toml".into(), model_toml(&self.identified)),
        ]
    }

    /// Writes the files into `folder`, which is made; into one that exists only by `force`.
    ///
    /// # Errors
    /// It exists, or cannot be written.
    pub fn write(&self, folder: impl AsRef<Path>, force: bool) -> Result<()> {
        OutputFolder::reserve(folder.as_ref(), force)?.write(&self.files())
    }
}
