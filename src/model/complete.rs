//! The values of all parameters of a structure, told apart from a candidate's.

use super::Parameter;

/// A value for every parameter of a structure, free and fixed, in the order of [`Structure::parameters`]: what equations are
/// computed with. A search's candidate, a slice, has values for the free ones alone.
///
/// [`Structure::parameters`]: super::Structure::parameters
#[derive(Debug, Clone, PartialEq)]
pub struct Complete<R>(Vec<R>);

impl<R> FromIterator<R> for Complete<R> {
    /// One value for every parameter.
    fn from_iter<I: IntoIterator<Item = R>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

impl<R> Complete<R> {
    /// The values of `candidate` for the free parameters, and the known ones of the fixed. `constant` makes a number from a
    /// known value.
    ///
    /// # Panics
    /// If the candidate has no value for a free parameter.
    pub fn with(
        parameters: &[Parameter],
        candidate: &[R],
        mut constant: impl FnMut(f64) -> R,
    ) -> Self
    where
        R: Copy,
    {
        let mut free = candidate.iter();
        let mut next = || {
            *free
                .next()
                .expect("a candidate has a value for every free parameter")
        };
        let value = |parameter: &Parameter| match parameter.is_fixed() {
            true => constant(parameter.nominal()),
            false => next(),
        };
        parameters.iter().map(value).collect()
    }

    /// The values, in the order of the parameters.
    pub fn as_slice(&self) -> &[R] {
        &self.0
    }
}

impl Complete<f64> {
    /// The values before any fit.
    pub fn nominal(parameters: &[Parameter]) -> Self {
        parameters.iter().map(Parameter::nominal).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values_stand_between_those_of_a_candidate() {
        let parameter = |start| Parameter::linear("any", "1", 0.0, start, 9.0);
        let parameters = [parameter(1.0), parameter(2.0).fixed(), parameter(3.0)];
        let nominal = Complete::nominal(&parameters);
        assert_eq!(nominal.as_slice(), [1.0, 2.0, 3.0]);
        let complete = Complete::with(&parameters, &[7.0f32, 8.0], |known| known as f32);
        assert_eq!(complete.as_slice(), [7.0, 2.0, 8.0]);
    }
}
