//! Model files: a structure and its parameters as TOML, complete or just what a user wants to be different.

mod check;

use super::toml_text::TomlText;
use crate::model::effects::Effect;
use crate::model::{Complete, Fluid, Pace, Parameter, Scale, Structure};
use crate::record::quoted;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};
use std::ops::{Range, RangeInclusive};
use std::path::Path;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

/// Keys without which a `[structure]` does not stand alone.
const COMPLETE: [&str; 3] = ["full_scale", "command_unit", "observed"];

/// Classes of oil (ISO VG) and temperatures (°C) that a hydraulic system works with.
const OILS: (RangeInclusive<f64>, RangeInclusive<f64>) = (10.0..=150.0, -20.0..=120.0);

/// What shows how a model file is written.
const EXAMPLE: &str = "a file that identify writes shows every key";

/// Largest magnitude of a parameter, in its unit.
const LARGEST: f64 = 1e18;

/// Fastest rate that integration steps follow, 1/s: see [`Parameter::fastest_rate`].
const FASTEST: f64 = 1e7;
/// Least ratio of a lag to that of the loop that they follow: a row shows no less.
const LEAST_RATIO: f64 = 1e-3;

/// A model file that has been read.
///
/// A `[structure]` that has `full_scale`, `command_unit` and `observed` stands alone: keys that are not there have their
/// defaults. One with less changes a structure that comes from elsewhere, key by key. A `[[parameter]]` changes the
/// parameter of its name, key by key. `[fluid]` with `iso_vg` and `temperature` gives density and viscosity their values
/// where no `[[parameter]]` does.
#[derive(Debug)]
pub struct ModelFile {
    file: TomlText,
    entries: Vec<Entry>,
    fluid: Option<Spanned<Fluid>>,
}

/// A `[[parameter]]` as it is read.
#[derive(Debug, Deserialize)]
#[serde(
    deny_unknown_fields,
    expecting = "a table with the name of a parameter"
)]
struct Entry {
    name: Spanned<String>,
    unit: Option<Spanned<String>>,
    value: Option<Spanned<f64>>,
    low: Option<Spanned<f64>>,
    high: Option<Spanned<f64>>,
    scale: Option<Spanned<Scale>>,
    fixed: Option<bool>,
}

/// A complete model as it is written.
#[derive(Serialize)]
struct Model<'a> {
    structure: &'a Structure,
    parameter: Vec<Row<'a>>,
}

/// A `[[parameter]]` as it is written.
#[derive(Serialize)]
struct Row<'a> {
    name: &'a str,
    unit: &'a str,
    value: f64,
    low: f64,
    high: f64,
    scale: Scale,
    fixed: bool,
}

impl ModelFile {
    /// Reads a model file.
    ///
    /// # Errors
    /// The file cannot be read, is longer than 1 MiB, is no TOML, or has keys or types that no model file has. Whether names and values fit
    /// shows in [`ModelFile::structure`] and [`ModelFile::parameters`].
    pub fn read(path: impl AsRef<Path>) -> Result<Self> {
        let kind = "give a model file, such as identify writes";
        Self::of(TomlText::read(path.as_ref(), kind, EXAMPLE)?)
    }

    /// [`ModelFile::read`] from the text of the file called `path`.
    ///
    /// # Errors
    /// As [`ModelFile::read`], but for those of reading the file.
    pub fn parse(path: &str, text: &str) -> Result<Self> {
        Self::of(TomlText::new(path, text, EXAMPLE))
    }

    fn of(file: TomlText) -> Result<Self> {
        let (mut entries, mut fluid) = (Vec::new(), None);
        for (key, value) in file.table()? {
            match key.get_ref().as_ref() {
                "structure" if value.get_ref().is_table() => check_tables(&file, &value)?,
                "parameter" => {
                    check_entries(&file, &value)?;
                    entries = Vec::deserialize(ValueDeserializer::from(value))
                        .map_err(|error| file.toml_error(&error))?;
                }
                "fluid" if value.get_ref().is_table() => {
                    let oil = Spanned::deserialize(ValueDeserializer::from(value));
                    fluid = Some(oil.map_err(|error| file.toml_error(&error))?);
                }
                _ => {
                    return Err(file.error(
                        key.span(),
                        format!("{} is no part of a model file", quoted(key.get_ref())),
                        "a model file has one [structure], one [fluid] and any number of [[parameter]]",
                    ));
                }
            }
        }
        Ok(Self {
            file,
            entries,
            fluid,
        })
    }

    /// The text of a complete model file for `structure` and its `parameters` with these `values`, all in the order of
    /// [`Structure::parameters`]. It reads back to exactly the same.
    pub fn to_toml(
        structure: &Structure,
        parameters: &[Parameter],
        values: &Complete<f64>,
    ) -> String {
        let rows = parameters
            .iter()
            .zip(values.as_slice())
            .map(|(parameter, &value)| Row {
                name: &parameter.name,
                unit: &parameter.unit,
                value,
                low: parameter.low,
                high: parameter.high,
                scale: parameter.scale,
                fixed: parameter.is_fixed(),
            });
        let model = Model {
            structure,
            parameter: rows.collect(),
        };
        toml::to_string(&model).expect("a model is a TOML table")
    }

