//! Cutting populations into parts, and parts into waves that fit on the device together.

use super::resident::{bytes, items_and_slots};
use super::station::Manner;
use crate::evaluate::Job;
use crate::{Error, Result};
use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

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

/// The next candidates of jobs, each with its shader, that fit on the device together, where `done` of each job's are
/// done; empty where all are. No buffer of a part has more than `manner.largest` bytes.
///
/// # Errors
/// If one candidate alone needs more.
pub(super) fn next<'a>(
    jobs: &[Job<'a>],
    sources: &'a [Arc<str>],
    done: impl IntoIterator<Item = usize>,
    manner: Manner,
) -> Result<Vec<Part<'a>>> {
    let Manner { largest, wave, .. } = manner;
    let mut parts: Vec<Part> = Vec::new();
    let mut used = 0;
    let mut data = HashSet::new();
    for (((number, &job), source), done) in jobs.iter().enumerate().zip(sources).zip(done) {
        let [items, slots] = items_and_slots(&job.problem.data).map(u64::from);
        let results = 16 * slots;
        let states = 4 * items * job.problem.structure.states().len().max(1) as u64;
        let values = 4 * job.population.dimension() as u64;
        let greatest = results.max(states).max(values);
        let most = (largest.min(wave) / greatest.max(1)) as usize;
        if most == 0 {
            return Err(Error::failed(
                format!("one candidate needs {greatest} bytes and a buffer has {largest}"),
                "use --evaluator cpu",
            ));
        }
        for first in (done..job.population.len()).step_by(most) {
            let range = first..job.population.len().min(first + most);
            let mut needs = (results + states + values) * range.len() as u64;
            if data.insert(Arc::as_ptr(&job.problem.data)) {
                needs += bytes(&job.problem.data).min(largest);
            }
            if used + needs > wave && used > 0 {
                return Ok(parts);
            }
            used += needs;
            parts.push(Part {
                number,
                job,
                source,
                range,
            });
        }
    }
    Ok(parts)
}
