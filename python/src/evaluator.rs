//! Costs of whole populations, for other optimisers.

use crate::error::{raised, refused};
use crate::running::WAIT;
use crate::session::Said;
use crate::source::{Given, Source, records};
use numpy::ndarray::ArrayView2;
use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use servobee::evaluate::{
    Chosen, Cost, CpuEvaluator, Memory, Population, Precision, Problem, Status,
};
use servobee::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;

/// What the thread of an evaluator answers: costs, and what has to be told.
type Answer = Result<(Vec<Cost>, Vec<String>)>;

/// A population whose costs are asked for.
struct Ask {
    population: Population,
    answer: Sender<Answer>,
    /// Whether nobody waits for them any more.
    gone: Arc<AtomicBool>,
}

/// So many rows of candidates are simulated between two looks at whether somebody waits.
const PIECE: usize = 50_000_000;

/// Costs, whether each candidate ran to its end, and what has to be told.
type Evaluated<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<bool>>,
    Vec<String>,
);

/// Costs of whole populations on records, on the CPU or a GPU.
#[pyclass(module = "servobee._servobee", frozen)]
pub(crate) struct Evaluator {
    /// To a thread that evaluates: no device has to be handed from thread to thread.
    asks: Mutex<Sender<Ask>>,
    problem: Problem,
    device: String,
}

/// A population as NumPy has it.
#[derive(FromPyObject)]
enum Array<'py> {
    Double(PyReadonlyArray2<'py, f64>),
    Single(PyReadonlyArray2<'py, f32>),
}

#[pymethods]
impl Evaluator {
    #[new]
    fn new(py: Python<'_>, given: Vec<Given<'_>>, said: &Bound<'_, PyDict>) -> PyResult<Self> {
        let said = Said(said);
        let sources = Source::all(py, given)?;
        let (session, device) = (said.session()?, said.device()?);
        let double = said.of("double")?.unwrap_or(false);
        let (ready, waits) = channel();
        let (asks, asked) = channel();
        let made = py.detach(move || {
            let records = records(&sources, &session.reading)?;
            let problem = session.prepare(&records, &[])?.problem().first_fit();
            let own = problem.clone();
            thread::spawn(move || {
                let chosen = match double {
                    true => Chosen::own("the CPU in f64", CpuEvaluator::new(Precision::F64)),
                    false => device.choose(0),
                };
                match chosen {
                    Err(error) => drop(ready.send(Err(error))),
                    Ok(mut chosen) => {
                        let _ = ready.send(Ok(chosen.evaluator.describe()));
                        serve(&mut chosen, &own, &asked);
                    }
                }
            });
            let device = waits.recv().unwrap_or_else(|_| Err(ended()))?;
            Ok((problem, device))
        });
        let (problem, device) = made.map_err(|error| raised(py, error))?;
        Ok(Self {
            asks: Mutex::new(asks),
            problem,
            device,
        })
    }

    /// What computes.
    #[getter]
    fn device(&self) -> &str {
        &self.device
    }

    /// How many rows count.
    #[getter]
    fn rows(&self) -> usize {
        self.problem.rows()
    }

    /// The free parameters.
    #[getter]
    fn parameters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyList>> {
        let free = self.problem.free().into_iter().map(|parameter| {
            let row = PyDict::new(py);
            row.set_item("name", &parameter.name)?;
            row.set_item("unit", &parameter.unit)?;
            row.set_item("low", parameter.low)?;
            row.set_item("start", parameter.nominal())?;
            row.set_item("high", parameter.high)?;
            row.set_item(
                "logarithmic",
                parameter.scale == servobee::model::Scale::Log,
            )?;
            Ok(row)
        });
        PyList::new(py, free.collect::<PyResult<Vec<_>>>()?)
    }

    /// Costs and whether each candidate ran to its end; with `columns` each column is a candidate, otherwise each row.
    fn evaluate<'py>(
        &self,
        py: Python<'py>,
        population: Array<'_>,
        columns: bool,
    ) -> PyResult<Evaluated<'py>> {
        let dimension = self.problem.free().len();
        let population = match &population {
            Array::Double(array) => gathered(py, array, columns, dimension)?,
            Array::Single(array) => gathered(py, array, columns, dimension)?,
        };
        let answer = self.answer(py, population)?;
        let (costs, warnings) = answer.map_err(|error| raised(py, error))?;
        let finished = costs.iter().map(|cost| cost.status == Status::Finished);
        let finished: Vec<bool> = finished.collect();
        let costs: Vec<f64> = costs.iter().map(|cost| cost.value).collect();
        Ok((costs.into_pyarray(py), finished.into_pyarray(py), warnings))
    }
}

