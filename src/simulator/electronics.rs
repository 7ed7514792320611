//! From the held command to what the spool's loop gets: delay, limits of its speed and size, dead band, gain, null bias, hysteresis and
//! lag.

use super::filter::{Lag, runge_kutta};
use super::planted::{COLD, Form, Heating, Kind, Planted, find, value};
use super::sensor::Line;
use super::valve::FULL_SCALE;
use rand_chacha::ChaCha8Rng;

/// The path of the command.
pub(super) struct Electronics {
    dead_band: f64,
    /// What is added to a command, V, and from which on all of it is, V.
    compensation: Option<[f64; 2]>,
    dc_gain: f64,
    /// What of the command comes late, and its lag.
    creep: Option<(f64, Lag)>,
    /// What a command of half of full scale adds to the coil's resistance in the end, and how warm it is.
    heating: Option<(f64, Lag)>,
    null_bias: f64,
    pade: Option<Pade>,
    ramp: Option<Ramp>,
    clamp: Option<f64>,
    hysteresis: Option<Hysteresis>,
    /// The one behind the other.
    lags: Vec<Lag>,
}

impl Electronics {
    /// The path in equilibrium with `command`.
    pub(super) fn new(planted: &[Planted], command: f64) -> Self {
        let dead_band = value(planted, Kind::DeadBand);
        let null_bias = value(planted, Kind::NullBias);
        let dc_gain = find(planted, Kind::DcGain, Form::Usual).map_or(1.0, |p| p.value);
        let mut lag = [Form::Usual, Form::SecondOrder]
            .into_iter()
            .filter_map(|form| find(planted, Kind::CommandLag, form));
        let lags = lag
            .next()
            .map_or(vec![], |p| Lag::in_a_row(p.form, p.value));
        let mut path = Self {
            dead_band,
            compensation: find(planted, Kind::DeadBand, Form::Compensated)
                .map(|p| [p.value, p.key("start").unwrap_or(1.0)]),
            dc_gain,
            creep: find(planted, Kind::DcGain, Form::Creeping).map(|p| {
                let mut lag = Lag::new(p.key("time").unwrap_or(1.0));
                lag.rest(command);
                (1.0 - p.value, lag)
            }),
            heating: find(planted, Kind::DcGain, Form::Heating)
                .map(|p| (1.0 / p.value - 1.0, Lag::new(p.key("time").unwrap_or(1.0)))),
            null_bias,
            lags,
            pade: find(planted, Kind::Delay, Form::Pade).map(|p| Pade::new(p.value, command)),
            ramp: [Form::Command, Form::Ramps]
                .into_iter()
                .find_map(|form| find(planted, Kind::SlewLimit, form))
                .map(|p| Ramp {
                    opening: p.value,
                    closing: p.key("closing").unwrap_or(p.value),
                    output: command,
                }),
            clamp: find(planted, Kind::StrokeLimit, Form::Command).map(|p| p.value),
            hysteresis: Hysteresis::planted(planted, dc_gain * command + null_bias),
        };
        let settled = path.passed(command);
        path.lags.iter_mut().for_each(|lag| lag.rest(settled));
        path
    }

    /// What leaves at the start and at the end of a step of `h` s through which `command` enters.
    pub(super) fn step(&mut self, command: f64, h: f64) -> [f64; 2] {
        let entering = match &mut self.pade {
            Some(pade) => pade.step(command, h),
            None => [command; 2],
        };
        let entering = match &mut self.ramp {
            Some(ramp) => ramp.step(entering[1], h),
            None => entering,
        };
        let entering = match &mut self.creep {
            Some((share, lag)) => {
                lag.jump(entering[0]);
                let late = [lag.value, lag.advance(entering[1], h)];
                [0, 1].map(|k| entering[k] - *share * (entering[k] - late[k]))
            }
            None => entering,
        };
        let entering = match &mut self.heating {
            Some((most, lag)) => {
                let heat = entering.map(|u| *most * (2.0 * u / FULL_SCALE).powi(2));
                lag.jump(heat[0]);
                let warm = [lag.value, lag.advance(heat[1], h)];
                [0, 1].map(|k| entering[k] / (1.0 + warm[k]))
            }
            None => entering,
        };
        let passed = entering.map(|u| self.passed(u));
        let lags = self.lags.iter_mut();
        lags.fold(passed, |[start, end], lag| {
            lag.jump(start);
            let before = lag.value;
            [before, lag.advance(end, h)]
        })
    }

