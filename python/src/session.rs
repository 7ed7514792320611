//! Diagnoses: from records to the files of a result.

use crate::error::{raised, refused};
use crate::running::running;
use crate::source::{Given, Source, reading, records};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use servobee::Session;
use servobee::diagnose::Cut;
use servobee::evaluate::{Devices, Memory};
use servobee::report::{Call, Edition, InputFile, Limits, ModelFile, OutputFolder};
use servobee::search::Plan;
use servobee::session::effects_named;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// The files of a result, by name.
pub(crate) type Files = Vec<(String, String)>;

/// A file of settings: at a path, or its text with what it is called.
#[derive(FromPyObject)]
pub(crate) enum Settings {
    Text(String, String),
    File(PathBuf),
}

impl Settings {
    pub(crate) fn model(&self) -> servobee::Result<ModelFile> {
        match self {
            Self::Text(name, text) => ModelFile::parse(name, text),
            Self::File(path) => ModelFile::read(path),
        }
    }

    fn limits(&self) -> servobee::Result<Limits> {
        match self {
            Self::Text(name, text) => Limits::parse(name, text),
            Self::File(path) => Limits::read(path),
        }
    }

    fn file(&self) -> Option<InputFile> {
        match self {
            Self::Text(..) => None,
            Self::File(path) => Some(InputFile::at(path)),
        }
    }
}

/// Everything that a call may say, and its defaults.
pub(crate) struct Said<'a, 'py>(pub(crate) &'a Bound<'py, PyDict>);

impl<'py> Said<'_, 'py> {
    /// What was said of `name`; `None` where nothing or None was.
    pub(crate) fn of<T>(&self, name: &str) -> PyResult<Option<T>>
    where
        T: for<'a> FromPyObject<'a, 'py, Error: Into<PyErr>>,
    {
        let Some(given) = self.0.get_item(name)?.filter(|given| !given.is_none()) else {
            return Ok(None);
        };
        match given.extract() {
            Ok(value) => Ok(Some(value)),
            Err(error) => {
                let error: PyErr = error.into();
                let problem = format!("is {}: {}", given.repr()?, error.value(self.py()));
                let remedy = "help(servobee) says what it takes";
                Err(refused(self.py(), name, &problem, remedy))
            }
        }
    }

    fn py(&self) -> Python<'py> {
        self.0.py()
    }

    /// What the word that was said of `name` stands for.
    pub(crate) fn one_of<T: Copy>(&self, name: &str, words: &[(&str, T)]) -> PyResult<Option<T>> {
        let Some(said) = self.of::<String>(name)? else {
            return Ok(None);
        };
        match words.iter().find(|(word, _)| *word == said) {
            Some((_, stands)) => Ok(Some(*stands)),
            None => {
                let words: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
                let remedy = format!("give {}", words.join(", "));
                Err(refused(self.py(), name, &format!("is {said:?}"), &remedy))
            }
        }
    }

    /// What was said in words of `name`, read by the library.
    pub(crate) fn read<T: FromStr<Err = servobee::Error> + Default>(
        &self,
        name: &str,
    ) -> PyResult<T> {
        match self.of::<String>(name)? {
            Some(words) => words.parse().map_err(|error| raised(self.py(), error)),
            None => Ok(T::default()),
        }
    }

    /// The units and the language of a page.
    pub(crate) fn edition(&self) -> PyResult<Edition> {
        Ok(Edition {
            units: self.read("units")?,
            language: self.read("language")?,
        })
    }

    /// How files are read.
    pub(crate) fn reading(&self) -> PyResult<servobee::record::Reading> {
        let maps = self.of::<Vec<String>>("maps")?.unwrap_or_default();
        let interval = self.of::<String>("sample_interval")?;
        let skip = self.of("skip_incomplete_rows")?.unwrap_or(false);
        reading(self.py(), &maps, interval.as_deref(), skip)
    }

    /// What evaluates.
    pub(crate) fn device(&self) -> PyResult<Devices> {
        let name = self.of::<String>("device")?.unwrap_or("auto".into());
        name.parse().map_err(|words: String| {
            refused(
                self.py(),
                "device",
                &format!("is {name:?}"),
                &format!("give {words}"),
            )
        })
    }

    /// The session.
    pub(crate) fn session(&self) -> PyResult<Session> {
        let raise = |error| raised(self.py(), error);
        let [model, limits] = ["model", "limits"].map(|name| self.of::<Settings>(name));
        let model = model?.map(|given| given.model()).transpose();
        let limits = limits?.map(|given| given.limits()).transpose();
        let effects = self.of::<String>("effects")?.unwrap_or("all".into());
        let usual = Session::default();
        Ok(Session {
            reading: self.reading()?,
            model: model.map_err(raise)?,
            limits: limits.map_err(raise)?,
            effects: effects_named(&effects).map_err(raise)?,
            max_effects: self.of("max_effects")?.unwrap_or(usual.max_effects),
            cut: Cut {
                hold_out: self.of("hold_out_share")?.unwrap_or(usual.cut.hold_out),
                rows: self.of("max_rows")?.unwrap_or(usual.cut.rows),
            },
            full_scale: self.of("full_scale")?,
            accuracy: self.read("accuracy")?,
            plan: Plan::of_records(self.of("seed")?.unwrap_or(1)),
            call: self.call()?,
            edition: self.edition()?,
            ..usual
        })
    }

    /// What the report says of the call.
    pub(crate) fn call(&self) -> PyResult<Call> {
        let [model, limits] = ["model", "limits"].map(|name| self.of::<Settings>(name));
        let beside = [model?, limits?];
        Ok(Call {
            arguments: self.of("arguments")?.unwrap_or_default(),
            about: self.read("about")?,
            files: beside.iter().flatten().filter_map(Settings::file).collect(),
        })
    }
}

