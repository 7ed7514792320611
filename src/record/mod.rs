//! Measurements: records in time and datasheet curves, with channels, units and checks, from CSV, Excel and MAT files.

mod blocked;
pub mod cases;
mod channel;
mod column;
mod conversion;
mod csv;
mod curve;
mod file;
mod format;
pub mod inspect;
mod interval;
mod join;
mod label;
mod mapping;
mod mat;
mod moment;
mod names;
mod ranges;
mod reading;
mod spikes;
mod table;
mod target;
mod tdms;
mod text;
mod unit;
mod wiring;
mod xlsx;

pub use channel::Channel;
pub use curve::{AreaCurve, FlowCurve, ResponseCurve, ResponsePoint, StepCurve};
pub use format::{Dialect, Format};
pub use mapping::Mapping;
pub use reading::{Reading, SampleInterval};
pub(crate) use text::{joined, quoted};
pub(crate) use unit::conversion_between;
pub use unit::{Quantity, Unit};
pub use wiring::{Direction, Unusual};
pub(crate) use wiring::{ends, reversals};

use crate::input::sha256;
use crate::{Error, Result};
use column::{Column, Measured};
pub(crate) use interval::median_interval;
use interval::{intervals, median};
use mapping::Sources;
use moment::Moments;
use spikes::without_spikes;
use std::collections::BTreeMap;
use std::ops::RangeInclusive;
use std::path::Path;
use table::Table;
use target::Target;

/// The share of each record that is held out where no other record is.
pub const HOLD_OUT: f64 = 0.30;

/// Largest values of a channel that can have been measured, in the unit that is kept.
const MEASURED: RangeInclusive<f64> = 1e-12..=1e12;

/// Rows that are so many s apart show nothing of a servo valve.
const SLOW: f64 = 0.5;

/// How many times longer than its rows at their usual interval a record may last.
const LONGEST_PAUSES: f64 = 100.0;

/// The values of one channel in one unit, which is V, mA, %, mm, 1, L/min, bar or degC.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// The unit.
    pub unit: String,
    /// One value a sample, in `unit`.
    pub values: Vec<f64>,
}

impl Series {
    /// Values in `unit`.
    pub fn new(unit: &str, values: Vec<f64>) -> Self {
        Self {
            unit: unit.into(),
            values,
        }
    }

    /// The largest magnitude, in `unit`.
    pub fn max_abs(&self) -> f64 {
        self.values
            .iter()
            .fold(0.0, |max, value| value.abs().max(max))
    }
}

/// A measurement in time: a command and what was measured with it, sample by sample.
///
/// It holds at least two samples at strictly rising times, and nothing but finite values.
#[derive(Debug, Clone, PartialEq)]
pub struct Record {
    /// The file's name without its extension.
    pub name: String,
    /// The file's path as it was given: what errors and warnings call the record.
    pub path: String,
    /// SHA-256 of the file's content in hexadecimal digits, of several files that of all behind each other; of a record from
    /// memory there is none.
    pub sha256: Option<String>,
    /// Columns of the file that no channel takes.
    pub ignored: Vec<String>,
    /// Columns that a mapping scales or shifts, each with what it is taken as.
    pub converted: Vec<String>,
    /// What looks wrong but need not be.
    pub warnings: Vec<String>,
    /// Columns that mappings name and the file does not have.
    absent: Vec<String>,
    time: Vec<f64>,
    channels: BTreeMap<Channel, Series>,
}

