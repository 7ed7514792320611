//! Two diagnoses of one valve, and what changed between them.

use super::{Diagnosed, Prepared, Session};
use crate::Result;
use crate::card::Measured;
use crate::compare::{Comparison, check_alike, compare};
use crate::evaluate::{Chosen, Fingerprint, Memory};
use crate::record::Record;
use crate::report::{ComparisonDocument, OutputFolder, comparison_page};
use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

/// What changed between two diagnoses, and both of them.
#[derive(Debug)]
pub struct Compared {
    /// The valve before.
    pub before: Diagnosed,
    /// The valve after.
    pub after: Diagnosed,
    /// What changed.
    pub comparison: Comparison,
    /// The report of it: `compare.json`.
    pub document: ComparisonDocument,
}

/// The problems of both sides.
#[derive(Debug)]
pub struct Pair {
    sides: [Prepared; 2],
    started: Instant,
}

impl Session {
    /// Both sides of a comparison, on the base model that all records together ask for.
    ///
    /// # Errors
    /// As of [`check_alike`] and [`Session::prepare`].
    pub fn pair(&self, before: &[Record], after: &[Record]) -> Result<Pair> {
        let started = Instant::now();
        let all: Vec<Record> = before.iter().chain(after).cloned().collect();
        check_alike(before, after)?;
        Ok(Pair {
            sides: [
                self.prepare_among(&all, before, &[])?,
                self.prepare_among(&all, after, &[])?,
            ],
            started,
        })
    }

    /// Diagnoses a valve `before` and `after` something was done to it, and says what changed; `progress` is told each stage and
    /// may break off.
    ///
    /// # Errors
    /// As of [`Session::pair`] and [`Pair::compare`].
    pub fn compare(
        &self,
        before: &[Record],
        after: &[Record],
        chosen: &mut Chosen,
        progress: &mut dyn FnMut(&str) -> ControlFlow<()>,
    ) -> Result<Compared> {
        self.pair(before, after)?.compare(chosen, progress)
    }
}

impl Pair {
    /// The same with what this `memory` remembers, and stopped by what stops it.
    pub fn remembering(self, memory: &Memory) -> Self {
        let sides = self.sides;
        Self {
            sides: sides.map(|side| side.remembering(memory.clone())),
            ..self
        }
    }

    /// What tells this comparison from any other.
    #[doc(hidden)]
    pub fn fingerprint(&self) -> u64 {
        let mut fingerprint = Fingerprint::default();
        fingerprint.text("compare");
        for side in &self.sides {
            fingerprint.text(&format!("{:x}", side.fingerprint()));
        }
        fingerprint.finish()
    }

    /// The diagnoses of both sides, and what changed.
    ///
    /// # Errors
    /// As of [`Prepared::diagnose`] and [`compare`]; it was broken off.
    pub fn compare(
        self,
        chosen: &mut Chosen,
        progress: &mut dyn FnMut(&str) -> ControlFlow<()>,
    ) -> Result<Compared> {
        let [first, mut second] = self.sides;
        let measured: [Measured; 2] = [first.measured.clone(), second.measured.clone()];
        let plan = first.plan.clone();
        let call = first.call.clone();
        let before = first.diagnose(chosen, progress)?;
        second.takes_hold_of(&before.identified);
        let after = second.diagnose(chosen, progress)?;
        let sides = [&before.identified, &after.identified];
        for side in sides {
            plan.memory.check(side.broken_off.as_deref())?;
        }
        let comparison = compare(sides, measured, &plan, progress)?;
        let document = ComparisonDocument::of(
            &comparison,
            [&before.document, &after.document],
            call,
            self.started.elapsed().as_secs_f64(),
        );
        Ok(Compared {
            before,
            after,
            comparison,
            document,
        })
    }
}

impl Compared {
    /// The page: `compare.html`.
    pub fn page(&self) -> String {
        comparison_page(&self.comparison, &self.document, &self.after.edition)
    }

    /// The files of the comparison, each with its name: its report and page, and those of both sides.
    pub fn files(&self) -> Vec<(String, String)> {
        let mut files = vec![
            ("compare.json".to_owned(), self.document.to_json()),
            ("compare.html".to_owned(), self.page()),
        ];
        for (name, side) in [("before", &self.before), ("after", &self.after)] {
            for (file, text) in side.report_files() {
                let end = file.rsplit('.').next().unwrap_or_default();
                files.push((format!("{name}.{end}"), text));
            }
        }
        files
    }

    /// Writes the files into `folder`, which is made; into one that exists only by `force`.
    ///
    /// # Errors
    /// It exists, or cannot be written.
    pub fn write(&self, folder: impl AsRef<Path>, force: bool) -> Result<()> {
        OutputFolder::reserve(folder.as_ref(), force)?.write(&self.files())
    }
}
