//! One run in many processes, which a launcher such as `mpirun` has started.

pub(super) use joined::{bytes, choose, join, leave};

use servobee::Error;

/// By what a launcher says how many processes it has started for one run: Open MPI, MPICH and its like, Slurm's `srun`.
const LAUNCHERS: [&str; 3] = ["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"];

/// Says that processes which a launcher has started share nothing.
const ALONE: &str = "SERVOBEE_ALONE";

/// What a launcher says, and the number of processes, where it has started several that are to share a run: the tasks of a job
/// array share nothing.
fn launched() -> Option<(String, usize)> {
    let is_task = |argument: std::ffi::OsString| {
        let text = argument.to_string_lossy();
        text == "--task" || text.starts_with("--task=")
    };
    if std::env::var(ALONE).is_ok_and(|value| value == "1") || std::env::args_os().any(is_task) {
        return None;
    }
    LAUNCHERS.iter().find_map(|name| {
        let count = std::env::var(name).ok()?.parse().ok()?;
        (count > 1).then(|| (format!("{name}={count}"), count))
    })
}

/// Refuses to be one of several processes that write the same files.
fn apart(said: String, count: usize, problem: &str, remedy: &str) -> Error {
    Error::input(
        said,
        format!("a launcher has started this program {count} times for one run, and {problem}"),
        format!("{remedy}, or set {ALONE}=1 where each process has a call of its own"),
    )
}

#[cfg(feature = "mpi")]
mod joined {
    use super::{LAUNCHERS, apart, launched};
    use servobee::Result;
    use servobee::audited::set_variable;
    use servobee::evaluate::ranks::World;
    use servobee::evaluate::{Chosen, Devices};
    use std::sync::{Mutex, MutexGuard, PoisonError};

    /// The processes of this run; nothing where there is but one.
    static WORLD: Mutex<Option<World>> = Mutex::new(None);

    fn world() -> MutexGuard<'static, Option<World>> {
        WORLD.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Joins the processes that a launcher has started for this run. All but the first serve it and are done when this is true.
    ///
    /// # Errors
    /// They cannot share a run.
    pub(in crate::cli) fn join() -> Result<bool> {
        // Launchers give each process a terminal of its own; what stands behind it is often a file.
        if LAUNCHERS
            .iter()
            .any(|name| std::env::var_os(name).is_some())
        {
            set_variable("NO_COLOR", "1");
        }
        let Some((said, count)) = launched() else {
            return Ok(false);
        };
        let joined = World::join()?;
        if joined.size() == 1 {
            let problem = "MPI connects none of them: it is another MPI than the launcher's";
            return Err(apart(
                said,
                count,
                problem,
                "use the mpirun of the MPI that it was built with",
            ));
        }
        if joined.rank() > 0 {
            joined.serve()?;
            return Ok(true);
        }
        *world() = Some(joined);
        Ok(false)
    }

    /// Ends those that serve this run.
    pub(in crate::cli) fn leave() {
        if let Some(joined) = world().take() {
            joined.end();
        }
    }

    /// Bytes that have gone to the other processes of this run and come from them; `None` where there are none.
    pub(in crate::cli) fn bytes() -> Option<u64> {
        world().as_ref().map(World::bytes)
    }

    /// The evaluator of all processes of this run, each of which chooses among `devices`.
    ///
    /// # Errors
    /// As of [`Devices::choose`].
    pub(in crate::cli) fn choose(devices: &Devices) -> Result<Chosen> {
        match &*world() {
            Some(joined) => joined.open(devices),
            None => devices.choose(0),
        }
    }
}

/// The same of a build that knows of no other process.
#[cfg(not(feature = "mpi"))]
mod joined {
    use super::{apart, launched};
    use servobee::Result;
    use servobee::evaluate::{Chosen, Devices};

    pub(in crate::cli) fn join() -> Result<bool> {
        match launched() {
            None => Ok(false),
            Some((said, count)) => {
                let problem = "this build does not share a run among processes";
                Err(apart(said, count, problem, "build it with --features mpi"))
            }
        }
    }

    pub(in crate::cli) fn leave() {}

    pub(in crate::cli) fn bytes() -> Option<u64> {
        None
    }

    pub(in crate::cli) fn choose(devices: &Devices) -> Result<Chosen> {
        devices.choose(0)
    }
}