impl Record {
    /// A record from values in memory: times in s, and channels in any unit they can have.
    ///
    /// # Errors
    /// No command; a channel of another length or in an unknown unit; a value that is not finite; fewer than two
    /// samples; times that do not rise strictly.
    pub fn new(
        name: &str,
        time: Vec<f64>,
        channels: impl IntoIterator<Item = (Channel, Series)>,
    ) -> Result<Self> {
        let place = |row, what: &str| format!("record {name:?}, sample {row}, {what}");
        let finite = |values: &[f64], what: &str| match values.iter().position(|v| !v.is_finite()) {
            None => Ok(()),
            Some(row) => Err(Error::input(
                place(row, what),
                format!("{} is not finite", values[row]),
                "repair the value or drop its sample",
            )),
        };
        finite(&time, "time")?;
        let mut kept = BTreeMap::new();
        for (channel, mut series) in channels {
            let whole = format!("record {name:?}, {channel}");
            if series.values.len() != time.len() {
                return Err(Error::input(
                    whole,
                    format!("has {} values at {} times", series.values.len(), time.len()),
                    "give one value a sample",
                ));
            }
            let unit = channel.quantity().unit(Some(&series.unit), whole)?;
            series
                .values
                .iter_mut()
                .for_each(|value| *value = unit.convert(*value));
            series.unit = unit.kept().into();
            finite(&series.values, channel.name())?;
            kept.insert(channel, series);
        }
        if !kept.contains_key(&Channel::Command) {
            return Err(Error::input(
                format!("record {name:?}"),
                "has no command",
                "add the channel command",
            ));
        }
        table::check_rising(&time, "s", name, |row| place(row, "time"))?;
        Ok(Self::assembled(name, time, kept, None))
    }

    /// Reads a file whose columns name channel and unit, `time [s]`, `command [V]`, `spool [%]`, in any order: CSV, a
    /// MAT file of level 5, or an Excel workbook in which one sheet holds a table.
    ///
    /// CSV: cells may be separated by commas, semicolons, tabs, blanks, bars or colons, decimals have points or commas, the
    /// header may stand below other lines and the units in a row of their own below it; lines that start with `#` and
    /// blank lines are skipped. MAT: vectors, columns of matrices, and structs such as those of Simulink and of
    /// `timeseries`. Times may be times of day, with or without a date: they count from the first. Two possible readings are refused, not guessed.
    ///
    /// `mappings` say what columns of this file are; such a column takes the place of one that has the channel's name, and may be scaled and shifted. A
    /// file need not have the column of a mapping if it has that channel otherwise, so that unlike files can be read with
    /// the same mappings. Columns that are no channel are listed in [`Record::ignored`]. A constant command or no
    /// response is accepted here; see [`Record::check_excited`] and [`Record::check_response`].
    ///
    /// # Errors
    /// A file that cannot be read as such a table, or is too large to be a record: 256 MiB, 16 million numbers, 10 000 columns;
    /// a column that is missing, there twice or in an unknown unit; a
    /// cell that is no finite number; columns of unequal length; fewer than two samples; times that do not rise strictly.
    pub fn read(path: impl AsRef<Path>, mappings: &[Mapping]) -> Result<Self> {
        Self::read_as(path, &Reading::with(mappings))
    }

    /// [`Record::read`] of a file that is read as `reading` says.
    ///
    /// `a.csv+b.csv` is one record from two files, if none is called so: their rows belong together where their times agree
    /// to a tenth of the interval, and one by one where one of them has no time.
    ///
    /// # Errors
    /// As [`Record::read`]; a sample interval beside a column of time; files whose rows do not belong together.
    pub fn read_as(path: impl AsRef<Path>, reading: &Reading) -> Result<Self> {
        let (table, content) = file::read_joined(path.as_ref(), reading)?;
        Self::from_table(table, &content, reading)
    }

    /// [`Record::read`] from the content of the file called `path`.
    ///
    /// # Errors
    /// As [`Record::read`], but for those of reading the file.
    pub fn parse(path: &str, content: impl AsRef<[u8]>, mappings: &[Mapping]) -> Result<Self> {
        Self::parse_as(path, content, &Reading::with(mappings))
    }

    /// [`Record::read_as`] from the content of the file called `path`.
    ///
    /// # Errors
    /// As [`Record::read_as`], but for those of reading the file.
    pub fn parse_as(path: &str, content: impl AsRef<[u8]>, reading: &Reading) -> Result<Self> {
        let content = content.as_ref();
        Self::from_table(file::parse(path, content)?, content, reading)
    }

    fn from_table(mut table: Table, content: &[u8], reading: &Reading) -> Result<Self> {
        reading.give_time(&mut table)?;
        let record = Self::of(&table, reading)?;
        Ok(Self {
            sha256: Some(sha256(content)),
            ..record
        })
    }