    /// What leaves without its lags where `command` enters.
    fn passed(&mut self, command: f64) -> f64 {
        let u = command - command.clamp(-self.dead_band, self.dead_band);
        let jump = |[most, start]: [f64; 2]| (most * u / start).clamp(-most, most);
        let u = u + self.compensation.map_or(0.0, jump);
        let u = self.dc_gain * u + self.null_bias;
        let u = self.hysteresis.as_mut().map_or(u, |h| h.apply(u));
        self.clamp.map_or(u, |limit| u.clamp(-limit, limit))
    }
}

/// What is added to the command on its way to the loop: a hum, and a null that moves as the valve warms up.
pub(super) struct Pickup {
    hum: Option<Line>,
    /// How far it moves, V, with which time constant, s.
    shift: Option<(f64, f64)>,
    /// How fast it moves, V/s, or V/K where that is.
    drift: f64,
    heating: Option<Heating>,
}

impl Pickup {
    pub(super) fn new(planted: &[Planted], rng: &mut ChaCha8Rng) -> Self {
        let hum = [Form::Usual, Form::Overtone];
        let hum = hum
            .into_iter()
            .find_map(|form| find(planted, Kind::CommandHum, form));
        let drifting = find(planted, Kind::NullBias, Form::Drifting);
        let heating = drifting.and_then(|p| p.key("heating"));
        Self {
            hum: hum.map(|p| Line::planted(p, rng)),
            drift: drifting.map_or(0.0, |p| p.value),
            heating: heating.and(Heating::planted(planted)),
            shift: find(planted, Kind::NullBias, Form::Settling)
                .map(|p| (p.value, p.key("warm_up").unwrap_or(1.0))),
        }
    }

    /// After `time` s.
    pub(super) fn at(&self, time: f64) -> f64 {
        let shifted = |(most, constant): (f64, f64)| -most * (-time / constant).exp_m1();
        let warmer = |heating: Heating| heating.temperature(time) - COLD;
        let drifted = self.drift * self.heating.map_or(time, warmer);
        self.shift.map_or(0.0, shifted)
            + drifted
            + self.hum.as_ref().map_or(0.0, |hum| hum.at(time))
    }
}

/// How late the command arrives, s: the exact delay. A held command stays held, only later.
pub(super) fn exact_delay(planted: &[Planted]) -> f64 {
    value(planted, Kind::Delay)
}

/// The ramp generator of an amplifier: y follows the command no faster than the limit, which may be another towards zero.
struct Ramp {
    opening: f64,
    closing: f64,
    output: f64,
}

impl Ramp {
    fn step(&mut self, command: f64, h: f64) -> [f64; 2] {
        let start = self.output;
        // To zero, and on from there.
        let closes = start * (command - start) < 0.0;
        let closed = if closes {
            start.abs().min(self.closing * h)
        } else {
            0.0
        };
        let most = closed + self.opening * (h - closed / self.closing);
        self.output += (command - start).clamp(-most, most);
        [start, self.output]
    }
}

/// The approximant (1 − θs/2 + θ²s²/12) / (1 + θs/2 + θ²s²/12) of a delay θ.
struct Pade {
    delay: f64,
    state: [f64; 2],
}

impl Pade {
    fn new(delay: f64, command: f64) -> Self {
        // w + θ/2 w' + θ²/12 w'' = u and y = w − θ/2 w' + θ²/12 w'' = u − θ w'.
        Self {
            delay,
            state: [command, 0.0],
        }
    }

    fn step(&mut self, command: f64, h: f64) -> [f64; 2] {
        let delay = self.delay;
        let output = |state: [f64; 2]| command - delay * state[1];
        let start = output(self.state);
        self.state = runge_kutta(self.state, h, |[w, rate], _| {
            [
                rate,
                12.0 / (delay * delay) * (command - w - delay / 2.0 * rate),
            ]
        });
        [start, output(self.state)]
    }
}

