//! The spool and its loop: feed-forward, resonance, slew limit, friction, flow force and stroke limit.

use super::electronics::Plays;
use super::filter::runge_kutta;
use super::outsider::{self, Oddity, Outsider, strength};
use super::planted::{Form, Kind, Planted, find, value};
use super::valve::{FULL_SCALE, Valve};
use std::collections::VecDeque;
use std::f64::consts::TAU;

/// The spool x with its velocity v. Without effects it is the valve of [`Valve`], with z = x + T v:
///
/// ```text
/// x' = v        T v' = K sat(u - x, ±S) - v
/// ```
///
/// Each effect takes its part from the drive, that is from sat(u − x), or limits x or v. One that winds up acts behind the
/// integrator of the loop instead: x' = f(w), z' = K sat(u − x), where w = (z − x)/T stands in the place of v.
pub(super) struct Spool {
    valve: Valve,
    speed: Speed,
    friction: Friction,
    flow_force: f64,
    flow_force_behind: f64,
    /// Near null, by what share less where the jet has turned, and over what opening it does, V.
    flow_force_of_angle: [f64; 3],
    stop: Stop,
    quadratic_damping: f64,
    amplitude_gain: f64,
    /// What each side of the drive, and of a pilot stage's flow, has more than their mean.
    asymmetry: f64,
    pilot_asymmetry: f64,
    /// By what share its drive saturates later to the positive side, and sooner to the negative one.
    saturation_asymmetry: f64,
    detent: f64,
    spring_preload: f64,
    torque_limit: f64,
    pilot_supply: f64,
    pilot_bias: f64,
    supply_null_shift: f64,
    feed_forward: f64,
    integral_action: f64,
    /// By what share of K an integrator leaks, and where to, V.
    leak: (f64, f64),
    before_limit: Option<BeforeLimit>,
    backlash: Option<Backlash>,
    /// Within how much of null its loop is fed back nothing, V.
    slot_clearance: f64,
    /// What of its error drives nothing, V.
    loop_dead_band: f64,
    linkage: Option<Backlash>,
    /// The iron of a torque motor, which the error comes through.
    iron: Option<Plays>,
    transducer: Transducer,
    resonance: Option<Resonance>,
    /// Time constant of a lag of the drive, s.
    drive_lag: Option<f64>,
    drive_delay: Option<DriveDelay>,
    /// Position, V; velocity, V/s; the deflection of the bristles, from −1 to 1; of what rings its velocity, V/s, and
    /// acceleration, V/s², or of a lag of the drive what has come through it, V/s; and what a controller has integrated.
    state: State,
}

type State = [f64; 6];

/// The spool as a mass on oil, v'' + 2 D ω v' = ω² (w − v): of what drives it, w = K sat(u − x), or of the valve's lag behind
/// that, T w' = K sat(u − x) − w.
struct Resonance {
    /// ω, 1/s.
    rate: f64,
    /// D.
    damping: f64,
    lagged: bool,
}

impl Resonance {
    fn planted(valve: &Valve, planted: &[Planted]) -> Option<Self> {
        let usual = find(planted, Kind::SpoolResonance, Form::Usual);
        let lagged = find(planted, Kind::SpoolResonance, Form::Lagged);
        let one = usual.or(lagged)?;
        let rate = TAU * one.value;
        let in_its_place = 0.5 * rate * valve.time_constant;
        Some(Self {
            rate,
            damping: one.key("damping").unwrap_or(in_its_place),
            lagged: lagged.is_some(),
        })
    }
}

/// A dead time of the drive, K sat(u − x), whose course is kept: what it was at the beginning and at the end of each of the last
/// steps, V/s, between which it may jump with the command.
struct DriveDelay {
    seconds: f64,
    course: VecDeque<[f64; 2]>,
}

