//! Parameters along which the cost is flat: the data do not ask for them.

use super::{Bound, Flat, LeastSquares, PolishOptions, Polished, polish};
use crate::Result;
use crate::model::Parameter;

/// The cost is flat where it rises by less than this many mean squared residuals: one row three deviations off.
const RISE: f64 = 9.0;
/// Points between the result and a bound at which the cost is looked at.
const POINTS: u32 = 4;
/// Parts of a flat range at whose ends the cost of other data is looked at: along a saturation that winds a loop up it has a
/// valley in every tenth of its value. The ends fill whole vectors.
const ALONG: u32 = 31;
/// So many of these ends, one vector of them, show whether that cost depends on the value at all.
const FIRST: u32 = 8;

/// [`polish`], after which a parameter that the data do not ask for has a value that does not depend on where the search
/// came from: the bound up to which the cost is flat, where the parameter does nothing (a saturation above every error, a
/// lag that is too short to be seen), or its value in `neutral` where the cost is flat between both bounds.
///
/// The gradient does not show this: it is zero at any saturation that is never reached, and beside one that is hardly
/// reached it says nothing of what comes farther up. So the cost itself is computed along the parameter.
///
/// # Errors
/// If the simulation diverges at `start`.
pub fn polish_what_counts(
    problem: &mut dyn LeastSquares,
    parameters: &[Parameter],
    [start, neutral]: [&[f64]; 2],
    options: &PolishOptions,
) -> Result<Polished> {
    let mut polished = polish(problem, parameters, start, options)?;
    let best = polished.cost;
    let mut held = parameters.to_vec();
    for (index, parameter) in parameters.iter().enumerate() {
        let edge = options.edge_tolerance;
        let looked = look_along(problem, parameter, index, &polished, neutral, edge);
        let Some((flat, value, bound)) = looked else {
            continue;
        };
        polished.values[index] = value;
        polished.at_bound[index] = bound;
        polished.flat.push(flat);
        held[index].set_fixed(true);
    }
    if polished.flat.is_empty() {
        return Ok(polished);
    }
    // What the others had made of it is taken back where the cost has risen at all.
    polished.cost = problem.cost(&polished.values).unwrap_or(f64::INFINITY);
    polished.evaluations += 1;
    if polished.cost > best * (1.0 + options.cost_tolerance.max(1e-9)) {
        let again = polish(problem, &held, &polished.values, options)?;
        let at_bound = again.at_bound.iter().zip(&polished.at_bound);
        polished = Polished {
            at_bound: at_bound.map(|(new, old)| new.or(*old)).collect(),
            iterations: polished.iterations + again.iterations,
            evaluations: polished.evaluations + again.evaluations,
            flat: polished.flat,
            ..again
        };
    }
    Ok(polished)
}

/// The range in which the cost does not change with parameter `index`, if there is one, the value that it then gets, and
/// the bound that this is. Its end is found to within this share of the way to the bound.
fn look_along(
    problem: &mut dyn LeastSquares,
    parameter: &Parameter,
    index: usize,
    polished: &Polished,
    neutral: &[f64],
    edge_tolerance: f64,
) -> Option<(Flat, f64, Option<Bound>)> {
    let here = parameter.to_unit(polished.values[index]);
    if parameter.is_fixed() || !here.is_finite() {
        return None;
    }
    let rows = polished.triangle.rows() as f64;
    let level = polished.cost * (1.0 + RISE / rows);
    let mut values = polished.values.clone();
    let mut is_flat = |unit: f64| {
        values[index] = parameter.from_unit(unit);
        problem.cost_up_to(&values, level).is_some()
    };
    // At the bound first: there nearly every parameter is told from a flat one.
    let mut up_to = |bound: f64| {
        let point = |k: u32| bound + (here - bound) * f64::from(k) / f64::from(POINTS);
        here == bound || (0..POINTS).all(|k| is_flat(point(k)))
    };
    let (down, up) = (up_to(0.0), up_to(1.0));
    let mut edge = |bound: f64| {
        let (mut rises, mut flat) = (bound, here);
        while (flat - rises).abs() > edge_tolerance * (here - bound).abs() {
            let middle = 0.5 * (rises + flat);
            match is_flat(middle) {
                true => flat = middle,
                false => rises = middle,
            }
        }
        parameter.from_unit(flat)
    };
    let (low, high, value, bound) = match (down, up) {
        (false, false) => return None,
        (true, true) => (parameter.low, parameter.high, neutral[index], None),
        (true, false) => (parameter.low, edge(1.0), parameter.low, Some(Bound::Low)),
        (false, true) => (edge(0.0), parameter.high, parameter.high, Some(Bound::High)),
    };
    let flat = Flat {
        parameter: index,
        low,
        high,
    };
    Some((flat, value, bound))
}

