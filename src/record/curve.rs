//! The curves of a datasheet.

use super::column::Measured;
use super::label::Label;
use super::table::{self, Table};
use super::unit::{Quantity, Unit};
use super::{Channel, Record, Series, file, usual_full_scale};
use crate::{Error, Result};
use std::path::Path;

/// Flow over opening at a fixed pressure drop.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowCurve {
    /// The file's name without its extension.
    pub name: String,
    /// Openings in %, strictly rising, two or more; of one side from 0 on, or of both.
    pub opening: Vec<f64>,
    /// Flow at each opening in L/min: positive on one side, of opposite signs at the ends of both.
    pub flow: Vec<f64>,
    /// Weight of each point in the cost: not negative, not all zero; 1 where the file has none.
    pub weight: Vec<f64>,
    /// What looks wrong but need not be.
    pub warnings: Vec<String>,
}

impl FlowCurve {
    /// Reads a CSV or MAT file with the columns `opening [%],flow [L/min]` and perhaps `weight`. Openings below zero are those
    /// of the other side, whose flow is negative.
    ///
    /// # Errors
    /// A file that cannot be read as such a table; openings that do not rise strictly; flows whose signs are not those of
    /// one side or of both; weights that are negative or all zero.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::of(&of_one_length(file::read(path.as_ref())?)?)
    }

    /// [`FlowCurve::read`] from the content of the file called `path`.
    ///
    /// # Errors
    /// As [`FlowCurve::read`], but for those of reading the file.
    pub fn parse(path: &str, content: impl AsRef<[u8]>) -> Result<Self> {
        Self::of(&of_one_length(file::parse(path, content.as_ref())?)?)
    }

    fn of(table: &Table) -> Result<Self> {
        let opening = table.needed_column("opening", Quantity::Share)?;
        let flow = table.needed_column("flow", Quantity::Flow)?;
        table.check_rising(&opening)?;
        check_sides(table, &opening, &flow)?;
        Ok(Self {
            name: table::stem(&table.path),
            weight: weights(table, opening.values.len())?,
            opening: opening.values,
            flow: flow.values,
            warnings: unknown(table, &["opening", "flow", "weight"]),
        })
    }
}

/// Orifice area over opening.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaCurve {
    /// The file's name without its extension.
    pub name: String,
    /// Openings in %, strictly rising, two or more.
    pub opening: Vec<f64>,
    /// Area at each opening in cm2, not negative.
    pub area: Vec<f64>,
    /// What looks wrong but need not be.
    pub warnings: Vec<String>,
}

impl AreaCurve {
    /// Reads a CSV or MAT file with the columns `opening [%],area [cm2]`.
    ///
    /// # Errors
    /// A file that cannot be read as such a table; openings that do not rise strictly; a negative area.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::of(&of_one_length(file::read(path.as_ref())?)?)
    }

    /// [`AreaCurve::read`] from the content of the file called `path`.
    ///
    /// # Errors
    /// As [`AreaCurve::read`], but for those of reading the file.
    pub fn parse(path: &str, content: impl AsRef<[u8]>) -> Result<Self> {
        Self::of(&of_one_length(file::parse(path, content.as_ref())?)?)
    }

    fn of(table: &Table) -> Result<Self> {
        let opening = table.needed_column("opening", Quantity::Share)?;
        let area = table.needed_column("area", Quantity::Area)?;
        table.check_rising(&opening)?;
        table.check(
            &area,
            |area| area >= 0.0,
            "is negative",
            "give 0 where it is closed",
        )?;
        Ok(Self {
            name: table::stem(&table.path),
            opening: opening.values,
            area: area.values,
            warnings: unknown(table, &["opening", "area"]),
        })
    }
}

/// One point of a frequency response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ResponsePoint {
    /// Frequency in Hz, positive.
    pub frequency: f64,
    /// Amplitude of the command in % of full scale, above 0 and at most 100; `None` in all points where the file has none.
    pub amplitude: Option<f64>,
    /// Phase in deg, negative where the valve lags, where it is known.
    pub phase: Option<f64>,
    /// Gain in dB, 0 at low frequency, where it is known. Phase or gain is.
    pub gain: Option<f64>,
    /// Weight in the cost, not negative; 1 where the file has none.
    pub weight: f64,
}

