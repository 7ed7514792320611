//! How often the diagnosis is right: effects are planted in many records of the [`simulator`](crate::simulator), and every record
//! is diagnosed without being told what is in it.
//!
//! ```text
//! Plan ──> Case ──> strength ──> record ──> diagnosis ──> Outcome ──> Row ──> Ledger ──> rates
//!          what to  until the    Setup      identify      planted             CSV file,
//!          plant    base fails              as the CLI    beside named        resumable
//!                   by so much
//! ```
//!
//! Every case has a name such as `single/hysteresis/3x/2`, from which and the plan's seed all its random numbers
//! follow.

mod case;
mod ledger;
mod outcome;
mod plan;
mod rates;
mod strength;

pub use case::Row;
pub use ledger::Ledger;
pub use outcome::{Outcome, judge};
pub use plan::{Case, Group, Plan, Subject, Variant};
pub use rates::{Band, Rate, Summary, Tally, quantile};

use crate::Result;
use crate::evaluate::Interrupt;
use rayon::ThreadPoolBuilder;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Runs all `cases` on so many threads, and hands each row over as it is done.
///
/// A case has one thread to itself: what one case does in parallel would otherwise be mixed up with another, and count
/// to its time. So the seconds of a row are those of one core. Once `interrupt` comes, what is under way is left.
///
/// # Errors
/// The first one of `done`, or of a thread that cannot be started; what a diagnosis fails with is an outcome.
pub fn run(
    cases: &[Case],
    seed: u64,
    threads: usize,
    interrupt: &Interrupt,
    done: impl FnMut(Row) -> Result<()> + Send,
) -> Result<()> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new((done, Ok(())));
    let work = || {
        let one = ThreadPoolBuilder::new().num_threads(1).build();
        let pool = match one {
            Ok(pool) => pool,
            Err(error) => {
                let error = crate::Error::failed(
                    format!("a thread cannot be started: {error}"),
                    "ask for fewer --threads",
                );
                done.lock().expect("no thread panics").1 = Err(error);
                return;
            }
        };
        while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
            let Some(row) = pool.install(|| case.run(seed, interrupt)) else {
                return;
            };
            let mut state = done.lock().expect("no thread panics");
            if state.1.is_err() {
                return;
            }
            state.1 = (state.0)(row);
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..threads.min(cases.len()) {
            scope.spawn(work);
        }
    });
    done.into_inner().expect("no thread panics").1
}