/// The values at which the cost of another problem, a sum over `rows` squares, is lowest, when only the parameters in
/// `flats` move, each inside its range; and which of them that problem asks for. Those that it does not ask for keep
/// their values.
///
/// The ranges are searched from several points each: along a saturation the cost may have more than one valley.
pub fn within_flats(
    problem: &mut dyn LeastSquares,
    rows: usize,
    parameters: &[Parameter],
    values: &[f64],
    flats: &[Flat],
    options: &PolishOptions,
) -> (Vec<f64>, Vec<Flat>) {
    let mut narrowed = parameters.to_vec();
    narrowed
        .iter_mut()
        .for_each(|parameter| parameter.set_fixed(true));
    let mut best = values.to_vec();
    let mut asked = Vec::new();
    for flat in flats {
        let parameter = &mut narrowed[flat.parameter];
        (parameter.low, parameter.high) = (flat.low, flat.high);
        let mut along = |ends: Vec<u32>| -> Vec<(f64, f64)> {
            let value = |end: u32| parameter.from_unit(f64::from(end) / f64::from(ALONG));
            let own: Vec<f64> = ends.into_iter().map(value).collect();
            let at = |&value: &f64| {
                let mut values = best.clone();
                values[flat.parameter] = value;
                values
            };
            let costs = problem.costs(&own.iter().map(at).collect::<Vec<_>>());
            let costs = costs.into_iter().map(|cost| cost.unwrap_or(f64::INFINITY));
            costs.zip(own).collect()
        };
        let by_cost = |a: &&(f64, f64), b: &&(f64, f64)| a.0.total_cmp(&b.0);
        let first = |k: u32| (k * ALONG + FIRST / 2) / (FIRST - 1);
        let mut costs = along((0..FIRST).map(first).collect());
        let [least, most] = [costs.iter().min_by(by_cost), costs.iter().max_by(by_cost)]
            .map(|found| found.expect("there are ends").0);
        if most > least * (1.0 + RISE / rows as f64) {
            let known = |end: &u32| (0..FIRST).any(|k| first(k) == *end);
            costs.extend(along((0..=ALONG).filter(|end| !known(end)).collect()));
            best[flat.parameter] = costs.iter().min_by(by_cost).expect("there are ends").1;
            narrowed[flat.parameter].set_fixed(false);
            asked.push(*flat);
        }
    }
    if !asked.is_empty()
        && let Ok(polished) = polish(problem, &narrowed, &best, options)
    {
        best = polished.values;
    }
    (best, asked)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is measured is `level` plus a ramp that is cut off at `limit`; `nothing` does nothing. 40 rows of the ramp up to
    /// `reach`, measured with a level of 2 and a limit of 9, and off by ±0.01 in turn.
    struct Ramp {
        reach: f64,
        costs: usize,
    }

    fn ramp(reach: f64) -> Ramp {
        Ramp { reach, costs: 0 }
    }

    impl LeastSquares for Ramp {
        fn rows(&mut self, candidate: &[f64], row: &mut dyn FnMut(f64, &[f64])) -> bool {
            let [level, limit, _] = candidate else {
                unreachable!("three parameters")
            };
            for k in 0..40 {
                let ramp = self.reach * f64::from(k) / 39.0;
                let noise = if k % 2 == 0 { 0.01 } else { -0.01 };
                let residual = 2.0 + ramp.min(9.0) + noise - level - ramp.min(*limit);
                let cut = if ramp > *limit { -1.0 } else { 0.0 };
                row(residual, &[-1.0, cut, 0.0]);
            }
            true
        }

        fn cost(&mut self, candidate: &[f64]) -> Option<f64> {
            self.costs += 1;
            let mut sum = 0.0;
            self.rows(candidate, &mut |residual, _| sum += residual * residual);
            Some(sum)
        }
    }

    fn parameters() -> [Parameter; 3] {
        [
            Parameter::linear("level", "V", -10.0, 0.0, 10.0),
            Parameter::log("limit", "V", 0.1, 5.0, 20.0),
            Parameter::linear("nothing", "V", -1.0, 0.25, 1.0),
        ]
    }

    #[test]
    fn what_the_data_do_not_ask_for_does_not_depend_on_the_start() {
        let parameters = parameters();
        let neutral = parameters.each_ref().map(|p| p.nominal());
        for limit in [3.5, 5.0, 6.7, 12.0] {
            let start = [0.3, limit, 0.7];
            let mut ramp = ramp(3.0);
            let options = PolishOptions::default();
            let found =
                polish_what_counts(&mut ramp, &parameters, [&start, &neutral], &options).unwrap();
            assert!((found.values[0] - 2.0).abs() < 1e-9, "{found:?}");
            assert_eq!(found.values[1..], [20.0, 0.25]);
            assert_eq!(found.at_bound, [None, Some(Bound::High), None]);
            let [limit, nothing] = &found.flat[..] else {
                panic!("{:?}", found.flat)
            };
            assert!(
                (limit.low - 3.0).abs() < 0.1 && limit.high == 20.0,
                "{limit:?}"
            );
            assert_eq!((nothing.low, nothing.high), (-1.0, 1.0));
        }
    }

    #[test]
    fn what_the_data_ask_for_stays_where_the_polish_left_it() {
        let parameters = parameters();
        let start = parameters.each_ref().map(|p| p.nominal());
        let mut ramp = ramp(15.0);
        let options = PolishOptions::default();
        let plain = polish(&mut ramp, &parameters, &start, &options).unwrap();
        let found = polish_what_counts(&mut ramp, &parameters, [&start, &start], &options).unwrap();
        assert!((found.values[1] - 9.0).abs() < 0.02, "{found:?}");
        assert_eq!(found.values[..2], plain.values[..2]);
        assert_eq!(found.flat.len(), 1);
    }

    #[test]
    fn other_data_set_what_the_first_left_open_inside_its_range() {
        let parameters = parameters();
        let values = [2.0, 20.0, 0.25];
        let flat = |parameter, low, high| Flat {
            parameter,
            low,
            high,
        };
        let flats = [flat(1, 3.0, 20.0), flat(2, -1.0, 1.0)];
        let options = PolishOptions::default();
        let within = |reach| {
            let mut ramp = ramp(reach);
            let found = within_flats(&mut ramp, 40, &parameters, &values, &flats, &options);
            (found, ramp.costs)
        };
        let ((found, asked), costs) = within(15.0);
        // All ends of the one, the first ends of the other, and a polish.
        assert!(costs > 32 + 8, "{costs}");
        assert!((found[1] - 9.0).abs() < 0.02, "{found:?}");
        assert_eq!((found[0], found[2]), (2.0, 0.25));
        assert_eq!(asked, [flats[0]]);
        // Data that do not reach it either leave it alone.
        assert_eq!(within(2.5), ((values.to_vec(), Vec::new()), 2 * 8));
    }

    #[test]
    fn the_end_of_a_flat_is_found_as_closely_as_is_asked() {
        let parameters = parameters();
        let start = parameters.each_ref().map(|p| p.nominal());
        let end = |edge_tolerance: f64| {
            let mut ramp = ramp(3.0);
            let options = PolishOptions {
                edge_tolerance,
                ..Default::default()
            };
            let found = polish_what_counts(&mut ramp, &parameters, [&start, &start], &options);
            (
                parameters[1].to_unit(found.unwrap().flat[0].low),
                ramp.costs,
            )
        };
        let (from, to) = (parameters[1].to_unit(3.0), parameters[1].to_unit(5.0));
        let [(close, many), (near, few)] = [2.5e-4, 0.03].map(end);
        assert!(
            (close - from).abs() < 0.003 && near >= close,
            "{close}, {near}"
        );
        assert!(near - close <= 0.03 * to && near < to, "{near}");
        assert_eq!(many - few, 12 - 6);
    }
}
