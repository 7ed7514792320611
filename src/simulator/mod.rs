//! A simulator of servo valves: records of a servo valve with planted effects, against which a diagnosis is checked.
//!
//! ```text
//! Command ──> electronics ──> spool ──> flow ──> sensors ──> noise, quantisation ──> Record
//!             delay, bias,    slew,     opening,  lag, offset,
//!             hysteresis      friction… supply…   drift, hum
//! ```
//!
//! It shares nothing with [`crate::model`]: its own equations, its own integration in steps of 20 µs. What is found in
//! its records is not found because the model is asked about itself.
//!
//! ```
//! use servobee::simulator::Setup;
//!
//! let setup = Setup {
//!     planted: vec!["delay=0.002".parse()?, "hysteresis~bouc_wen=0.2".parse()?],
//!     seconds: 1.0,
//!     ..Setup::default()
//! };
//! let record = setup.record()?;
//! assert_eq!(record.samples(), 1000);
//! # servobee::Result::Ok(())
//! ```

mod command;
mod electronics;
mod filter;
mod flow;
mod meter;
mod noise;
mod outsider;
mod planted;
mod random;
mod sensor;
mod spool;
mod valve;

pub use command::Command;
pub use meter::{Meter, Supply};
pub use noise::{Noise, Quantisation};
pub use outsider::{Oddity, Outsider};
use planted::Heating;
pub use planted::{Form, Kind, Planted};
pub use valve::{FULL_SCALE, RATED_DROP, Valve};

use crate::record::{Channel, Record, Series};
use crate::{Error, Result};
use electronics::{Electronics, Pickup, exact_delay};
use flow::{Flow, Seen};
use outsider::{odd_command, seen_rate, strength};
use random::{Stream, random};
use sensor::{Sensor, hanging};
use spool::Spool;

/// How long the valve is held at its first command before the record starts, s.
const RUN_IN: f64 = 0.3;

/// The unit of the measured spool.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpoolUnit {
    /// V, as the command.
    #[default]
    Volt,
    /// % of full scale.
    Percent,
}

impl SpoolUnit {
    /// The unit in a record.
    pub fn name(self) -> &'static str {
        match self {
            Self::Volt => "V",
            Self::Percent => "%",
        }
    }

    /// Its full scale.
    fn full_scale(self) -> f64 {
        match self {
            Self::Volt => FULL_SCALE,
            Self::Percent => 100.0,
        }
    }
}

/// A valve on a simulated bench, and how it is measured.
#[derive(Debug, Clone, PartialEq)]
pub struct Setup {
    /// The record's name.
    pub name: String,
    /// The valve.
    pub valve: Valve,
    /// What effects it has; no effect twice on a channel.
    pub planted: Vec<Planted>,
    /// What else is odd about it.
    pub outsiders: Vec<Outsider>,
    /// What is commanded.
    pub command: Command,
    /// Length of the record, s; of no use where the command's samples are given.
    pub seconds: f64,
    /// Rows a second, which is also how often the command changes.
    pub rate: f64,
    /// Noise of every measured channel.
    pub noise: Noise,
    /// Rounding of every measured channel.
    pub quantisation: Option<Quantisation>,
    /// The unit of the measured spool.
    pub spool_unit: SpoolUnit,
    /// Whether flow is measured.
    pub flow: bool,
    /// Where it is.
    pub meter: Meter,
    /// What feeds the valve.
    pub supply: Supply,
    /// The longest integration step, s.
    pub step: f64,
    /// Seed of command, noise, and whatever else is drawn.
    pub seed: u64,
}

impl Default for Setup {
    /// 8 s of the bench's command at 1 kHz, spool in V and flow measured with white noise of 0.3 % of full scale.
    fn default() -> Self {
        Self {
            name: "simulator".into(),
            valve: Valve::default(),
            planted: Vec::new(),
            outsiders: Vec::new(),
            command: Command::Bench,
            seconds: 8.0,
            rate: 1000.0,
            noise: Noise::white(0.3),
            quantisation: None,
            spool_unit: SpoolUnit::Volt,
            flow: true,
            meter: Meter::Load,
            supply: Supply::Constant,
            step: 20e-6,
            seed: 1,
        }
    }
}

