//! Intervals, identifiability and profiles.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servobee::model::Parameter;
use servobee::search::polish::{
    Interval, Kind, LeastSquares, PolishOptions, Polished, Uncertainty, UncertaintyOptions,
    Unidentifiable, autocorrelation_inflation, polish, profile,
};

use super::problems::{Curve, Valley, unbounded};

fn polished(
    problem: &mut dyn LeastSquares,
    parameters: &[Parameter],
    start: &[f64],
) -> (Polished, Uncertainty) {
    let polished = polish(problem, parameters, start, &PolishOptions::default()).unwrap();
    let uncertainty = Uncertainty::new(parameters, &polished, &UncertaintyOptions::default());
    (polished, uncertainty)
}

/// y = a + b x through five points: a = 0.17, b = 0.98, Σ(x − x̄)² = 10.
fn line() -> Curve {
    Curve {
        points: vec![(1.0, 1.1), (2.0, 2.3), (3.0, 2.9), (4.0, 4.2), (5.0, 5.05)],
        model: |x, p, gradient| {
            gradient.copy_from_slice(&[1.0, x]);
            p[0] + p[1] * x
        },
    }
}

/// Textbook half-widths of the 95 % intervals of `line`: t s √(1/n + x̄²/S) and t s/√S, with t(3) = 3.182446305.
fn line_half_widths(cost: f64) -> [f64; 2] {
    let ts = 3.182_446_305_284_263 * (cost / 3.0).sqrt();
    [ts * (0.2_f64 + 9.0 / 10.0).sqrt(), ts / 10.0_f64.sqrt()]
}

fn assert_interval(interval: &Interval, centre: f64, half_width: f64, tolerance: f64) {
    let off = |limit: f64, expected: f64| (limit - expected).abs() < tolerance * half_width;
    assert!(
        off(interval.low, centre - half_width) && off(interval.high, centre + half_width),
        "{interval:?} instead of {centre} ± {half_width}"
    );
    assert!(!interval.open_low && !interval.open_high);
}

#[test]
fn a_line_has_the_textbook_intervals() {
    let parameters = [unbounded("a"), unbounded("b")];
    let (polished, uncertainty) = polished(&mut line(), &parameters, &[0.0, 0.0]);
    assert!(
        (polished.values[0] - 0.17).abs() < 1e-9,
        "{:?}",
        polished.values
    );
    assert!((polished.values[1] - 0.98).abs() < 1e-9);
    assert_eq!(uncertainty.degrees_of_freedom, 3.0);
    assert!(uncertainty.unidentifiable.is_empty());
    let half_widths = line_half_widths(polished.cost);
    for (j, &half_width) in half_widths.iter().enumerate() {
        assert_interval(
            &uncertainty.intervals[j],
            polished.values[j],
            half_width,
            1e-9,
        );
    }
}

#[test]
fn the_profile_of_a_linear_problem_is_the_textbook_interval() {
    let parameters = [unbounded("a"), unbounded("b")];
    let (polished, mut uncertainty) = polished(&mut line(), &parameters, &[0.0, 0.0]);
    let half_widths = line_half_widths(polished.cost);
    // The curvature's own limits would be met at once: make the search bracket and refine.
    for interval in &mut uncertainty.intervals {
        interval.low -= 1.0;
        interval.high += 0.3;
    }
    for (j, &half_width) in half_widths.iter().enumerate() {
        let interval = profile(
            &mut line(),
            &parameters,
            &polished,
            &uncertainty,
            j,
            &PolishOptions::default(),
        );
        assert_interval(&interval, polished.values[j], half_width, 2e-3);
    }
}

#[test]
fn a_bound_cuts_an_interval_and_says_so() {
    let parameters = [
        Parameter::linear("a", "V", 0.0, 0.0, 10.0),
        Parameter::linear("b", "V", -10.0, 0.0, 10.0),
    ];
    let (_, uncertainty) = polished(&mut line(), &parameters, &[0.0, 0.0]);
    let [a, b] = [uncertainty.intervals[0], uncertainty.intervals[1]];
    assert!(a.low == 0.0 && a.open_low && !a.open_high, "{a:?}");
    assert!(!b.open_low && !b.open_high);
}

