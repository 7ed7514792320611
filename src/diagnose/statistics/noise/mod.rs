//! The noise floor: what no model can explain.
//!
//! ```text
//! repeats ────────┐
//! quiet ──────────┼─ the first that there is ─┐
//! differences ────┘                           ├─ the larger is the floor
//! resolution ─────────────────────────────────┘
//! ```
//!
//! Each source tells its own value and how well it is known; where two of them differ by more than that, the report says so.

mod differences;
mod moments;
mod quiet;
mod repeats;
mod resolution;
mod swing;

use crate::record::median_interval;
use resolution::Resolution;
pub use swing::Swing;

/// A source that shows less than this share of the largest value shows what arithmetic leaves of one value that is held.
const NOTHING: f64 = 1e-12;
/// Two sources disagree if they differ by more than this many standard errors, and by more than their margins.
const APART: f64 = 4.0;

/// Where a noise floor comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoiseMethod {
    /// The differences between repeats of the command.
    RepeatedCommand,
    /// What is left where the command rests.
    QuietStretches,
    /// The differences of neighbouring residuals.
    Differences,
    /// The steps of values and times.
    Resolution,
}

impl NoiseMethod {
    /// What a report calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::RepeatedCommand => "repeated command",
            Self::QuietStretches => "quiet stretches",
            Self::Differences => "high-pass residual",
            Self::Resolution => "resolution",
        }
    }

    /// What is left this many times above the floor is not noise, whatever it does or does not correlate with. Where the
    /// noise was seen by itself that is less than where it follows from assumptions.
    pub fn margin(self) -> f64 {
        match self {
            Self::RepeatedCommand | Self::QuietStretches => 1.3,
            Self::Differences | Self::Resolution => 2.0,
        }
    }
}

/// What one source says of the noise.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Source {
    /// Standard deviation, in the channel's unit.
    pub value: f64,
    /// Its standard error; `None` of a resolution, below which no noise can be.
    pub error: Option<f64>,
    /// The source.
    pub method: NoiseMethod,
}

/// A noise floor and where it comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Noise {
    /// Standard deviation, in the channel's unit.
    pub value: f64,
    /// How it was estimated.
    pub method: NoiseMethod,
    /// What every source says that there is, in the order in which they are asked.
    pub sources: Vec<Source>,
    /// What goes on swinging where the command rests, which is no noise.
    pub swing: Option<Swing>,
    /// Where the floor is the resolution: by how much each row can be off for that reason alone; otherwise empty.
    pub allowance: Vec<f64>,
    /// What noise of the measured inputs makes of it, where there is some.
    pub of_inputs: Option<OfInputs>,
}

/// What a model makes of noise that was measured in the commands or pressures and that the valve did not get.
#[derive(Debug, Clone, PartialEq)]
pub struct OfInputs {
    /// Which inputs those are.
    pub of: &'static str,
    /// Standard deviation, in the channel's unit.
    pub value: f64,
    /// What residuals depend on for this reason alone, as [`Remaining::correlates_with`](super::residual::Remaining).
    pub shown: Vec<(String, f64)>,
}

impl Noise {
    /// What is left of the `residual` beyond the resolution, where that is the floor: rounding follows the signal and looks
    /// like an effect, but is none.
    pub fn beyond(&self, residual: Vec<f64>) -> Vec<f64> {
        if !self.is_resolution() {
            return residual;
        }
        let rows = residual.iter().zip(&self.allowance);
        rows.map(|(left, allowed)| left - left.clamp(-allowed, *allowed))
            .collect()
    }

    /// The same without what is made of the inputs' noise.
    pub(in crate::diagnose) fn of_the_channel(mut self) -> Self {
        if let Some(known) = self.of_inputs.take() {
            let others = self.value.powi(2) - known.value.powi(2);
            self.value = others.max(0.0).sqrt();
        }
        self
    }

    /// The same with this made of the inputs' noise beside it.
    pub(in crate::diagnose) fn with(mut self, of_inputs: OfInputs) -> Self {
        self.value = self.value.hypot(of_inputs.value);
        self.of_inputs = Some(of_inputs);
        self
    }