impl DriveDelay {
    /// The mean of the drive that acts in a step of `h` s, of its course that goes straight in each step; zero before the first.
    fn acting(&self, h: f64) -> f64 {
        let back = (self.seconds / h).max(1.0);
        let whole = back.floor();
        let at = |number: f64| self.course.get(number as usize).unwrap_or(&[0.0; 2]);
        let (earlier, later) = (back - whole, 1.0 - back + whole);
        let ([_, end], [begin, _]) = (at(whole), at(whole - 1.0));
        let rise = |number: f64| at(number)[1] - at(number)[0];
        earlier * (end - 0.5 * earlier * rise(whole))
            + later * (begin + 0.5 * later * rise(whole - 1.0))
    }

    /// A step of `h` s has ended.
    fn keep(&mut self, drive: [f64; 2], h: f64) {
        self.course.push_front(drive);
        self.course.truncate((self.seconds / h) as usize + 2);
    }
}

enum Speed {
    Free,
    /// |v| ≤ limit: v itself, so that nothing winds up.
    Limited(f64),
    /// x' = v / (1 + (v / limit)⁴)^¼.
    Smooth(f64),
    /// |z'| ≤ limit.
    Integrator(f64),
    /// x' follows a hyperbola from v to the limit of its side, from which it stays a share `bend` away where the two meet; z goes
    /// on where it winds up, and else v as if there were no limit.
    Rounded {
        up: f64,
        down: f64,
        bend: f64,
        winds_up: bool,
    },
    /// x' is v between −down and up, and v goes on.
    Sides {
        up: f64,
        down: f64,
    },
    /// x' = limit · tanh(v / limit), and z goes on.
    Tanh(f64),
    /// |x'| ≤ limit, and z goes on: a pilot stage that delivers no more (Merritt 1967).
    Windup(f64),
}

enum Friction {
    None,
    /// The drive loses F sign(v), F = coulomb + excess · exp(−(v / stribeck)²), and the spool sticks where v = 0 while
    /// |drive| ≤ F.
    Coulomb {
        coulomb: f64,
        excess: f64,
        stribeck: f64,
        /// Zero while it sticks, otherwise the sign of v.
        direction: f64,
    },
    /// z − x loses F sign(x'), and the spool sticks until it exceeds F and the excess: an overdamped spool with Coulomb
    /// friction and stiction under a loop that integrates (Olsson et al. 1998).
    Windup {
        coulomb: f64,
        excess: f64,
        /// Zero while it sticks, otherwise the sign of x'.
        direction: f64,
    },
    /// Bristles: the drive loses F ζ, ζ' = (v − |v| ζ F / g(v)) / width, g as F of the other. Dahl's has no excess.
    Bristles {
        coulomb: f64,
        excess: f64,
        stribeck: f64,
        width: f64,
    },
}

/// A play between what the loop moves and what follows it: what the loop is fed back, or the spool.
struct Backlash {
    half_width: f64,
    /// What follows, V.
    at: f64,
    /// Whether the record has what follows.
    recorded: bool,
}

/// What the loop is fed back of the spool: x + square · (x / full scale)² + cubic · (x / full scale)³, V; and x + (shift + stretch · x)
/// · warm of one that warms up, which the record has as well.
struct Transducer {
    square: f64,
    cubic: f64,
    shift: f64,
    stretch: f64,
    warm_up: f64,
    /// From 0 to 1.
    warm: f64,
}

impl Transducer {
    fn planted(planted: &[Planted]) -> Self {
        let curved = find(planted, Kind::FeedbackCurvature, Form::Usual);
        let drifts = find(planted, Kind::NullBias, Form::Transducer);
        let key = |key| drifts.and_then(|p| p.key(key));
        Self {
            square: curved.and_then(|p| p.key("square")).unwrap_or(0.0),
            cubic: curved.map_or(0.0, |p| p.value),
            shift: drifts.map_or(0.0, |p| p.value),
            stretch: key("stretch").unwrap_or(0.0),
            warm_up: key("warm_up").unwrap_or(1.0),
            warm: 0.0,
        }
    }

    /// By how much it shows more than where the spool is as it has warmed up.
    fn drift(&self, x: f64) -> f64 {
        (self.shift + self.stretch * x) * self.warm
    }

