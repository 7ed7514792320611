//! How the Bees Algorithm is set up.

use crate::{Error, Result};

/// The largest generation that [`Settings::check`] lets through.
const MOST_CANDIDATES: usize = 1 << 24;

/// How a Bees Algorithm search is set up. The short names are the literature's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Generations after the initial scouts.
    pub itr: usize,
    /// Scout bees: the size of the population that sites are selected from.
    pub n: usize,
    /// Sites selected for neighbourhood search, the best of the population.
    pub m: usize,
    /// Elite sites, the best of the selected ones.
    pub e: usize,
    /// Bees recruited for each elite site.
    pub nep: usize,
    /// Bees recruited for each of the other selected sites.
    pub nsp: usize,
    /// Half the width of a new site's neighbourhood.
    pub ngh: Neighbourhood,
    /// Which coordinates a recruited bee moves along.
    pub moves: Moves,
    /// What happens to a neighbourhood in which no recruited bee finds anything better.
    pub variant: Variant,
}

/// A neighbourhood's half-width: recruits land up to this far from their site in each coordinate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Neighbourhood {
    /// In the unit of each parameter.
    Absolute(f64),
    /// As a fraction of each parameter's range, in ratios where its scale is logarithmic.
    Relative(f64),
}

/// Which coordinates of its site a recruited bee changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moves {
    /// One, drawn anew for each bee.
    OneCoordinate,
    /// All at once, as in both papers of [`Variant`].
    AllCoordinates,
    /// Half of the bees move along all coordinates. The other half follow half the difference of two
    /// selected sites, as the trial vectors of Differential Evolution do (Storn & Price 1997), and so
    /// learn the direction of narrow valleys from the other sites.
    Differences,
}

/// The published forms of the algorithm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Variant {
    /// Pham et al. 2006, "The Bees Algorithm, a novel tool for complex optimisation problems":
    /// neighbourhoods keep their size and sites are given up only for better ones.
    Basic,
    /// Pham & Castellani 2009, "The Bees Algorithm: modelling foraging behaviour to solve
    /// continuous optimization problems": a neighbourhood shrinks when its recruits find nothing
    /// better, and a site is abandoned when that happens too often in a row.
    Standard {
        /// Factor by which a neighbourhood shrinks.
        alpha: f64,
        /// Stagnant generations in a row after which a site is abandoned.
        stlim: usize,
    },
}

impl Settings {
    /// Table 1 of the paper that servobee follows: 2755 evaluations.
    pub const fn paper() -> Self {
        Self {
            itr: 20,
            n: 15,
            m: 8,
            e: 5,
            nep: 20,
            nsp: 10,
            ngh: Neighbourhood::Relative(0.01),
            moves: Moves::AllCoordinates,
            variant: Variant::Basic,
        }
    }

    /// Small generations, for tens of thousands of evaluations one after another.
    pub const fn standard() -> Self {
        Self {
            itr: 500,
            n: 20,
            m: 10,
            e: 3,
            nep: 20,
            nsp: 5,
            ngh: Neighbourhood::Relative(0.1),
            moves: Moves::Differences,
            variant: Variant::Standard {
                alpha: 0.8,
                stlim: 20,
            },
        }
    }

    /// Thousands of candidates a generation, to fill a GPU.
    pub const fn large() -> Self {
        Self {
            itr: 100,
            n: 128,
            m: 32,
            e: 8,
            nep: 256,
            nsp: 64,
            ..Self::standard()
        }
    }

    /// Few bees around a start: a search that need only find the valley which a polish then follows.
    pub const fn local() -> Self {
        Self {
            itr: 5,
            n: 10,
            m: 5,
            e: 2,
            nep: 12,
            nsp: 5,
            ngh: Neighbourhood::Relative(0.05),
            moves: Moves::Differences,
            variant: Variant::Standard {
                alpha: 0.8,
                stlim: 10,
            },
        }
    }

    /// For many small searches at once, each over a space of few dimensions that a polish then follows up.
    pub const fn scattered() -> Self {
        Self {
            itr: 5,
            n: 48,
            m: 6,
            e: 2,
            nep: 10,
            nsp: 5,
            ngh: Neighbourhood::Relative(0.1),
            moves: Moves::Differences,
            variant: Variant::Standard {
                alpha: 0.8,
                stlim: 10,
            },
        }
    }

    /// Candidates of a generation after the initial scouts.
    pub const fn per_generation(&self) -> usize {
        self.e * self.nep + (self.m - self.e) * self.nsp + (self.n - self.m)
    }

    /// Bees recruited for the selected site of this rank.
    pub(super) fn recruits(&self, rank: usize) -> usize {
        if rank < self.e { self.nep } else { self.nsp }
    }

    /// Says what is wrong with the settings, if anything.
    pub fn check(&self) -> Result<()> {
        let counts = [
            ("itr", self.itr),
            ("n", self.n),
            ("m", self.m),
            ("e", self.e),
            ("nep", self.nep),
            ("nsp", self.nsp),
        ];
        for (name, count) in counts {
            if count == 0 {
                return refuse(name, "is 0", "give at least 1");
            }
            if count > MOST_CANDIDATES {
                return refuse(
                    name,
                    format!("{count} is too many"),
                    format!("give at most {MOST_CANDIDATES}"),
                );
            }
        }
        if self.m > self.n {
            let problem = format!("{} sites of {} scouts", self.m, self.n);
            return refuse("m", problem, "select at most n sites");
        }
        if self.e > self.m {
            let problem = format!("{} elite sites of {} selected", self.e, self.m);
            return refuse("e", problem, "make at most m sites elite");
        }
        if self.per_generation() > MOST_CANDIDATES {
            let problem = format!("a generation of {} candidates", self.per_generation());
            return refuse("nep", problem, format!("stay below {MOST_CANDIDATES}"));
        }
        match self.ngh {
            Neighbourhood::Absolute(size) if !(size.is_finite() && size > 0.0) => {
                return refuse("ngh", format!("{size} is no size"), "give a positive one");
            }
            Neighbourhood::Relative(fraction) if !(fraction > 0.0 && fraction <= 1.0) => {
                let problem = format!("{fraction} is no fraction of a range");
                return refuse("ngh", problem, "give more than 0 and at most 1");
            }
            _ => {}
        }
        if let Variant::Standard { alpha, stlim } = self.variant {
            if !(alpha > 0.0 && alpha < 1.0) {
                let problem = format!("{alpha} shrinks nothing");
                return refuse("alpha", problem, "give more than 0 and less than 1");
            }
            if stlim == 0 {
                return refuse("stlim", "is 0", "give at least 1");
            }
        }
        Ok(())
    }
}

fn refuse(
    name: &str,
    problem: impl std::fmt::Display,
    remedy: impl std::fmt::Display,
) -> Result<()> {
    Err(Error::input(
        format!("Bees setting {name}"),
        problem,
        remedy,
    ))
}
