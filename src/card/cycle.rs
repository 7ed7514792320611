//! The slow cycle: what the valve does at rest for every command.

use super::bench::Bench;

/// Commands from zero to full scale.
const STEPS: usize = 100;

/// The valve at rest, command after command.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cycle {
    /// From full scale down to minus full scale: command, and flow (L/min) or, without a valve, spool.
    pub falling: Vec<[f64; 2]>,
    /// And up again.
    pub rising: Vec<[f64; 2]>,
}

impl Cycle {
    /// Takes the valve through a cycle.
    pub(super) fn of(bench: &Bench) -> Self {
        let full = bench.structure.full_scale;
        let steps = STEPS as i32;
        let level = |k: i32| full * f64::from(k) / f64::from(steps);
        let up = (0..steps).map(level);
        let down = (-steps + 1..=steps).rev().map(level);
        let again = (-steps..=steps).map(level);
        let commands: Vec<f64> = up.chain(down).chain(again).collect();
        let outputs = bench.settled(&commands, bench.rest());
        let output = usize::from(bench.structure.valve().is_some());
        let points: Vec<[f64; 2]> = commands
            .iter()
            .zip(&outputs)
            .map(|(&command, settled)| [command, settled[output]])
            .collect();
        let turn = 2 * STEPS + STEPS;
        Self {
            falling: points[STEPS..=turn].to_vec(),
            rising: points[turn..].to_vec(),
        }
    }
}
