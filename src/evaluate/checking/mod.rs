//! Whether a device computes right: samples of its costs against the CPU's in f64, and another device where it does not.

pub(super) mod cross_check;
pub(super) mod guard;
pub(super) mod judgement;
pub(super) mod warnings;
