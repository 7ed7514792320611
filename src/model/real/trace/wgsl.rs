//! WGSL, in `f32`.

use super::Language;

/// WGSL, in `f32`.
#[derive(Debug)]
pub struct Wgsl;

impl Language for Wgsl {
    /// The shortest decimal that gives back the same `f32`; a negative one in parentheses, since `a--b` is no WGSL.
    fn literal(value: f64) -> String {
        let value = value as f32;
        if value < 0.0 {
            format!("({value:?}f)")
        } else {
            format!("{value:?}f")
        }
    }

    fn choice(value: &str, yes: &str, no: &str) -> String {
        format!("select({no}, {yes}, {value} > 0.0)")
    }
}
