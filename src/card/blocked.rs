//! The tests with blocked ports: how steeply the load pressure rises at null, and what returns to the tank.

use super::bench::Bench;
use super::construction::line;
use crate::model::Output;

/// The pressure gain is read off where the load pressure is less than this share of the supply's, as ISO 10770-1 does.
const STRAIGHT: f64 = 0.4;
/// Reaches that are tried, % of full scale, until the load pressure goes well beyond that on both sides.
const REACHES: [f64; 8] = [0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 25.0, 60.0];
const BEYOND: f64 = 0.6;
/// Commands on either side of null.
const STEPS: i32 = 60;

/// What a valve with blocked ports shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BlockedPorts {
    /// Load pressure over that of the supply for each unit of command over full scale, % per %.
    pub(super) gain: Option<f64>,
    /// The largest return flow, L/min.
    pub(super) leakage: f64,
}

impl BlockedPorts {
    /// Of the valve on the bench, where it has edges. It has no actuator's delay: every command is held until the spool rests.
    pub(super) fn of(bench: &Bench, null: f64) -> Option<Self> {
        let bench = bench.with_blocked_ports()?;
        let drop = bench.drop()?;
        let full = bench.structure.full_scale;
        let interval = bench.rest();
        let sweep = |reach: f64| -> Vec<[f64; 3]> {
            let level = |k: i32| null + 0.01 * reach * full * f64::from(k) / f64::from(STEPS);
            let up: Vec<f64> = (-STEPS..=STEPS).map(level).collect();
            // Down before up, so that a play is taken through on the same side.
            let commands: Vec<f64> = up.iter().rev().chain(&up).copied().collect();
            let rows = bench.settled_outputs(&commands, interval);
            let shown = commands.iter().zip(&rows);
            shown
                .map(|(&command, row)| {
                    let pressure = row[Output::LoadPressure] / drop;
                    [command / full, pressure, row[Output::ReturnFlow]]
                })
                .collect()
        };
        let mut leakage = f64::NEG_INFINITY;
        let mut gain = None;
        for reach in REACHES {
            let rows = sweep(reach);
            leakage = rows.iter().map(|row| row[2]).fold(leakage, f64::max);
            let (down, up) = rows.split_at(rows.len() / 2);
            let pressures = rows.iter().map(|row| row[1]);
            let (low, high) = pressures
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), p| {
                    (p.min(low), p.max(high))
                });
            if gain.is_none() && low < -BEYOND && high > BEYOND {
                let points =
                    |rows: &[[f64; 3]]| rows.iter().map(|row| [row[0], row[1]]).collect::<Vec<_>>();
                let slopes = [down, up].map(|branch| slope(&points(branch)));
                gain = slopes[0].zip(slopes[1]).map(|(a, b)| 0.5 * (a + b));
            }
        }
        Some(Self { gain, leakage })
    }
}

/// The slope of the straight line through the points of one branch, command over full scale and load pressure over the supply's,
/// whose pressure is within the part that counts; `None` with fewer than three.
pub(super) fn slope(points: &[[f64; 2]]) -> Option<f64> {
    let straight = within(points);
    (straight.len() >= 3).then(|| line(straight.iter())[1])
}

/// Those points.
pub(super) fn within(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let straight = points.iter().filter(|point| point[1].abs() <= STRAIGHT);
    straight.copied().collect()
}
