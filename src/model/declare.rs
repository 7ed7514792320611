//! Parameters are declared where their values are used.

use super::{Complete, Parameter};

/// Where the equations of a base model get the values of their parameters from.
pub trait Declare<R> {
    /// The value of the parameter that `declare` describes.
    fn parameter(&mut self, declare: &dyn Fn() -> Parameter) -> R;
}

/// Lists the parameters that equations declare, each with its nominal value.
#[derive(Debug, Default)]
pub(super) struct Listing(pub(super) Vec<Parameter>);

impl Declare<f64> for Listing {
    fn parameter(&mut self, declare: &dyn Fn() -> Parameter) -> f64 {
        let parameter = declare();
        let value = parameter.nominal();
        self.0.push(parameter);
        value
    }
}

/// Gives equations the values of their parameters, in the order in which they are declared.
#[derive(Debug)]
pub struct Given<'a, R>(std::slice::Iter<'a, R>);

impl<'a, R> Given<'a, R> {
    /// These values, from the first on.
    pub fn new(values: &'a Complete<R>) -> Self {
        Self(values.as_slice().iter())
    }
}

impl<R: Copy> Given<'_, R> {
    /// The next value.
    ///
    /// # Panics
    /// If there is none left.
    #[inline(always)]
    pub fn next_value(&mut self) -> R {
        *self.0.next().expect("as many values as parameters")
    }
}

impl<R: Copy> Declare<R> for Given<'_, R> {
    fn parameter(&mut self, _: &dyn Fn() -> Parameter) -> R {
        self.next_value()
    }
}