/// Phase, gain or both over frequency at one amplitude or several.
#[derive(Debug, Clone, PartialEq)]
pub struct ResponseCurve {
    /// The file's name without its extension.
    pub name: String,
    /// The points, in the order of the file.
    pub points: Vec<ResponsePoint>,
    /// What looks wrong but need not be.
    pub warnings: Vec<String>,
}

impl ResponseCurve {
    /// Reads a CSV or MAT file with the columns `frequency [Hz]`, `phase [deg]` or `gain [dB]` or both, and perhaps
    /// `amplitude [%]` and `weight`, in any order. A column of another name is frequency, phase or gain if its unit says so: the
    /// heads `Hz,dB,deg` do. Where there are both, cells of phase or gain may be empty.
    ///
    /// # Errors
    /// A file that cannot be read as such a table; a frequency that is not positive; an amplitude outside 0 to 100 %; a row of
    /// neither phase nor gain; weights that are negative or all zero.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::of(&of_one_length(file::read(path.as_ref())?)?)
    }

    /// [`ResponseCurve::read`] from the content of the file called `path`.
    ///
    /// # Errors
    /// As [`ResponseCurve::read`], but for those of reading the file.
    pub fn parse(path: &str, content: impl AsRef<[u8]>) -> Result<Self> {
        Self::of(&of_one_length(file::parse(path, content.as_ref())?)?)
    }

    fn of(table: &Table) -> Result<Self> {
        let Some(frequency) = quantity(table, "frequency", Quantity::Frequency)? else {
            return Err(table.missing("\"frequency [Hz]\"", RENAME));
        };
        let amplitude = match table.find("amplitude", is_amplitude)? {
            Some(index) => Some(measured(table, index, Quantity::Share)?),
            None => None,
        };
        let sparse = |name, kind| -> Result<_> {
            let Some(index) = quantity(table, name, kind)? else {
                return Ok(None);
            };
            let values = table.sparse_values(index, unit(table, index, kind)?)?;
            Ok(Some((index, values)))
        };
        let (phase, gain) = (
            sparse("phase", Quantity::Phase)?,
            sparse("gain", Quantity::Gain)?,
        );
        let Some((first, _)) = phase.as_ref().or(gain.as_ref()) else {
            return Err(table.missing("\"phase [deg]\" or \"gain [dB]\"", RENAME));
        };
        let frequency = measured(table, frequency, Quantity::Frequency)?;
        table.check(
            &frequency,
            |frequency| frequency > 0.0,
            "is not positive",
            "give frequencies above 0, not their logarithm",
        )?;
        if let Some(amplitude) = &amplitude {
            table.check(
                amplitude,
                |amplitude| amplitude > 0.0 && amplitude <= 100.0,
                "is outside 0 to 100 %",
                "give the command's amplitude as a share of full scale",
            )?;
        }
        let rows = frequency.values.len();
        let at = |column: &Option<(usize, Vec<Option<f64>>)>, row: usize| {
            column.as_ref().and_then(|(_, values)| values[row])
        };
        if let Some(row) = (0..rows).find(|&row| at(&phase, row).or(at(&gain, row)).is_none()) {
            return Err(table.empty(row, *first));
        }
        let weight = weights(table, rows)?;

        let columns = [&phase, &gain].map(|column| column.as_ref().map(|(index, _)| *index));
        let columns = [
            Some(frequency.index),
            amplitude.as_ref().map(|own| own.index),
        ]
        .into_iter()
        .chain(columns)
        .flatten();
        let mut known: Vec<&str> = columns
            .map(|index| table.columns[index].label.name.as_str())
            .collect();
        known.push("weight");
        let mut warnings = unknown(table, &known);
        let mut phases = (0..rows).filter_map(|row| at(&phase, row)).peekable();
        if phases.peek().is_some() && phases.all(|phase| phase > 0.0) {
            warnings.push("every phase is positive: a lag is a negative phase".into());
        }
        let gains = (0..rows).filter_map(|row| Some((frequency.values[row], at(&gain, row)?)));
        if let Some((frequency, gain)) = gains.min_by(|a, b| a.0.total_cmp(&b.0))
            && gain.abs() > NORMAL
        {
            warnings.push(format!(
                "the gain at the lowest frequency, {frequency} Hz, is {gain} dB: gains are taken as relative to that of a \
                 slow command, which is 0 dB"
            ));
        }
        let points = (0..rows).map(|row| ResponsePoint {
            frequency: frequency.values[row],
            amplitude: amplitude.as_ref().map(|own| own.values[row]),
            phase: at(&phase, row),
            gain: at(&gain, row),
            weight: weight[row],
        });
        Ok(Self {
            name: table::stem(&table.path),
            points: points.collect(),
            warnings,
        })
    }
}

