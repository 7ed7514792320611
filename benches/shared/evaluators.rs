//! What the benchmarks evaluate on.

use servobee::evaluate::gpu::{self, Checks, GpuEvaluator};
use servobee::evaluate::{CpuEvaluator, Evaluator, Precision};

/// Every evaluator of this machine with a short name.
pub(crate) fn evaluators() -> Vec<(String, Box<dyn Evaluator>)> {
    let mut list: Vec<(String, Box<dyn Evaluator>)> = vec![
        (
            "CPU f64".into(),
            Box::new(CpuEvaluator::new(Precision::F64)),
        ),
        (
            "CPU f32".into(),
            Box::new(CpuEvaluator::new(Precision::F32)),
        ),
    ];
    for adapter in gpu::adapters() {
        let evaluator =
            GpuEvaluator::new(&adapter, Checks::Off).expect("the adapter gives a device");
        let name = adapter.get_info().name;
        // lavapipe's name goes on with its LLVM and vector width.
        let short = name.split(" (").next().expect("a first part");
        list.push((short.into(), Box::new(evaluator)));
    }
    list
}