    /// Whether the floor is the channel's resolution.
    pub fn is_resolution(&self) -> bool {
        self.method == NoiseMethod::Resolution
    }

    /// Whether it was taken from rests that show more than its fast part does, by more than they can: it drifts, or the valve moves.
    pub(in crate::diagnose) fn may_be_a_motion(&self) -> bool {
        // Where rests were asked nothing repeats: only the fast part can disagree with them.
        self.method == NoiseMethod::QuietStretches && self.disagreement(true).is_some()
    }

    /// The two measured sources that differ most, where they differ by more than they can. Where the differences of a residual that
    /// is `structured` show more than the others, that is no noise.
    pub fn disagreement(&self, structured: bool) -> Option<[Source; 2]> {
        let sources = self.sources.iter();
        let measured = sources.filter_map(|one| Some((one, one.error?)));
        let measured: Vec<(&Source, f64)> = measured.collect();
        let pairs = measured
            .iter()
            .enumerate()
            .flat_map(|(i, first)| measured[i + 1..].iter().map(move |second| (first, second)));
        let apart = pairs.filter_map(|(&(first, error), &(second, other))| {
            let [low, high] = [first, second].map(|one| one.value.max(self.resolution()));
            let ratio = low.max(high) / low.min(high);
            let margin = first.method.margin().max(second.method.margin());
            let sure = (high - low).abs() > APART * error.hypot(other);
            let larger = if first.value > second.value {
                first
            } else {
                second
            };
            let of_structure = structured && larger.method == NoiseMethod::Differences;
            (sure && ratio > margin && !of_structure).then_some((ratio, [*first, *second]))
        });
        apart
            .max_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, pair)| pair)
    }

    /// What the channel's resolution alone causes; 0 where none is seen.
    pub fn resolution(&self) -> f64 {
        let is = |one: &&Source| one.method == NoiseMethod::Resolution;
        self.sources.iter().find(is).map_or(0.0, |one| one.value)
    }
}

/// The rows of a channel, one record after another.
#[derive(Debug, Clone, Copy)]
pub struct NoiseRows<'a> {
    /// The row at which each record starts.
    pub starts: &'a [usize],
    /// Time, s.
    pub time: &'a [f64],
    /// Command.
    pub command: &'a [f64],
    /// Measured values.
    pub measured: &'a [f64],
    /// Measured less simulated.
    pub residual: &'a [f64],
    /// What is left of other channels in the same rows.
    pub beside: &'a [Vec<f64>],
}

/// The standard deviation of the noise in a channel. `quiet` is looked at where the command rests: the measured values, or the
/// residual, from which a model has taken what it explains.
///
/// - Where the command repeats itself exactly, from the differences of the residual between the repeats: what the valve does,
///   modelled or not, cancels, and what a measured pressure does that does not repeat is the model's. A disturbance that does not
///   repeat counts as noise.
/// - Otherwise from what remains about a line where the command rests; about several, where a long rest drifts. Not where that
///   swings, nor where it is larger than the fast part and another channel shows the same: that is a motion.
/// - Otherwise from first to third differences of the residual, as if its fast part were noise that a first-order
///   filter coloured; no more than all of the residual.
/// - Never less than the rounding of values and times causes, nor what a reading moves while it is held. Where that is more
///   than half of the variance, the resolution is what the floor is taken from. Of held readings each counts once above.
pub fn noise_floor(rows: NoiseRows, quiet: &[f64]) -> Noise {
    let NoiseRows {
        starts,
        time,
        command,
        measured,
        residual,
        beside,
    } = rows;
    let moves = beside
        .iter()
        .any(|other| quiet::moves_together(starts, command, residual, other));
    let simulated: Vec<f64> = measured.iter().zip(residual).map(|(y, e)| y - e).collect();
    let resolution = Resolution::new(starts, time, measured, &simulated);
    let all = Columns {
        starts: starts.to_vec(),
        time: time.to_vec(),
        command: command.to_vec(),
        quiet: quiet.to_vec(),
        residual: residual.to_vec(),
    };
    let (mut sources, swing) = match resolution.held {
        1 => measured_sources(&[all], moves),
        _ => {
            let readings = all.only(&resolution.readings(starts, measured));
            let (mut found, swing) = measured_sources(&[readings, all], moves);
            // The rows between two readings are off by what has moved since.
            for source in &mut found {
                source.value = source.value.hypot(resolution.moving());
            }
            (found, swing)
        }
    };
    let largest = measured.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
    sources.retain(|one| one.value > NOTHING * largest);
    let nothing = Source {
        value: 0.0,
        error: None,
        method: NoiseMethod::Differences,
    };
    let mut floor = sources.first().copied().unwrap_or(nothing);
    let mut allowance = Vec::new();
    let least = Source {
        value: resolution.deviation(),
        error: None,
        method: NoiseMethod::Resolution,
    };
    if least.value > 0.0 {
        sources.push(least);
    }
    // What is measured has the rounding in it: where that is most of its variance, the floor is the resolution.
    if least.value.powi(2) > floor.value.powi(2) / 2.0 {
        let value = floor.value.max(least.value);
        floor = Source { value, ..least };
        allowance = resolution.allowance();
    }
    Noise {
        value: floor.value,
        method: floor.method,
        sources,
        swing,
        allowance,
        of_inputs: None,
    }
}