    fn shown(&self, x: f64) -> f64 {
        let share = x / FULL_SCALE;
        x + self.square * share.powi(2) + self.cubic * share.powi(3) + self.drift(x)
    }
}

enum Stop {
    None,
    /// bottom ≤ x ≤ top, where it hits v becomes zero.
    Hard {
        bottom: f64,
        top: f64,
    },
    /// |x| ≤ limit, and z goes on.
    Windup(f64),
    /// The drive loses stiffness · (x − limit) beyond the limit.
    Soft {
        limit: f64,
        stiffness: f64,
    },
    /// x' loses rate · (x − limit) beyond the limit.
    Elastic {
        limit: f64,
        rate: f64,
    },
    /// The same beyond the limit of either side, and |z| ≤ rail.
    Rail {
        bottom: f64,
        top: f64,
        rate: f64,
        rail: f64,
    },
}

/// A controller that integrates the error before its output is limited: what it adds to the error, V, grows by `rate` times that.
struct BeforeLimit {
    rate: f64,
    anti_windup: AntiWindup,
}

enum AntiWindup {
    None,
    /// The integral loses what its output exceeds the limit by, at this rate, 1/s.
    Tracking(f64),
    /// It leaks away at this rate, 1/s.
    Leaking(f64),
    /// It does not grow where the output is beyond its limit on the side of the error.
    Clamping,
    /// It does not grow beyond ± a limit, V.
    Limit(f64),
}

impl BeforeLimit {
    fn planted(planted: &[Planted]) -> Option<Self> {
        let of = |form| find(planted, Kind::IntegralAction, form);
        let with = |p: &Planted, anti_windup| Self {
            rate: p.value,
            anti_windup,
        };
        let key = |p: &Planted, key| p.key(key).unwrap_or(1.0);
        let usual = of(Form::Windup).map(|p| with(p, AntiWindup::None));
        let clamping = || of(Form::Clamping).map(|p| with(p, AntiWindup::Clamping));
        let tracking =
            || of(Form::Tracking).map(|p| with(p, AntiWindup::Tracking(key(p, "tracking"))));
        let limited = || of(Form::Limited).map(|p| with(p, AntiWindup::Limit(key(p, "limit"))));
        let leaking = || of(Form::Leaking).map(|p| with(p, AntiWindup::Leaking(key(p, "leak"))));
        usual
            .or_else(clamping)
            .or_else(tracking)
            .or_else(limited)
            .or_else(leaking)
    }

    /// How fast the integral grows, V/s.
    fn grows(&self, error: f64, integral: f64, saturation: f64) -> f64 {
        let output = error + integral;
        let excess = output - output.clamp(-saturation, saturation);
        match self.anti_windup {
            AntiWindup::Tracking(tracking) => self.rate * error - tracking * excess,
            AntiWindup::Leaking(leak) => self.rate * error - leak * integral,
            AntiWindup::Clamping if excess * error > 0.0 => 0.0,
            AntiWindup::Limit(limit) if integral.abs() >= limit && integral * error > 0.0 => 0.0,
            _ => self.rate * error,
        }
    }
}

impl Backlash {
    fn follower(&self, x: f64) -> f64 {
        self.at.clamp(x - self.half_width, x + self.half_width)
    }
}

/// Plays of the iron: so many are as good as one of every width.
const MANY: usize = 100;

fn stribeck_level(coulomb: f64, excess: f64, stribeck: f64, velocity: f64) -> f64 {
    if excess == 0.0 {
        return coulomb;
    }
    coulomb + excess * (-(velocity / stribeck).powi(2)).exp()
}

