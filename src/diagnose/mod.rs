//! What the fit left over: how much of it is noise, and whether the rest has structure.
//!
//! 1. *Noise floor*: from repeated commands, rests, or the residual's differences; the report says which.
//! 2. *Is there structure?* The residual is tested against command, its powers, rate and direction, simulated spool, pressures,
//!    time, lines in its spectrum, and its loudness, all against surrogates of the same colour, with one level for the family.
//! 3. *Which effect?* The effects that were asked, those of the catalogue or one's own, are simulated at several values each,
//!    linearised there together with the base model, and compared with what the best of them would promise by chance (wild
//!    block bootstrap over the whole family). The plausible ones are refitted with the base, by bees and polish, and ranked by
//!    held-out error. Effects of equal error that the record cannot tell apart are reported as tied. Then again with the effect
//!    added; effects are exchanged and dropped where the others have made them worse or superfluous; pairs are tried where none
//!    helps alone.
//! 4. *No name*: effects are believed if they leave nothing that can be seen, or explain at least 80 % of what was above the
//!    noise. Otherwise the verdict is `unexplained`, and the report describes what is missing by a curve of one signal at one
//!    port, under `free_form`, never under a physical name.
//! 5. *Not asked*: where no effect was looked for, or not to the end, the verdict is `not_diagnosed`.

mod attribution;
mod bootstrap;
mod compare;
mod density;
mod evidence;
mod free_form;
mod hold;
mod identify;
mod line;
mod linear;
mod measurements;
mod noise;
mod question;
mod residual;
mod score;
mod screen;
mod signals;
mod signature;
#[cfg(test)]
mod simulated;
mod stage;
mod unexcited;
mod verdict;

pub use attribution::{Added, Considered, Contest, Decision, Refit, Rival};
pub use bootstrap::{
    Improvement, Interval, block_length, improvement, resample_indices, surrogate,
};
pub use compare::{Comparison, indistinguishable};
pub use density::spectral_density;
pub use free_form::FoundForm;
pub use hold::{Between, OtherHold};
pub use identify::{Fitted, Identified, Options, Sides, identify};
pub use measurements::{Cut, Measurements, ROWS, Used};
pub use noise::{Noise, noise_floor};
pub use question::Question;
pub use residual::{Remaining, Residuals, coloured, remaining};
pub use score::{Compared, errors};
pub use signature::{Bin, Signature, signatures};
pub use unexcited::Unexcited;
pub use verdict::Verdict;
