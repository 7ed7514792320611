//! The Bees Algorithm, a search of ask and tell.

mod settings;

use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{Method, Search, Start};
use crate::Result;
use crate::evaluate::{Cost, Population};
use crate::model::Parameter;

pub use settings::{Moves, Neighbourhood, Settings, Variant};

/// A search by the Bees Algorithm.
///
/// Each generation is asked for as one population and told its costs:
///
/// ```
/// use servobee::evaluate::Cost;
/// use servobee::model::Parameter;
/// use servobee::search::{Bees, Search, Settings, Start};
///
/// let parameters = [Parameter::linear("x", "1", -5.0, 4.0, 5.0)];
/// let mut bees = Bees::new(&parameters, Settings::paper(), Start::Uniform, 1)?;
/// while !bees.finished() {
///     let population = bees.ask();
///     let costs: Vec<Cost> = population.iter().map(|x| Cost::finished(x[0] * x[0])).collect();
///     bees.tell(&costs);
/// }
/// assert!(bees.best().1.value < 0.01);
/// # servobee::Result::Ok(())
/// ```
///
/// The random numbers of a generation depend on the seed and the generation alone, so that a search
/// is the same whatever evaluates it.
#[derive(Debug, Clone, PartialEq)]
pub struct Bees {
    parameters: Vec<Parameter>,
    settings: Settings,
    start: Start,
    seed: u64,
    /// The population of scouts, the best first. A site stands for its whole neighbourhood.
    sites: Vec<Site>,
    /// What the last `ask` proposed.
    asked: Option<Population>,
    best: (Vec<f64>, Cost),
    history: Vec<Cost>,
    evaluations: usize,
}

/// A candidate that a scout found and that bees may be recruited for.
#[derive(Debug, Clone, PartialEq)]
struct Site {
    candidate: Vec<f64>,
    cost: Cost,
    /// Size of its neighbourhood as a fraction of a new one's.
    patch: f64,
    /// Generations in a row in which no recruited bee found anything better.
    stagnant: usize,
}

impl Bees {
    /// A search over `parameters`, all of them free.
    ///
    /// # Errors
    /// If [`Settings::check`] or [`Start::check`] refuses.
    pub fn new(
        parameters: &[Parameter],
        settings: Settings,
        start: Start,
        seed: u64,
    ) -> Result<Self> {
        settings.check()?;
        start.check(parameters)?;
        let known = parameters.iter().map(|p| p.nominal()).collect();
        Ok(Self {
            parameters: parameters.to_vec(),
            settings,
            start,
            seed,
            sites: Vec::new(),
            asked: None,
            best: (known, Cost::DIVERGED),
            history: Vec::new(),
            evaluations: 0,
        })
    }

    /// Generations done; the initial scouts are generation 0.
    pub fn generation(&self) -> usize {
        self.history.len().saturating_sub(1)
    }

    /// The bees recruited for the selected sites, best site first, then the scouts.
    fn generate(&self) -> Population {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(self.history.len() as u64);
        let mut population = Population::new(self.parameters.len());

        let mut scouts = self.settings.n - self.selected().len();
        for (rank, site) in self.selected().iter().enumerate() {
            for _ in 0..self.settings.recruits(rank) {
                population.push(&self.recruit(&site.candidate, site.patch, &mut rng));
            }
        }
        let first = self.history.is_empty();
        if first && let Start::From(candidate) | Start::Near(candidate) = &self.start {
            population.push(candidate);
            scouts -= 1;
        }
        for _ in 0..scouts {
            population.push(&match &self.start {
                Start::Near(candidate) if first => self.recruit(candidate, 1.0, &mut rng),
                _ => self.scout(&mut rng),
            });
        }
        population
    }

    fn scout(&self, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let anywhere = |p: &Parameter| p.from_unit(rng.random_range(0.0..=1.0));
        self.parameters.iter().map(anywhere).collect()
    }

    fn recruit(&self, site: &[f64], patch: f64, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let dimension = site.len();
        match self.settings.moves {
            Moves::OneCoordinate => {
                let one = rng.random_range(0..dimension);
                self.wander(site, one..one + 1, patch, rng)
            }
            Moves::Differences if self.selected().len() > 1 && rng.random() => {
                self.follow_difference(site, rng)
            }
            Moves::AllCoordinates | Moves::Differences => {
                self.wander(site, 0..dimension, patch, rng)
            }
        }
    }

