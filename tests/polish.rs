//! The polish against closed forms, certified solutions and its own promises.

use servobee::model::Parameter;
use servobee::search::polish::{Bound, LeastSquares, PolishOptions, Stop, polish};

/// y = model(x, parameters) with the model's gradient, fitted to (x, y).
struct Curve<F> {
    data: Vec<(f64, f64)>,
    model: F,
}

impl<F: FnMut(f64, &[f64], &mut [f64]) -> f64> LeastSquares for Curve<F> {
    fn rows(&mut self, candidate: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        let mut gradient = vec![0.0; candidate.len()];
        for &(x, y) in &self.data {
            let simulated = (self.model)(x, candidate, &mut gradient);
            gradient.iter_mut().for_each(|slope| *slope = -*slope);
            row(y - simulated, &gradient);
        }
        true
    }

    fn cost(&mut self, candidate: &[f64]) -> Option<f64> {
        let mut gradient = vec![0.0; candidate.len()];
        let squares = self
            .data
            .iter()
            .map(|&(x, y)| (y - (self.model)(x, candidate, &mut gradient)).powi(2));
        let cost: f64 = squares.sum();
        cost.is_finite().then_some(cost)
    }
}

/// A parameter without bounds.
fn unbounded(name: &str) -> Parameter {
    Parameter::linear(name, "1", f64::NEG_INFINITY, 0.0, f64::INFINITY)
}

/// Rosenbrock's valley, residuals 10 (b − a²) and 1 − a: minimum 0 at (1, 1).
struct Valley;

impl LeastSquares for Valley {
    fn rows(&mut self, at: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        row(10.0 * (at[1] - at[0] * at[0]), &[-20.0 * at[0], 10.0]);
        row(1.0 - at[0], &[-1.0, 0.0]);
        true
    }

    fn cost(&mut self, at: &[f64]) -> Option<f64> {
        Some(100.0 * (at[1] - at[0] * at[0]).powi(2) + (1.0 - at[0]).powi(2))
    }
}

#[test]
fn follows_a_curved_valley() {
    let polished = polish(
        &mut Valley,
        &[unbounded("a"), unbounded("b")],
        &[-1.2, 1.0],
        &PolishOptions::default(),
    )
    .unwrap();
    assert!(polished.stop.converged());
    assert!(polished.iterations < 50, "{}", polished.iterations);
    for value in polished.values {
        assert!((value - 1.0).abs() < 1e-9, "{value}");
    }
}

#[test]
fn stops_on_the_bound_of_a_valley() {
    // With a ≤ 0.5 the minimum is at a = 0.5, b = 0.25, cost 0.25.
    let parameters = [
        Parameter::linear("a", "1", -2.0, 0.0, 0.5),
        Parameter::linear("b", "1", -2.0, 0.0, 2.0),
    ];
    let polished = polish(
        &mut Valley,
        &parameters,
        &[-1.2, 1.0],
        &PolishOptions::default(),
    )
    .unwrap();
    assert_eq!(polished.values[0], 0.5);
    assert!((polished.values[1] - 0.25).abs() < 1e-9);
    assert!((polished.cost - 0.25).abs() < 1e-12);
    assert_eq!(polished.at_bound, [Some(Bound::High), None]);
    assert!(polished.stop.converged());
}

#[test]
fn a_parameter_can_leave_its_bound() {
    let parameters = [
        Parameter::linear("a", "1", -2.0, 0.0, 2.0),
        Parameter::linear("b", "1", -2.0, 0.0, 2.0),
    ];
    let polished = polish(
        &mut Valley,
        &parameters,
        &[-2.0, 2.0],
        &PolishOptions::default(),
    )
    .unwrap();
    assert!((polished.values[0] - 1.0).abs() < 1e-9);
    assert_eq!(polished.at_bound, [None, None]);
}

#[test]
fn the_iteration_limit_is_reported() {
    let options = PolishOptions {
        max_iterations: 3,
        ..Default::default()
    };
    let polished = polish(
        &mut Valley,
        &[unbounded("a"), unbounded("b")],
        &[-1.2, 1.0],
        &options,
    )
    .unwrap();
    assert_eq!(polished.stop, Stop::Iterations);
    assert_eq!(polished.iterations, 3);
}

/// |a| + 1 as residual: a kink at the minimum, and diverging beyond 3.
struct Kink;

impl LeastSquares for Kink {
    fn rows(&mut self, at: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
        row(at[0].abs() + 1.0, &[at[0].signum()]);
        at[0].abs() < 3.0
    }

    fn cost(&mut self, at: &[f64]) -> Option<f64> {
        (at[0].abs() < 3.0).then(|| (at[0].abs() + 1.0).powi(2))
    }
}

#[test]
fn ends_at_a_kink_without_an_increase() {
    let options = PolishOptions::default();
    let polished = polish(&mut Kink, &[unbounded("a")], &[2.5], &options).unwrap();
    assert!(polished.stop.converged(), "{:?}", polished.stop);
    assert!(polished.values[0].abs() < 1e-4, "{:?}", polished);
    assert!(polish(&mut Kink, &[unbounded("a")], &[4.0], &options).is_err());
}

#[test]
fn a_log_parameter_and_a_fixed_one() {
    let data = (0..20)
        .map(|i| f64::from(i) / 10.0)
        .map(|x| (x, 3.0 * (-0.5 * x).exp()))
        .collect();
    let mut problem = Curve {
        data,
        model: |x: f64, p: &[f64], gradient: &mut [f64]| {
            let decay = (-p[1] * x).exp();
            gradient.copy_from_slice(&[decay, -p[0] * x * decay]);
            p[0] * decay
        },
    };
    let parameters = [
        Parameter::linear("amplitude", "V", 0.0, 3.0, 10.0).fixed(),
        Parameter::log("rate", "1/s", 1e-3, 1.0, 1e3),
    ];
    let polished = polish(
        &mut problem,
        &parameters,
        &[3.0, 100.0],
        &PolishOptions::default(),
    )
    .unwrap();
    assert_eq!(polished.values[0], 3.0);
    assert!((polished.values[1] - 0.5).abs() < 1e-9, "{:?}", polished);
    assert!(polished.cost < 1e-18);
}