/// What noise is measured from.
struct Columns {
    starts: Vec<usize>,
    time: Vec<f64>,
    command: Vec<f64>,
    quiet: Vec<f64>,
    residual: Vec<f64>,
}

impl Columns {
    /// Some of the `rows`, which rise.
    fn only(&self, rows: &[usize]) -> Self {
        let of = |values: &[f64]| rows.iter().map(|&k| values[k]).collect();
        let starts = self.starts.iter();
        Self {
            starts: starts
                .map(|start| rows.partition_point(|k| k < start))
                .collect(),
            time: of(&self.time),
            command: of(&self.command),
            quiet: of(&self.quiet),
            residual: of(&self.residual),
        }
    }
}

/// What is measured of the noise, the surest source first, each in the first of `columns` that have enough rows for it; and what
/// swings in rests, which are then no source; neither are they where the valve `moves` in them.
fn measured_sources(columns: &[Columns], moves: bool) -> (Vec<Source>, Option<Swing>) {
    let repeated = |c: &Columns| repeats::variance(&c.starts, &c.command, &c.residual);
    let resting = |c: &Columns| quiet::rests(&c.starts, &c.command, &c.quiet, &c.residual);
    let fast = |c: &Columns| differences::variance(&c.starts, &c.residual);
    let repeated = columns.iter().find_map(repeated);
    let rests = columns
        .iter()
        .find_map(|c| Some((resting(c)?, median_interval(&c.time))));
    let fast = columns.first().map(fast);
    let swing = rests
        .as_ref()
        .zip(fast)
        .and_then(|((rests, interval), (variance, _))| {
            swing::of(rests, variance.sqrt(), *interval)
        });
    let quiet = rests.map(|(rests, _)| quiet::variance(&rests));
    let larger = |quiet: f64| {
        let margin = NoiseMethod::QuietStretches.margin().powi(2);
        fast.is_none_or(|(fast, _)| quiet > margin * fast)
    };
    let quiet = quiet.filter(|(quiet, _)| swing.is_none() && !(moves && larger(*quiet)));
    let found = [
        (repeated, NoiseMethod::RepeatedCommand),
        (quiet, NoiseMethod::QuietStretches),
        (fast, NoiseMethod::Differences),
    ];
    let source = |(found, method): (Option<(f64, f64)>, NoiseMethod)| {
        let (variance, rows) = found?;
        Some(Source {
            value: variance.sqrt(),
            error: Some((variance / (2.0 * rows)).sqrt()),
            method,
        })
    };
    (found.into_iter().filter_map(source).collect(), swing)
}

#[cfg(test)]
mod tests;