    /// A candidate in the site's neighbourhood, away from the site in the `moved` coordinates.
    fn wander(
        &self,
        site: &[f64],
        moved: Range<usize>,
        patch: f64,
        rng: &mut ChaCha8Rng,
    ) -> Vec<f64> {
        let mut bee = site.to_vec();
        for (value, parameter) in bee[moved.clone()].iter_mut().zip(&self.parameters[moved]) {
            let step = patch * rng.random_range(-1.0..=1.0);
            *value = match self.settings.ngh {
                Neighbourhood::Absolute(size) => parameter.clamp(*value + step * size),
                Neighbourhood::Relative(fraction) => {
                    parameter.from_unit(parameter.to_unit(*value) + step * fraction)
                }
            };
        }
        bee
    }

    /// The site moved by half the difference of two selected sites, in some of the coordinates.
    fn follow_difference(&self, site: &[f64], rng: &mut ChaCha8Rng) -> Vec<f64> {
        let sites = self.selected();
        let from = rng.random_range(0..sites.len());
        let to = (from + rng.random_range(1..sites.len())) % sites.len();
        // Many coordinates at once follow a curved valley, few suit parameters that act apart.
        let chance = if rng.random() { 0.9 } else { 0.1 };
        let always = rng.random_range(0..site.len());

        let mut bee = site.to_vec();
        for (index, parameter) in self.parameters.iter().enumerate() {
            if index == always || rng.random_bool(chance) {
                let at = |candidate: &[f64]| parameter.to_unit(candidate[index]);
                let step = at(&sites[to].candidate) - at(&sites[from].candidate);
                bee[index] = parameter.from_unit(at(site) + 0.5 * step);
            }
        }
        bee
    }

    /// The sites that bees are recruited for, the best first.
    fn selected(&self) -> &[Site] {
        &self.sites[..self.sites.len().min(self.settings.m)]
    }
}

impl Search for Bees {
    /// Asking again before telling gives the same generation.
    fn ask(&mut self) -> Population {
        if self.asked.is_none() {
            self.asked = Some(self.generate());
        }
        self.asked.clone().expect("just filled")
    }

    fn tell(&mut self, costs: &[Cost]) {
        let population = self.asked.take().expect("tell follows ask");
        assert_eq!(costs.len(), population.len(), "one cost per candidate");
        let mut bees = population.iter().zip(costs.iter().copied());

        self.sites.truncate(self.settings.m);
        for (rank, site) in self.sites.iter_mut().enumerate() {
            let recruits = bees.by_ref().take(self.settings.recruits(rank));
            site.forage(recruits, self.settings.variant);
        }
        if let Variant::Standard { stlim, .. } = self.settings.variant {
            self.sites.retain(|site| site.stagnant < stlim);
        }
        self.sites.extend(bees.map(|(candidate, cost)| Site {
            candidate: candidate.to_vec(),
            cost,
            patch: 1.0,
            stagnant: 0,
        }));
        self.sites.sort_by_key(|site| site.cost);

        // An abandoned site never holds the only copy of the best candidate: it was the best here
        // before it stagnated.
        if let Some(site) = self.sites.first()
            && site.cost < self.best.1
        {
            self.best = (site.candidate.clone(), site.cost);
        }
        self.history.push(self.best.1);
        self.evaluations += costs.len();
    }

    fn best(&self) -> (&[f64], Cost) {
        (&self.best.0, self.best.1)
    }

    fn history(&self) -> &[Cost] {
        &self.history
    }

    fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Whether all generations of the settings are done. Asking for more is allowed.
    fn finished(&self) -> bool {
        self.history.len() > self.settings.itr
    }
}

impl Method for Settings {
    fn begin(&self, parameters: &[Parameter], start: Start, seed: u64) -> Result<Box<dyn Search>> {
        Ok(Box::new(Bees::new(parameters, *self, start, seed)?))
    }
}

impl Site {
    /// Moves to the best recruited bee where that is better, and otherwise stagnates.
    fn forage<'a>(&mut self, recruits: impl Iterator<Item = (&'a [f64], Cost)>, variant: Variant) {
        let best = recruits.min_by_key(|&(_, cost)| cost);
        match best {
            Some((candidate, cost)) if cost < self.cost => {
                self.candidate.copy_from_slice(candidate);
                self.cost = cost;
                self.stagnant = 0;
            }
            _ => {
                self.stagnant += 1;
                if let Variant::Standard { alpha, .. } = variant {
                    self.patch *= alpha;
                }
            }
        }
    }
}
