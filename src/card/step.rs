//! The answer to a step of the command from zero to full scale.

use super::bench::Bench;

/// Rows in the slowest time constant, and how many of them the answer is watched.
const ROWS: (f64, f64) = (60.0, 15.0);
/// The step is done when the spool has gone this share of its way.
pub(super) const DONE: f64 = 0.9;

/// Spool over time after a step of the command from zero to full scale.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Time, s, and spool, % of where it ends.
    pub points: Vec<[f64; 2]>,
    /// Time until the spool has first gone 90 % of its way, s.
    pub time: Option<f64>,
    /// How far it goes beyond its end, %.
    pub overshoot: f64,
}

impl Step {
    /// The step of a valve; `None` where nothing moves the spool, or it never arrives.
    pub(super) fn of(bench: &Bench) -> Option<Self> {
        let [gain, _, saturation] = bench.actuator()?;
        let full = bench.structure.full_scale;
        let slowest = bench.slowest();
        let length = ROWS.1 * slowest + 3.0 * full / (gain * saturation) + bench.delay();
        let interval = slowest / ROWS.0;
        let count = (length / interval).ceil() as usize;
        // Zero for a row: equilibrium is where the valve starts.
        let commands: Vec<f64> = [0.0]
            .into_iter()
            .chain(std::iter::repeat_n(full, count))
            .collect();
        let outputs = bench.run(&commands, interval);
        let (start, end) = (outputs[1][0], outputs[count][0]);
        if !((end - start).is_finite() && end != start) {
            return None;
        }
        let points: Vec<[f64; 2]> = outputs[1..]
            .iter()
            .enumerate()
            .map(|(k, row)| {
                [
                    interval * k as f64,
                    100.0 * (row[0] - start) / (end - start),
                ]
            })
            .collect();
        let goal = 100.0 * DONE;
        let crossed = points.windows(2).find(|pair| pair[1][1] >= goal);
        let largest = points.iter().map(|point| point[1]).fold(0.0, f64::max);
        Some(Self {
            time: crossed.map(|pair| {
                let [[before, low], [after, high]] = [pair[0], pair[1]];
                before + (after - before) * (goal - low) / (high - low)
            }),
            overshoot: (largest - 100.0).max(0.0),
            points,
        })
    }
}