#[test]
fn a_parameter_on_its_bound_leaves_the_covariance_of_the_others() {
    // With a held at 0.5 the line has the slope Σx(y − 0.5)/Σx² and the error s/√Σx², four degrees of freedom.
    let parameters = [Parameter::linear("a", "V", 0.5, 1.0, 10.0), unbounded("b")];
    let (polished, uncertainty) = polished(&mut line(), &parameters, &[3.0, 0.0]);
    assert_eq!(polished.values[0], 0.5);
    assert_eq!(uncertainty.intervals[0], Interval::whole(&parameters[0]));
    assert_eq!(uncertainty.degrees_of_freedom, 4.0);
    let expected = (polished.cost / 4.0 / 55.0).sqrt();
    assert!((uncertainty.standard_errors[1].unwrap() / expected - 1.0).abs() < 1e-9);
    assert_eq!(uncertainty.standard_errors[0], None);
}

#[test]
fn a_product_names_both_factors_and_keeps_the_rest() {
    // y = area · coefficient · x + offset, gain without effect.
    let mut problem = Curve {
        model: |x, p, gradient| {
            gradient.copy_from_slice(&[p[1] * x, p[0] * x, 1.0, 0.0]);
            p[0] * p[1] * x + p[2]
        },
        ..line()
    };
    let parameters = [
        Parameter::log("max_area", "m²", 0.01, 1.0, 100.0),
        Parameter::linear("discharge_coefficient", "1", 0.1, 0.7, 2.0),
        unbounded("offset"),
        Parameter::linear("saturation", "V", 0.0, 5.0, 10.0),
    ];
    let (polished, uncertainty) = polished(&mut problem, &parameters, &[1.0, 0.7, 0.0, 5.0]);
    assert!((polished.values[0] * polished.values[1] - 0.98).abs() < 1e-9);
    assert_eq!(
        uncertainty.unidentifiable,
        [
            Unidentifiable {
                parameters: vec![3],
                kind: Kind::NoEffect
            },
            Unidentifiable {
                parameters: vec![0, 1],
                kind: Kind::Combination
            },
        ]
    );
    let words: Vec<String> = uncertainty
        .unidentifiable
        .iter()
        .map(|group| group.describe(&parameters))
        .collect();
    assert_eq!(words[0], "saturation: the data does not depend on it");
    assert_eq!(
        words[1],
        "max_area and discharge_coefficient: only a combination is determined"
    );
    // Two directions are fitted, and the offset is as well determined as on a plain line.
    assert_eq!(uncertainty.degrees_of_freedom, 3.0);
    assert_interval(
        &uncertainty.intervals[2],
        0.17,
        line_half_widths(polished.cost)[0],
        1e-6,
    );
    assert_eq!(uncertainty.intervals[0], Interval::whole(&parameters[0]));
}

#[test]
fn independent_ties_are_named_apart() {
    // a·b acts on the even points, c·d on the odd ones.
    let mut problem = Curve {
        points: (1..=10)
            .map(f64::from)
            .map(|x| (x, 2.0 * x + (7.0 * x).sin()))
            .collect(),
        model: |x, p, gradient| {
            let first = if x % 2.0 == 0.0 { 0 } else { 2 };
            gradient.fill(0.0);
            gradient[first] = p[first + 1] * x;
            gradient[first + 1] = p[first] * x;
            p[first] * p[first + 1] * x
        },
    };
    let parameters = ["a", "b", "c", "d"].map(|name| Parameter::linear(name, "1", 0.1, 1.0, 10.0));
    let (_, uncertainty) = polished(&mut problem, &parameters, &[1.0, 1.0, 2.0, 2.0]);
    let groups: Vec<&[usize]> = uncertainty
        .unidentifiable
        .iter()
        .map(|group| group.parameters.as_slice())
        .collect();
    assert_eq!(groups, [&[0, 1], &[2, 3]]);
}