impl Evaluator {
    /// What the thread answers. Ctrl-C does not wait for it.
    fn answer(&self, py: Python<'_>, population: Population) -> PyResult<Answer> {
        let (answer, mut answers) = channel();
        let gone = Arc::new(AtomicBool::new(false));
        let ask = Ask {
            population,
            answer,
            gone: gone.clone(),
        };
        let asks = self.asks.lock().unwrap_or_else(PoisonError::into_inner);
        let asked = asks.send(ask);
        drop(asks);
        if asked.is_err() {
            return Ok(Err(ended()));
        }
        loop {
            let (receiver, heard) = py.detach(move || {
                let heard = answers.recv_timeout(WAIT);
                (answers, heard)
            });
            answers = receiver;
            match heard {
                Ok(answer) => return Ok(answer),
                Err(RecvTimeoutError::Disconnected) => return Ok(Err(ended())),
                Err(RecvTimeoutError::Timeout) => {
                    if let Err(exception) = py.check_signals() {
                        gone.store(true, Ordering::Relaxed);
                        return Err(exception);
                    }
                }
            }
        }
    }
}

/// Answers until nobody asks any more.
fn serve(chosen: &mut Chosen, problem: &Problem, asked: &Receiver<Ask>) {
    while let Ok(ask) = asked.recv() {
        let costs = costs(chosen, problem, &ask);
        let warnings = chosen.warnings(&Memory::default());
        // Whom Ctrl-C has stopped does not hear it.
        let _ = ask.answer.send(costs.map(|costs| (costs, warnings)));
    }
}

/// The costs of a population, piece by piece; those so far where nobody waits any more.
fn costs(chosen: &mut Chosen, problem: &Problem, ask: &Ask) -> Result<Vec<Cost>> {
    let population = &ask.population;
    let size = (PIECE / problem.rows().max(1)).max(256);
    if population.len() <= size {
        return chosen.evaluator.costs(problem, population);
    }
    let candidates: Vec<&[f64]> = population.iter().collect();
    let mut costs = Vec::with_capacity(candidates.len());
    for piece in candidates.chunks(size) {
        if ask.gone.load(Ordering::Relaxed) {
            break;
        }
        let piece = Population::of(population.dimension(), piece.concat());
        costs.extend(chosen.evaluator.costs(problem, &piece)?);
    }
    Ok(costs)
}

fn ended() -> Error {
    Error::failed("the evaluator has ended", "make another")
}

/// The population in an array. It is copied once, since other threads may write to the array meanwhile; what is stored candidate
/// after candidate in double precision, in one piece.
fn gathered<T: Element + Copy + Into<f64>>(
    py: Python<'_>,
    array: &PyReadonlyArray2<'_, T>,
    columns: bool,
    dimension: usize,
) -> PyResult<Population> {
    let view: ArrayView2<'_, T> = match columns {
        true => array.as_array().reversed_axes(),
        false => array.as_array(),
    };
    if view.ncols() != dimension {
        let shape = array.shape();
        let wanted = match columns {
            true => format!("({dimension}, candidates)"),
            false => format!("(candidates, {dimension})"),
        };
        return Err(refused(
            py,
            "population",
            &format!(
                "is ({}, {}), and {dimension} parameters are free",
                shape[0], shape[1]
            ),
            &format!("give {wanted}, or say the other layout"),
        ));
    }
    let values: Vec<f64> = match view.as_slice() {
        Some(values) => values.iter().map(|&value| value.into()).collect(),
        None => view.iter().map(|&value| value.into()).collect(),
    };
    if let Some(odd) = values.iter().position(|value| !value.is_finite()) {
        let (candidate, parameter) = (odd / dimension, odd % dimension);
        return Err(refused(
            py,
            &format!("population, candidate {candidate}, parameter {parameter}"),
            &format!("is {}", values[odd]),
            "give finite numbers",
        ));
    }
    Ok(Population::of(dimension, values))
}
