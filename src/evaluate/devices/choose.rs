//! Which evaluator a run uses, and why.

use crate::Result;
use crate::evaluate::checking::cross_check::Thoroughness;
use crate::evaluate::checking::guard::{Guarded, Standby};
use crate::evaluate::checkpoint::{Memory, Remembering};
use crate::evaluate::devices::by_size::BySize;
use crate::evaluate::devices::cpu::{CpuEvaluator, Precision};
use crate::evaluate::devices::gpu::{self, Checks, GpuEvaluator};
use crate::evaluate::devices::ranks::{OnThread, Rank, Ranks};
use crate::evaluate::evaluator::Evaluator;
use std::fmt::{self, Display, Formatter};
use std::str::FromStr;

/// One device that the user asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Choice {
    /// The CPU, and for large populations a hardware GPU if there is one.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// A GPU, also one in software; an error where there is none.
    Gpu,
    /// The GPU adapter of this number, in the order of [`gpu::adapters`]; an error where there is none.
    Adapter(usize),
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu),
            _ => text
                .strip_prefix("gpu:")
                .and_then(|number| number.parse().ok())
                .map(Self::Adapter)
                .ok_or_else(|| WORDS.into()),
        }
    }
}

impl Display for Choice {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Auto => f.write_str("auto"),
            Self::Cpu => f.write_str("cpu"),
            Self::Gpu => f.write_str("gpu"),
            Self::Adapter(number) => write!(f, "gpu:{number}"),
        }
    }
}

/// What `--evaluator` may say.
const WORDS: &str = "one of auto, cpu, gpu, gpu:NUMBER, several of them as gpu:0+gpu:1, or gpu:all";

/// All that the user asks for: one device, or several that evaluate at once, each its slice of every population.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Devices {
    /// These.
    Named(Vec<Choice>),
    /// Every GPU of this machine, those in software where there are no others.
    EveryGpu,
}

impl Default for Devices {
    fn default() -> Self {
        Self::Named(vec![Choice::default()])
    }
}

impl FromStr for Devices {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "gpu:all" => Ok(Self::EveryGpu),
            _ => text
                .split('+')
                .map(str::parse)
                .collect::<std::result::Result<_, _>>()
                .map(Self::Named),
        }
    }
}

impl Display for Devices {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::EveryGpu => f.write_str("gpu:all"),
            Self::Named(choices) => {
                let words: Vec<String> = choices.iter().map(Choice::to_string).collect();
                f.write_str(&words.join("+"))
            }
        }
    }
}

impl Devices {
    /// Their evaluator. Of several processes on this machine each says its `place` among them, from 0 on: where nothing names the GPU,
    /// they take one each.
    ///
    /// # Errors
    /// As of [`choose`], of any of them.
    pub fn choose(&self, place: usize) -> Result<Chosen> {
        let every = match self {
            Self::Named(choices) => choices.clone(),
            Self::EveryGpu => every_gpu(),
        };
        let choices = match every[..] {
            [] => return Err(gpu::none_found()),
            [one] => return choose_at(one, place),
            _ => every,
        };
        let open = |choice| {
            let opened = OnThread::open(move || Ok(choose_at(choice, place)?.evaluator));
            Box::new(opened) as Box<dyn Rank>
        };
        let devices = Ranks::new("device", choices.into_iter().map(open).collect())?;
        Ok(Chosen {
            evaluator: Box::new(devices),
            why: "asked for".into(),
        })
    }
}

fn every_gpu() -> Vec<Choice> {
    let adapters = gpu::adapters();
    let has_hardware = adapters.iter().any(|adapter| !gpu::is_software(adapter));
    let numbered = adapters.iter().enumerate();
    let wanted = numbered.filter(|(_, adapter)| !has_hardware || !gpu::is_software(adapter));
    wanted.map(|(number, _)| Choice::Adapter(number)).collect()
}

/// An evaluator and the reason for it.
pub struct Chosen {
    /// The evaluator. Samples of its costs are computed again in f64; one that fails is given up, with a warning, for
    /// what else may compute.
    pub evaluator: Box<dyn Evaluator>,
    /// Why it and no other, for the user.
    pub why: String,
}

