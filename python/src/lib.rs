//! What `import servobee` stands on: the library's way from records to pages, its evaluators, and its tools, as functions of
//! plain values. What is pleasant in Python is written there.

mod error;
mod evaluator;
mod running;
mod session;
mod source;
mod tools;

use pyo3::prelude::*;

#[pymodule]
mod _servobee {
    #[pymodule_export]
    use crate::evaluator::Evaluator;
    #[pymodule_export]
    use crate::session::{compare, identify, write};
    #[pymodule_export]
    use crate::tools::{batch, begin_batch, datasheet, effects, export, simulate, synthesize};
}
