//! Cutting populations into batches that fit on the device.

use super::configuration::Configuration;
use super::resident::{Written, bytes};
use crate::evaluate::evaluator::Job;
use crate::evaluate::problem::identity::DataIdentity;
use crate::{Error, Result};
use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

/// Candidates of a job in a batch.
pub(super) struct Portion<'a> {
    /// Number of the job.
    pub(super) number: usize,
    pub(super) job: Job<'a>,
    /// The shader.
    pub(super) source: &'a str,
    /// Which of the job's candidates.
    pub(super) range: Range<usize>,
}

/// The next batch of `jobs`, each with its shader, where `done` candidates of each job are done; empty where all are. No
/// buffer of a portion has more than `configuration.largest_buffer` bytes.
///
/// # Errors
/// If one candidate alone needs more.
pub(super) fn next_batch<'a>(
    jobs: &[Job<'a>],
    sources: &'a [Arc<str>],
    done: impl IntoIterator<Item = usize>,
    configuration: Configuration,
) -> Result<Vec<Portion<'a>>> {
    let Configuration {
        largest_buffer,
        batch,
        ..
    } = configuration;
    let mut portions: Vec<Portion> = Vec::new();
    let mut used = 0;
    let mut data = HashSet::new();
    for (((number, &job), source), done) in jobs.iter().enumerate().zip(sources).zip(done) {
        let written = Written::of(job.problem);
        let values = job.population.dimension() as u64;
        let numbers = [
            values,
            written.states,
            written.results,
            written.items.into(),
        ];
        let greatest = 4 * numbers.into_iter().max().unwrap_or(0);
        let all = 4 * numbers.into_iter().sum::<u64>();
        let most = (largest_buffer.min(batch) / greatest.max(1)) as usize;
        if most == 0 {
            return Err(Error::failed(
                format!("one candidate needs {greatest} bytes and a buffer has {largest_buffer}"),
                "use --evaluator cpu",
            ));
        }
        for first in (done..job.population.len()).step_by(most) {
            let range = first..job.population.len().min(first + most);
            let mut needs = all * range.len() as u64;
            if data.insert(DataIdentity::of(&job.problem.data)) {
                needs += bytes(&job.problem.data).min(largest_buffer);
            }
            if used + needs > batch && used > 0 {
                return Ok(portions);
            }
            used += needs;
            portions.push(Portion {
                number,
                job,
                source,
                range,
            });
        }
    }
    Ok(portions)
}