    /// The channels of a table, which has its time.
    fn of(table: &Table, reading: &Reading) -> Result<Self> {
        let Sources {
            taken,
            small,
            ignored,
            mut warnings,
            absent,
        } = Sources::of(table, &reading.mappings)?;
        let indices = taken.values().map(|(index, _)| *index);
        let indices: Vec<usize> = indices.chain(small.iter().map(|one| one.index)).collect();
        warnings.extend(table.notes.iter().cloned());
        let complete = reading.without_incomplete_rows(table, &indices);
        let table = match &complete {
            None => table,
            Some((complete, said)) => {
                warnings.push(said.clone());
                complete
            }
        };
        let mut columns = BTreeMap::<Target, Measured>::new();
        let mut converted = Vec::new();
        for (target, (index, conversion)) in taken {
            let values = table.values(index, conversion)?;
            let unit = conversion.unit.kept();
            if conversion.changes() {
                let column = quoted(&table.columns[index].label.text);
                converted.push(format!("{column} is taken as {target} {conversion}"));
            }
            columns.insert(
                target,
                Measured {
                    index,
                    values,
                    unit,
                },
            );
        }
        let missing = |target: Target| {
            let wanted = format!("\"{target} [{}]\"", target.quantity().usual().kept());
            let mut remedy =
                format!("rename the column that holds it or add --map \"COLUMN={target} [UNIT]\"");
            if target == Target::Time {
                remedy.push_str(", or --sample-interval SECONDS if the file has none");
            }
            remedy.push_str("; servobee inspect proposes what to add");
            table.missing(&wanted, &remedy)
        };
        let time = columns
            .remove(&Target::Time)
            .ok_or_else(|| missing(Target::Time))?;
        if !columns.contains_key(&Target::Channel(Channel::Command)) {
            return Err(missing(Target::Channel(Channel::Command)));
        }
        let used = columns.values().map(|column| column.index);
        let seconds = small.iter().map(|one| one.index);
        table.check_lengths(std::iter::once(time.index).chain(used).chain(seconds))?;
        table.check_rising(&time)?;
        for one in &small {
            let values = table.values(one.index, one.conversion)?;
            let large = columns.get_mut(&one.target).expect("there is a first one");
            warnings.extend(one.joins(&values, large, table));
        }
        let channels = columns
            .into_iter()
            .filter_map(|(target, column)| match target {
                Target::Time => None,
                Target::Channel(channel) => {
                    Some((channel, Series::new(column.unit, column.values)))
                }
            })
            .collect();
        let Column { label, moments, .. } = &table.columns[time.index];
        if let Some(moments) = moments {
            converted.push(time_of_day(&label.text, moments));
        }
        let in_a_unit = moments.is_none() && reading.sample_interval.is_none();
        let spelt = Some(label.spelt.as_str()).filter(|_| in_a_unit);
        let mut record = Self::assembled(&table::stem(&table.path), time.values, channels, spelt);
        record.path = table.path.clone();
        record.ignored = ignored;
        record.warnings.extend(warnings);
        record.absent = absent;
        record.converted = converted;
        Ok(record)
    }

    /// Of times, which stand in the column `spelt` so, and channels.
    fn assembled(
        name: &str,
        time: Vec<f64>,
        mut channels: BTreeMap<Channel, Series>,
        spelt: Option<&str>,
    ) -> Self {
        let mut warnings = time_warnings(&time, spelt);
        let command = channels[&Channel::Command].values.clone();
        let measured = channels
            .iter_mut()
            .filter(|(channel, _)| **channel != Channel::Command);
        warnings.extend(measured.filter_map(|(&channel, series)| {
            without_spikes(channel, &series.unit, &mut series.values, &command)
        }));
        Self {
            name: name.into(),
            path: name.into(),
            sha256: None,
            ignored: Vec::new(),
            warnings,
            absent: Vec::new(),
            converted: Vec::new(),
            time,
            channels,
        }
    }