#[test]
fn a_weak_pair_is_named() {
    // Two lags that only their sum shows, but for a tiny part below the noise.
    let mut problem = Curve {
        points: (0..50)
            .map(|i| f64::from(i) / 10.0)
            .map(|t| (t, 0.3 * t + 0.05 * (37.0 * t).sin()))
            .collect(),
        model: |t, p, gradient| {
            gradient.copy_from_slice(&[t, t + 1e-3 * t * t]);
            p[0] * t + p[1] * (t + 1e-3 * t * t)
        },
    };
    let parameters = ["delay", "lag"].map(|name| Parameter::linear(name, "s", -1.0, 0.0, 1.0));
    let (_, uncertainty) = polished(&mut problem, &parameters, &[0.1, 0.1]);
    assert_eq!(uncertainty.unidentifiable.len(), 1);
    assert_eq!(uncertainty.unidentifiable[0].kind, Kind::Weak);
    assert_eq!(
        uncertainty.unidentifiable[0].describe(&parameters),
        "delay and lag: the data hardly tells them apart"
    );
}

#[test]
fn two_weak_pairs_are_told_apart() {
    let half = |i: i32| f64::from(i % 50) / 10.0;
    let mut problem = Curve {
        points: (0..100)
            .map(|i| (half(i) + if i < 50 { 0.0 } else { 100.0 }, half(i)))
            .map(|(x, t)| (x, 0.3 * t + 0.05 * (37.0 * x).sin()))
            .collect(),
        model: |x, p, gradient| {
            let (first, t) = if x < 100.0 { (0, x) } else { (2, x - 100.0) };
            gradient.fill(0.0);
            gradient[first] = t;
            gradient[first + 1] = t + 1e-3 * t * t;
            p[first] * t + p[first + 1] * (t + 1e-3 * t * t)
        },
    };
    let names = ["delay", "lag", "other delay", "other lag"];
    let parameters = names.map(|name| Parameter::linear(name, "s", -1.0, 0.0, 1.0));
    let (_, uncertainty) = polished(&mut problem, &parameters, &[0.1; 4]);
    let groups = uncertainty.unidentifiable;
    assert!(groups.iter().all(|group| group.kind == Kind::Weak));
    let groups: Vec<&[usize]> = groups.iter().map(|group| &group.parameters[..]).collect();
    assert_eq!(groups, [&[0, 1], &[2, 3]]);
}

#[test]
fn as_many_parameters_as_residuals_leave_no_interval() {
    let parameters = [unbounded("a"), unbounded("b")];
    let (_, uncertainty) = polished(&mut Valley, &parameters, &[-1.2, 1.0]);
    assert_eq!(uncertainty.standard_errors, [None, None]);
    assert_eq!(uncertainty.intervals[0], Interval::whole(&parameters[0]));
}

/// y = min(x, saturation) for x up to 1: above 1 a saturation has no effect.
fn saturated(saturation: f64, noise: f64) -> Curve {
    let points = (0..=100).map(|i| f64::from(i) / 100.0);
    Curve {
        points: points
            .map(|x| (x, x.min(saturation) + noise * (137.0 * x * x).sin()))
            .collect(),
        model: |x, p, gradient| {
            gradient[0] = if x < p[0] { 0.0 } else { 1.0 };
            x.min(p[0])
        },
    }
}

#[test]
fn the_profile_of_a_saturation_that_is_never_reached_is_open_above() {
    let parameters = [Parameter::log("saturation", "V", 0.1, 1.0, 10.0)];
    let mut problem = saturated(5.0, 0.01);
    let (polished, uncertainty) = polished(&mut problem, &parameters, &[3.0]);
    assert_eq!(uncertainty.unidentifiable[0].kind, Kind::NoEffect);
    let interval = profile(
        &mut problem,
        &parameters,
        &polished,
        &uncertainty,
        0,
        &PolishOptions::default(),
    );
    assert!(interval.open_high && interval.high == 10.0, "{interval:?}");
    assert!(
        !interval.open_low && (0.9..1.0).contains(&interval.low),
        "{interval:?}"
    );
    // The cost has risen by its margin there, to within the precision of the limit: 0.1 % of its distance, 1.1 e-folds.
    let mut excess = |factor: f64| {
        let rise = problem.cost(&[factor * interval.low]).unwrap() - polished.cost;
        rise / uncertainty.cost_margin
    };
    let (inside, outside) = (excess(1.002), excess(0.998));
    assert!(inside < 1.0 && 1.0 < outside, "{inside} {outside}");
}

