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

    let rest = neighbour_correlation(whitened());
    let alpha = 4.0 * rest * rest / (1.0 - rest * rest).powi(2);
    let longest = whitened().map(<[f64]>::len).max().unwrap_or(1);
    let width = (1.1447 * (alpha * left_count).cbrt()).round() as usize;
    let width = width.clamp(1, longest);
    let moving: f64 = whitened()
        .map(|stretch| moving_squares(stretch, width))
        .sum();
    let long_run = moving / (width as f64 * left_count) / (1.0 - rho).powi(2);
    (long_run * count / squares).max(1.0)
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
}
