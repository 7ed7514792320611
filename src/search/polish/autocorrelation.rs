//! How many coloured residuals carry the information of one independent residual.

/// Largest autoregressive coefficient used for whitening, so that slow residuals are not divided by almost zero.
const MAX_WHITENING: f64 = 0.97;

/// Long-run variance of the residuals over their variance, 1 + 2 Σ ρₖ, at least 1.
///
/// The residuals are whitened by a first-order autoregression ρ, the sum over the lags of what is left is taken under
/// Bartlett's window, and the result divided by (1 − ρ)² (Andrews and Monahan 1992, "An improved
/// heteroskedasticity and autocorrelation consistent covariance matrix estimator"; the window is that of Newey and
/// West 1987, its width the automatic one of Andrews 1991, eq. 6.2 and 6.4). Each of the `stretches` is a run of
/// consecutive residuals: no correlation is looked for across their ends.
///
/// It is the factor by which the variance of a mean grows. A parameter whose gradient varies much faster than the
/// residuals is better determined than this says.
pub fn autocorrelation_inflation(stretches: &[&[f64]]) -> f64 {
    let (squares, count) = power(stretches.iter().copied());
    let rho = neighbour_correlation(stretches.iter().copied()).clamp(-MAX_WHITENING, MAX_WHITENING);
    let whitened: Vec<Vec<f64>> = stretches
        .iter()
        .map(|stretch| {
            stretch
                .windows(2)
                .map(|pair| pair[1] - rho * pair[0])
                .collect()
        })
        .collect();
    let whitened = || whitened.iter().map(Vec::as_slice);
    let (left, left_count) = power(whitened());
    if squares == 0.0 || left == 0.0 {
        return 1.0;
    }

    let longest = whitened().map(<[f64]>::len).max().unwrap_or(1);
    let width = bandwidth(neighbour_correlation(whitened()), left_count).clamp(1, longest);
    let moving: f64 = whitened()
        .map(|stretch| moving_squares(stretch, width))
        .sum();
    let long_run = moving / (width as f64 * left_count) / (1.0 - rho).powi(2);
    (long_run * count / squares).max(1.0)
}

/// The automatic width of Bartlett's window for `count` residuals of a first-order autoregression ρ (Andrews 1991, eq. 6.2
/// and 6.4).
fn bandwidth(rho: f64, count: f64) -> usize {
    let alpha = 4.0 * rho * rho / (1.0 - rho * rho).powi(2);
    (1.1447 * (alpha * count).cbrt()).round() as usize
}

/// Sum of squares and number of the residuals.
fn power<'a>(stretches: impl Iterator<Item = &'a [f64]>) -> (f64, f64) {
    stretches.flatten().fold((0.0, 0.0), |(squares, count), r| {
        (squares + r * r, count + 1.0)
    })
}

/// Correlation of each residual with the next.
fn neighbour_correlation<'a>(stretches: impl Iterator<Item = &'a [f64]> + Clone) -> f64 {
    let products = stretches
        .clone()
        .flat_map(|stretch| stretch.windows(2))
        .map(|pair| pair[0] * pair[1]);
    let (squares, _) = power(stretches);
    if squares > 0.0 {
        products.sum::<f64>() / squares
    } else {
        0.0
    }
}

/// Sum of the squared sums over every window of `width` residuals, those reaching past the ends included.
///
/// It equals `width` Σₖ cₖ (1 − |k|/`width`) with the lagged products cₖ: Bartlett's window in one pass.
fn moving_squares(stretch: &[f64], width: usize) -> f64 {
    let mut sum = 0.0;
    let mut squares = 0.0;
    for end in 0..stretch.len() + width - 1 {
        sum += stretch.get(end).unwrap_or(&0.0);
        squares += sum * sum;
        if end + 1 >= width {
            sum -= stretch[end + 1 - width];
        }
    }
    squares
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn moving_sums_equal_the_bartlett_window() {
        let r = [0.3, -1.2, 0.7, 2.1, -0.4, 0.9];
        for width in 1..=r.len() {
            let lag = |k: usize| (0..r.len() - k).map(|t| r[t] * r[t + k]).sum::<f64>();
            let tail: f64 = (1..width)
                .map(|k| lag(k) * (1.0 - k as f64 / width as f64))
                .sum();
            let expected = width as f64 * (lag(0) + 2.0 * tail);
            assert!(
                (moving_squares(&r, width) - expected).abs() < 1e-12,
                "width {width}"
            );
        }
    }

    #[test]
    fn the_automatic_width_grows_with_correlation_and_count() {
        // 1.1447 (4 ρ² / ((1 − ρ)² (1 + ρ)²) n)^(1/3), by hand.
        for (rho, count, width) in [
            (0.0, 1e4, 0),
            (0.5, 1e3, 14),
            (-0.5, 1e3, 14),
            (0.1, 1e4, 8),
            (0.8, 1e5, 144),
        ] {
            assert_eq!(bandwidth(rho, count), width, "{rho} {count}");
        }
    }

    #[test]
    fn a_mean_of_coloured_residuals_is_as_uncertain_as_their_spectrum_at_zero_says() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let white: Vec<f64> = (0..60_000).map(|_| rng.random_range(-1.0..1.0)).collect();
        let moving: Vec<f64> = white.windows(3).map(|w| w[0] + w[1] + w[2]).collect();
        let autoregressive = |rho: f64| -> Vec<f64> {
            let filter = |state: &mut f64, input: &f64| {
                *state = rho * *state + input;
                Some(*state)
            };
            white.iter().scan(0.0, filter).collect()
        };
        // (1 + ρ) / (1 − ρ); of a moving sum of three its squared gain at zero, 9, over its variance, 3.
        for (residuals, expected, tolerance) in [
            (white.clone(), 1.0, 0.1),
            (autoregressive(0.5), 3.0, 0.1),
            (autoregressive(0.9), 19.0, 0.1),
            (autoregressive(-0.5), 1.0, 0.1),
            // No first-order filter whitens this: what is left depends on the window.
            (moving, 3.0, 0.2),
        ] {
            // The ends of a hundred stretches are no neighbours.
            for length in [residuals.len(), 600] {
                let stretches: Vec<&[f64]> = residuals.chunks(length).collect();
                let found = autocorrelation_inflation(&stretches);
                assert!(
                    (found / expected - 1.0).abs() < tolerance,
                    "{found} instead of {expected} in stretches of {length}"
                );
            }
        }
    }
}
