//! Cutting populations into parts, and parts into waves that fit on the device together.

use super::resident::{bytes, items_and_slots};
use crate::evaluate::Job;
use crate::{Error, Result};
use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

/// Bytes of results, states and data of a wave, about.
const WAVE: u64 = 256 << 20;

/// Candidates of a job that are evaluated together.
pub(super) struct Part<'a> {
    /// Number of the job.
    pub(super) number: usize,
    pub(super) job: Job<'a>,
    /// The shader.
    pub(super) source: &'a str,
    /// Which of the job's candidates.
    pub(super) range: Range<usize>,
}

/// Cuts jobs, each with its shader, into waves. No buffer of a part has more than `largest` bytes.
///
/// # Errors
/// If one candidate alone needs more.
pub(super) fn waves<'a>(
    jobs: &[Job<'a>],
    sources: &'a [String],
    largest: u64,
) -> Result<Vec<Vec<Part<'a>>>> {
    let mut waves: Vec<Vec<Part>> = vec![Vec::new()];
    let mut used = 0;
    let mut data = HashSet::new();
    for ((number, &job), source) in jobs.iter().enumerate().zip(sources) {
        let [items, slots] = items_and_slots(&job.problem.data).map(u64::from);
        let results = 16 * slots;
        let states = 4 * items * job.problem.structure.states().len().max(1) as u64;
        let values = 4 * job.population.dimension() as u64;
        let greatest = results.max(states).max(values);
        let most = (largest.min(WAVE) / greatest.max(1)) as usize;
        if most == 0 {
            return Err(Error::failed(
                format!("one candidate needs {greatest} bytes and a buffer has {largest}"),
                "use --evaluator cpu",
            ));
        }
        for first in (0..job.population.len()).step_by(most) {
            let range = first..job.population.len().min(first + most);
            let mut needs = (results + states + values) * range.len() as u64;
            if data.insert(Arc::as_ptr(&job.problem.data)) {
                needs += bytes(&job.problem.data).min(largest);
            }
            if used + needs > WAVE && used > 0 {
                waves.push(Vec::new());
                used = 0;
                data.clear();
            }
            used += needs;
            waves.last_mut().expect("at least one").push(Part {
                number,
                job,
                source,
                range,
            });
        }
    }
    waves.retain(|wave| !wave.is_empty());
    Ok(waves)
}
