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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::devices::gpu::Checks;
    use crate::evaluate::devices::gpu::evaluator::BATCH;
    use crate::evaluate::devices::gpu::limits::largest_buffer;
    use crate::evaluate::workload;
    use std::time::Duration;

    const MILLION: usize = 1_000_000;

    #[test]
    fn a_million_candidates_on_a_million_rows_come_in_batches_that_fit() {
        let problem = workload::actuator_and_valve(MILLION);
        let population = workload::population(&problem, MILLION);
        let job = Job {
            problem: &problem,
            population: &population,
        };
        let sources = ["".into()];
        let configuration = Configuration {
            checks: Checks::Off,
            workgroup: 64,
            largest_buffer: largest_buffer(&wgpu::Limits::defaults()),
            limited_loops: false,
            batch: BATCH,
            submission: 0.05,
            timeout: Duration::from_secs(1),
        };
        let written = Written::of(&problem);
        let rows = bytes(&problem.data);
        let (mut done, mut batches) = (0, 0);
        while done < MILLION {
            let batch = next_batch(&[job], &sources, [done], configuration).expect("a batch");
            let mut needs = rows;
            for Portion { range, .. } in batch {
                assert_eq!(range.start, done);
                assert!(range.end > done, "nothing in {range:?}");
                done = range.end;
                let count = range.len() as u64;
                assert!(4 * written.results * count <= configuration.largest_buffer);
                needs += 4 * (written.results + written.states) * count;
            }
            // One portion there has to be, beside the rows.
            assert!(needs <= rows + configuration.batch, "{needs} bytes");
            batches += 1;
        }
        // A slice's sum of each channel: 123 slices of two channels.
        assert_eq!(written.results, 246);
        let fewest = (4 * written.results * MILLION as u64).div_ceil(BATCH);
        assert!(
            (fewest..2 * fewest).contains(&batches),
            "{batches} of {fewest}"
        );
    }
}
