//! C, in `double`.

use super::Language;

/// C, in `double`.
#[derive(Debug)]
pub struct C;

impl Language for C {
    /// The shortest decimal that gives back the same number.
    fn literal(value: f64) -> String {
        if value.is_sign_negative() {
            format!("({value:?})")
        } else {
            format!("{value:?}")
        }
    }

    fn choice(value: &str, yes: &str, no: &str) -> String {
        format!("({value} > 0.0 ? {yes} : {no})")
    }
}
