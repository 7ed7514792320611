//! `servobee synthesize`.

use super::table::{number, table};
use clap::ValueEnum;
use servobee::Result;
use servobee::record::Channel;
use servobee::report::OutputFile;
use servobee::simulator::{
    Command, Kind, Meter, Noise, Oddity, Outsider, Planted, Quantisation, Setup, SpoolUnit,
    Strength, Supply, Valve,
};
use std::path::{Path, PathBuf};

/// Makes a bench record of a servo valve with planted effects
///
/// The valve is simulated with equations and an integrator of its own, in steps of 20 us. The full scale of the
/// command is 10 V. Prints what was planted, and how much of each channel is due to it in standard deviations of the noise.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES, after_long_help = format!("{EXAMPLES}\n\n{}", names()))]
pub(super) struct Arguments {
    /// Plant these effects: NAME=VALUE, in full NAME~FORM.CHANNEL=VALUE:KEY=NUMBER; --help lists them
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',')]
    effect: Vec<Planted>,
    /// Plant these effects that are in no catalogue: NAME=VALUE; --help lists them
    #[arg(long, value_name = "NAME=VALUE,...", value_delimiter = ',')]
    outsider: Vec<Outsider>,
    /// Write the record to this CSV file
    #[arg(long, value_name = "RECORD.csv")]
    out: PathBuf,
    /// Replace the file if it exists
    #[arg(long)]
    force: bool,
    /// What is commanded
    #[arg(
        long,
        value_name = "bench|multisine|chirp|steps|triangle",
        default_value = "bench"
    )]
    command: Command,
    /// Length of the record in s
    #[arg(long, value_name = "NUMBER", default_value_t = 8.0)]
    seconds: f64,
    /// Rows a second
    #[arg(long, value_name = "HZ", default_value_t = 1000.0)]
    rate: f64,
    /// Standard deviation of the noise in % of full scale
    #[arg(long, value_name = "PERCENT", default_value_t = 0.3)]
    noise: f64,
    /// Colour 70 % of the noise's variance: first-order noise with this corner
    #[arg(long, value_name = "HZ")]
    noise_colour: Option<f64>,
    /// Round the measurements as a converter of so many bits over +- full scale does
    #[arg(long, value_name = "BITS")]
    quantise: Option<u32>,
    /// The unit of the measured spool
    #[arg(long, value_enum, value_name = "V|%", default_value_t = Unit::Volt)]
    spool_unit: Unit,
    /// Where the flow is measured: between A and B, or in the pressure line, where leakage shows
    #[arg(long, value_enum, value_name = "load|supply", default_value_t = Place::Load)]
    meter: Place,
    /// What feeds the valve: a constant pressure drop, or a pump whose pressure gives way and is measured
    #[arg(long, value_enum, value_name = "constant|measured", default_value_t = Fed::Constant)]
    supply: Fed,
    /// Measure the spool alone
    #[arg(long)]
    no_flow: bool,
    /// Seed of all random numbers; the same seed gives the same record
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// Draw a plausible valve from the seed
    #[arg(long, conflicts_with_all = ["gain", "time_constant", "saturation", "rated_flow"])]
    random_valve: bool,
    /// The valve's gain K in 1/s [default: 200]
    #[arg(long, value_name = "NUMBER")]
    gain: Option<f64>,
    /// The valve's time constant T in s [default: 0.003]
    #[arg(long, value_name = "NUMBER")]
    time_constant: Option<f64>,
    /// The valve's saturation S in V [default: 3]
    #[arg(long, value_name = "NUMBER")]
    saturation: Option<f64>,
    /// The valve's flow at full opening and a drop of 10 bar in L/min [default: 60]
    #[arg(long, value_name = "NUMBER")]
    rated_flow: Option<f64>,
}

