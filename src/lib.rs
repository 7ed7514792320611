//! Finds the parameters of electro-hydraulic servo valves with the Bees Algorithm, on the CPU or on a GPU.
//!
//! ```text
//! record ──> structure ──> candidates ──> costs ──> fit ──> residual ──> diagnosis ──> report
//! measured   base model    a search asks  Evaluator  polish  what is      which effect  report.html, report.json,
//! or curve   + effects                    CPU | GPU          left over    explains it   model.toml, residual.csv
//! ```
//!
//! - [`record`]: measurements in time and datasheet curves, with channels, units and checks.
//! - [`model`]: the physics, each equation written once over [`model::Real`] and read as `f64`, `f32`, vectors of
//!   candidates, dual numbers and as text: WGSL, C and Modelica. A structure is a base model ([`model::base`]), what is observed
//!   of it, and what is attached at its ports. The servo valve is the base model of this crate: its actuator is
//!   `ż = K · sat(u − x, ±S)`, `ẋ = (z − x) / T` ([`model::actuator`]); an orifice passes
//!   `q = Cd A √(2/ρ) p / (p² + pcr²)^¼` ([`model::orifice`]); four or six of them make a valve ([`model::valve`]), near
//!   null those of its edges ([`model::edges`]). What
//!   measured valves show beyond that is in [`model::effects`], one file an effect.
//! - [`evaluate`]: the costs of a whole population at once, behind one trait: the problem, the time loops, the devices, whether
//!   they compute right, and what is kept of a run.
//! - [`search`]: searches as ask and tell, of which the Bees Algorithm is one, and a Levenberg-Marquardt polish with exact
//!   sensitivities that says how well the data determine each parameter, and which it cannot tell apart.
//! - [`diagnose`]: the noise floor, whether the residual is more than noise, which effects explain it, and what error they
//!   leave on data that was held out. Its statistics know nothing of the procedure that uses them.
//! - [`card`]: the figures of a datasheet, as they follow from a fitted model and as the measured curves show them.
//! - [`compare`]: two diagnoses, of before and after a repair: one structure fitted to both, and what changed.
//! - [`report`]: what a run tells and leaves behind.
//! - [`session`]: the way through all of them, from records or the curves of a datasheet to a page, in one call.
//! - [`export`]: a fitted model for other tools: an FMU, Modelica, a Simscape script, C.
//!
//! Each of them knows only those above it. Beside them stand `simulator`, which makes records with planted effects from equations
//! of its own, and `scorecard`, which counts on such records how often the diagnosis is right.
//!
//! # To add something
//!
//! | to add | touch |
//! |---|---|
//! | an effect | its file in `src/model/effects` and its line in `catalogue!` there; tests ask for its twin in `src/simulator` |
//! | a base model | its file in `src/model/base` and its line in `base_models!` there; or, from outside, [`model::base::register_base`] |
//! | an observed channel | its line in `channels!` of `src/record/channel.rs` and in `outputs!` of `src/model/output.rs`; the base model that computes it; the words by which its columns are known, in `src/record/names.rs` |
//! | an input | its line in `inputs!` of `src/model/input.rs` |
//! | a search | [`search::Search`] and [`search::Method`], here or outside, and its name in a [`search::Plan`] |
//! | a device | [`evaluate::Evaluator`] |
//! | a cost of errors | [`evaluate::Loss`] |
//! | a file of a result | `src/session/diagnosed.rs` |
//! | a field of a result | its struct in `src/report`, and its line in `schema` |
//!
//! Each was tried; `benches/house.py` counts what it takes.
//!
//! # From a record to a page
//!
//! ```
//! use servobee::Session;
//! use servobee::evaluate::{Choice, choose};
//! use std::ops::ControlFlow;
//!
//! let session = Session::default();
//! let records = session.read(&["tests/data/bench.csv"])?;
//! let mut chosen = choose(Choice::Cpu)?;
//! let diagnosed = session.identify(&records, &[], &mut chosen, &mut |_| ControlFlow::Continue(()))?;
//! assert_eq!(diagnosed.document.effect_names(), ["delay"]);
//!
//! let folder = tempfile::tempdir().expect("a folder for the result");
//! diagnosed.write(folder.path().join("result"), false)?;
//! # assert!(folder.path().join("result/report.html").is_file());
//! # servobee::Result::Ok(())
//! ```
//!
//! What differs is named: `Session { loss: Some(OwnLoss::of::<Huber>()), ..Session::default() }`. `examples/own.rs` has an
//! evaluator, a loss, a search and an effect that somebody else has written.
//!
//! # A fit
//!
//! ```
//! use servobee::evaluate::problem::{Data, Problem, Sample, Series};
//! use servobee::evaluate::{CpuEvaluator, Precision, reference};
//! use servobee::model::{Complete, Initial, Input, Outputs, Structure};
//! use servobee::search::{Plan, fit};
//! use std::ops::ControlFlow;
//!
//! // A valve's answer to a step of 10 V from rest, every 2 ms.
//! let structure = Structure { initial: Initial::Rest, ..Structure::actuator(10.0, "V") };
//! let parameters = structure.parameters();
//! let time: Vec<f64> = (0..60).map(|k| 0.002 * f64::from(k)).collect();
//! let step = Sample { input: Input { command: 10.0, ..Input::default() }, weight: 1.0, ..Sample::default() };
//! let measured = Outputs::all(true);
//! let mut series = Series { name: "step".into(), measured, samples: vec![step; time.len()], time };
//! series.set_steps(structure.fastest_rate(&parameters), 1);
//! let [gain, time_constant, saturation] = [220.0, 0.008, 1.2];
//! let truth = Complete::from_iter([gain, time_constant, saturation]);
//! let measured = reference::trajectories(&structure, &truth, &[series.clone()]);
//! for (sample, measured) in series.samples.iter_mut().zip(&measured[0]) {
//!     sample.target = *measured;
//! }
//!
//! let problem = Problem::new(structure, parameters, Data::Series(vec![series]));
//! let mut evaluator = CpuEvaluator::new(Precision::F32);
//! let plan = Plan { coloured: false, ..Plan::of_records(1) };
//! let fit = fit(&problem, &mut evaluator, &plan, &mut |_| ControlFlow::Continue(()))?;
//! assert!((fit.values()[0] / gain - 1.0).abs() < 1e-6);
//! # servobee::Result::Ok(())
//! ```
//!
//! # An effect of your own
//!
//! Written once for all numbers, it runs on every evaluator, is differentiated for the polish, and a diagnosis that is given
//! it looks for it as for those of the catalogue.
//!
//! ```
//! use servobee::model::effects::{Act, Effect, Entry, Law, Port, register};
//! use servobee::model::{Parameter, Real, Structure};
//!
//! /// An amplifier that bends: u + bend · u · |u|.
//! struct Bend<R>(R);
//!
//! impl<R: Real> Act<R> for Bend<R> {
//!     fn command(&self, _own: &mut [R], command: R) -> R {
//!         command + self.0 * command * command.abs()
//!     }
//! }
//!
//! struct BendLaw;
//!
//! impl Law for BendLaw {
//!     type Act<R: Real> = Bend<R>;
//!     fn act<R: Real>(next: &mut dyn FnMut() -> R) -> Bend<R> {
//!         Bend(next())
//!     }
//! }
//!
//! let entry = register::<BendLaw>(Entry {
//!     name: "bend",
//!     port: Port::Command,
//!     summary: "The amplifier bends",
//!     finding: "the amplifier bends by {bend}",
//!     equation: "u + bend u |u|",
//!     shows: "an error that grows with the square of the command",
//!     confused: "gain_curvature, which the spool does not show",
//!     source: "the amplifier's data sheet",
//!     parameters: |scale, _| vec![Parameter::linear("bend", "1", -0.5 / scale.command, 0.0, 0.5 / scale.command)],
//!     trials: |scale, _| vec![vec![0.05 / scale.command]],
//!     imitated_by: &[],
//!     states: &[],
//!     neutral: &[],
//!     applies: |_| true,
//!     outputs: None,
//!     view: None,
//!     frequency: None,
//! })?;
//! let structure = Structure::actuator(10.0, "V").with(Effect { entry, output: None });
//! assert!(structure.parameters().iter().any(|parameter| parameter.name == "bend"));
//! # servobee::Result::Ok(())
//! ```
//!
//! # A cost of your own
//!
//! ```
//! use servobee::evaluate::problem::{Data, Problem};
//! use servobee::evaluate::Loss;
//! use servobee::model::{Real, Structure};
//!
//! /// Huber's loss: beyond twice the noise an error costs no more than its size.
//! struct Huber;
//!
//! impl Loss for Huber {
//!     fn of<R: Real>(error: R, size: R) -> R {
//!         let limit = R::constant(2.0) * size;
//!         let large = error.abs();
//!         let linear = limit * (R::constant(2.0) * large - limit);
//!         (large - limit).if_positive(linear, error * error)
//!     }
//! }
//!
//! let structure = Structure::actuator(10.0, "V");
//! let parameters = structure.parameters();
//! let problem = Problem::new(structure, parameters, Data::Series(Vec::new())).with_loss::<Huber>();
//! ```

// What is hidden in the documentation is there for the commands, the tests and the benches; it may change at any time.
#[doc(hidden)]
pub mod audited;
pub mod card;
pub mod compare;
pub mod diagnose;
mod error;
pub mod evaluate;
pub mod export;
mod input;
pub mod model;
pub mod record;
pub mod report;
#[doc(hidden)]
pub mod scorecard;
pub mod search;
pub mod session;
#[doc(hidden)]
pub mod simulator;

pub use error::{Error, Result};
pub use session::Session;
