//! The polish against closed forms, certified solutions and its own promises.

mod nist;
mod problems;
mod uncertainty;

use problems::{Curve, Kink, Valley, unbounded};
use servobee::model::Parameter;
use servobee::search::polish::{Bound, PolishOptions, Stop, polish};

#[test]
fn follows_a_curved_valley() {
    let parameters = [unbounded("a"), unbounded("b")];
    let polished = polish(
        &mut Valley,
        &parameters,
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
fn a_start_outside_the_bounds_is_moved_inside() {
    let parameters = [
        Parameter::linear("a", "1", -2.0, 0.0, 2.0),
        Parameter::linear("b", "1", -2.0, 0.0, 2.0),
    ];
    let polished = polish(
        &mut Valley,
        &parameters,
        &[9.0, -9.0],
        &PolishOptions::default(),
    )
    .unwrap();
    assert!(polished.cost < 1e-12, "{polished:?}");
}

#[test]
fn the_iteration_limit_is_reported() {
    let options = PolishOptions {
        max_iterations: 3,
        ..Default::default()
    };
    let parameters = [unbounded("a"), unbounded("b")];
    let polished = polish(&mut Valley, &parameters, &[-1.2, 1.0], &options).unwrap();
    assert_eq!(polished.stop, Stop::Iterations);
    assert_eq!(polished.iterations, 3);
}

#[test]
fn ends_at_a_kink_without_an_increase() {
    let options = PolishOptions::default();
    let polished = polish(&mut Kink, &[unbounded("a")], &[2.5], &options).unwrap();
    assert!(polished.stop.converged(), "{:?}", polished.stop);
    assert!(polished.values[0].abs() < 1e-4, "{polished:?}");
    assert!(polish(&mut Kink, &[unbounded("a")], &[4.0], &options).is_err());
}

#[test]
fn a_log_parameter_beside_a_fixed_one() {
    let points = (0..20)
        .map(|i| f64::from(i) / 10.0)
        .map(|x| (x, 3.0 * (-0.5 * x).exp()));
    let mut problem = Curve {
        points: points.collect(),
        model: |x, p, gradient| {
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
    assert!((polished.values[1] - 0.5).abs() < 1e-9, "{polished:?}");
    assert!(polished.cost < 1e-18);
}
