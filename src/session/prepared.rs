//! A problem before its diagnosis.

use super::Diagnosed;
use crate::Result;
use crate::card::{Card, Measured};
use crate::diagnose::{self, IdentificationProblem, Identified, identify};
use crate::evaluate::problem::Series;
use crate::evaluate::{Chosen, Fingerprint, Memory, interrupted};
use crate::report::{Call, Document, Edition, Limit, number};
use crate::search::Plan;
use std::ops::ControlFlow;
use std::time::Instant;

/// A problem before its diagnosis: nothing of what the session was told is open any more.
#[derive(Debug)]
pub struct Prepared {
    pub(super) problem: IdentificationProblem,
    pub(super) options: diagnose::Options,
    pub(super) plan: Plan,
    pub(super) measured: Measured,
    pub(super) knows_full_scale: bool,
    pub(super) limits: Vec<Limit>,
    /// What undermines the result whatever it is.
    pub(super) warnings: Vec<String>,
    pub(super) call: Call,
    pub(super) edition: Edition,
    pub(super) started: Instant,
}

impl Prepared {
    /// Says what was assumed and what was left out.
    pub(super) fn remark(&mut self) {
        let structure = &self.problem.structure;
        let measurements = &mut self.problem.measurements;
        if !self.knows_full_scale {
            measurements.bench.push(format!(
                "full scale is taken to be the largest |command|, {} {}: what the valve card has in shares of it is not \
                 determined until --full-scale or a model file gives it",
                number(structure.full_scale),
                structure.command_unit
            ));
        }
        let used = measurements.used();
        if used < measurements.rows {
            let stretches = measurements.fit.len() + measurements.hold_out.len();
            self.warnings.push(format!(
                "of {} rows {used} are used, in {stretches} stretches all along the records: --max-rows sets how many",
                measurements.rows
            ));
        }
        let choosing = measurements.choosing();
        let looks = self.options.max_effects > 0 && !self.options.effects.is_empty();
        if looks && choosing < used {
            self.warnings.push(format!(
                "effects are chosen by {choosing} of {used} rows, stretches all along the long records; the result is fitted to \
                 all, and its figures are of all, but for the error before and after each effect"
            ));
        }
        if let Some(loss) = self.problem.loss {
            self.warnings.push(format!(
                "in the fits an error costs what {} says, not its square",
                loss.name()
            ));
        }
    }

    /// What is fitted, and on which records.
    pub fn problem(&self) -> &IdentificationProblem {
        &self.problem
    }

    /// The same with what this `memory` remembers, and stopped by what stops it.
    pub fn remembering(mut self, memory: Memory) -> Self {
        self.plan.memory = memory;
        self
    }

    /// The command between two rows is taken as in `other`: one logger wrote both.
    pub(super) fn takes_hold_of(&mut self, other: &Identified) {
        self.problem.structure.hold = other.after.problem.structure.hold;
        self.problem.hold_known = true;
    }

    /// What tells this diagnosis from any other.
    #[doc(hidden)]
    pub fn fingerprint(&self) -> u64 {
        let Self {
            problem,
            plan,
            options,
            ..
        } = self;
        let mut fingerprint = Fingerprint::default();
        fingerprint.text(&format!(
            "identify {:?} {:?} {} {plan:?} {options:?}",
            problem.structure, problem.parameters, problem.hold_known
        ));
        let measurements = &problem.measurements;
        for series in measurements.fit.iter().chain(&measurements.hold_out) {
            tell_of(&mut fingerprint, series);
        }
        fingerprint.finish()
    }

    /// The diagnosis, and the card and the report of its result; `progress` is told each stage and may break off.
    ///
    /// # Errors
    /// As of [`identify`].
    pub fn diagnose(
        self,
        chosen: &mut Chosen,
        progress: &mut dyn FnMut(&str) -> ControlFlow<()>,
    ) -> Result<Diagnosed> {
        let Self { problem, plan, .. } = &self;
        let (identified, of_run) = chosen.run(&plan.memory, |evaluator| {
            identify(
                problem.clone(),
                evaluator,
                plan,
                &self.options,
                &mut *progress,
            )
        })?;
        // What is known is told even to whoever has broken off.
        let _ = progress("valve card");
        let after = &identified.after;
        let hold = after.problem.structure.hold;
        let card = Card::of(&after.problem, &after.fit).beside(self.measured, hold);
        let card = match self.knows_full_scale {
            true => card,
            false => card.without_full_scale(),
        };
        let broken_off = identified.broken_off.as_deref().map(interrupted);
        let warnings = self.warnings.into_iter().chain(of_run).chain(broken_off);
        let mut document = Document::of(
            &identified,
            &card,
            chosen,
            self.plan.seed,
            self.started.elapsed().as_secs_f64(),
            self.call,
            warnings.collect(),
        );
        document.judge(&self.limits);
        Ok(Diagnosed {
            identified,
            card,
            document,
            edition: self.edition,
        })
    }
}

/// Tells `fingerprint` what is measured.
fn tell_of(fingerprint: &mut Fingerprint, series: &Series) {
    fingerprint.text(&series.name).values(&series.time);
    for sample in &series.samples {
        fingerprint
            .values(&sample.input.numbers())
            .values(&sample.target.0)
            .values(&[sample.weight]);
    }
}