/// What a bench would measure without noise and rounding.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulation {
    /// s.
    pub time: Vec<f64>,
    /// The command that was asked for, V.
    pub command: Vec<f64>,
    /// In the unit of [`Setup::spool_unit`].
    pub spool: Vec<f64>,
    /// L/min.
    pub flow: Vec<f64>,
    /// The pressure drop from P to T, bar; of use where it is measured.
    pub supply: Vec<f64>,
    /// degC, where the oil warms up.
    pub temperature: Option<Vec<f64>>,
}

/// How much of a channel is due to what is planted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strength {
    /// The channel.
    pub channel: Channel,
    /// The root mean square of the difference that planting makes, without noise, in the channel's unit.
    pub rms: f64,
    /// The same in standard deviations of the channel's noise.
    pub in_noise: f64,
}

impl Setup {
    /// The channels that are measured and their units and full scales.
    fn measured(&self) -> Vec<(Channel, &'static str, f64)> {
        let spool = (
            Channel::Spool,
            self.spool_unit.name(),
            self.spool_unit.full_scale(),
        );
        let flow = (Channel::Flow, "L/min", self.valve.rated_flow);
        let mut channels = vec![spool];
        channels.extend(self.flow.then_some(flow));
        let supply = (Channel::SupplyPressure, "bar", RATED_DROP);
        channels.extend((self.supply == Supply::Measured).then_some(supply));
        channels
    }

    /// The standard deviation of a channel's noise and rounding together, in the channel's unit; zero for a channel
    /// that has none.
    pub fn noise_std(&self, channel: Channel) -> f64 {
        let rounding = self.quantisation.map_or(0.0, Quantisation::step);
        let share = (self.noise.percent / 100.0).hypot(rounding / 12f64.sqrt());
        let of = self.measured().into_iter().find(|m| m.0 == channel);
        of.map_or(0.0, |(_, _, full_scale)| share * full_scale)
    }

    /// # Errors
    /// A number that makes no sense, or an effect that is planted twice.
    fn check(&self) -> Result<()> {
        let refuse =
            |what: &str, problem: String, remedy: &str| Err(Error::input(what, problem, remedy));
        let numbers = [
            ("the valve's gain", self.valve.gain),
            ("the valve's time constant", self.valve.time_constant),
            ("the valve's saturation", self.valve.saturation),
            ("the valve's rated flow", self.valve.rated_flow),
            ("the record's length in s", self.seconds),
            ("the record's rate in Hz", self.rate),
            ("the integration step in s", self.step),
            ("the noise's corner in Hz", self.noise.colour.unwrap_or(1.0)),
        ];
        for (what, number) in numbers {
            if !(number > 0.0 && number.is_finite()) {
                return refuse(what, format!("is {number}"), "give a number above zero");
            }
        }
        if !(0.0..=100.0).contains(&self.noise.percent) {
            let problem = format!("is {} % of full scale", self.noise.percent);
            return refuse("noise", problem, "give 0 to 100 %");
        }
        if let Some(Quantisation::Bits(bits)) = self.quantisation
            && !(1..=32).contains(&bits)
        {
            return refuse("quantisation", format!("has {bits} bits"), "give 1 to 32");
        }
        if !(2.0..=1e7).contains(&(self.seconds * self.rate)) {
            let problem = format!("{} s at {} Hz make no record", self.seconds, self.rate);
            return refuse("record", problem, "ask for 2 to 10 000 000 rows");
        }
        if let Command::Samples(values) = &self.command
            && (values.len() < 2 || !values.iter().all(|u| u.is_finite()))
        {
            return refuse(
                "command",
                "is too short or not finite".into(),
                "give two or more numbers",
            );
        }
        for (index, planted) in self.planted.iter().enumerate() {
            planted.check()?;
            let same = |p: &&Planted| p.effect == planted.effect && p.channel == planted.channel;
            if let Some(first) = self.planted[..index].iter().find(same) {
                let problem = format!("{first} is planted already");
                return refuse(&format!("effect {planted}"), problem, "plant it once");
            }
            let needs_flow = planted.channel == Channel::Flow || planted.effect.place() == "flow";
            if needs_flow && !self.flow {
                let place = format!("effect {planted}");
                return refuse(
                    &place,
                    "the flow is not measured".into(),
                    "measure it, or plant on the spool",
                );
            }
            if self.meter < planted.effect.meter() {
                return refuse(
                    &format!("effect {planted}"),
                    "no meter between A and B sees it".into(),
                    "measure the flow in the pressure line: --meter supply",
                );
            }
        }
        self.check_supply()?;
        for (index, outsider) in self.outsiders.iter().enumerate() {
            outsider.check()?;
            if self.outsiders[..index]
                .iter()
                .any(|o| o.oddity == outsider.oddity)
            {
                let place = format!("outsider {outsider}");
                return refuse(&place, "is planted already".into(), "plant it once");
            }
        }
        Ok(())
    }