/// The spool's answer to a step, from rest.
#[derive(Debug, Clone, PartialEq)]
pub struct StepCurve {
    /// The file's name without its extension.
    pub name: String,
    /// Times in s, strictly rising, two or more. A step that is not given comes at 0.
    pub time: Vec<f64>,
    /// The spool at each time.
    pub spool: Series,
    /// The command at each time, if it is given; otherwise it is a step of full scale.
    pub command: Option<Series>,
    /// What looks wrong but need not be.
    pub warnings: Vec<String>,
}

impl StepCurve {
    /// Reads a CSV or MAT file with the columns `time [s],spool [V]` and perhaps `command [V]`.
    ///
    /// # Errors
    /// A file that cannot be read as such a table; times that do not rise strictly.
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        Self::of(&of_one_length(file::read(path.as_ref())?)?)
    }

    /// [`StepCurve::read`] from the content of the file called `path`.
    ///
    /// # Errors
    /// As [`StepCurve::read`], but for those of reading the file.
    pub fn parse(path: &str, content: impl AsRef<[u8]>) -> Result<Self> {
        Self::of(&of_one_length(file::parse(path, content.as_ref())?)?)
    }

    fn of(table: &Table) -> Result<Self> {
        let time = table.needed_column("time", Quantity::Time)?;
        let spool = table.needed_column("spool", Quantity::Signal)?;
        let command = table.column("command", Quantity::Signal)?;
        table.check_rising(&time)?;
        let series = |column: Measured| Series::new(column.unit, column.values);
        Ok(Self {
            name: table::stem(&table.path),
            time: time.values,
            spool: series(spool),
            command: command.map(series),
            warnings: unknown(table, &["time", "spool", "command"]),
        })
    }

    /// The step as a record. It starts at rest, whatever its first command is.
    ///
    /// Where the curve has no command, it is 0 before time 0 and `full_scale`, in the spool's unit, from then on. If
    /// that is not given either, it is 10 V or 100 %. A curve without a row at time 0 gets one: there the spool is at rest.
    ///
    /// # Errors
    /// Neither command nor full scale are given, and the unit has no usual full scale; or no row comes after the step.
    pub fn to_record(&self, full_scale: Option<f64>) -> Result<Record> {
        let unit = &self.spool.unit;
        let (mut time, mut spool) = (self.time.clone(), self.spool.clone());
        let command = match &self.command {
            Some(command) => command.clone(),
            None => {
                let full_scale =
                    full_scale
                        .or_else(|| usual_full_scale(unit))
                        .ok_or_else(|| {
                            Error::input(
                                format!("step {:?}", self.name),
                                format!("has no command, and a step in {unit} has no usual height"),
                                format!(
                                    "add the column \"command [{unit}]\" or give the full scale"
                                ),
                            )
                        })?;
                let begin = time.partition_point(|&time| time < 0.0);
                if time[time.len() - 1] <= 0.0 {
                    return Err(Error::input(
                        format!("step {:?}", self.name),
                        format!(
                            "ends at {} s, and the step comes at 0 s",
                            time[time.len() - 1]
                        ),
                        format!(
                            "give times since the step, or add the column \"command [{unit}]\""
                        ),
                    ));
                }
                if time[begin] > 0.0 {
                    time.insert(begin, 0.0);
                    spool.values.insert(begin, 0.0);
                }
                let step = |&time: &f64| if time < 0.0 { 0.0 } else { full_scale };
                Series::new(unit, time.iter().map(step).collect())
            }
        };
        Record::new(
            &self.name,
            time,
            [(Channel::Command, command), (Channel::Spool, spool)],
        )
    }
}

/// What to do about a column that is not there.
const RENAME: &str = "add it or rename the column that holds it";
/// Largest gain of a slow command, dB, that does not ask whether gains are relative to it.
const NORMAL: f64 = 3.0;

/// The column that is called `name`, or else the one whose unit is one of `kind`; a head that is nothing but a unit has it.
///
/// # Errors
/// There are two.
fn quantity(table: &Table, name: &str, kind: Quantity) -> Result<Option<usize>> {
    if let Some(index) = table.find(name, |label| label.name == name)? {
        return Ok(Some(index));
    }
    table.find(name, |label| {
        kind.is_in(label.unit.as_deref().unwrap_or(&label.spelt))
    })
}

