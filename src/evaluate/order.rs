//! Candidates that are alike stand beside each other: those of one vector then meet the edges of saturation in the same rows, and
//! a row in which none does is cheap.

use super::{Cost, Job, Population, Problem};
use crate::Result;
use crate::evaluate::problem::Data;

/// Candidates that are not told apart further: as many as go in lockstep on vectors.
const TOGETHER: usize = 16;
/// Candidates that are sorted on one core.
const ON_ONE_CORE: usize = 4096;

/// What `evaluate` finds for `jobs` where like candidates stand beside each other; the costs in the order of the populations.
/// Below `least_rows` sorting takes as long as it saves.
///
/// # Errors
/// Those of `evaluate`.
pub(in crate::evaluate) fn side_by_side(
    jobs: &[Job<'_>],
    least_rows: usize,
    evaluate: impl FnOnce(&[Job<'_>]) -> Result<Vec<Vec<Cost>>>,
) -> Result<Vec<Vec<Cost>>> {
    let orders: Vec<Option<Vec<u32>>> = jobs.iter().map(|job| order(job, least_rows)).collect();
    let sorted = |(job, order): (&Job<'_>, &Option<Vec<u32>>)| {
        let order = order.as_ref()?;
        let mut population = Population::new(job.population.dimension());
        for &number in order {
            population.push(job.population.candidate(number as usize));
        }
        Some(population)
    };
    let populations: Vec<Option<Population>> = jobs.iter().zip(&orders).map(sorted).collect();
    let jobs: Vec<Job<'_>> = jobs
        .iter()
        .zip(&populations)
        .map(|(job, sorted)| Job {
            problem: job.problem,
            population: sorted.as_ref().unwrap_or(job.population),
        })
        .collect();
    let mut costs = evaluate(&jobs)?;
    for (costs, order) in costs.iter_mut().zip(orders) {
        let Some(order) = order else { continue };
        let mut back = vec![Cost::DIVERGED; costs.len()];
        for (cost, number) in costs.drain(..).zip(order) {
            back[number as usize] = cost;
        }
        *costs = back;
    }
    Ok(costs)
}

/// The numbers of a job's candidates, like ones beside each other; `None` where that does not pay.
fn order(job: &Job<'_>, least_rows: usize) -> Option<Vec<u32>> {
    let Job {
        problem,
        population,
    } = job;
    let Data::Series(records) = &*problem.data else {
        return None;
    };
    let rows: usize = records.iter().map(|record| record.samples.len()).sum();
    let pays = problem.has_exact_steps() && rows >= least_rows && population.len() > TOGETHER;
    let axes = if pays {
        axes(problem, population)
    } else {
        Vec::new()
    };
    if axes.is_empty() {
        return None;
    }
    let mut order: Vec<u32> = (0..population.len() as u32).collect();
    halve(&mut order, &axes, 0);
    Some(order)
}

/// Where every candidate lies between the bounds of the parameters that decide when an edge is met, the most telling first.
fn axes(problem: &Problem, population: &Population) -> Vec<Vec<f32>> {
    let free = problem.free();
    let axis = |name: &&str| {
        let index = free.iter().position(|parameter| parameter.name == *name)?;
        let at = |candidate: &[f64]| free[index].to_unit(candidate[index]) as f32;
        Some(population.iter().map(at).collect())
    };
    let names = problem.structure.edges_follow();
    names.iter().filter_map(axis).collect()
}

/// Halves the candidates along one axis after the other.
fn halve(order: &mut [u32], axes: &[Vec<f32>], depth: usize) {
    if order.len() <= TOGETHER {
        return;
    }
    let axis = &axes[depth % axes.len()];
    let middle = (order.len() / 2).next_multiple_of(TOGETHER);
    order.select_nth_unstable_by(middle, |&a, &b| {
        axis[a as usize].total_cmp(&axis[b as usize])
    });
    let alone = order.len() <= ON_ONE_CORE;
    let (low, high) = order.split_at_mut(middle);
    if alone {
        halve(low, axes, depth + 1);
        halve(high, axes, depth + 1);
    } else {
        rayon::join(
            || halve(low, axes, depth + 1),
            || halve(high, axes, depth + 1),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluate::workload;

    const ROWS: usize = 256;

    #[test]
    fn costs_come_back_to_their_candidates() {
        for size in [1, 16, 17, 1000, 10_000] {
            let problem = workload::actuator(ROWS);
            let population = workload::population(&problem, size);
            let mut sorted = false;
            let jobs = [Job {
                problem: &problem,
                population: &population,
            }];
            let costs = side_by_side(&jobs, ROWS, |jobs| {
                let given = jobs[0].population;
                sorted = given != &population;
                let product = |candidate: &[f64]| Cost::finished(candidate.iter().product());
                Ok(vec![given.iter().map(product).collect()])
            });
            assert_eq!(sorted, size > TOGETHER);
            for (cost, candidate) in costs.unwrap()[0].iter().zip(population.iter()) {
                assert_eq!(cost.value, candidate.iter().product::<f64>());
            }
        }
    }

    #[test]
    fn those_of_one_vector_are_alike() {
        let problem = workload::actuator(ROWS);
        let population = workload::population(&problem, 8192);
        let job = Job {
            problem: &problem,
            population: &population,
        };
        let (order, axes) = (order(&job, ROWS).unwrap(), axes(&problem, &population));
        assert_eq!(axes.len(), 3);
        // 512 vectors: eight pieces of each axis.
        for axis in axes {
            let spread = |vector: &[u32]| {
                let at = vector.iter().map(|&number| axis[number as usize]);
                at.clone().fold(0.0, f32::max) - at.fold(1.0, f32::min)
            };
            let mean = order.chunks(TOGETHER).map(spread).sum::<f32>() / 512.0;
            assert!(mean < 0.13, "{mean}");
        }
    }

    #[test]
    fn what_takes_no_exact_steps_or_has_few_rows_stays_as_it_is() {
        for problem in [
            workload::actuator(ROWS - 1),
            workload::with_effects(&["friction"], ROWS),
        ] {
            let population = workload::population(&problem, 100);
            let job = Job {
                problem: &problem,
                population: &population,
            };
            assert_eq!(order(&job, ROWS), None);
        }
    }
}