/// Identifies `fitted` records. Returns the files of the result.
#[pyfunction]
pub(crate) fn identify(
    py: Python<'_>,
    fitted: Vec<Given<'_>>,
    held_out: Vec<Given<'_>>,
    said: &Bound<'_, PyDict>,
    told: Option<&Bound<'_, PyAny>>,
) -> PyResult<Files> {
    let said = Said(said);
    let (fitted, held_out) = (Source::all(py, fitted)?, Source::all(py, held_out)?);
    let (session, device) = (said.session()?, said.device()?);
    running(py, told, move |progress, interrupt| {
        let fitted = records(&fitted, &session.reading)?;
        let held_out = records(&held_out, &session.reading)?;
        let memory = Memory::default().stopped_by(interrupt);
        let prepared = session.prepare(&fitted, &held_out)?.remembering(memory);
        let diagnosed = prepared.diagnose(&mut device.choose(0)?, progress)?;
        Ok(diagnosed.files())
    })
}

/// Compares the records of `before` and `after`. Returns the files of the result.
#[pyfunction]
pub(crate) fn compare(
    py: Python<'_>,
    before: Vec<Given<'_>>,
    after: Vec<Given<'_>>,
    said: &Bound<'_, PyDict>,
    told: Option<&Bound<'_, PyAny>>,
) -> PyResult<Files> {
    let said = Said(said);
    let (before, after) = (Source::all(py, before)?, Source::all(py, after)?);
    let (session, device) = (said.session()?, said.device()?);
    running(py, told, move |progress, interrupt| {
        let before = records(&before, &session.reading)?;
        let after = records(&after, &session.reading)?;
        let memory = Memory::default().stopped_by(interrupt);
        let pair = session.pair(&before, &after)?.remembering(&memory);
        Ok(pair.compare(&mut device.choose(0)?, progress)?.files())
    })
}

/// Writes the files of a result into a folder, all or none.
#[pyfunction]
pub(crate) fn write(py: Python<'_>, folder: PathBuf, files: Files, force: bool) -> PyResult<()> {
    let write = |folder: &Path| OutputFolder::reserve(folder, force)?.write(&files);
    py.detach(|| write(&folder))
        .map_err(|error| raised(py, error))
}
