//! The columns among the variables of a MAT file.
//!
//! Vectors are columns, and so are those of matrices, `x(1)`, `x(2)`. A struct's fields are columns beside each other. Two
//! kinds of structs are known: Simulink's with `time` and `signals`, and what `timeseries` saved as a struct has.

use super::value::{Fields, Value};
use crate::record::Channel;
use crate::record::column::Column;
use crate::record::label::{Label, visible};
use crate::record::table::Other;
use std::collections::{BTreeMap, HashSet};

/// A wider matrix is no record.
const WIDEST: usize = 1000;

/// Columns, and what else there is.
#[derive(Debug, Default)]
pub(super) struct Gathered {
    pub(super) columns: Vec<Column>,
    pub(super) others: Vec<Other>,
}

impl Gathered {
    /// All that is in `variables`. Times that several structs repeat are one column.
    pub(super) fn of(variables: &Fields) -> Self {
        let mut gathered = Self::default();
        gathered.group("", variables);
        let mut times = HashSet::new();
        gathered.columns.retain(|column| {
            let values = column.values.iter().map(|value| value.to_bits());
            column.label.name != "time"
                || times.insert((column.label.unit.clone(), values.collect::<Vec<u64>>()))
        });
        gathered
    }

    /// The fields of the struct at `path`, or all variables.
    fn group(&mut self, path: &str, fields: &Fields) {
        let units = Units(field(fields, "units"));
        let time = time_field(fields);
        let samples = time
            .and_then(|name| field(fields, name))
            .and_then(vector_length)
            .or_else(|| usual_length(fields));
        let own_name = path.rsplit('.').next().unwrap_or(path);
        for (name, value) in fields {
            let at = match path {
                "" => name.clone(),
                _ => format!("{path}.{name}"),
            };
            let lower = name.to_lowercase();
            match (lower.as_str(), value) {
                ("units" | "datainfo" | "timeinfo" | "name", _) if !path.is_empty() => {}
                ("units", Value::Structs(_)) => {}
                _ if time == Some(name.as_str()) => {
                    let info = field(fields, "timeinfo").and_then(units_of);
                    let unit = units.of(name).or(info);
                    self.value(&at, "time", value, None, unit.as_deref());
                }
                ("data", Value::Numbers { .. }) if time.is_some() && !path.is_empty() => {
                    let given = field(fields, "name").and_then(text);
                    let given = given.filter(|name| *name != "unnamed");
                    let info = field(fields, "datainfo").and_then(units_of);
                    let unit = units.whole().or(info);
                    self.value(
                        &at,
                        given.unwrap_or(own_name),
                        value,
                        samples,
                        unit.as_deref(),
                    );
                }
                ("signals", Value::Structs(signals)) if time.is_some() => {
                    self.signals(&at, own_name, signals, samples);
                }
                _ => self.value(&at, name, value, samples, units.of(name).as_deref()),
            }
        }
    }

    /// What Simulink saves beside `time`: an array of structs, each with `values` and perhaps a `label`.
    fn signals(&mut self, path: &str, own_name: &str, signals: &[Fields], samples: Option<usize>) {
        for (index, signal) in signals.iter().enumerate() {
            let (at, unnamed) = match signals.len() {
                1 => (path.to_owned(), own_name.to_owned()),
                _ => {
                    let number = index + 1;
                    (format!("{path}({number})"), format!("signals({number})"))
                }
            };
            let name = field(signal, "label").and_then(text).unwrap_or(&unnamed);
            let unit = field(signal, "units").and_then(text).map(str::to_owned);
            for (part, value) in signal {
                if part == "values" {
                    let at = format!("{at}.values");
                    self.value(&at, name, value, samples, unit.as_deref());
                }
            }
        }
    }

    /// A value at `path` that is called `name` and belongs to so many samples, if that is known.
    fn value(
        &mut self,
        path: &str,
        name: &str,
        value: &Value,
        samples: Option<usize>,
        unit: Option<&str>,
    ) {
        match value {
            Value::Numbers { sizes, values } => self.numbers(path, name, sizes, values, samples, unit),
            Value::Structs(elements) => match &elements[..] {
                [fields] => self.group(path, fields),
                _ => {
                    for (index, fields) in elements.iter().enumerate() {
                        self.group(&format!("{path}({})", index + 1), fields);
                    }
                }
            },
            Value::Cells(cells) if cells.len() == 1 => {
                self.value(path, name, &cells[0], samples, unit);
            }
            Value::Cells(_) => self.other(path, "cells"),
            Value::Text(_) => self.other(path, "text"),
            Value::Other(what) => self.other(path, what),
            Value::Object(class) => self.others.push(Other {
                name: path.into(),
                what: format!("an object of the class {class}, which hides its values from other programs"),
                remedy: Some(format!(
                    "save its values in MATLAB: s = struct('time', {path}.Time, 'command', {path}.Data); save('record.mat', '-struct', 's', '-v7')"
                )),
            }),
        }
    }