impl Friction {
    fn planted(planted: &[Planted]) -> Self {
        let of = |form| find(planted, Kind::Friction, form);
        let bristles = |p: &Planted, share: f64| Self::Bristles {
            coulomb: p.value,
            excess: p.key("excess").unwrap_or(share * p.value),
            stribeck: p.key("stribeck").unwrap_or(1.0),
            width: p.key("width").unwrap_or(1.0),
        };
        if let Some(p) = of(Form::Usual) {
            return Self::Coulomb {
                coulomb: p.value,
                excess: p.key("excess").unwrap_or(0.0),
                stribeck: p.key("stribeck").unwrap_or(1.0),
                direction: 0.0,
            };
        }
        if let Some(p) = of(Form::Windup) {
            return Self::Windup {
                coulomb: p.value,
                excess: p.key("excess").unwrap_or(0.0),
                direction: 0.0,
            };
        }
        let dahl = of(Form::Dahl).map(|p| bristles(p, 0.0));
        let lugre = || of(Form::Lugre).map(|p| bristles(p, 0.4));
        dahl.or_else(lugre).unwrap_or(Self::None)
    }
}

impl Spool {
    /// The spool at rest at `position`.
    pub(super) fn new(
        valve: Valve,
        planted: &[Planted],
        outsiders: &[Outsider],
        position: f64,
    ) -> Self {
        let limit = |kind, form| find(planted, kind, form).map(|p| p.value);
        let slew = |form| limit(Kind::SlewLimit, form);
        let usual = slew(Form::Usual).map(Speed::Limited);
        let rounded = [Form::Rounded, Form::Pilot, Form::Uneven]
            .into_iter()
            .find_map(|form| {
                find(planted, Kind::SlewLimit, form).map(|p| Speed::Rounded {
                    up: p.value,
                    down: p.key("negative").unwrap_or(p.value),
                    bend: p.key("bend").unwrap_or(1.0),
                    winds_up: form == Form::Rounded,
                })
            });
        let sides = find(planted, Kind::SlewLimit, Form::Sides).map(|p| Speed::Sides {
            up: p.value,
            down: p.key("negative").unwrap_or(p.value),
        });
        let speed = usual
            .or(rounded)
            .or(sides)
            .or_else(|| slew(Form::Smooth).map(Speed::Smooth))
            .or_else(|| slew(Form::Integrator).map(Speed::Integrator))
            .or_else(|| slew(Form::Windup).map(Speed::Windup))
            .or_else(|| slew(Form::Tanh).map(Speed::Tanh))
            .unwrap_or(Speed::Free);
        let soft = find(planted, Kind::StrokeLimit, Form::Soft).map(|p| Stop::Soft {
            limit: p.value,
            stiffness: p.key("stiffness").unwrap_or(1.0),
        });
        let elastic = find(planted, Kind::StrokeLimit, Form::Elastic).map(|p| Stop::Elastic {
            limit: p.value,
            rate: p.key("rate").unwrap_or(1.0),
        });
        let rail = find(planted, Kind::StrokeLimit, Form::Rail).map(|p| Stop::Rail {
            bottom: -p.key("negative").unwrap_or(p.value),
            top: p.value,
            rate: p.key("rate").unwrap_or(1.0),
            rail: p.key("rail").unwrap_or(13.0),
        });
        let usual = find(planted, Kind::StrokeLimit, Form::Usual);
        let sides = find(planted, Kind::StrokeLimit, Form::Sides);
        let hard = usual.or(sides).map(|p| Stop::Hard {
            bottom: -p.key("negative").unwrap_or(p.value),
            top: p.value,
        });
        let stroke = |form| limit(Kind::StrokeLimit, form);
        let stop = soft
            .or(elastic)
            .or(rail)
            .or(hard)
            .or_else(|| stroke(Form::Windup).map(Stop::Windup))
            .unwrap_or(Stop::None);
        let play = |form| {
            find(planted, Kind::Hysteresis, form).map(|p| Backlash {
                half_width: p.value,
                at: position,
                recorded: form == Form::Transducer,
            })
        };
        Self {
            valve,
            speed,
            friction: Friction::planted(planted),
            flow_force: value(planted, Kind::FlowForce),
            flow_force_behind: find(planted, Kind::FlowForce, Form::Windup)
                .map_or(0.0, |p| p.value),
            flow_force_of_angle: find(planted, Kind::FlowForce, Form::Angle).map_or(
                [0.0, 0.0, 1.0],
                |p| {
                    let key = |key| p.key(key).unwrap_or(1.0);
                    [p.value, key("turn"), key("span")]
                },
            ),
            stop,
            quadratic_damping: strength(outsiders, Oddity::QuadraticDamping),
            amplitude_gain: strength(outsiders, Oddity::AmplitudeGain),
            asymmetry: limit(Kind::AsymmetricGain, Form::Loop).unwrap_or(0.0),
            pilot_asymmetry: limit(Kind::AsymmetricGain, Form::Pilot).unwrap_or(0.0),
            saturation_asymmetry: limit(Kind::AsymmetricGain, Form::Saturation).unwrap_or(0.0),
            detent: strength(outsiders, Oddity::Detent),
            spring_preload: strength(outsiders, Oddity::SpringPreload),
            torque_limit: strength(outsiders, Oddity::TorqueLimit),
            pilot_supply: value(planted, Kind::PilotSupply),
            pilot_bias: limit(Kind::NullBias, Form::Pilot).unwrap_or(0.0),
            supply_null_shift: limit(Kind::NullBias, Form::Supply).unwrap_or(0.0),
            feed_forward: value(planted, Kind::FeedForward),
            integral_action: value(planted, Kind::IntegralAction),
            leak: find(planted, Kind::DcGain, Form::Leaking).map_or((0.0, 0.0), |p| {
                (1.0 / p.value - 1.0, p.key("zero").unwrap_or(0.0))
            }),
            before_limit: BeforeLimit::planted(planted),
            backlash: play(Form::Feedback).or_else(|| play(Form::Transducer)),
            slot_clearance: limit(Kind::DeadBand, Form::Feedback).unwrap_or(0.0),
            loop_dead_band: limit(Kind::DeadBand, Form::Loop).unwrap_or(0.0),
            linkage: play(Form::Linkage),
            iron: find(planted, Kind::Hysteresis, Form::Loop).map(|p| {
                Plays::of_any_width(
                    p.value,
                    2.0 * p.value / p.key("share").unwrap_or(0.5),
                    MANY,
                    0.0,
                )
            }),
            transducer: Transducer::planted(planted),
            resonance: Resonance::planted(&valve, planted),
            drive_lag: limit(Kind::CommandLag, Form::Loop),
            drive_delay: limit(Kind::Delay, Form::Loop).map(|seconds| DriveDelay {
                seconds,
                course: VecDeque::new(),
            }),
            state: [position, 0.0, 0.0, 0.0, 0.0, 0.0],
        }
    }

