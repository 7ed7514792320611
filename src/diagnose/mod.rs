//! What the fit left over: how much of it is noise, and whether the rest has structure.
//!
//! 1. *Noise floor*: from repeated commands, rests, or the residual's differences, and no less than the channel resolves; the
//!    report says which, and whether those that there are agree. What is left within the resolution is no sign of an effect.
//!    White noise of a measured command, of at most 0.5 % of its range, or of a pressure, that the valve does not follow is smoothed away; what a
//!    model makes of the rest of it counts as noise, and what that looks like as no sign of an effect.
//! 2. *Is there structure?* The residual is tested against command, its powers, rate and direction, simulated spool, pressures,
//!    time, lines in its spectrum, and its loudness, all against surrogates of the same colour, with one level for the family.
//! 3. *Which effect?* The effects that were asked, those of the catalogue or one's own, are simulated at several values each,
//!    linearised there together with the base model, and the reduction of the cost that this predicts is compared with that of
//!    the best of them on surrogates (wild block bootstrap over the whole family). The plausible ones are refitted with the
//!    base, by bees and polish, and ranked by held-out error. Effects of equal error that the record cannot tell apart are
//!    reported as tied. Then again with the effect added; effects take another form of their cause, which begins where they
//!    ended, and are exchanged and dropped where the others have made them worse or superfluous; pairs are tried where none
//!    helps alone. Where what was refitted leaves much, effects of how the spool moves are fitted to models that are led along
//!    the measurement and then let go, and where that leaves much, all effects are searched for in a wide space. All this seeks
//!    on lively stretches of about 2400 rows; what leads somewhere is polished on all by which effects are chosen.
//! 4. *Grades*: effects are `found` if they bring the held-out error of every channel to its noise and leave nothing structured,
//!    and a part (`partly`) if they explain 80 % of what was above it, each of them 40 % of what those before it have left, or 80 %
//!    of what is left without it, where they do not reach the noise, and the model follows half of each channel's motion. Several
//!    that take a little each are pieces of a curve that is none of theirs. Otherwise the verdict is `none` where the base model
//!    follows every channel nearly to its noise, and `unexplained` where it does not, or where the record cannot tell four causes
//!    from each other; of what is `unexplained` the report describes what is missing by a curve of one signal at one port, under
//!    `free_form`, never under a physical name.
//!    Parameters that the fitted rows do not determine, or less closely than the held-out rows ask for, are set by these, within
//!    what the fitted rows allow, for every model alike.
//! 5. *Not asked*: where no effect was looked for, or not to the end, the verdict is `not_diagnosed`.
//!
//! In the order in which a diagnosis goes: `problem` and `measurements` are what it begins with, `identify` is the procedure,
//! `fitted` a fit with all that follows from it, `run_in` lets the model forget where it began, `clocks` puts records in phase
//! that hum, `quiet_inputs` smooths commands and pressures that were measured with noise, `between_rows` puts jumps between the rows, `hold` tells
//! what the command does between two rows or tries both ways, `evidence` is what models are judged by, `preference` which of two it prefers, `unexcited` sets what the
//! fitted rows leave open, `screen`, `led`, `wide`, `sought` and `attribution` find the effects, `added` is what became of each,
//! `verdict` decides, `free_form` describes what has no name, `signature` shows what gave it away, and `identified` is the
//! result. `statistics` knows none of them.

mod added;
mod attribution;
mod between_rows;
mod clocks;
mod conditions;
mod curved;
mod evidence;
mod fitted;
mod free_form;
mod hold;
mod hums;
mod identified;
mod identify;
mod input_noise;
mod jumps;
mod known;
mod led;
mod left_over;
mod linear;
mod located;
mod measurements;
mod placed_jumps;
mod preference;
mod problem;
mod quiet_inputs;
mod run_in;
mod screen;
mod sensors;
mod settled;
mod signals;
mod signature;
mod simulation;
mod sought;
mod stage;
mod statistics;
mod stepped;
mod unexcited;
mod verdict;
mod wide;

pub use added::{Added, Considered, Contest, Decision, Refit, Rival};
pub(crate) use clocks::seconds_apart;
pub use conditions::Conditions;
pub use fitted::Fitted;
pub use free_form::FoundForm;
pub use hold::{Between, OtherHold};
pub use identified::Identified;
pub use identify::identify;
pub use located::{Located, Place};
pub use measurements::{Cut, Measurements, ROWS, Used};
pub use placed_jumps::PlacedJumps;
pub use problem::{IdentificationProblem, Options};
pub use signature::{Bin, Signature};
pub use simulation::{Compared, Errors, Sides, Trajectories, errors};
pub use statistics::bootstrap::{
    Improvement, Interval, block_length, improvement, resample_indices, surrogate,
};
pub use statistics::compare::{Comparison, indistinguishable};
pub use statistics::density::spectral_density;
pub use statistics::noise::{Noise, NoiseMethod, NoiseRows, OfInputs, Source, Swing, noise_floor};
pub use statistics::residual::{Remaining, Residuals, remaining};
pub use statistics::rows::coloured;
pub use unexcited::{Sharpened, Unexcited};
pub use verdict::Verdict;
