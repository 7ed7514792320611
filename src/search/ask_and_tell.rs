//! What every search is: asked for candidates and told their costs, it never sees how they are judged.

use crate::evaluate::{Cost, Population};
use crate::model::{Parameter, Scale};
use crate::{Error, Result};

/// A search under way. It is asked for a population and told the costs, in turn, until it is finished.
pub trait Search: Send {
    /// The next population, every candidate inside the bounds.
    fn ask(&mut self) -> Population;

    /// Takes the costs of the population last asked for, in its order.
    ///
    /// # Panics
    /// If no population was asked for, or it had another number of candidates.
    fn tell(&mut self, costs: &[Cost]);

    /// The best candidate so far and its cost. Until one has finished, the parameters' start values and a diverged cost.
    fn best(&self) -> (&[f64], Cost);

    /// The best cost after each population.
    fn history(&self) -> &[Cost];

    /// Candidates judged so far.
    fn evaluations(&self) -> usize;

    /// Whether it has come to its end.
    fn finished(&self) -> bool;
}

/// A method of searching, with its settings.
pub trait Method: std::fmt::Debug + Send + Sync {
    /// Begins a search over `parameters`, all of them free. The same seed gives the same search.
    ///
    /// # Errors
    /// If the settings make no sense, or [`Start::check`] refuses the parameters.
    fn begin(&self, parameters: &[Parameter], start: Start, seed: u64) -> Result<Box<dyn Search>>;
}

/// Where the first candidates go.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// All over the space.
    Uniform,
    /// The first to this candidate, exactly; the others all over the space.
    From(Vec<f64>),
    /// The first to this candidate, exactly; the others into its neighbourhood. With few evaluations
    /// and a good candidate this ends closer than `From`: nothing is spent far away.
    Near(Vec<f64>),
}

impl Start {
    /// Refuses parameters that span no space, and a candidate outside of it.
    ///
    /// # Errors
    /// If there is no parameter, bounds are no range, or the candidate is not within them.
    pub fn check(&self, parameters: &[Parameter]) -> Result<()> {
        if parameters.is_empty() {
            return Err(Error::input(
                "parameters",
                "none is free",
                "leave at least one free to search",
            ));
        }
        for parameter in parameters {
            let (low, high) = (parameter.low, parameter.high);
            let width = high - low;
            let positive = parameter.scale == Scale::Linear || low > 0.0;
            if !(width.is_finite() && width > 0.0 && positive) {
                return Err(Error::input(
                    format!("parameter {}", parameter.name),
                    format!("bounds {low} to {high} are no range"),
                    "give finite bounds, the lower one first, both positive on a logarithmic scale",
                ));
            }
        }
        let (Self::From(candidate) | Self::Near(candidate)) = self else {
            return Ok(());
        };
        if candidate.len() != parameters.len() {
            return Err(Error::input(
                "start",
                format!(
                    "{} values for {} parameters",
                    candidate.len(),
                    parameters.len()
                ),
                "give one value for each free parameter",
            ));
        }
        for (parameter, &value) in parameters.iter().zip(candidate) {
            if !(parameter.low..=parameter.high).contains(&value) {
                return Err(Error::input(
                    format!("start of {}", parameter.name),
                    format!("{value} is outside {} to {}", parameter.low, parameter.high),
                    "start inside the bounds, or widen them",
                ));
            }
        }
        Ok(())
    }
}