    /// Its position, V, behind its play and with what is fed forward of its motion.
    pub(super) fn position(&self) -> f64 {
        let x = self.state[0] + self.feed_forward * self.state[1];
        self.linkage.as_ref().map_or(x, |play| play.follower(x))
    }

    /// What the record has of a spool at `position`, V.
    pub(super) fn recorded(&self, position: f64) -> f64 {
        match &self.backlash {
            Some(play) if play.recorded => play.at,
            _ => position + self.transducer.drift(position),
        }
    }

    /// Moves on by `h` s to `time`, in which the command goes straight from `command[0]` to `command[1]` and the pressure drop is
    /// `drop` times the rated one.
    pub(super) fn step(&mut self, command: [f64; 2], drop: f64, time: f64, h: f64) {
        self.transducer.warm = -(-time / self.transducer.warm_up).exp_m1();
        // Where the command has come with the row the error is largest.
        self.magnetise(command[0]);
        let late = self.drive_delay.is_some();
        let begins = late.then(|| self.valve.gain * self.driven(command[0], drop));
        match self.friction {
            Friction::Coulomb { .. } => self.step_with_sticking(command, drop, h),
            _ => {
                let direction = self.slip();
                self.state = self.moved(self.state, command, drop, direction, h);
            }
        }
        let ends = late.then(|| self.valve.gain * self.driven(command[1], drop));
        if let (Some(delay), Some(begins), Some(ends)) = (&mut self.drive_delay, begins, ends) {
            delay.keep([begins, ends], h);
        }
        if let Some(AntiWindup::Limit(limit)) =
            self.before_limit.as_ref().map(|one| &one.anti_windup)
        {
            self.state[5] = self.state[5].clamp(-limit, *limit);
        }
        self.magnetise(command[1]);
        let x = self.state[0];
        for play in [&mut self.backlash, &mut self.linkage]
            .into_iter()
            .flatten()
        {
            play.at = play.follower(x);
        }
        if let Stop::Windup(limit) = self.stop
            && self.state[0].abs() > limit
        {
            let lead = self.state[0] + self.valve.time_constant * self.state[1];
            self.state[0] = limit.copysign(self.state[0]);
            self.state[1] = (lead - self.state[0]) / self.valve.time_constant;
        }
        if let Stop::Rail { rail, .. } = self.stop {
            let lead = self.state[0] + self.valve.time_constant * self.state[1];
            self.state[1] = (lead.clamp(-rail, rail) - self.state[0]) / self.valve.time_constant;
        }
        if let Stop::Hard { bottom, top } = self.stop
            && !(bottom < self.state[0] && self.state[0] < top)
        {
            self.state[0] = self.state[0].clamp(bottom, top);
            // It may move away from the stop, not into it.
            if self.state[1] * self.state[0] > 0.0 {
                self.state[1] = 0.0;
                if let Friction::Coulomb { direction, .. } = &mut self.friction {
                    *direction = 0.0;
                }
            }
        }
    }