/// An amplitude in dB is that of the response: its gain.
fn is_amplitude(label: &Label) -> bool {
    let gain = |unit: &str| Quantity::Gain.is_in(unit);
    label.name == "amplitude" && !label.unit.as_deref().is_some_and(gain)
}

/// The numbers of column `index`.
///
/// # Errors
/// Its unit is none of `kind`, or a cell is empty or no finite number.
fn measured(table: &Table, index: usize, kind: Quantity) -> Result<Measured> {
    let unit = unit(table, index, kind)?;
    Ok(Measured {
        index,
        values: table.values(index, unit)?,
        unit: unit.kept(),
    })
}

/// The unit of column `index`, which may be all that its head says.
///
/// # Errors
/// It is none of `kind`, or missing.
fn unit(table: &Table, index: usize, kind: Quantity) -> Result<&'static Unit> {
    let label = &table.columns[index].label;
    match label.unit {
        None if kind.is_in(&label.spelt) => {
            kind.unit(Some(&label.spelt), table.header_place(index))
        }
        _ => table.unit(index, kind),
    }
}

/// A table whose columns are of one length.
///
/// # Errors
/// They are not.
fn of_one_length(table: Table) -> Result<Table> {
    table.check_lengths(0..table.columns.len())?;
    Ok(table)
}

/// Refuses flows that are not those of a valve that opens on one side, or on both.
///
/// # Errors
/// They are such: none flows, only the other side opens, one side's flow is negative, or both ends' have the same sign.
fn check_sides(table: &Table, opening: &Measured, flow: &Measured) -> Result<()> {
    let (openings, flows) = (&opening.values, &flow.values);
    let last = openings.len() - 1;
    let refuse = |row: usize, column: &Measured, problem: String, remedy: &str| {
        Err(Error::input(
            table.place(row, column.index),
            problem,
            remedy,
        ))
    };
    let largest = (0..=last).max_by(|&a, &b| flows[a].abs().total_cmp(&flows[b].abs()));
    let largest = largest.expect("two rows at least");
    if flows[largest] == 0.0 {
        let place = table.header_place(flow.index);
        return Err(Error::input(
            place,
            "every flow is 0",
            "give the flow of a valve that opens",
        ));
    }
    if openings[last] <= 0.0 {
        let remedy = "give openings and flows of one side without their signs";
        return refuse(
            last,
            opening,
            format!(
                "no opening is above 0, and the last is {} %",
                openings[last]
            ),
            remedy,
        );
    }
    if openings[0] >= 0.0 && flows[largest] < 0.0 {
        let problem = format!("{} L/min is negative, and no opening is", flows[largest]);
        let remedy = "give the flow of one side without its sign, or the openings of the other side with theirs";
        return refuse(largest, flow, problem, remedy);
    }
    if openings[0] < 0.0 && flows[0] * flows[last] >= 0.0 {
        let problem = format!(
            "{} L/min at {} % does not have the opposite sign of {} L/min at {} %",
            flows[0], openings[0], flows[last], openings[last]
        );
        let remedy = "give a minus sign to the flow from B to A, or the openings of one side only, from 0 on";
        return refuse(0, flow, problem, remedy);
    }
    Ok(())
}

/// The column `weight`, or ones.
fn weights(table: &Table, rows: usize) -> Result<Vec<f64>> {
    let Some(weight) = table.column("weight", Quantity::Number)? else {
        return Ok(vec![1.0; rows]);
    };
    let remedy = "give 1 to points that count in full, 0 to those that do not";
    table.check(&weight, |weight| weight >= 0.0, "is negative", remedy)?;
    if weight.values.iter().all(|&weight| weight == 0.0) {
        let place = table.header_place(weight.index);
        return Err(Error::input(place, "every weight is 0", remedy));
    }
    Ok(weight.values)
}

/// A warning for every column that is none of `known`.
fn unknown(table: &Table, known: &[&str]) -> Vec<String> {
    let unknown = |name: &str| !name.is_empty() && !known.contains(&name);
    table
        .columns
        .iter()
        .map(|column| &column.label)
        .filter(|label| unknown(&label.name))
        .map(|label| format!("column {:?} is not known and was ignored", label.text))
        .collect()
}