    /// The structure of the file: on its own where it is complete, otherwise `base` with the file's changes.
    ///
    /// # Errors
    /// An unknown key, a wrong type, a value outside its range, parts that do not fit together; whatever `base` refuses,
    /// which is called only where it is needed.
    pub fn structure(&self, base: impl FnOnce() -> Result<Structure>) -> Result<Structure> {
        let Some(own) = self.own_structure() else {
            return base();
        };
        let complete = COMPLETE.iter().all(|key| own.get_ref().get(*key).is_some());
        let removes_valve = !complete && own.get_ref().get("valve").is_none();
        let base = match complete {
            true => String::new(),
            false => toml::to_string(&base()?).expect("a structure is a TOML table"),
        };
        let mut table = DeTable::parse(&base).expect("just written").into_inner();
        overlay(
            &mut table,
            own.get_ref().as_table().expect("checked when parsed"),
        );
        let value = Spanned::new(own.span(), DeValue::Table(table));
        let mut structure = Structure::deserialize(ValueDeserializer::from(value))
            .map_err(|error| self.file.toml_error(&error))?;
        if removes_valve && !structure.needs_valve() {
            structure.remove_valve();
        }
        structure.effects.sort_by_key(Effect::rank);
        self.check(&structure)?;
        Ok(structure)
    }

    /// Whether the file says what the command does between two rows.
    pub fn says_hold(&self) -> bool {
        let own = self.own_structure();
        own.is_some_and(|own| own.get_ref().get("hold").is_some())
    }

    /// Whether the file says what the full scale of the command is.
    pub fn says_full_scale(&self) -> bool {
        let own = self.own_structure();
        own.is_some_and(|own| own.get_ref().get("full_scale").is_some())
    }

    /// The structure of a file that must have all of it.
    ///
    /// # Errors
    /// As [`ModelFile::structure`]; a `[structure]` that is missing or does not stand alone.
    pub fn complete_structure(&self) -> Result<Structure> {
        self.structure(|| {
            Err(Error::input(
                &self.file.path,
                "has no [structure] with full_scale, command_unit and observed",
                "give a complete model file, such as identify writes",
            ))
        })
    }

    /// `base`, the parameters of the structure, with the file's changes; a `value` becomes the start value.
    ///
    /// # Errors
    /// A fluid that is no hydraulic oil, or a structure without one. A parameter that the structure does not have or that is there twice; another unit; bounds that are not finite,
    /// not in order, or not positive on a logarithmic scale; a value outside them.
    pub fn parameters(&self, base: Vec<Parameter>) -> Result<Vec<Parameter>> {
        let mut parameters = base;
        if let Some(fluid) = &self.fluid {
            self.fill(&mut parameters, fluid)?;
        }
        for (i, entry) in self.entries.iter().enumerate() {
            let name = entry.name.get_ref();
            if self.entries[..i].iter().any(|e| e.name.get_ref() == name) {
                return Err(self.file.error(
                    entry.name.span(),
                    format!("there is a parameter {name} above already"),
                    "delete one of the two",
                ));
            }
            let Some(parameter) = parameters.iter_mut().find(|p| p.name == *name) else {
                let names: Vec<&str> = parameters.iter().map(|p| p.name.as_str()).collect();
                return Err(self.file.error(
                    entry.name.span(),
                    "the structure has no such parameter",
                    format!("use one of {}", names.join(", ")),
                ));
            };
            self.change(parameter, entry)?;
        }
        Ok(parameters)
    }

    /// Gives density and viscosity the values of the file's fluid.
    fn fill(&self, parameters: &mut [Parameter], fluid: &Spanned<Fluid>) -> Result<()> {
        let refuse =
            |problem: String, remedy: &str| Err(self.file.error(fluid.span(), problem, remedy));
        let Fluid {
            iso_vg,
            temperature,
        } = *fluid.get_ref();
        if !OILS.0.contains(&iso_vg) || !OILS.1.contains(&temperature) {
            return refuse(
                format!("ISO VG {iso_vg} at {temperature} degC is no hydraulic oil at work"),
                "give iso_vg from 10 to 150 and a temperature from -20 to 120 degC",
            );
        }
        for (name, value) in [
            ("density", fluid.get_ref().density()),
            ("viscosity", fluid.get_ref().viscosity()),
        ] {
            match parameters.iter_mut().find(|p| p.name == name) {
                Some(parameter) => parameter.set_nominal(parameter.clamp(value)),
                None => {
                    return refuse(
                        "the structure has no valve that oil flows through".into(),
                        "delete [fluid], or observe flow",
                    );
                }
            }
        }
        Ok(())
    }

