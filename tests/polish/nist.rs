//! Certified values and standard deviations of the NIST Statistical Reference Datasets, from both certified starts.

use std::collections::BTreeMap;

use serde::Deserialize;
use servobee::model::Parameter;
use servobee::search::polish::{
    LeastSquares, PolishOptions, Uncertainty, UncertaintyOptions, polish,
};

use super::problems::{Curve, Model, unbounded};

#[derive(Deserialize)]
struct Certified {
    starts: Vec<Vec<f64>>,
    values: Vec<f64>,
    standard_errors: Vec<f64>,
    cost: f64,
    x: Vec<f64>,
    y: Vec<f64>,
}

impl Certified {
    fn problem(&self, name: &str) -> (Curve, Vec<Parameter>) {
        let points = self.x.iter().copied().zip(self.y.iter().copied()).collect();
        let parameter = |number| match (name, number) {
            // From the first start a free rate runs to infinity, where the curve is a constant: a local minimum.
            ("BoxBOD", 2) => Parameter::linear("b2", "1", 0.0, 1.0, 10.0),
            // The first start lies orders of magnitude away, beyond a long curved valley on a linear scale.
            ("MGH10", _) => Parameter::log(&format!("b{number}"), "1", 1e-9, 1.0, 1e9),
            _ => unbounded(&format!("b{number}")),
        };
        let parameters = (1..=self.values.len()).map(parameter).collect();
        (
            Curve {
                points,
                model: model(name),
            },
            parameters,
        )
    }
}

fn certified() -> BTreeMap<String, Certified> {
    toml::from_str(include_str!("../golden/nist_strd.toml")).unwrap()
}

#[test]
fn the_models_have_the_certified_cost_at_the_certified_values() {
    for (name, certified) in certified() {
        let (mut problem, _) = certified.problem(&name);
        let cost = problem.cost(&certified.values).unwrap();
        assert_close(&name, "cost", cost, certified.cost, 1e-8);
    }
}

#[test]
fn finds_the_certified_values_and_standard_deviations_from_both_starts() {
    let options = PolishOptions {
        max_iterations: 2000,
        cost_tolerance: 1e-15,
        ..Default::default()
    };
    for (name, certified) in certified() {
        for (number, start) in certified.starts.iter().enumerate() {
            let (mut problem, parameters) = certified.problem(&name);
            let polished = polish(&mut problem, &parameters, start, &options).unwrap();
            assert!(
                polished.stop.converged(),
                "{name} from start {}",
                number + 1
            );
            assert_close(&name, "cost", polished.cost, certified.cost, 1e-9);
            let uncertainty =
                Uncertainty::new(&parameters, &polished, &UncertaintyOptions::default());
            for j in 0..parameters.len() {
                assert_close(
                    &name,
                    "value",
                    polished.values[j],
                    certified.values[j],
                    1e-7,
                );
                let error = uncertainty.standard_errors[j].unwrap();
                assert_close(
                    &name,
                    "standard error",
                    error,
                    certified.standard_errors[j],
                    1e-6,
                );
            }
        }
    }
}

fn assert_close(name: &str, what: &str, found: f64, certified: f64, tolerance: f64) {
    let error = (found / certified - 1.0).abs();
    assert!(
        error < tolerance,
        "{name}: {what} {found:e} instead of {certified:e}, off by {error:.1e}"
    );
}

fn model(name: &str) -> Model {
    match name {
        "Misra1a" | "BoxBOD" => saturating,
        "Lanczos3" => three_exponentials,
        "MGH17" => two_exponentials,
        "Thurber" => cubic_over_cubic,
        "Eckerle4" => peak,
        "Rat43" => growth,
        "MGH09" => rational,
        "MGH10" => steep,
        _ => panic!("no model for {name}"),
    }
}

/// b1 (1 − exp(−b2 x))
fn saturating(x: f64, b: &[f64], gradient: &mut [f64]) -> f64 {
    let decay = (-b[1] * x).exp();
    gradient.copy_from_slice(&[1.0 - decay, b[0] * x * decay]);
    b[0] * (1.0 - decay)
}

/// b1 exp(−b2 x) + b3 exp(−b4 x) + b5 exp(−b6 x)
fn three_exponentials(x: f64, b: &[f64], gradient: &mut [f64]) -> f64 {
    let mut sum = 0.0;
    for (b, gradient) in b.chunks(2).zip(gradient.chunks_mut(2)) {
        let decay = (-b[1] * x).exp();
        gradient.copy_from_slice(&[decay, -b[0] * x * decay]);
        sum += b[0] * decay;
    }
    sum
}

/// b1 + b2 exp(−b4 x) + b3 exp(−b5 x)
fn two_exponentials(x: f64, b: &[f64], gradient: &mut [f64]) -> f64 {
    let (fourth, fifth) = ((-b[3] * x).exp(), (-b[4] * x).exp());
    gradient.copy_from_slice(&[1.0, fourth, fifth, -b[1] * x * fourth, -b[2] * x * fifth]);
    b[0] + b[1] * fourth + b[2] * fifth
}

/// (b1 + b2 x + b3 x² + b4 x³) / (1 + b5 x + b6 x² + b7 x³)
fn cubic_over_cubic(x: f64, b: &[f64], gradient: &mut [f64]) -> f64 {
    let above = b[0] + x * (b[1] + x * (b[2] + x * b[3]));
    let below = 1.0 + x * (b[4] + x * (b[5] + x * b[6]));
    let powers = [1.0, x, x * x, x * x * x];
    for (gradient, power) in gradient.iter_mut().zip(powers.iter().chain(&powers[1..])) {
        *gradient = power / below;
    }
    for gradient in &mut gradient[4..] {
        *gradient *= -above / below;
    }
    above / below
}

/// b1/b2 exp(−½ ((x − b3)/b2)²)
fn peak(x: f64, b: &[f64], gradient: &mut [f64]) -> f64 {
    let z = (x - b[2]) / b[1];
    let bell = (-0.5 * z * z).exp() / b[1];
    gradient.copy_from_slice(&[
        bell,
        b[0] * bell * (z * z - 1.0) / b[1],
        b[0] * bell * z / b[1],
    ]);
    b[0] * bell
}

/// b1 / (1 + exp(b2 − b3 x))^(1/b4)
fn growth(x: f64, b: &[f64], gradient: &mut [f64]) -> f64 {
    let power = (b[1] - b[2] * x).exp();
    let factor = (1.0 + power).powf(-1.0 / b[3]);
    let slope = -b[0] * factor * power / (b[3] * (1.0 + power));
    let shape = b[0] * factor * (1.0 + power).ln() / (b[3] * b[3]);
    gradient.copy_from_slice(&[factor, slope, -x * slope, shape]);
    b[0] * factor
}

/// b1 (x² + b2 x) / (x² + b3 x + b4)
fn rational(x: f64, b: &[f64], gradient: &mut [f64]) -> f64 {
    let (above, below) = (x * x + b[1] * x, x * x + b[2] * x + b[3]);
    let value = b[0] * above / below;
    gradient.copy_from_slice(&[
        above / below,
        b[0] * x / below,
        -value * x / below,
        -value / below,
    ]);
    value
}

/// b1 exp(b2 / (x + b3))
fn steep(x: f64, b: &[f64], gradient: &mut [f64]) -> f64 {
    let factor = (b[1] / (x + b[2])).exp();
    let value = b[0] * factor;
    gradient.copy_from_slice(&[
        factor,
        value / (x + b[2]),
        -value * b[1] / (x + b[2]).powi(2),
    ]);
    value
}
