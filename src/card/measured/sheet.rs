//! What a curve of a datasheet shows of the figures by itself: the points as they were digitised, on straight lines between.

use super::reading::{Reading, Spread};
use crate::card::construction::CycleFigures;
use crate::card::cycle::Cycle;
use crate::card::figures::{Definition, NO_NULL, Source};
use crate::card::quantity::Quantity;
use crate::card::step::DONE;
use crate::evaluate::problem::{Data, Series};
use crate::model::Initial;
use crate::search::datasheet::Sheet;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Commands from zero to full scale at which a flow curve is drawn.
const STEPS: i32 = 100;
/// Draws from which the scatter of a curve's points becomes that of its figures.
const DRAWS: u64 = 200;
/// Points at the end of a step over which it ends, and the share of its way by which they may differ.
const END: (usize, f64) = (4, 0.03);
/// The test that a step was.
const STEP: &str = "step of the datasheet";
/// How near an amplitude has to be to that of a figure, as a share of it.
const NEAR: f64 = 0.25;

/// A curve of a datasheet: its points, x rising.
enum Curve {
    /// Opening, %, and flow; whether it is of both sides.
    Flow(Vec<[f64; 2]>, bool),
    /// Of each amplitude, %: frequency, phase and gain.
    Response(Vec<(f64, Vec<Tone>)>),
    /// Time since the step, and spool.
    Step(Vec<[f64; 2]>),
}

/// Frequency, phase (degrees) and gain (dB), where the datasheet has them.
type Tone = (f64, [Option<f64>; 2]);

