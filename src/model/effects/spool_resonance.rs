//! The spool is a mass on a spring of oil.

use super::host;
use super::in_loop::{BehindLag, InLoop, Quickness, SecondPole};
use super::view::{Excitation, Over, Values, View};
use super::{Entry, Port};
use crate::model::{Pace, Parameter, Real};

pub(super) const ENTRY: Entry = Entry {
    name: "spool_resonance",
    port: Port::Actuator,
    summary: "The spool is a mass on the oil of its chambers: it rings inside its loop",
    finding: "the spool rings inside its loop with a damping of {spool_damping}",
    equation: "v'' / w^2 + 2 D v' / w + v = K sat(u - x, S), dx/dt = v; D = spool_damping, w = 2 D / T",
    shows: "ringing of the spool after everything quick that fades while the loop still settles; the flow shows it as well",
    confused: "line_resonance and periodic_disturbance, which the spool does not show or which go on at rest; a smaller damping of the \
               loop itself, which one frequency shows and not two",
    source: "K / (s (s^2 / w^2 + 2 D s / w + 1)): Merritt, Hydraulic Control Systems, 1967; torque motor and spool of a servo valve: \
             Thayer, Moog Technical Bulletin 103, 1965",
    parameters: |_, _| {
        vec![
            Parameter::linear("spool_damping", "1", 0.03, 1.0, 1.0),
            Parameter::linear("spool_share", "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    trials: |_, _| [0.8, 0.4, 0.15].map(|damping| vec![damping]).to_vec(),
    imitated_by: &[],
    states: &["spool_velocity"],
    neutral: &[("spool_share", 0.0)],
    applies: host::moves_no_piston,
    outputs: None,
    view: Some(View::new(
        Excitation::Step { seconds: 0.4 },
        Over::Time,
        Values::Trial(1),
    )),
    frequency: None,
};

/// The spool rings inside its loop.
pub(in crate::model) type SpoolResonance<R> = SecondPole<R, Damping>;

/// Of two poles that swing.
#[derive(Debug, Clone)]
pub(in crate::model) struct Damping;

impl Quickness for Damping {
    #[inline(always)]
    fn of<R: Real>(damping: R) -> R {
        R::constant(4.0) * damping * damping
    }
}

pub(super) const LAGGED: Entry = Entry {
    name: "spool_resonance~lagged",
    summary: "The spool is a mass on the oil of its chambers, driven through a lag: it rings inside its loop",
    finding: "the spool rings inside its loop at {spool_frequency} with a damping of {spool_damping_lagged}, behind the loop's lag",
    equation: "T dw/dt + w = K sat(u - x, S), v'' / w0^2 + 2 D v' / w0 + v = w, dx/dt = v; w0 = 2 pi spool_frequency, \
               D = spool_damping_lagged",
    confused: "spool_resonance, whose drive does not lag; line_resonance and periodic_disturbance, which the spool does not show or \
               which go on at rest",
    parameters: |scale, _| {
        // Rows show no faster ringing.
        let fastest = 0.5 / scale.interval;
        vec![
            Parameter::log("spool_frequency", "Hz", 2e-3 * fastest, fastest, fastest)
                .paced(Pace::Frequency),
            Parameter::linear("spool_damping_lagged", "1", 0.03, 0.5, 1.0),
            Parameter::linear("spool_share_lagged", "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    trials: |scale, _| {
        [0.015, 0.05, 0.15]
            .map(|share| vec![share / scale.interval, 0.3])
            .to_vec()
    },
    imitated_by: &["time_constant"],
    states: &["lagging_spool_velocity", "lagging_spool_acceleration"],
    neutral: &[("spool_share_lagged", 0.0)],
    frequency: Some("spool_frequency"),
    ..ENTRY
};

/// The spool rings inside its loop behind the loop's lag.
pub(in crate::model) type SpoolResonanceBehindLag<R> = BehindLag<R, Ringing<R>>;

/// A mass on oil, whose states are its speed and its acceleration.
#[derive(Debug, Clone)]
pub(in crate::model) struct Ringing<R> {
    /// Hz.
    frequency: R,
    damping: R,
}

impl<R: Real> InLoop<R> for Ringing<R> {
    #[inline(always)]
    fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            frequency: next(),
            damping: next(),
        }
    }

    #[inline(always)]
    fn passed(&self, own: &[R], _driven: R) -> R {
        own[0]
    }

    #[inline(always)]
    fn follow(&self, own: &[R], driven: R, _lag: R, slope: &mut [R]) {
        let rate = R::constant(std::f64::consts::TAU) * self.frequency;
        slope[0] = own[1];
        let pull = rate * (driven - own[0]) - R::constant(2.0) * self.damping * own[1];
        slope[1] = rate * pull;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::model::effects::in_loop::tests::{self as loops, AT};
    use crate::model::effects::{Act, Motion};

    /// What v has come to from zero after each of `times`, s, at these `rates`: in steps of 1 us.
    fn course(times: &[f64], mut rates: impl FnMut(f64) -> f64) -> Vec<f64> {
        let (mut v, mut t, step) = (0.0, 0.0, 1e-6);
        let mut till = |time: f64| {
            while t < time {
                v += step * rates(t);
                t += step;
            }
            v
        };
        times.iter().map(|&time| till(time)).collect()
    }

    /// v of v'' / w² + 2 D v' / w + v = 100 from rest: 100 (1 - e^(-D w t) (cos(q t) + D w / q sin(q t))), q = w √(1 - D²).
    fn answer(t: f64, damping: f64, rate: f64) -> f64 {
        let (turns, fades) = (rate * (1.0 - damping * damping).sqrt(), damping * rate);
        let swings = (turns * t).cos() + fades / turns * (turns * t).sin();
        100.0 * (1.0 - (-fades * t).exp() * swings)
    }

    #[test]
    fn in_place_of_the_lag_it_answers_a_drive_as_a_pole_pair() {
        let mut values = [0.3, 1.0].into_iter();
        let effect: SpoolResonance<f64> = SpoolResonance::new(|| values.next().unwrap());
        let (lag, mut own, mut speed) = (AT.time_constant, [0.0], 0.0);
        let times = [1e-3, 5e-3, 20e-3];
        // Of the lag T w' = drive - v, of which the speed w of the base model is what drives the effect.
        let found = course(&times, |_| {
            let mut slope = [0.0];
            effect.follow(&own, speed, &Motion { speed, ..AT }, &mut slope);
            let before = effect.speed(&own, speed, &AT);
            speed += 1e-6 * (100.0 - before) / lag;
            own[0] += 1e-6 * slope[0];
            slope[0]
        });
        for (found, t) in found.into_iter().zip(times) {
            let exact = answer(t, 0.3, 0.6 / lag);
            assert!((found - exact).abs() < 0.05, "{t}: {found} {exact}");
        }
    }

    #[test]
    fn behind_the_lag_it_answers_the_lag_as_a_pole_pair() {
        let mut values = [50.0, 0.3].into_iter();
        let ringing = Ringing::new(|| values.next().unwrap());
        let times = [1e-3, 5e-3, 20e-3];
        let found = loops::answer::<_, 2>(&ringing, &times);
        for (found, t) in found.into_iter().zip(times) {
            let exact = answer(t, 0.3, std::f64::consts::TAU * 50.0);
            assert!((found - exact).abs() < 0.05, "{t}: {found} {exact}");
        }
    }
}