    /// All that a reader of the file should know, each with the file's path: its warnings, the columns that were scaled or
    /// shifted, and those ignored.
    pub fn remarks(&self) -> Vec<String> {
        let mut remarks = self.warnings.clone();
        remarks.extend(self.converted.iter().cloned());
        if !self.ignored.is_empty() {
            let names = self.ignored.iter().map(String::as_str);
            remarks.push(format!("ignored the columns {}", text::listed(names)));
        }
        remarks
            .iter()
            .map(|remark| format!("{}: {remark}", self.path))
            .collect()
    }

    /// How many samples there are: two or more.
    pub fn samples(&self) -> usize {
        self.time.len()
    }

    /// The times of the samples in s, strictly rising.
    pub fn time(&self) -> &[f64] {
        &self.time
    }

    /// The series of a channel, if the record has it.
    pub fn get(&self, channel: Channel) -> Option<&Series> {
        self.channels.get(&channel)
    }

    /// The command.
    pub fn command(&self) -> &Series {
        &self.channels[&Channel::Command]
    }

    /// The channels there are, in the order of [`Channel::ALL`].
    pub fn channels(&self) -> impl Iterator<Item = (Channel, &Series)> {
        self.channels
            .iter()
            .map(|(&channel, series)| (channel, series))
    }

    /// The row where the hold-out begins if the last `hold_out` of the rows, a share from 0 to 1, are held out.
    ///
    /// The first row is never held out.
    pub fn split(&self, hold_out: f64) -> usize {
        let fitted = (1.0 - hold_out.clamp(0.0, 1.0)) * self.samples() as f64;
        (fitted.round() as usize).max(1)
    }

    /// The full scale of the command, in its unit.
    pub fn full_scale(&self) -> f64 {
        full_scale(&self.command().unit, self.command().max_abs())
    }

    /// Refuses a command that never changes, from which nothing can be identified.
    ///
    /// Reading does not ask for this: a constant command is what a simulation may want, and a step that starts with
    /// the record has one. Whoever identifies calls it.
    ///
    /// # Errors
    /// The command is constant, or so large or small that no valve has it. The record pauses for far longer than it
    /// lasts: a model runs through every pause in steps of the usual interval.
    pub fn check_excited(&self) -> Result<()> {
        let command = self.command();
        self.check_size(Channel::Command, command)?;
        self.check_pauses()?;
        if command
            .values
            .iter()
            .any(|&value| value != command.values[0])
        {
            return Ok(());
        }
        Err(Error::input(
            format!("{}, column \"command [{}]\"", self.path, command.unit),
            format!(
                "is {} throughout, so there is nothing to identify",
                command.values[0]
            ),
            "give a record whose command moves",
        ))
    }

    /// Refuses a record of no [responses](Self::responses), to which no model can be fitted, and one of two tests at once.
    ///
    /// Reading does not ask for this: a simulation needs the command alone. Whoever identifies calls it.
    ///
    /// # Errors
    /// None of them is there, or one is so large or small that no valve has it.
    pub fn check_response(&self) -> Result<()> {
        self.check_one_test()?;
        let answers = self.responses();
        let responses = self
            .channels()
            .filter(|(channel, _)| answers.contains(channel));
        let mut checked = responses
            .map(|(channel, series)| self.check_size(channel, series))
            .peekable();
        if checked.peek().is_some() {
            return checked.collect();
        }
        let present = self.channels().map(|(channel, _)| channel.name());
        let present = present.chain(self.ignored.iter().map(String::as_str));
        let wanted = Channel::RESPONSES.map(|channel| format!("{:?}", channel.column()));
        Err(Error::input(
            &self.path,
            format!(
                "has no column {}, only \"time\", {}",
                joined(wanted.into(), "or"),
                text::listed(present)
            ),
            "rename the column that holds one of them or add --map \"COLUMN=spool [UNIT]\"",
        ))
    }