    /// The direction in which a spool moves that can stick behind the integrator, zero where it sticks.
    fn slip(&mut self) -> f64 {
        let Friction::Windup {
            coulomb,
            excess,
            direction,
        } = &mut self.friction
        else {
            return 0.0;
        };
        let ahead = self.valve.time_constant * self.state[1];
        let needed = match *direction == ahead.signum() {
            true => *coulomb,
            false => *coulomb + *excess,
        };
        *direction = if ahead.abs() > needed {
            ahead.signum()
        } else {
            0.0
        };
        *direction
    }

    /// x' for z − x = T w.
    fn speed(&self, x: f64, w: f64, drop: f64, direction: f64) -> f64 {
        let w = w - self.flow_force_behind * x * drop / self.valve.time_constant;
        let w = match self.friction {
            Friction::Windup { coulomb, .. } => {
                let slides = direction * w - coulomb / self.valve.time_constant;
                direction * slides.max(0.0)
            }
            _ => w,
        };
        if let Stop::Windup(limit) = self.stop
            && x.abs() >= limit
            && w * x > 0.0
        {
            return 0.0;
        }
        let w = match self.stop {
            Stop::Elastic { limit, rate } => w - rate * (x - x.clamp(-limit, limit)),
            Stop::Rail {
                bottom, top, rate, ..
            } => w - rate * (x - x.clamp(bottom, top)),
            _ => w,
        };
        let w = w * (1.0 + self.pilot_asymmetry * w.signum());
        match self.speed {
            Speed::Limited(limit) | Speed::Windup(limit) => w.clamp(-limit, limit),
            Speed::Rounded { up, down, bend, .. } => {
                let limit = if w > 0.0 { up } else { down };
                let bend = bend * limit;
                let steep = w * f64::hypot(limit, bend) / limit;
                (f64::hypot(steep + limit, bend) - f64::hypot(steep - limit, bend)) / 2.0
            }
            Speed::Sides { up, down } => w.clamp(-down, up),
            Speed::Tanh(limit) => limit * (w / limit).tanh(),
            Speed::Smooth(limit) => w / (1.0 + (w / limit).powi(4)).sqrt().sqrt(),
            _ => w,
        }
    }