#[test]
fn the_profile_of_a_saturation_that_is_reached_is_closed() {
    let parameters = [Parameter::log("saturation", "V", 0.1, 1.0, 10.0)];
    let mut problem = saturated(0.6, 0.01);
    let (polished, uncertainty) = polished(&mut problem, &parameters, &[0.8]);
    let interval = profile(
        &mut problem,
        &parameters,
        &polished,
        &uncertainty,
        0,
        &PolishOptions::default(),
    );
    assert!(!interval.open_low && !interval.open_high);
    assert!(interval.low < 0.6 && 0.6 < interval.high, "{interval:?}");
    assert!(interval.high - interval.low < 0.02, "{interval:?}");
}

/// A standard normal deviate, by Box and Muller.
fn normal(random: &mut ChaCha8Rng) -> f64 {
    let (u, v): (f64, f64) = (random.random(), random.random());
    (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
}

/// Shares of 500 replicates of a first-order step response in whose 95 % intervals the true gain and time constant
/// lie, without and with the autocorrelation's inflation. The noise is autoregressive with coefficient `rho`.
fn coverage(rho: f64, samples: usize) -> [[f64; 2]; 2] {
    let truth = [2.0, 0.5];
    let parameters = [
        Parameter::linear("gain", "1", 0.0, 1.0, 10.0),
        Parameter::log("lag", "s", 0.01, 1.0, 10.0),
    ];
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut hits = [[0.0; 2]; 2];
    let replicates = 500;
    for _ in 0..replicates {
        let mut noise = normal(&mut random) / (1.0 - rho * rho).sqrt();
        let mut problem = Curve {
            points: Vec::new(),
            model: |t, p, gradient| {
                let decay = (-t / p[1]).exp();
                gradient.copy_from_slice(&[1.0 - decay, -p[0] * decay * t / (p[1] * p[1])]);
                p[0] * (1.0 - decay)
            },
        };
        for i in 0..samples {
            let t = 3.0 * i as f64 / samples as f64;
            let exact = (problem.model)(t, &truth, &mut [0.0; 2]);
            problem.points.push((t, exact + 0.1 * noise));
            noise = rho * noise + normal(&mut random);
        }
        let polished = polish(
            &mut problem,
            &parameters,
            &[1.0, 1.0],
            &PolishOptions::default(),
        )
        .unwrap();
        let inflation = autocorrelation_inflation(&[&problem.residuals(&polished.values)]);
        for (hits, inflation) in hits.iter_mut().zip([1.0, inflation]) {
            let options = UncertaintyOptions {
                inflation,
                ..Default::default()
            };
            let uncertainty = Uncertainty::new(&parameters, &polished, &options);
            for j in 0..2 {
                let interval = uncertainty.intervals[j];
                hits[j] += f64::from(interval.low <= truth[j] && truth[j] <= interval.high)
                    / f64::from(replicates);
            }
        }
    }
    hits
}

#[test]
fn intervals_cover_the_truth_in_white_noise() {
    for share in coverage(0.0, 60).into_iter().flatten() {
        assert!((0.93..=0.97).contains(&share), "{share}");
    }
}

#[test]
fn inflation_restores_the_coverage_in_coloured_noise() {
    let [without, with] = coverage(0.8, 400);
    for j in 0..2 {
        assert!(without[j] < 0.75, "{without:?}");
        assert!((0.90..=0.98).contains(&with[j]), "{with:?}");
    }
}

#[test]
fn the_inflation_of_white_and_coloured_residuals() {
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let white: Vec<f64> = (0..20_000).map(|_| normal(&mut random)).collect();
    assert!(autocorrelation_inflation(&[&white]) < 1.1);
    let mut state = 0.0;
    let coloured: Vec<f64> = white
        .iter()
        .map(|e| {
            state = 0.9 * state + e;
            state
        })
        .collect();
    // A first-order autoregression has (1 + ρ)/(1 − ρ) = 19.
    let whole = autocorrelation_inflation(&[&coloured]);
    assert!((15.0..22.0).contains(&whole), "{whole}");
    let (first, second) = coloured.split_at(8000);
    let parts = autocorrelation_inflation(&[first, second]);
    assert!((parts / whole - 1.0).abs() < 0.05, "{parts} {whole}");
    assert_eq!(autocorrelation_inflation(&[&[]]), 1.0);
}
