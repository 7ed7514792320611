//! The command's rate is fed forward.

use super::host;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Host, Port};
use crate::model::{Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "feed_forward",
    port: Port::Command,
    summary: "The rate of the command is fed forward: the closed loop has a zero",
    finding: "the loop has a zero: the command's rate is fed forward with {feed_forward}",
    equation: "x + feed_forward dx/dt, as of a loop whose command is u + feed_forward du/dt",
    shows: "less lag than the loop's own poles have; the residual follows the command's rate and does not depend on its size",
    confused: "a larger gain or a smaller time constant, which change the damping, too; delay, which lags where this leads",
    source: "velocity feed-forward of position controllers; zeros of PD and PI controllers; Franklin, Powell, Emami-Naeini, Feedback Control of Dynamic Systems",
    parameters: |scale, _| {
        let longest = (100.0 * scale.interval).clamp(0.1, 1.0);
        vec![Parameter::linear("feed_forward", "s", 0.0, 0.0, longest)]
    },
    trials: |scale, _| [2.0, 8.0, 30.0].map(|n| vec![n * scale.interval]).to_vec(),
    imitated_by: &[],
    states: &[],
    neutral: &[],
    applies: shows_a_loop,
    outputs: None,
    view: Some(View::new(
        Excitation::Chirp,
        Over::CommandRate,
        Values::Trial(0),
    )),
    frequency: None,
};

fn shows_a_loop(host: &dyn Host) -> bool {
    host::loop_output(host).is_some()
}

/// The rate of the command is fed forward.
#[derive(Debug, Clone)]
pub(in crate::model) struct FeedForward<R> {
    lead: R,
}

impl<R: Real> FeedForward<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self { lead: next() }
    }
}

impl<R: Real> Act<R> for FeedForward<R> {
    /// What a linear loop makes of u + T du/dt is what it makes of u, and T times the rate of that: so no command that jumps
    /// has to be differentiated.
    #[inline(always)]
    fn place(&self, _own: &[R], spool: R, speed: R) -> R {
        spool + self.lead * speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spool_is_ahead_by_its_speed() {
        let mut values = [0.008].into_iter();
        let effect: FeedForward<f64> = FeedForward::new(|| values.next().unwrap());
        assert_eq!(effect.place(&[], 1.0, -50.0), 0.6);
    }
}