    fn other(&mut self, path: &str, what: &str) {
        self.others.push(Other {
            name: path.into(),
            what: what.into(),
            remedy: None,
        });
    }

    fn numbers(
        &mut self,
        path: &str,
        name: &str,
        sizes: &[usize],
        values: &[f64],
        samples: Option<usize>,
        unit: Option<&str>,
    ) {
        let mut column = |path: &str, name: &str, values: Vec<f64>| {
            let mut label = Label::at(path, name);
            label.unit = label.unit.or_else(|| unit.map(visible));
            self.columns.push(Column::of(label, values));
        };
        let sizes: Vec<usize> = sizes.iter().copied().filter(|&size| size != 1).collect();
        match sizes[..] {
            _ if values.is_empty() => self.other(path, "empty"),
            [] => self.other(path, "a single number"),
            [_] => column(path, name, values.to_vec()),
            [rows, columns] => {
                // A signal a row, where only the rows are as long as the times, or nothing is but they are longer.
                let across = match samples {
                    Some(samples) if [rows, columns].contains(&samples) => rows != samples,
                    _ => columns > rows,
                };
                let (length, number) = if across {
                    (columns, rows)
                } else {
                    (rows, columns)
                };
                if number > WIDEST {
                    return self.other(path, &format!("a matrix of {rows} x {columns}"));
                }
                for index in 0..number {
                    let values = match across {
                        true => values.iter().skip(index).step_by(rows).copied().collect(),
                        false => values[index * length..(index + 1) * length].to_vec(),
                    };
                    let [path, name] = [path, name].map(|name| format!("{name}({})", index + 1));
                    column(&path, &name, values);
                }
            }
            _ => self.other(path, &format!("an array of {} dimensions", sizes.len())),
        }
    }
}

/// The field called `name`, whatever its case.
fn field<'a>(fields: &'a Fields, name: &str) -> Option<&'a Value> {
    let found = fields
        .iter()
        .find(|(field, _)| field.eq_ignore_ascii_case(name));
    found.map(|(_, value)| value)
}

/// The field that is the time: `time`, or `t` beside a channel that has its name.
fn time_field(fields: &Fields) -> Option<&str> {
    let named = |wanted: &str| {
        let found = fields.iter().find(|(name, value)| {
            name.eq_ignore_ascii_case(wanted) && matches!(value, Value::Numbers { .. })
        });
        found.map(|(name, _)| name.as_str())
    };
    let is_channel =
        |(name, _): &(String, Value)| Label::parse(name).name.parse::<Channel>().is_ok();
    named("time").or_else(|| named("t").filter(|_| fields.iter().any(is_channel)))
}

/// How many numbers a vector of numbers has.
fn vector_length(value: &Value) -> Option<usize> {
    match value {
        Value::Numbers { sizes, values } if sizes.contains(&values.len()) => Some(values.len()),
        _ => None,
    }
}

/// The length that most vectors have.
fn usual_length(fields: &Fields) -> Option<usize> {
    let mut times = BTreeMap::new();
    let lengths = fields.iter().filter_map(|(_, value)| vector_length(value));
    for length in lengths.filter(|&length| length > 1) {
        *times.entry(length).or_insert(0) += 1;
    }
    times
        .into_iter()
        .max_by_key(|&(_, times)| times)
        .map(|(length, _)| length)
}

/// A text that is not empty, alone or in a cell.
fn text(value: &Value) -> Option<&str> {
    match value {
        Value::Text(text) => Some(text.trim()).filter(|text| !text.is_empty()),
        Value::Cells(cells) if cells.len() == 1 => text(&cells[0]),
        _ => None,
    }
}

/// The text in the field `Units` of a struct.
fn units_of(value: &Value) -> Option<String> {
    match value {
        Value::Structs(elements) => {
            let units = elements.first().and_then(|fields| field(fields, "units"));
            units.and_then(text).map(str::to_owned)
        }
        _ => None,
    }
}

/// The field `units` beside others: a text, or a struct with a text for each.
struct Units<'a>(Option<&'a Value>);

impl Units<'_> {
    fn of(&self, name: &str) -> Option<String> {
        match self.0 {
            Some(Value::Structs(elements)) => {
                let unit = elements.first().and_then(|fields| field(fields, name));
                unit.and_then(text).map(str::to_owned)
            }
            _ => None,
        }
    }

    fn whole(&self) -> Option<String> {
        self.0.and_then(text).map(str::to_owned)
    }
}