    /// # Errors
    /// An effect that shows by the supply's pressure alone where that is not measured, or one on it where it is.
    fn check_supply(&self) -> Result<()> {
        for planted in &self.planted {
            let (problem, remedy) = match (planted.effect, self.supply) {
                (effect, supply) if supply < effect.supply(planted.form) => (
                    "nothing shows it where the supply's pressure stands still",
                    "let it give way and measure it: --supply measured",
                ),
                (Kind::SupplyDroop, Supply::Measured) => (
                    "nothing of it is left where the supply's pressure is measured",
                    "leave --supply measured away",
                ),
                _ => continue,
            };
            return Err(Error::input(format!("effect {planted}"), problem, remedy));
        }
        Ok(())
    }

    fn rows(&self) -> usize {
        match &self.command {
            Command::Samples(values) => values.len(),
            _ => (self.seconds * self.rate).round() as usize,
        }
    }

    /// What would be measured without noise and rounding.
    ///
    /// # Errors
    /// A number that makes no sense, an effect that is planted twice, or a valve that runs away.
    pub fn simulate(&self) -> Result<Simulation> {
        self.check()?;
        let mut simulation = self.run()?;
        let shown = self.shown();
        for values in [&mut simulation.spool, &mut simulation.flow] {
            show(&shown, values);
        }
        Ok(simulation)
    }

    /// Which row each row shows, where measurements hang.
    fn shown(&self) -> Option<Vec<usize>> {
        let share = strength(&self.outsiders, Oddity::Dropout);
        let mut rng = random(self.seed, Stream::Hanging);
        (share > 0.0).then(|| hanging(share, self.rows(), 1.0 / self.rate, &mut rng))
    }

    fn run(&self) -> Result<Simulation> {
        let (planted, outsiders) = (&self.planted, &self.outsiders);
        let interval = 1.0 / self.rate;
        let rows = self.rows();
        let asked = self
            .command
            .draw(rows, interval, &mut random(self.seed, Stream::Command));
        let sent = odd_command(&asked, interval, outsiders);
        let rate = seen_rate(&asked, interval);

        let mut electronics = Electronics::new(planted, sent[0]);
        let pickup = Pickup::new(planted, &mut random(self.seed, Stream::Hum));
        let rest = electronics.step(sent[0], self.step)[0] + pickup.at(0.0);
        let mut spool = Spool::new(self.valve, planted, outsiders, rest);
        let mut seen = Seen::new(planted, outsiders, rest);
        let mut flow = Flow::new(
            self.valve,
            (self.meter, self.supply),
            planted,
            outsiders,
            seen.position,
        );
        let mut rng = random(self.seed, Stream::Sensors);
        let mut sensor = |channel, scale, value| {
            Sensor::new(channel, planted, outsiders, scale, value, &mut rng)
        };
        let scale = self.spool_unit.full_scale() / FULL_SCALE;
        let mut spool_sensor = sensor(Channel::Spool, scale, seen.position);
        let mut flow_sensor = sensor(Channel::Flow, 1.0, flow.value);

        let pieces = self.pieces(exact_delay(planted));
        let time: Vec<f64> = (0..rows).map(|row| row as f64 / self.rate).collect();
        let mut simulation = Simulation {
            time,
            command: asked,
            spool: Vec::with_capacity(rows),
            flow: Vec::with_capacity(rows),
            supply: Vec::with_capacity(rows),
            temperature: None,
        };
        let run_in = (RUN_IN * self.rate).ceil() as usize;
        for tick in 0..run_in + rows {
            // Before the first row time stands still at zero and the command at its first value.
            let row = tick.saturating_sub(run_in);
            let start = simulation.time[row];
            if tick >= run_in {
                simulation.spool.push(spool_sensor.read(start, rate[row]));
                simulation.flow.push(flow_sensor.read(start, rate[row]));
                simulation.supply.push(flow.drop() * RATED_DROP);
            }
            let mut passed = 0.0;
            for piece in &pieces {
                let command = sent[row.saturating_sub(piece.late)];
                for _ in 0..piece.steps {
                    let h = piece.step;
                    passed += h;
                    let now = if tick < run_in { 0.0 } else { start + passed };
                    let before = (now - h).max(0.0);
                    let [from, to] = electronics.step(command, h);
                    let command = [from + pickup.at(before), to + pickup.at(now)];
                    spool.step(command, flow.drop(), now, h);
                    seen.advance(spool.position(), now, h);
                    flow.advance(seen.position, now, h);
                    spool_sensor.advance(spool.recorded(seen.position), h);
                    flow_sensor.advance(flow.value, h);
                }
            }
        }
        let times = simulation.time.iter();
        simulation.temperature = Heating::planted(planted)
            .map(|heating| times.map(|&t| heating.temperature(t)).collect());
        let all = simulation.spool.iter().chain(&simulation.flow);
        if all.into_iter().all(|y| y.is_finite()) {
            return Ok(simulation);
        }
        Err(Error::failed(
            "the planted valve runs away",
            "plant weaker effects, or a valve with more damping",
        ))
    }