/// A loop that does not depend on the rate; its half-width is b.
enum Hysteresis {
    Plays(Plays),
    BoucWen(BoucWen),
    Gradual(Gradual),
}

/// y = u + Σ c (p − u), p = max(u − r, min(u + r, p₋)).
pub(super) struct Plays(Vec<Play>);

struct Play {
    half_width: f64,
    share: f64,
    output: f64,
}

impl Plays {
    /// So `many` plays of any width up to the `widest`, at rest at `u`, that are behind by `half_width` where all are crossed.
    pub(super) fn of_any_width(half_width: f64, widest: f64, many: usize, u: f64) -> Self {
        let one = |k: usize| Play {
            half_width: widest * (k as f64 + 0.5) / many as f64,
            share: 2.0 * half_width / (widest * many as f64),
            output: u,
        };
        Self((0..many).map(one).collect())
    }

    /// What comes through where `u` has gone straight here.
    pub(super) fn passed(&self, u: f64) -> f64 {
        let behind = |play: &Play| play.share * (play.follower(u) - u);
        u + self.0.iter().map(behind).sum::<f64>()
    }

    /// `u` has gone straight here.
    pub(super) fn keep(&mut self, u: f64) {
        for play in &mut self.0 {
            play.output = play.follower(u);
        }
    }
}

impl Play {
    fn follower(&self, u: f64) -> f64 {
        self.output.clamp(u - self.half_width, u + self.half_width)
    }
}

/// y = u − b ζ with ζ' = u' / w (1 − |ζ| (1 + sign(u' ζ)) / 2): the loop closes to ±b over a travel of some w.
struct BoucWen {
    half_width: f64,
    travel: f64,
    before: f64,
    inner: f64,
}

/// y = u − b h, h' = |u'| (sign(u') − h) / w.
struct Gradual {
    half_width: f64,
    travel: f64,
    before: f64,
    inner: f64,
}

/// So many plays are as good as one of every width.
const MANY: usize = 500;

/// Half-widths of the plays of a Preisach operator in units of their mean.
const PREISACH: [f64; 6] = [0.1, 0.4, 0.75, 1.05, 1.5, 2.2];

impl Hysteresis {
    fn planted(planted: &[Planted], command: f64) -> Option<Self> {
        let of = |form| find(planted, Kind::Hysteresis, form);
        let play = |half_width| Play {
            half_width,
            share: 1.0,
            output: command,
        };
        if let Some(p) = of(Form::Usual) {
            return Some(Self::Plays(Plays(vec![play(p.value)])));
        }
        if let Some(p) = of(Form::Preisach) {
            let share = 1.0 / PREISACH.len() as f64;
            let plays = PREISACH.map(|r| Play {
                share,
                ..play(r * p.value)
            });
            return Some(Self::Plays(Plays(plays.into())));
        }
        if let Some(p) = of(Form::Spread) {
            let widest = p.key("widest").unwrap_or(1.0);
            return Some(Self::Plays(Plays::of_any_width(
                p.value, widest, MANY, command,
            )));
        }
        if let Some(p) = of(Form::Gradual) {
            return Some(Self::Gradual(Gradual {
                half_width: p.value,
                travel: p.key("travel").unwrap_or(1.0),
                before: command,
                inner: 0.0,
            }));
        }
        of(Form::BoucWen).map(|p| {
            Self::BoucWen(BoucWen {
                half_width: p.value,
                travel: p.key("width").unwrap_or(p.value),
                before: command,
                inner: 0.0,
            })
        })
    }

    fn apply(&mut self, u: f64) -> f64 {
        match self {
            Self::Plays(plays) => {
                plays.keep(u);
                plays.passed(u)
            }
            Self::BoucWen(loop_) => loop_.apply(u),
            Self::Gradual(loop_) => loop_.apply(u),
        }
    }
}

