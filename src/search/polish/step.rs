//! The damped Gauss-Newton step within bounds.

use nalgebra::linalg::QR;
use nalgebra::{DMatrix, DVector};

use super::Triangle;

/// The step s with `low` ≤ s ≤ `high` that minimises |r + J s|² + `damping` |D s|², D = diag(`norms`).
///
/// Primal active set (Nocedal and Wright, Numerical Optimization, 16.5): move towards the minimum over the parameters
/// that are not held, hold the first one that meets its bound, release one that its bound no longer resists.
/// Every move lowers the damped model, so the step descends even if the loop is cut short.
pub(super) fn bounded_step(
    triangle: &Triangle,
    damping: f64,
    norms: &DVector<f64>,
    low: &DVector<f64>,
    high: &DVector<f64>,
) -> DVector<f64> {
    let count = triangle.columns();
    // A parameter without any effect so far has no norm: any positive number keeps it from moving.
    let weight = norms.map(|norm| damping.sqrt() * if norm > 0.0 { norm } else { 1.0 });
    let mut matrix = DMatrix::zeros(2 * count, count);
    matrix.rows_mut(0, count).copy_from(&triangle.r());
    matrix
        .rows_mut(count, count)
        .copy_from(&DMatrix::from_diagonal(&weight));
    let mut right = DVector::zeros(2 * count);
    right.rows_mut(0, count).copy_from(&-triangle.projected());

    let mut step = DVector::zeros(count);
    let mut held: Vec<bool> = (0..count).map(|j| low[j] == high[j]).collect();
    for _ in 0..4 * count + 4 {
        let free: Vec<usize> = (0..count).filter(|&j| !held[j]).collect();
        let remaining = &right - &matrix * &step;
        let change = least_squares(matrix.select_columns(&free), remaining);
        let mut fraction = 1.0;
        let mut blocking = None;
        for (&j, &change) in free.iter().zip(&change) {
            let bound = if change < 0.0 { low[j] } else { high[j] };
            if change != 0.0 && (bound - step[j]) / change < fraction {
                fraction = (bound - step[j]) / change;
                blocking = Some((j, bound));
            }
        }
        for (&j, &change) in free.iter().zip(&change) {
            step[j] += fraction * change;
        }
        if let Some((j, bound)) = blocking {
            step[j] = bound;
            held[j] = true;
            continue;
        }
        let descent = matrix.tr_mul(&(&right - &matrix * &step));
        let inward = |j: &usize| {
            let j = *j;
            let noise = 1e-12 * matrix.column(j).norm() * right.norm();
            low[j] < high[j]
                && held[j]
                && ((step[j] <= low[j] && descent[j] > noise)
                    || (step[j] >= high[j] && descent[j] < -noise))
        };
        match (0..count).filter(inward).max_by(|&a, &b| {
            let pull = |j: usize| descent[j].abs() / matrix.column(j).norm();
            pull(a).total_cmp(&pull(b))
        }) {
            Some(j) => held[j] = false,
            None => break,
        }
    }
    step
}

/// Solves an overdetermined system of full rank in the least-squares sense.
fn least_squares(matrix: DMatrix<f64>, mut right: DVector<f64>) -> DVector<f64> {
    let count = matrix.ncols();
    if count == 0 {
        return DVector::zeros(0);
    }
    let qr = QR::new(matrix);
    qr.q_tr_mul(&mut right);
    qr.unpack_r()
        .solve_upper_triangular(&right.rows(0, count))
        .unwrap_or_else(|| DVector::zeros(count))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn steps_meet_the_optimality_conditions_of_the_bounded_problem() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let count = 6;
        let mut held = 0;
        for round in 0..200 {
            // Whether values are small or large makes no difference.
            let size = [1.0, 1e4, 1e-4][round % 3];
            let triangle = Triangle::gather(count, |row| {
                for _ in 0..10 {
                    let gradient: Vec<f64> =
                        (0..count).map(|_| random.random::<f64>() - 0.3).collect();
                    row(size * (random.random::<f64>() - 0.5), &gradient);
                }
                true
            })
            .unwrap();
            let norms = triangle.column_norms();
            // Some parameters start on a bound: no room to one side.
            let mut side = || size * (random.random::<f64>() - 0.3).max(0.0);
            let low = DVector::from_fn(count, |_, _| -side());
            let high = DVector::from_fn(count, |_, _| side());
            let damping = 1e-3;
            let step = bounded_step(&triangle, damping, &norms, &low, &high);

            let pull = damping * norms.component_mul(&norms).component_mul(&step);
            let descent =
                -triangle.gradient() - triangle.r().tr_mul(&(triangle.r() * &step)) - pull;
            for j in 0..count {
                assert!(low[j] <= step[j] && step[j] <= high[j]);
                let resisted = (descent[j] < 0.0 && step[j] == low[j])
                    || (descent[j] > 0.0 && step[j] == high[j]);
                assert!(
                    resisted || descent[j].abs() < 1e-10 * size,
                    "{j}: {descent} {step}"
                );
                held += usize::from(resisted);
            }
            assert!(triangle.predicted_decrease(&step) >= 0.0);
        }
        assert!(
            held > 200,
            "too few bounds were active to test anything: {held}"
        );
    }
}
