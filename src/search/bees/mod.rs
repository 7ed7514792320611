//! The Bees Algorithm, as ask and tell: it proposes candidates and never sees how they are judged.

mod settings;

use std::ops::Range;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::evaluate::{Cost, Population};
use crate::model::{Parameter, Scale};
use crate::{Error, Result};

pub use settings::{Moves, Neighbourhood, Settings, Variant};

/// Where the initial scouts go.
#[derive(Debug, Clone, PartialEq)]
pub enum Start {
    /// All over the space.
    Uniform,
    /// The first to this candidate, exactly; the others all over the space.
    From(Vec<f64>),
    /// The first to this candidate, exactly; the others into its neighbourhood. With few evaluations
    /// and a good candidate this ends closer than `From`: no site is spent far away.
    Near(Vec<f64>),
}

/// A search under way.
///
/// Each generation is asked for as one population and told its costs:
///
/// ```
/// use servobee::evaluate::Cost;
/// use servobee::model::Parameter;
/// use servobee::search::{Bees, Settings, Start};
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

/// A place that a scout found and that bees may be recruited for.
#[derive(Debug, Clone, PartialEq)]
struct Site {
    candidate: Vec<f64>,
    cost: Cost,
    /// Size of its neighbourhood as a part of a new one's.
    patch: f64,
    /// Generations in a row in which no recruited bee found anything better.
    stagnant: usize,
}

impl Bees {
    /// A search over `parameters`, all of them free.
    pub fn new(
        parameters: &[Parameter],
        settings: Settings,
        start: Start,
        seed: u64,
    ) -> Result<Self> {
        settings.check()?;
        check_space(parameters)?;
        if let Start::From(candidate) | Start::Near(candidate) = &start {
            check_start(parameters, candidate)?;
        }
        let known = parameters.iter().map(|p| p.start).collect();
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

    /// The next generation: the bees recruited for the selected sites, best site first, then the
    /// scouts. Asking again before telling gives the same one.
    pub fn ask(&mut self) -> Population {
        if self.asked.is_none() {
            self.asked = Some(self.generate());
        }
        self.asked.clone().expect("just filled")
    }

    /// Takes the costs of the generation last asked for, in its order.
    ///
    /// # Panics
    /// If no generation was asked for, or it had another number of candidates.
    pub fn tell(&mut self, costs: &[Cost]) {
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

    /// The best candidate so far and its cost. Until one has finished, the parameters' start values
    /// and a diverged cost.
    pub fn best(&self) -> (&[f64], Cost) {
        (&self.best.0, self.best.1)
    }

    /// The best cost after the initial scouts and after each generation.
    pub fn history(&self) -> &[Cost] {
        &self.history
    }

    /// Candidates judged so far.
    pub fn evaluations(&self) -> usize {
        self.evaluations
    }

    /// Generations done; the initial scouts are generation 0.
    pub fn generation(&self) -> usize {
        self.history.len().saturating_sub(1)
    }

    /// Whether all generations of the settings are done. Asking for more is allowed.
    pub fn finished(&self) -> bool {
        self.history.len() > self.settings.itr
    }

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

    /// A place in the site's neighbourhood, away from the site in the `moved` coordinates.
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
                Neighbourhood::Relative(part) => {
                    parameter.from_unit(parameter.to_unit(*value) + step * part)
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

fn check_space(parameters: &[Parameter]) -> Result<()> {
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
    Ok(())
}

fn check_start(parameters: &[Parameter], candidate: &[f64]) -> Result<()> {
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
