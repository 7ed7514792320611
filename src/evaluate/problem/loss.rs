//! What an error costs, where that is not its square.

use crate::model::real::reading::{Readings, for_number, reading};
use crate::model::{Outputs, Real};

/// What an error costs, for every kind of number: see [`Problem::with_loss`](crate::evaluate::Problem::with_loss).
pub trait Loss: 'static {
    /// The cost of an `error`, measured less simulated, in an output whose noise has this `size`, both in the output's
    /// unit. In the square of that unit; zero where the error is zero and nowhere below it. Intervals mean something as far
    /// as it is the square of a small error.
    fn of<R: Real>(error: R, size: R) -> R;
}

/// A loss as a function of one kind of number, and the size of each output's noise.
pub type SizedLoss<R> = (fn(R, R) -> R, Outputs<f64>);

/// A [`Loss`] that a problem has: see [`Problem::with_loss`](crate::evaluate::Problem::with_loss).
#[derive(Debug, Clone, Copy)]
pub struct OwnLoss {
    readings: Readings,
    name: fn() -> &'static str,
}

impl OwnLoss {
    /// `L`, for every kind of number.
    pub fn of<L: Loss>() -> Self {
        Self {
            readings: |number| for_number!(number, R => L::of::<R> as fn(R, R) -> R),
            name: std::any::type_name::<L>,
        }
    }

    /// What the code calls it, to tell it from others.
    pub fn name(self) -> &'static str {
        (self.name)()
    }

    /// The loss as a function of this kind of number.
    pub(in crate::evaluate) fn function<R: Real>(self) -> fn(R, R) -> R {
        reading::<R, _>(self.readings)
    }
}