impl BoucWen {
    /// Exact for a command that goes straight to `u`: ζ is straight up to zero, then closes in exponentially.
    fn apply(&mut self, u: f64) -> f64 {
        let moved = (u - self.before) / self.travel;
        let (sign, way) = (moved.signum(), moved.abs());
        let along = sign * self.inner;
        let straight = (-along).clamp(0.0, way);
        let rest = way - straight;
        let reached = along + straight;
        self.inner = sign * (1.0 - (1.0 - reached) * (-rest).exp()).min(1.0);
        if rest == 0.0 {
            self.inner = sign * reached;
        }
        self.before = u;
        u - self.half_width * self.inner
    }
}

impl Gradual {
    /// Exact for a command that goes straight to `u`.
    fn apply(&mut self, u: f64) -> f64 {
        let moved = u - self.before;
        self.before = u;
        if moved != 0.0 {
            let end = moved.signum();
            self.inner = end + (self.inner - end) * (-moved.abs() / self.travel).exp();
        }
        u - self.half_width * self.inner
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path(text: &str) -> Electronics {
        Electronics::new(&[text.parse().unwrap()], 0.0)
    }

    /// The outputs on the way up and down at zero, after a full loop, for a command of `count` steps each way.
    fn loop_at_zero(text: &str, count: i32) -> f64 {
        let mut path = path(text);
        let mut at_zero = Vec::new();
        let up = (-count..=count).map(|k| 5.0 * f64::from(k) / f64::from(count));
        let all: Vec<f64> = up.clone().chain(up.rev()).collect();
        for u in all.iter().chain(&all) {
            let y = path.step(*u, 1e-3)[1];
            if *u == 0.0 {
                at_zero.push(y);
            }
        }
        at_zero[3] - at_zero[2]
    }

    #[test]
    fn every_hysteresis_has_its_width_at_any_rate() {
        for (form, tolerance) in [
            ("", 1e-12),
            ("~preisach", 1e-12),
            ("~spread", 1e-9),
            ("~bouc_wen", 1e-9),
            ("~gradual", 1e-4),
        ] {
            for count in [50, 5000] {
                let width = loop_at_zero(&format!("hysteresis{form}=0.2"), count);
                assert!((width - 0.4).abs() < tolerance, "{form} {count}: {width}");
            }
        }
        let mean = PREISACH.iter().sum::<f64>() / PREISACH.len() as f64;
        assert!((mean - 1.0).abs() < 1e-12);
    }

    #[test]
    fn bouc_wen_does_not_depend_on_the_steps_of_its_command() {
        let mut coarse = path("hysteresis~bouc_wen=0.3:width=0.7");
        let mut fine = path("hysteresis~bouc_wen=0.3:width=0.7");
        let mut from = 0.0;
        for to in [1.0, 0.6, 0.9, -2.0, -1.9, 0.3] {
            let y = coarse.step(to, 1e-3)[1];
            let mut last = 0.0;
            for k in 1..=100 {
                last = fine.step(from + (to - from) * f64::from(k) / 100.0, 1e-3)[1];
            }
            assert!((y - last).abs() < 1e-12, "{to}: {y} {last}");
            from = to;
        }
    }

    #[test]
    fn a_ramp_follows_the_command_no_faster_than_its_limit() {
        let mut path = path("slew_limit~command=100");
        let ends: Vec<f64> = (0..4).map(|_| path.step(0.25, 1e-3)[1]).collect();
        for (end, expected) in ends.iter().zip([0.1, 0.2, 0.25, 0.25]) {
            assert!((end - expected).abs() < 1e-12, "{ends:?}");
        }
    }

    #[test]
    fn a_clamp_lets_no_more_through() {
        let mut path = path("stroke_limit~command=3");
        assert_eq!(
            [2.0, 8.0, -8.0].map(|u| path.step(u, 1e-3)[1]),
            [2.0, 3.0, -3.0]
        );
    }

    #[test]
    fn pade_delays_a_slow_ramp_by_its_delay() {
        let mut path = path("delay~pade=0.004");
        let mut last = 0.0;
        for k in 0..50_000 {
            last = path.step(f64::from(k) * 2e-5, 2e-5)[0];
        }
        let lag = 49_999.0 * 2e-5 - last;
        assert!((lag - 0.004).abs() < 2e-5, "{lag}");
    }
}
