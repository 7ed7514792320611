//! What stands beside a diagnosis: batches, simulations, exports, made-up records, datasheets, the catalogue.

use crate::error::{raised, refused};
use crate::running::running;
use crate::session::{Files, Said, Settings};
use crate::source::{Given, Source};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use servobee::evaluate::Memory;
use servobee::evaluate::problem::Stream;
use servobee::export::{Format, Model};
use servobee::record::check_mappings;
use servobee::report::{OutputFile, effects_json};
use servobee::search::datasheet::Case;
use servobee::session::{Datasheet, RunningBatch, Simulated, Task, found};
use servobee::simulator::{Meter, Noise, Quantisation, Setup, SpoolUnit, Valve};
use std::path::PathBuf;
use std::str::FromStr;

/// Identifies every file, each on its own, and writes the results into the folder `out`. Returns what `batch.json` has.
#[pyfunction]
pub(crate) fn batch(
    py: Python<'_>,
    files: Vec<PathBuf>,
    out: PathBuf,
    said: &Bound<'_, PyDict>,
    told: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, Vec<String>)> {
    let said = Said(said);
    let (mut session, device) = (said.session()?, said.device()?);
    let baseline: Option<PathBuf> = said.of("baseline")?;
    let [force, resume] = ["force", "resume"].map(|name| said.of::<bool>(name));
    let (force, resume) = (force?.unwrap_or(false), resume?.unwrap_or(false));
    let task: Option<String> = said.of("task")?;
    let task: Option<Task> = task
        .map(|task| {
            task.parse()
                .map_err(|words: String| refused(py, "task", &format!("is {task:?}"), &words))
        })
        .transpose()?;
    running(py, told, move |progress, interrupt| {
        session.plan.memory = Memory::default().stopped_by(interrupt);
        let files = found(&files, &out)?;
        let mut batch = match (task, resume) {
            (Some(task), _) => RunningBatch::task(&session, &out, task)?,
            (None, true) => RunningBatch::resume(&session, &out)?,
            (None, false) => RunningBatch::begin(&session, &out, force)?,
        };
        let files = batch.share(baseline.as_deref(), &files);
        let mut chosen = device.choose(0)?;
        let mut all = || -> servobee::Result<()> {
            if let Some(path) = &baseline {
                batch.baseline(path, &mut chosen, progress)?;
            }
            for (i, path) in files.iter().enumerate() {
                let place = format!("{}/{}", i + 1, files.len());
                let mut told = |stage: &str| progress(&format!("{place} {stage}"));
                batch.take(path, &mut chosen, &mut told)?;
            }
            Ok(())
        };
        let result = all();
        let written = batch.write()?;
        result?;
        Ok((written.to_json(), batch.take_warnings()))
    })
}

/// Makes the folder `out` of a batch, whose files tasks then take.
#[pyfunction]
pub(crate) fn begin_batch(py: Python<'_>, out: PathBuf, said: &Bound<'_, PyDict>) -> PyResult<()> {
    let said = Said(said);
    let (session, force) = (said.session()?, said.of("force")?.unwrap_or(false));
    running(py, None, move |_, _| {
        RunningBatch::begin(&session, &out, force).map(|_| ())
    })
}

/// A channel of a simulation: name, unit, RMSE, fit in %, and integration error.
type Channel = (String, String, Option<f64>, Option<f64>, f64);

/// A record simulated with a model: its rows as CSV, what is said of each channel, and remarks on the record.
#[pyfunction]
pub(crate) fn simulate(
    py: Python<'_>,
    model: Settings,
    record: Given<'_>,
    said: &Bound<'_, PyDict>,
) -> PyResult<(String, Vec<Channel>, Vec<String>)> {
    let reading = Said(said).reading()?;
    let source = Source::of(py, record)?;
    running(py, None, move |_, _| {
        let record = source.read(&reading)?;
        check_mappings(&reading.mappings, &[&record])?;
        let remarks = record.remarks();
        let simulated = Simulated::new(&model.model()?, record)?;
        let channels = simulated.channels().into_iter().map(|one| {
            let rmse = one.score.map(|score| score.rmse);
            let fit = one.score.and_then(|score| score.fit_percent);
            (
                one.name.to_owned(),
                one.unit,
                rmse,
                fit,
                one.integration_error,
            )
        });
        let channels = channels.collect();
        Ok((simulated.to_csv(), channels, remarks))
    })
}

/// Exports a model to the file at `out`, whose ending names the format. Returns what has to be said of it.
#[pyfunction]
pub(crate) fn export(
    py: Python<'_>,
    model: Settings,
    out: PathBuf,
    force: bool,
) -> PyResult<Option<String>> {
    running(py, None, move |_, _| {
        let format = Format::of(&out)?;
        let file = model.model()?;
        let structure = file.complete_structure()?;
        let parameters = file.parameters(structure.parameters())?;
        let stem = out.file_stem().unwrap_or_default().to_string_lossy();
        let model = Model::new(&stem, structure, parameters);
        let output = OutputFile::create(&out, force)?;
        let (bytes, said) = format.export(&model)?;
        output.finish_bytes(&bytes)?;
        Ok(said)
    })
}

