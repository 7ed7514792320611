//! Which evaluator a run uses, and why.

use super::gpu::{self, Checks, GpuEvaluator};
use super::{CpuEvaluator, Evaluator, Precision};
use crate::Result;
use std::str::FromStr;

/// What the user asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Choice {
    /// A hardware GPU if there is one, otherwise the CPU.
    #[default]
    Auto,
    /// The CPU.
    Cpu,
    /// A GPU, also one in software; an error where there is none.
    Gpu,
}

impl FromStr for Choice {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        match text {
            "auto" => Ok(Self::Auto),
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu),
            _ => Err("one of auto, cpu, gpu".into()),
        }
    }
}

/// An evaluator and the reason for it.
pub struct Chosen {
    /// The evaluator.
    pub evaluator: Box<dyn Evaluator>,
    /// Why it and no other, for the user.
    pub why: String,
}

/// The evaluator for `choice`. Both search in f32, which finds the valley; the polish and every figure that is reported
/// are computed in f64.
///
/// # Errors
/// If a GPU is asked for and there is none, or it gives no device.
pub fn choose(choice: Choice) -> Result<Chosen> {
    let cpu = |why: &str| Chosen {
        evaluator: Box::new(CpuEvaluator::new(Precision::F32)),
        why: why.into(),
    };
    if choice == Choice::Cpu {
        return Ok(cpu("asked for"));
    }
    let adapters = gpu::adapters();
    let best = gpu::best(&adapters);
    match (choice, best) {
        (Choice::Gpu, Some(adapter)) => {
            let evaluator = Box::new(GpuEvaluator::new(adapter, Checks::Off)?);
            Ok(Chosen {
                evaluator,
                why: "asked for".into(),
            })
        }
        (Choice::Gpu, None) => Err(gpu::none_found()),
        (_, Some(adapter)) if !gpu::is_software(adapter) => {
            match GpuEvaluator::new(adapter, Checks::Off) {
                Ok(evaluator) => Ok(Chosen {
                    evaluator: Box::new(evaluator),
                    why: "a hardware GPU".into(),
                }),
                Err(error) => Ok(cpu(&format!("the GPU failed: {error}"))),
            }
        }
        (_, Some(_)) => Ok(cpu(
            "the only GPU adapter is software; --evaluator gpu uses it",
        )),
        (_, None) => Ok(cpu("no GPU adapter found")),
    }
}
