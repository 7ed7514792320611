//! The line to the flow meter rings.

use super::act::SecondOrder;
use super::entry;
use super::view::{Excitation, Over, Values, View};
use super::{Act, Entry, Moment, Port};
use crate::model::{Pace, Parameter, Real};

/// 50 m of line, closed at its end, ring at this frequency, Hz: c / 4L.
const SLOWEST: f64 = 5.0;

pub(super) const ENTRY: Entry = Entry {
    name: "line_resonance",
    port: Port::Flow,
    summary: "The oil column in the line rings at its own frequency",
    finding: "the oil column in the line rings at {line_frequency}",
    equation: "q'' + 2 D w q' + w^2 q = w^2 Q, w = 2 pi line_frequency, D = line_damping",
    shows: "ringing at one frequency whatever the command; the spool does not show it (a damping above 0.6 would not ring)",
    confused: "compressibility, which does not ring; periodic_disturbance, which goes on at rest",
    source: "line dynamics; Merritt, Hydraulic Control Systems, 1967",
    parameters: |scale, output| {
        vec![
            Parameter::log(
                &entry::on("line_frequency", output),
                "Hz",
                SLOWEST.min(0.2 / scale.interval),
                0.1 / scale.interval,
                0.45 / scale.interval,
            )
            .paced(Pace::Frequency),
            Parameter::log(&entry::on("line_damping", output), "1", 0.005, 0.1, 0.6),
            Parameter::linear(&entry::on("line_share", output), "1", 0.0, 1.0, 1.0).fixed(),
        ]
    },
    trials: |scale, _| {
        [0.01, 0.02, 0.035, 0.06, 0.1, 0.17, 0.3]
            .map(|share| vec![share / scale.interval, 0.15])
            .to_vec()
    },
    imitated_by: &[],
    states: &["column", "column_rate"],
    neutral: &[("line_share", 0.0)],
    applies: entry::shows_a_flow,
    outputs: Some(entry::flow_outputs),
    view: Some(View::new(
        Excitation::Step { seconds: 0.4 },
        Over::Time,
        Values::Trial(1),
    )),
    frequency: Some("line_frequency"),
};

/// The oil column in the line rings at its own frequency.
#[derive(Debug, Clone)]
pub(in crate::model) struct LineResonance<R> {
    column: SecondOrder<R>,
    share: R,
}

impl<R: Real> LineResonance<R> {
    #[inline(always)]
    pub(super) fn new(mut next: impl FnMut() -> R) -> Self {
        Self {
            column: SecondOrder::new(next(), next()),
            share: next(),
        }
    }
}

impl<R: Real> Act<R> for LineResonance<R> {
    #[inline(always)]
    fn settled(&self, own: &mut [R], value: R) {
        own[0] = value;
        own[1] = R::constant(0.0);
    }

    #[inline(always)]
    fn filter(&self, own: &mut [R], before: R, after: R, step: R) {
        self.column.filter(own, before, after, step);
    }

    #[inline(always)]
    fn measure(&self, own: &[R], value: R, _moment: &Moment<R>) -> R {
        value + self.share * (own[0] - value)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_rings_as_the_closed_form_says() {
        let mut values = [100.0, 0.1, 1.0].into_iter();
        let effect: LineResonance<f64> = LineResonance::new(|| values.next().unwrap());
        let mut own = [0.0; 2];
        effect.settled(&mut own, 0.0);
        for _ in 0..300 {
            effect.filter(&mut own, 1.0, 1.0, 2e-5);
        }
        let rate = 100.0 * std::f64::consts::TAU;
        let damped = rate * (1.0f64 - 0.01).sqrt();
        let t = 300.0 * 2e-5;
        let ring = (damped * t).cos() + 0.1 * rate / damped * (damped * t).sin();
        let exact = 1.0 - (-0.1 * rate * t).exp() * ring;
        let moment = Moment {
            time: 2.0,
            temperature: 50.0,
            opening: 3.0,
            drop: 10.0,
            relative_drop: 1.0,
        };
        assert!((effect.measure(&own, 7.0, &moment) - exact).abs() < 1e-8);
    }
}