const EXAMPLES: &str = "Examples:
  servobee synthesize --effect delay=0.002 --out delayed.csv
  servobee synthesize --effect hysteresis~bouc_wen=0.2,sensor_lag.flow=0.004 --random-valve --seed 7 --out two.csv
  servobee synthesize --effect leakage=1.5:width=4 --meter supply --noise 0.2 --noise-colour 50 --quantise 12 --out leaky.csv
  servobee synthesize --outsider detent=0.2 --command triangle --seconds 10 --out odd.csv
  servobee synthesize --out null.csv";

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Unit {
    #[value(name = "V")]
    Volt,
    #[value(name = "%")]
    Percent,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Place {
    Load,
    Supply,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Fed {
    Constant,
    Measured,
}

/// All effects and outsiders with their units, forms and keys.
fn names() -> String {
    let effect = |kind: Kind| {
        let forms: Vec<String> = kind
            .forms()
            .iter()
            .map(|f| format!("~{}", f.name()))
            .collect();
        let keys: Vec<String> = kind.keys().map(|key| format!(":{key}")).collect();
        let more = [&forms[..], &keys[..]].concat().join(" ");
        let example = format!("{kind}={} [{}]", kind.typical(), kind.unit());
        format!("  {example:<38} {more}").trim_end().to_owned()
    };
    let outsider = |oddity: Oddity| format!("  {oddity}={} [{}]", oddity.typical(), oddity.unit());
    format!(
        "Effects, each with a typical value, its other forms and its further parameters:\n{}\n\
         The last four act on a channel, .spool or .flow, whose unit they have; without one on the spool.\n\n\
         Outsiders, each with a value that is well seen:\n{}",
        Kind::ALL.map(effect).join("\n"),
        Oddity::ALL.map(outsider).join("\n"),
    )
}

pub(super) fn run(arguments: &Arguments) -> Result<()> {
    let setup = setup(arguments);
    let file = OutputFile::create(&arguments.out, arguments.force)?;
    let record = setup.record()?;
    let strength = setup.strength()?;
    tell!("{}", summary(&setup, &strength));
    tell!(
        "{} rows of {} s at {} Hz in {}",
        record.samples(),
        setup.seconds,
        setup.rate,
        arguments.out.display()
    );
    file.finish(&record.to_csv())
}

fn setup(arguments: &Arguments) -> Setup {
    let usual = Valve::default();
    let valve = match arguments.random_valve {
        true => Valve::random(arguments.seed),
        false => Valve {
            gain: arguments.gain.unwrap_or(usual.gain),
            time_constant: arguments.time_constant.unwrap_or(usual.time_constant),
            saturation: arguments.saturation.unwrap_or(usual.saturation),
            rated_flow: arguments.rated_flow.unwrap_or(usual.rated_flow),
        },
    };
    Setup {
        name: name(&arguments.out),
        valve,
        planted: arguments.effect.clone(),
        outsiders: arguments.outsider.clone(),
        command: arguments.command.clone(),
        seconds: arguments.seconds,
        rate: arguments.rate,
        noise: match arguments.noise_colour {
            Some(corner) => Noise::coloured(arguments.noise, corner),
            None => Noise::white(arguments.noise),
        },
        quantisation: arguments.quantise.map(Quantisation::Bits),
        spool_unit: match arguments.spool_unit {
            Unit::Volt => SpoolUnit::Volt,
            Unit::Percent => SpoolUnit::Percent,
        },
        flow: !arguments.no_flow,
        meter: match arguments.meter {
            Place::Load => Meter::Load,
            Place::Supply => Meter::Supply,
        },
        supply: match arguments.supply {
            Fed::Constant => Supply::Constant,
            Fed::Measured => Supply::Measured,
        },
        seed: arguments.seed,
        ..Setup::default()
    }
}

fn name(path: &Path) -> String {
    path.file_stem()
        .map_or_else(String::new, |stem| stem.to_string_lossy().into_owned())
}

fn summary(setup: &Setup, strength: &[Strength]) -> String {
    let Valve {
        gain,
        time_constant,
        saturation,
        rated_flow,
    } = setup.valve;
    let planted = setup
        .planted
        .iter()
        .map(|p| format!("{p} [{}]", unit(setup, p)));
    let odd = setup
        .outsiders
        .iter()
        .map(|o| format!("{o} [{}], an outsider", o.oddity.unit()));
    let mut lines = vec![format!(
        "Valve: K = {} 1/s, T = {} s, S = {} V, {} L/min at {} bar",
        number(gain),
        number(time_constant),
        number(saturation),
        number(rated_flow),
        servobee::simulator::RATED_DROP
    )];
    lines.extend(planted.chain(odd).map(|what| format!("Planted: {what}")));
    if lines.len() == 1 {
        lines.push("Planted: nothing".into());
        return lines.join("\n");
    }
    let heads = ["channel", "unit", "noise", "planted RMS", "in noise"];
    let row = |s: &Strength| {
        vec![
            s.channel.name().into(),
            channel_unit(setup, s.channel).into(),
            number(setup.noise_std(s.channel)),
            number(s.rms),
            match s.in_noise.is_finite() {
                true => number(s.in_noise),
                false => "-".into(),
            },
        ]
    };
    lines.push(table(&heads, strength.iter().map(row)));
    lines.join("\n")
}

fn channel_unit(setup: &Setup, channel: Channel) -> &'static str {
    match channel {
        Channel::Flow => "L/min",
        Channel::SupplyPressure => "bar",
        _ => setup.spool_unit.name(),
    }
}

/// The unit of an effect's value, where it has the channel's with that one.
fn unit(setup: &Setup, planted: &Planted) -> String {
    let unit = planted.unit();
    match unit.strip_prefix("unit") {
        Some(rest) => format!("{}{rest}", channel_unit(setup, planted.channel)),
        None => unit.into(),
    }
}