impl Curve {
    fn of(sheet: &Sheet) -> Self {
        let values = |name: &str| {
            let known = sheet.measured.iter().find(|one| one.name == name);
            known.map(|one| &one.values)
        };
        let pairs = |values: &[Option<f64>]| {
            let both = sheet.points.iter().zip(values);
            let known = both.filter_map(|(point, value)| Some([point[0], (*value)?]));
            known.collect::<Vec<[f64; 2]>>()
        };
        if let Some(flow) = values("flow") {
            let points = pairs(flow);
            let both = points.first().is_some_and(|point| point[0] < 0.0);
            return Self::Flow(points, both);
        }
        if let Some(spool) = values("spool") {
            let begins = match &*sheet.problem.data {
                Data::Series(all) => begins(sheet, &all[0]),
                Data::Tones(_) => 0.0,
            };
            let since = |[time, spool]: [f64; 2]| [time - begins, spool];
            return Self::Step(pairs(spool).into_iter().map(since).collect());
        }
        let mut responses: Vec<(f64, Vec<Tone>)> = Vec::new();
        for (i, point) in sheet.points.iter().enumerate() {
            let at = |name| values(name).and_then(|all| all[i]);
            let tone = (point[1], [at("phase"), at("gain")]);
            match responses.iter_mut().find(|one| one.0 == point[0]) {
                Some((_, tones)) => tones.push(tone),
                None => responses.push((point[0], vec![tone])),
            }
        }
        for (_, tones) in &mut responses {
            tones.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        Self::Response(responses)
    }
}

/// When the command of a step leaves what it was at first.
fn begins(sheet: &Sheet, series: &Series) -> f64 {
    let command = |row: usize| series.samples[row].input.command;
    // A curve from rest may begin with its step.
    let first = match sheet.problem.structure.initial {
        Initial::Rest => 0.0,
        _ => command(0),
    };
    let row = (0..series.time.len()).find(|&row| command(row) != first);
    series.time[row.unwrap_or(0)]
}

/// A figure as the curve of `sheet` shows it, or why it does not.
pub(in crate::card) fn read(sheet: &Sheet, figure: &Definition) -> Result<Reading, String> {
    match (Curve::of(sheet), figure.source) {
        (Curve::Flow(points, both), Source::Cycle(own)) => flow(&points, both, figure, own),
        (Curve::Response(all), Source::PhaseLimit(amplitude)) => {
            limit(&all, amplitude, 0, -90.0, "-90°")
        }
        (Curve::Response(all), Source::AmplitudeLimit(amplitude)) => {
            limit(&all, amplitude, 1, 10.0 * 0.5f64.log10(), "-3 dB")
        }
        (Curve::Step(points), Source::StepTime) => {
            let [time, _] = step(&points)?;
            Ok(Reading::around(1e3 * time[0], 1e3 * time[1], STEP.into()))
        }
        (Curve::Step(points), Source::Overshoot) => {
            let [_, beyond] = step(&points)?;
            let found = Reading::around(beyond[0], beyond[1], STEP.into());
            Ok(Reading {
                low: found.low.max(0.0),
                ..found
            })
        }
        (_, Source::Cycle(_)) => Err("no flow curve was given".into()),
        (_, Source::Leakage) => Err("no curve of leakage was given".into()),
        (_, Source::PressureGain) => Err("no curve of the load pressure was given".into()),
        (_, Source::Threshold) => Err("a curve of a datasheet shows no reversal".into()),
        (_, Source::PhaseLimit(_) | Source::AmplitudeLimit(_)) => {
            Err("no frequency response was given".into())
        }
        (_, Source::StepTime | Source::Overshoot) => Err("no step was given".into()),
    }
}

fn flow(
    points: &[[f64; 2]],
    both: bool,
    figure: &Definition,
    own: fn(&CycleFigures) -> Option<f64>,
) -> Result<Reading, String> {
    // Of one side its own figures alone: as if the other were alike.
    let of_one_side = [Quantity::RatedFlow, Quantity::FlowGain, Quantity::Overlap];
    if !both && !of_one_side.contains(&figure.quantity) {
        return Err("the flow curve is of one side".into());
    }
    if figure.quantity == Quantity::Hysteresis {
        return Err("one curve shows no difference between two directions".into());
    }
    let whole = |points: &[[f64; 2]]| match both {
        true => points.to_vec(),
        false => {
            let other = points.iter().rev().filter(|point| point[0] > 0.0);
            let other = other.map(|point| point.map(|value| -value));
            other.chain(points.iter().copied()).collect()
        }
    };
    let figures = |points: &[[f64; 2]]| drawn(&whole(points)).figures(f64::from(STEPS));
    let found = figures(points).ok_or(NO_NULL)?;
    let value = own(&found).ok_or("the curve ends before full scale")?;
    let size = scatter(points);
    let draws = (0..DRAWS).filter_map(|seed| {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || (0..12).map(|_| random.random_range(-0.5..0.5)).sum::<f64>();
        let disturbed: Vec<[f64; 2]> = points
            .iter()
            .map(|&[x, y]| [x, y + size * normal()])
            .collect();
        figures(&disturbed)
    });
    let spread = Spread {
        draws: draws.collect(),
        cycles: Vec::new(),
    };
    let test = match both {
        true => "flow curve of both sides",
        false => "flow curve of one side",
    };
    let half = spread.half_width(value, own);
    let half = Some(half).filter(|half| half.is_finite());
    let half = half.ok_or("the points are too few")?;
    Ok(Reading::around(value, half, test.into()))
}

/// The curve as a cycle without hysteresis.
fn drawn(points: &[[f64; 2]]) -> Cycle {
    let (first, last) = (points[0][0], points[points.len() - 1][0]);
    let inside = |command: &f64| (first..=last).contains(command);
    let commands = (-STEPS..=STEPS).map(f64::from).filter(inside);
    let rising: Vec<[f64; 2]> = commands.map(|u| [u, between(points, u)]).collect();
    Cycle {
        falling: rising.iter().rev().copied().collect(),
        rising,
    }
}

fn between(points: &[[f64; 2]], x: f64) -> f64 {
    let after = points.partition_point(|point| point[0] < x);
    let after = after.clamp(1, points.len() - 1);
    let ([before, low], [next, high]) = (points[after - 1], points[after]);
    low + (high - low) * (x - before) / (next - before)
}

/// The standard deviation of a point, from how far each is off the line through its neighbours: of a smooth curve no less than
/// how far a straight line between its points is off.
fn scatter(points: &[[f64; 2]]) -> f64 {
    let off = points.windows(3).map(|three| {
        let middle = between(&[three[0], three[2]], three[1][0]);
        (three[1][1] - middle).powi(2) / 1.5
    });
    (off.sum::<f64>() / (points.len().saturating_sub(2)).max(1) as f64).sqrt()
}

/// Where a response at this amplitude falls to `level`, in phase (0) or gain (1).
fn limit(
    all: &[(f64, Vec<Tone>)],
    amplitude: f64,
    what: usize,
    level: f64,
    name: &str,
) -> Result<Reading, String> {
    let near = |one: &&(f64, Vec<Tone>)| (one.0 - amplitude).abs() <= NEAR * amplitude;
    let off = |one: &&(f64, Vec<Tone>)| (one.0 - amplitude).abs();
    let own = all.iter().filter(near);
    let own = own.min_by(|a, b| off(a).total_cmp(&off(b)));
    let (amplitude, tones) = own.ok_or("no response at this amplitude was given")?;
    let point = |tone: &Tone| Some([tone.0.ln(), tone.1[what]?]);
    let points: Vec<[f64; 2]> = tones.iter().filter_map(point).collect();
    let crossed = points
        .windows(2)
        .find(|pair| pair[0][1] > level && pair[1][1] <= level);
    let [[before, high], [after, low]] = crossed
        .map(|pair| [pair[0], pair[1]])
        .ok_or_else(|| format!("the response does not pass {name}"))?;
    let frequency = (before + (after - before) * (high - level) / (high - low)).exp();
    let half = 1.96 * frequency * scatter(&points) * (after - before) / (high - low);
    let test = format!("frequency response at {amplitude} %");
    Ok(Reading::around(frequency, half, test))
}

/// Until 90 % of the way, s, and beyond its end, %, each with how far it may be off.
fn step(points: &[[f64; 2]]) -> Result<[[f64; 2]; 2], String> {
    let answer: Vec<[f64; 2]> = points
        .iter()
        .copied()
        .filter(|point| point[0] >= 0.0)
        .collect();
    let settled = answer.len().checked_sub(END.0).map(|from| &answer[from..]);
    let last = settled.ok_or("the step has too few points")?;
    let extreme =
        |pick: fn(f64, f64) -> f64| last.iter().map(|point| point[1]).fold(f64::NAN, pick);
    let (start, end) = (
        answer[0][1],
        last.iter().map(|point| point[1]).sum::<f64>() / END.0 as f64,
    );
    let way = end - start;
    let settles = extreme(f64::max) - extreme(f64::min) < END.1 * way.abs();
    if !settles {
        return Err("the answer to the step does not settle".into());
    }
    let share: Vec<[f64; 2]> = answer
        .iter()
        .map(|&[t, y]| [t, (y - start) / way])
        .collect();
    let crossed = share.windows(2).find(|pair| pair[1][1] >= DONE);
    let [[before, low], [after, high]] = crossed
        .map(|pair| [pair[0], pair[1]])
        .ok_or("not reached")?;
    let time = before + (after - before) * (DONE - low) / (high - low);
    let noise = 1.96 * scatter(&share[share.len() / 2..]);
    let largest = share.iter().map(|point| point[1]).fold(0.0, f64::max);
    Ok([
        [
            time,
            noise.max(scatter(&share)) * (after - before) / (high - low),
        ],
        [100.0 * (largest - 1.0).max(0.0), 100.0 * noise],
    ])
}
