//! The curves of a datasheet.

use super::column::Measured;
use super::table::{self, Table};
use super::unit::Quantity;
use super::{Channel, Record, Series, file, usual_full_scale};
use crate::{Error, Result};
use std::path::Path;

/// Flow over opening at a fixed pressure drop.
#[derive(Debug, Clone, PartialEq)]
pub struct FlowCurve {
    /// The file's name without its extension.
    pub name: String,
    /// Openings in %, strictly rising, two or more.
    pub opening: Vec<f64>,
    /// Flow at each opening in L/min.
    pub flow: Vec<f64>,
    /// Weight of each point in the cost: not negative, not all zero; 1 where the file has none.
    pub weight: Vec<f64>,
    /// What looks wrong but need not be.
    pub warnings: Vec<String>,
}

impl FlowCurve {
    /// Reads a CSV or MAT file with the columns `opening [%],flow [L/min]` and perhaps `weight`.
    ///
    /// # Errors
    /// A file that cannot be read as such a table; openings that do not rise strictly; weights that are negative or
    /// all zero.
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
    /// Amplitude of the command in % of full scale, above 0 and at most 100.
    pub amplitude: f64,
    /// Phase in deg, negative where the valve lags.
    pub phase: f64,
    /// Gain in dB, where it is known.
    pub gain: Option<f64>,
    /// Weight in the cost, not negative; 1 where the file has none.
    pub weight: f64,
}

/// Phase, and perhaps gain, over frequency at one amplitude or several.
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
    /// Reads a CSV or MAT file with the columns `frequency [Hz],amplitude [%],phase [deg]` and perhaps `gain [dB]`, where
    /// cells may be empty, and `weight`.
    ///
    /// # Errors
    /// A file that cannot be read as such a table; a frequency that is not positive; an amplitude outside 0 to 100 %;
    /// weights that are negative or all zero.
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
        let frequency = table.needed_column("frequency", Quantity::Frequency)?;
        let amplitude = table.needed_column("amplitude", Quantity::Share)?;
        let phase = table.needed_column("phase", Quantity::Phase)?;
        table.check(
            &frequency,
            |frequency| frequency > 0.0,
            "is not positive",
            "give frequencies above 0, not their logarithm",
        )?;
        table.check(
            &amplitude,
            |amplitude| amplitude > 0.0 && amplitude <= 100.0,
            "is outside 0 to 100 %",
            "give the command's amplitude as a share of full scale",
        )?;
        let rows = phase.values.len();
        let gain = match table.find("gain", |label| label.name == "gain")? {
            Some(index) => table.sparse_values(index, table.unit(index, Quantity::Gain)?)?,
            None => vec![None; rows],
        };
        let weight = weights(table, rows)?;

        let mut warnings = unknown(
            table,
            &["frequency", "amplitude", "phase", "gain", "weight"],
        );
        if phase.values.iter().all(|&phase| phase > 0.0) {
            warnings.push("every phase is positive: a lag is a negative phase".into());
        }
        let points = (0..rows).map(|row| ResponsePoint {
            frequency: frequency.values[row],
            amplitude: amplitude.values[row],
            phase: phase.values[row],
            gain: gain[row],
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
    /// that is not given either, it is 10 V or 100 %.
    ///
    /// # Errors
    /// Neither command nor full scale are given, and the unit has no usual full scale.
    pub fn to_record(&self, full_scale: Option<f64>) -> Result<Record> {
        let unit = &self.spool.unit;
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
                let step = |&time: &f64| if time < 0.0 { 0.0 } else { full_scale };
                Series::new(unit, self.time.iter().map(step).collect())
            }
        };
        Record::new(
            &self.name,
            self.time.clone(),
            [
                (Channel::Command, command),
                (Channel::Spool, self.spool.clone()),
            ],
        )
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