/// A bench record with planted effects, as CSV.
#[pyfunction]
pub(crate) fn synthesize(py: Python<'_>, said: &Bound<'_, PyDict>) -> PyResult<String> {
    let said = Said(said);
    let usual = Setup::default();
    let number = |name: &str| said.of::<f64>(name);
    let seed = said.of("seed")?.unwrap_or(usual.seed);
    let valve = match said.of("random_valve")?.unwrap_or(false) {
        true => Valve::random(seed),
        false => Valve {
            gain: number("gain")?.unwrap_or(usual.valve.gain),
            time_constant: number("time_constant")?.unwrap_or(usual.valve.time_constant),
            saturation: number("saturation")?.unwrap_or(usual.valve.saturation),
            rated_flow: number("rated_flow")?.unwrap_or(usual.valve.rated_flow),
        },
    };
    let texts = |name: &str| -> PyResult<Vec<String>> { Ok(said.of(name)?.unwrap_or_default()) };
    let (planted, outsiders) = (texts("effects")?, texts("outsiders")?);
    let command = said.of::<String>("command")?.unwrap_or("bench".into());
    let noise = number("noise")?.unwrap_or(0.3);
    let noise = match number("noise_colour")? {
        Some(corner) => Noise::coloured(noise, corner),
        None => Noise::white(noise),
    };
    let quantise: Option<u32> = said.of("quantise")?;
    let units = [("V", SpoolUnit::Volt), ("%", SpoolUnit::Percent)];
    let meters = [("load", Meter::Load), ("supply", Meter::Supply)];
    let setup = Setup {
        name: "synthesized".into(),
        valve,
        planted: parsed(py, &planted)?,
        outsiders: parsed(py, &outsiders)?,
        command: command.parse().map_err(|error| raised(py, error))?,
        seconds: number("seconds")?.unwrap_or(8.0),
        rate: number("rate")?.unwrap_or(1000.0),
        noise,
        quantisation: quantise.map(Quantisation::Bits),
        spool_unit: said.one_of("spool_unit", &units)?.unwrap_or_default(),
        flow: said.of("flow")?.unwrap_or(true),
        meter: said.one_of("meter", &meters)?.unwrap_or_default(),
        seed,
        ..usual
    };
    running(py, None, move |_, _| Ok(setup.record()?.to_csv()))
}

fn parsed<T: FromStr<Err = servobee::Error>>(py: Python<'_>, words: &[String]) -> PyResult<Vec<T>> {
    let parsed: servobee::Result<_> = words.iter().map(|one| one.parse()).collect();
    parsed.map_err(|error| raised(py, error))
}

/// Fits the curves of a datasheet. Returns the files of the result, and what has to be said.
#[pyfunction]
pub(crate) fn datasheet(
    py: Python<'_>,
    said: &Bound<'_, PyDict>,
    told: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Files, Vec<String>)> {
    let said = Said(said);
    let usual = Datasheet::default();
    let cases = [
        ("d675", Case::D675),
        ("kbfdg5v", Case::Kbfdg5v),
        ("two-amplitude", Case::TwoAmplitude),
        ("step", Case::Step),
    ];
    let streams = [("paper", Stream::Paper), ("settled", Stream::Settled)];
    let datasheet = Datasheet {
        case: said.one_of("case", &cases)?.unwrap_or(usual.case),
        flow: said.of("flow")?,
        response: said.of("response")?,
        step: said.of("step")?,
        drop: said.of("drop")?.unwrap_or(usual.drop),
        amplitude: said.of("amplitude")?,
        full_scale: said.of("full_scale")?,
        stream: said.one_of("stream", &streams)?.unwrap_or(usual.stream),
        seed: said.of("seed")?.unwrap_or(usual.seed),
        call: said.call()?,
        edition: said.edition()?,
        ..usual
    };
    let device = said.device()?;
    running(py, told, move |progress, interrupt| {
        let prepared = datasheet.prepare()?;
        let memory = Memory::default().stopped_by(interrupt);
        let mut warnings = prepared.warnings().to_vec();
        let fitted = prepared
            .remembering(memory)
            .fit(&mut device.choose(0)?, &mut |title, generation| {
                progress(&format!("{title}, generation {generation}"))
            })?;
        warnings.extend(fitted.document.warnings.clone());
        Ok((fitted.files(), warnings))
    })
}

/// The catalogue of effects, as JSON.
#[pyfunction]
pub(crate) fn effects() -> String {
    effects_json()
}