    /// Whether anything acts on z − x, so that the lag is between z and what x' makes of it.
    fn winds_up(&self) -> bool {
        self.flow_force_behind != 0.0
            || matches!(self.friction, Friction::Windup { .. })
            || matches!(
                self.stop,
                Stop::Windup(_) | Stop::Elastic { .. } | Stop::Rail { .. }
            )
            || matches!(
                self.speed,
                Speed::Windup(_) | Speed::Tanh(_) | Speed::Rounded { winds_up: true, .. }
            )
    }

    fn step_with_sticking(&mut self, command: [f64; 2], drop: f64, h: f64) {
        let start = self.state;
        let Friction::Coulomb {
            coulomb,
            excess,
            mut direction,
            ..
        } = self.friction
        else {
            return;
        };
        let escape = |drive: f64| {
            if drive.abs() > coulomb + excess {
                drive.signum()
            } else {
                0.0
            }
        };
        if direction == 0.0 {
            direction = escape(self.driven(command[0], drop));
        }
        if direction == 0.0 {
            // What integrates goes on where the spool sticks.
            let middle = (command[0] + command[1]) / 2.0;
            let reference = self.reference(middle, start[5]);
            let drive = self.valve.gain * self.drive(start[0], reference, drop);
            self.state[5] += self.grows(middle, start[0], start[5], drive) * h;
        } else {
            self.state = self.moved(start, command, drop, direction, h);
            if self.state[1] * direction < 0.0 {
                // It comes to rest within the step, and stays there or sets out the other way.
                let share = start[1] / (start[1] - self.state[1]);
                let turn = command[0] + share * (command[1] - command[0]);
                let [rest, .., integral] =
                    self.moved(start, [command[0], turn], drop, direction, share * h);
                self.state = [rest, 0.0, 0.0, 0.0, 0.0, integral];
                direction = escape(self.driven(turn, drop));
                if direction != 0.0 {
                    let left = (1.0 - share) * h;
                    self.state = self.moved(self.state, [turn, command[1]], drop, direction, left);
                }
            }
        }
        if let Friction::Coulomb {
            direction: kept, ..
        } = &mut self.friction
        {
            *kept = direction;
        }
    }

    /// What its loop is fed back of a spool at `x`, V.
    fn fed_back(&self, x: f64) -> f64 {
        let follower = self.backlash.as_ref().map_or(x, |play| play.follower(x));
        let shown = self.transducer.shown(follower);
        shown - shown.clamp(-self.slot_clearance, self.slot_clearance)
    }

    /// The command with what its controller has integrated of the error before that is limited, V.
    fn reference(&self, u: f64, integral: f64) -> f64 {
        match self.before_limit {
            None => u,
            Some(_) => u + integral,
        }
    }

    /// What a controller has integrated that integrates its limited drive, V/s.
    fn after_limit(&self, integral: f64) -> f64 {
        match self.before_limit {
            None => integral,
            Some(_) => 0.0,
        }
    }

    /// How fast that, or what it has integrated of the `proportional` part, V/s, grows.
    fn grows(&self, u: f64, x: f64, integral: f64, proportional: f64) -> f64 {
        match &self.before_limit {
            None => self.integral_action * proportional,
            Some(one) => one.grows(u - self.fed_back(x), integral, self.valve.saturation),
        }
    }

    /// What drives the spool, with what its controller has integrated, V; friction is not in it.
    fn driven(&self, u: f64, drop: f64) -> f64 {
        let [x, .., integral] = self.state;
        let drive = self.drive(x, self.reference(u, integral), drop);
        drive + self.after_limit(integral) / self.valve.gain
    }

    /// The error of `command` has come to the iron.
    fn magnetise(&mut self, command: f64) {
        let Some(mut iron) = self.iron.take() else {
            return;
        };
        let [x, .., integral] = self.state;
        iron.keep(self.reference(command, integral) - self.fed_back(x));
        self.iron = Some(iron);
    }