impl Chosen {
    /// An evaluator of one's own, called `name` in messages, whose costs are checked as those of a device are; where it fails
    /// the CPU takes over.
    ///
    /// # Errors
    /// As of [`Guarded::new`].
    pub fn own(name: &str, evaluator: impl Evaluator + 'static) -> Result<Self> {
        let own = Standby::new(name, Thoroughness::Device, || Ok(evaluator));
        Ok(Self {
            evaluator: Box::new(Guarded::new(own, on_cpu())?),
            why: "given".into(),
        })
    }

    /// What `run` computes with the evaluator, whose costs `memory` remembers, and what the user has to be told of it. Where
    /// costs turn out to be wrong that it has used, it is run again, with what has been put in the place of what gave them.
    ///
    /// # Errors
    /// As `run`; what the user has to be told of it is then in [`Chosen::warnings`].
    pub fn run<T>(
        &mut self,
        memory: &Memory,
        mut run: impl FnMut(&mut dyn Evaluator) -> Result<T>,
    ) -> Result<(T, Vec<String>)> {
        loop {
            let mut remembering = Remembering::new(self.evaluator.as_mut(), memory.clone());
            let result = run(&mut remembering);
            if !remembering.misled() {
                return Ok((result?, self.warnings(memory)));
            }
        }
    }

    /// What the user has to be told of a run with this `memory` and was not told yet.
    pub fn warnings(&mut self, memory: &Memory) -> Vec<String> {
        let mut warnings = self.evaluator.take_warnings();
        warnings.extend(memory.failure());
        warnings
    }
}

/// The evaluator for `choice`. Both search in f32, which finds the valley; the polish and every figure that is reported
/// are computed in f64. Where a GPU fails another one takes over, and in the end the CPU, unless a GPU is asked for.
///
/// # Errors
/// If a GPU is asked for and there is none, or it gives no device.
pub fn choose(choice: Choice) -> Result<Chosen> {
    choose_at(choice, 0)
}

fn choose_at(choice: Choice, place: usize) -> Result<Chosen> {
    let adapters = match choice {
        Choice::Cpu => Vec::new(),
        Choice::Adapter(number) => {
            let mut adapters = gpu::adapters();
            if number >= adapters.len() {
                return Err(gpu::not_there(number, adapters.len()));
            }
            vec![adapters.swap_remove(number)]
        }
        Choice::Auto | Choice::Gpu => gpu::ranked_for(place, gpu::adapters()),
    };
    let (line, why): (Vec<Standby>, _) = match choice {
        Choice::Gpu | Choice::Adapter(_) => {
            (adapters.iter().take(1).map(on_gpu).collect(), "asked for")
        }
        Choice::Cpu => (on_cpu(), "asked for"),
        Choice::Auto => {
            let hardware = adapters.iter().filter(|adapter| !gpu::is_software(adapter));
            if let Some(best) = hardware.clone().next() {
                let gpus: Vec<Standby> = hardware.map(on_gpu).collect();
                let open = || guarded(gpus.into_iter().chain(on_cpu()).collect());
                let evaluator = BySize::new(guarded(on_cpu())?, name_of(best), Box::new(open));
                return Ok(Chosen {
                    evaluator: Box::new(evaluator),
                    why: "a hardware GPU was found".into(),
                });
            }
            let why = match adapters.is_empty() {
                false => "the only GPU adapter is software; --evaluator gpu uses it",
                true => "no GPU adapter found",
            };
            (on_cpu(), why)
        }
    };
    Ok(Chosen {
        evaluator: guarded(line)?,
        why: why.into(),
    })
}

/// The first of `line` that works, in whose place the others may come.
fn guarded(line: Vec<Standby>) -> Result<Box<dyn Evaluator>> {
    let mut line = line.into_iter();
    let first = line.next().ok_or_else(gpu::none_found)?;
    Ok(Box::new(Guarded::new(first, line)?))
}

fn name_of(adapter: &wgpu::Adapter) -> String {
    format!("the GPU \"{}\"", adapter.get_info().name)
}

fn on_gpu(adapter: &wgpu::Adapter) -> Standby {
    let adapter = adapter.clone();
    Standby::new(name_of(&adapter), Thoroughness::Device, move || {
        GpuEvaluator::new(&adapter, Checks::Off)
    })
}

/// The CPU, and what takes over where its f32 is wrong.
fn on_cpu() -> Vec<Standby> {
    [
        ("the CPU in f32", Precision::F32),
        ("the CPU in f64", Precision::F64),
    ]
    .map(|(name, precision)| {
        Standby::new(name, Thoroughness::Cpu, move || {
            Ok(CpuEvaluator::new(precision))
        })
    })
    .into()
}