    /// Refuses a record that lasts far longer than its rows at their usual interval would.
    fn check_pauses(&self) -> Result<()> {
        let steps = intervals(&self.time);
        let usual = median(&steps);
        let length = self.time[self.samples() - 1] - self.time[0];
        if length <= LONGEST_PAUSES * usual * steps.len() as f64 {
            return Ok(());
        }
        let longest = (0..steps.len()).max_by(|&a, &b| steps[a].total_cmp(&steps[b]));
        let row = longest.expect("two rows have an interval");
        Err(Error::input(
            format!("{}, sample {}", self.path, row + 1),
            format!(
                "{:.3e} s pass until the next, {:.1e} times what is usual",
                steps[row],
                steps[row] / usual
            ),
            "cut the file there, and give its parts as records of their own",
        ))
    }

    /// Refuses values whose squares a search in `f32` cannot hold.
    fn check_size(&self, channel: Channel, series: &Series) -> Result<()> {
        let largest = series.max_abs();
        match largest == 0.0 || MEASURED.contains(&largest) {
            true => Ok(()),
            false => Err(Error::input(
                format!("{}, column \"{channel} [{}]\"", self.path, series.unit),
                format!(
                    "has {largest:e} {} as its largest value: no valve has that",
                    series.unit
                ),
                "correct the value, or the unit of the column",
            )),
        }
    }

    /// The record as CSV: what [`Record::read`] reads back to the same values.
    pub fn to_csv(&self) -> String {
        let mut text = String::from("time [s]");
        for (channel, series) in &self.channels {
            text.push_str(&format!(",{channel} [{}]", series.unit));
        }
        text.push('\n');
        for (row, time) in self.time.iter().enumerate() {
            text.push_str(&time.to_string());
            for series in self.channels.values() {
                text.push(',');
                text.push_str(&series.values[row].to_string());
            }
            text.push('\n');
        }
        text
    }

    /// Writes [`Record::to_csv`] to a file, over whatever is there.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_csv(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        std::fs::write(path, self.to_csv()).map_err(|error| {
            Error::input(
                path.display(),
                format!("cannot be written: {error}"),
                "check the path, its permissions and the space left",
            )
        })
    }
}

/// Full scale of a command in `unit` whose largest magnitude is `max_abs`: 10 for V, 100 for %, otherwise `max_abs`.
pub fn full_scale(unit: &str, max_abs: f64) -> f64 {
    usual_full_scale(unit).unwrap_or(max_abs)
}

/// The full scale that a unit has by itself.
pub fn usual_full_scale(unit: &str) -> Option<f64> {
    match unit {
        "V" => Some(10.0),
        "%" => Some(100.0),
        _ => None,
    }
}

/// What is said of a column that holds times of day.
fn time_of_day(column: &str, moments: &Moments) -> String {
    let midnights = match moments.midnights {
        0 => String::new(),
        times => format!(
            ", and passes midnight {}",
            text::count(times as usize, "time")
        ),
    };
    format!(
        "{} is taken as time [s] since {}{midnights}",
        quoted(column),
        quoted(&moments.written)
    )
}

/// Times in s that look as if they were in another unit; they may be of a `column` of a file.
fn time_warnings(time: &[f64], column: Option<&str>) -> Vec<String> {
    let step = median_interval(time);
    let length = time[time.len() - 1] - time[0];
    let mut warnings = Vec::new();
    if step >= SLOW {
        let says = column.map_or(String::new(), |column| {
            format!(" --map \"{column}=time [ms]\" says so")
        });
        warnings.push(format!(
            "samples are {step} s apart, {length} s in all: is time really in s, not in ms?{says}"
        ));
    }
    if length < 1e-3 {
        warnings.push(format!(
            "all samples are within {length} s: is time really in s?"
        ));
    }
    warnings
}

/// Refuses a mapping whose column is in none of the files that `records` were read from: it is misspelt.
///
/// # Errors
/// There is one.
pub fn check_mappings(mappings: &[Mapping], records: &[&Record]) -> Result<()> {
    let lost = |mapping: &&Mapping| {
        records
            .iter()
            .all(|record| record.absent.contains(&mapping.column))
    };
    match mappings.iter().find(lost) {
        None => Ok(()),
        Some(Mapping { column, .. }) => Err(Error::input(
            format!("--map {column:?}"),
            "is no column of any file",
            "correct its name; servobee inspect lists the columns of a file",
        )),
    }
}