    /// sat(u − x) and what flow force, soft stop, detent and preload take from it, V; friction is not in it.
    fn drive(&self, x: f64, u: f64, drop: f64) -> f64 {
        let error = u + 10.0 * self.supply_null_shift * (drop - 1.0) - self.fed_back(x);
        let error = self.iron.as_ref().map_or(error, |iron| iron.passed(error));
        let error = error - error.clamp(-self.loop_dead_band, self.loop_dead_band);
        let [down, up] =
            [-1.0, 1.0].map(|side| (side + self.saturation_asymmetry) * self.valve.saturation);
        let mut drive = error.clamp(down, up);
        if let Speed::Integrator(limit) = self.speed {
            let limit = limit / self.valve.gain;
            drive = drive.clamp(-limit, limit);
        }
        let [near_null, turn, span] = self.flow_force_of_angle;
        let turned = near_null * (1.0 - turn * (1.0 - (-x.abs() / span).exp()));
        drive -= (self.flow_force + turned) * x * drop;
        if let Stop::Soft { limit, stiffness } = self.stop {
            drive -= stiffness * (x - x.clamp(-limit, limit));
        }
        drive += self.pilot_bias;
        if self.detent != 0.0 {
            drive -= outsider::detent(self.detent, x);
        }
        if self.spring_preload != 0.0 {
            drive -= outsider::spring_preload(self.spring_preload, x);
        }
        drive
    }

    fn moved(&self, state: State, command: [f64; 2], drop: f64, direction: f64, h: f64) -> State {
        let winds_up = self.winds_up();
        let late = self.drive_delay.as_ref().map(|delay| delay.acting(h));
        let mut end = runge_kutta(
            state,
            h,
            |[x, v, bristles, rings, swings, integral], share| {
                let u = command[0] + share * (command[1] - command[0]);
                let mut drive = self.drive(x, self.reference(u, integral), drop);
                let mut bend = 0.0;
                match self.friction {
                    Friction::None | Friction::Windup { .. } => {}
                    Friction::Coulomb {
                        coulomb,
                        excess,
                        stribeck,
                        ..
                    } => drive -= direction * stribeck_level(coulomb, excess, stribeck, v),
                    Friction::Bristles {
                        coulomb,
                        excess,
                        stribeck,
                        width,
                    } => {
                        drive -= coulomb * bristles;
                        let share = coulomb / stribeck_level(coulomb, excess, stribeck, v);
                        bend = (v - v.abs() * bristles * share) / width;
                    }
                }
                let gain = self.valve.gain
                    * outsider::amplitude_gain(self.amplitude_gain, x)
                    * (1.0 + self.asymmetry * drive.signum())
                    * (1.0 + self.pilot_supply * (drop.sqrt() - 1.0));
                let proportional = gain * drive;
                let driven = late.unwrap_or(proportional + self.after_limit(integral));
                let (leak, zero) = self.leak;
                let wound = x + self.valve.time_constant * v;
                let driven = driven - self.valve.gain * leak * (wound - zero);
                let grows = self.grows(u, x, integral, proportional);
                if let Some(resonance) = &self.resonance {
                    let driving = if resonance.lagged { v } else { driven };
                    let pull =
                        resonance.rate * (driving - rings) - 2.0 * resonance.damping * swings;
                    let lag = (driven - v) / self.valve.time_constant;
                    let speed = self.speed(x, rings, drop, direction);
                    return [speed, lag, bend, swings, resonance.rate * pull, grows];
                }
                let (driven, comes_through) = match self.drive_lag {
                    Some(lag) => (rings, (driven - rings) / lag),
                    None => (driven, 0.0),
                };
                let speed = self.speed(x, v, drop, direction);
                let lost = if winds_up { speed } else { v };
                let drag = lost + outsider::quadratic_drag(self.quadratic_damping, v);
                let torque = outsider::limited_torque(self.torque_limit, driven - drag);
                [
                    speed,
                    torque / self.valve.time_constant,
                    bend,
                    comes_through,
                    0.0,
                    grows,
                ]
            },
        );
        if let Speed::Limited(limit) = self.speed {
            end[1] = end[1].clamp(-limit, limit);
        }
        end
    }
}