    /// The interval between two rows, cut where a command that is `delay` s late changes.
    fn pieces(&self, delay: f64) -> Vec<Piece> {
        let interval = 1.0 / self.rate;
        let whole = (delay * self.rate).round();
        let cut = |late: f64, seconds: f64| {
            let steps = (seconds / self.step - 1e-9).ceil().max(1.0);
            Piece {
                late: late as usize,
                steps: steps as usize,
                step: seconds / steps,
            }
        };
        if (delay * self.rate - whole).abs() < 1e-6 {
            return vec![cut(whole, interval)];
        }
        let whole = (delay * self.rate).floor();
        let rest = delay - whole * interval;
        vec![cut(whole + 1.0, rest), cut(whole, interval - rest)]
    }

    /// The record that the simulator gives: with noise and rounding.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn record(&self) -> Result<Record> {
        self.check()?;
        let simulation = self.run()?;
        let rows = simulation.time.len();
        let shown = self.shown();
        let mut rng = random(self.seed, Stream::Noise);
        let mut channels = vec![(
            Channel::Command,
            Series::new("V", simulation.command.clone()),
        )];
        for (channel, unit, full_scale) in self.measured() {
            let mut values = simulation.channel(channel).to_vec();
            let noise = self.noise.draw(rows, 1.0 / self.rate, &mut rng);
            for (value, noise) in values.iter_mut().zip(noise) {
                *value += self.noise.percent / 100.0 * full_scale * noise;
                if let Some(quantisation) = self.quantisation {
                    let step = quantisation.step() * full_scale;
                    *value = (*value / step).round() * step;
                }
            }
            show(&shown, &mut values);
            channels.push((channel, Series::new(unit, values)));
        }
        if let Some(temperature) = simulation.temperature {
            channels.push((Channel::Temperature, Series::new("degC", temperature)));
        }
        Record::new(&self.name, simulation.time, channels)
    }

    /// What planting changes on each measured channel, without noise. Part of it a model without the effect can follow
    /// with other parameters.
    ///
    /// # Errors
    /// As [`Setup::simulate`].
    pub fn strength(&self) -> Result<Vec<Strength>> {
        let planted = self.simulate()?;
        let without = Self {
            planted: Vec::new(),
            outsiders: Vec::new(),
            ..self.clone()
        };
        let without = without.simulate()?;
        let strength = |(channel, _, _): (Channel, _, _)| {
            let pairs = planted
                .channel(channel)
                .iter()
                .zip(without.channel(channel));
            let sum: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
            let rms = (sum / planted.time.len() as f64).sqrt();
            Strength {
                channel,
                rms,
                in_noise: rms / self.noise_std(channel),
            }
        };
        Ok(self.measured().into_iter().map(strength).collect())
    }
}

impl Simulation {
    /// The values of a channel that is measured.
    fn channel(&self, channel: Channel) -> &[f64] {
        match channel {
            Channel::SupplyPressure => &self.supply,
            Channel::Flow => &self.flow,
            _ => &self.spool,
        }
    }
}

/// A stretch of every interval between two rows.
struct Piece {
    /// How many rows back the command is that acts in it.
    late: usize,
    steps: usize,
    /// s.
    step: f64,
}

fn show(shown: &Option<Vec<usize>>, values: &mut [f64]) {
    if let Some(shown) = shown {
        let all = values.to_vec();
        for (value, &row) in values.iter_mut().zip(shown) {
            *value = all[row];
        }
    }
}