    fn change(&self, parameter: &mut Parameter, entry: &Entry) -> Result<()> {
        if let Some(unit) = entry
            .unit
            .as_ref()
            .filter(|unit| *unit.get_ref() != parameter.unit)
        {
            return Err(self.file.error(
                unit.span(),
                format!("{} is in {}", parameter.name, parameter.unit),
                format!("convert it to {}", parameter.unit),
            ));
        }
        for number in [&entry.value, &entry.low, &entry.high]
            .into_iter()
            .flatten()
        {
            if !number.get_ref().is_finite() {
                return Err(self
                    .file
                    .error(number.span(), "is not finite", "give a number"));
            }
            if number.get_ref().abs() > LARGEST {
                let problem = format!("is beyond {LARGEST:e} {}", parameter.unit);
                return Err(self
                    .file
                    .error(number.span(), problem, "give what a valve can have"));
            }
        }
        let set = |field: &mut f64, number: &Option<Spanned<f64>>| {
            if let Some(number) = number {
                *field = *number.get_ref();
            }
        };
        set(&mut parameter.low, &entry.low);
        set(&mut parameter.high, &entry.high);
        if let Some(value) = &entry.value {
            parameter.set_nominal(*value.get_ref());
        }
        if let Some(scale) = &entry.scale {
            parameter.scale = *scale.get_ref();
        }
        parameter.set_fixed(entry.fixed.unwrap_or(parameter.is_fixed()));

        let Parameter {
            name, low, high, ..
        } = &*parameter;
        let start = &parameter.nominal();
        let span = |number: &Option<Spanned<f64>>| number.as_ref().map(Spanned::span);
        let place = |number| span(number).unwrap_or(entry.name.span());
        if low >= high {
            return Err(self.file.error(
                span(&entry.low).unwrap_or(place(&entry.high)),
                format!("{name} has bounds {low} .. {high}"),
                "let low be less than high",
            ));
        }
        if parameter.scale == Scale::Log && *low <= 0.0 {
            return Err(self.file.error(
                place(&entry.low),
                format!("{name} has low {low} on a logarithmic scale"),
                "give a positive low, or scale = \"linear\"",
            ));
        }
        let too_fast = match parameter.pace {
            Some(Pace::LagRatio) => *low < LEAST_RATIO,
            _ => parameter.fastest_rate() > Some(FASTEST),
        };
        let fast_bound = match parameter.pace {
            Some(Pace::TimeConstant | Pace::Delay | Pace::LagRatio) => (&entry.low, "low", low),
            _ => (&entry.high, "high", high),
        };
        if let (true, (own, bound, value)) = (too_fast, fast_bound) {
            return Err(self.file.error(
                place(own),
                format!(
                    "{name} has {bound} {value:e} {}: no valve is as fast",
                    parameter.unit
                ),
                "give bounds of rates below 1e7 1/s, of time constants above 1e-7 s, and of their ratios from 1e-3 on",
            ));
        }
        if !(*low..=*high).contains(start) {
            return Err(self.file.error(
                place(&entry.value),
                format!("the value {start} of {name} is outside its bounds {low} .. {high}"),
                "give a value inside them, or other low and high with it",
            ));
        }
        Ok(())
    }

    /// The file's `[structure]`, with the places of its keys in the text.
    fn own_structure(&self) -> Option<Spanned<DeValue<'_>>> {
        let mut table = self.file.table().expect("parsed before");
        table.remove("structure")
    }

    /// Where the value of a key of `[structure]` stands, or what encloses it.
    fn find(&self, keys: &[&str]) -> Range<usize> {
        let Some(structure) = self.own_structure() else {
            return 0..0;
        };
        let mut value = &structure;
        for key in keys {
            value = value.get_ref().get(*key).unwrap_or(value);
        }
        value.span()
    }
}

/// Refuses lists where `[structure]` has tables: their values would be taken one after the other.
fn check_tables(file: &TomlText, structure: &Spanned<DeValue<'_>>) -> Result<()> {
    for key in ["valve", "free_form"] {
        if let Some(part) = structure
            .get_ref()
            .get(key)
            .filter(|part| part.get_ref().is_array())
        {
            return Err(file.error(
                part.span(),
                format!("{key} is a list"),
                format!("give a table [structure.{key}]"),
            ));
        }
    }
    Ok(())
}

/// Refuses a parameter that is a list, as [`check_tables`] does.
fn check_entries(file: &TomlText, parameters: &Spanned<DeValue<'_>>) -> Result<()> {
    let entries = parameters.get_ref().as_array().into_iter().flatten();
    match entries.into_iter().find(|entry| entry.get_ref().is_array()) {
        None => Ok(()),
        Some(entry) => Err(file.error(
            entry.span(),
            "the parameter is a list",
            "give a table [[parameter]] with its name",
        )),
    }
}

/// Puts the file's keys over the base's; a valve is changed key by key, too.
fn overlay<'a>(base: &mut DeTable<'a>, own: &DeTable<'a>) {
    for (key, value) in own {
        match (
            base.get_mut(key.get_ref().as_ref()).map(Spanned::get_mut),
            value.get_ref(),
        ) {
            (Some(DeValue::Table(base)), DeValue::Table(own)) if key.get_ref() == "valve" => {
                overlay(base, own);
            }
            _ => {
                base.insert(key.clone(), value.clone());
            }
        }
    }
}
