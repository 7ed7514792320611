//! Long runs: on a thread of their own, without Python's lock, while this one tells their stages and minds Ctrl-C.

use crate::error::raised;
use pyo3::prelude::*;
use servobee::Result;
use servobee::evaluate::Interrupt;
use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

/// How long Ctrl-C may wait to be noticed.
pub(crate) const WAIT: Duration = Duration::from_millis(50);

/// What a run tells its stages, and asks whether to go on.
pub(crate) type Progress<'a> = &'a mut dyn FnMut(&str) -> ControlFlow<()>;

/// What `run` gives; its stages are told to `told`, an exception of which stops it as Ctrl-C does.
pub(crate) fn running<T: Send>(
    py: Python<'_>,
    told: Option<&Bound<'_, PyAny>>,
    run: impl FnOnce(Progress, Interrupt) -> Result<T> + Send,
) -> PyResult<T> {
    let stop = Arc::new(AtomicBool::new(false));
    let (tell, hears) = channel::<String>();
    let done = thread::scope(|scope| {
        let asked = stop.clone();
        let worker = scope.spawn(move || {
            let interrupt = Interrupt::new({
                let asked = asked.clone();
                move || asked.load(Ordering::Relaxed)
            });
            let mut progress = |stage: &str| {
                // Nobody hears it who has gone.
                let _ = tell.send(stage.to_owned());
                match asked.load(Ordering::Relaxed) {
                    true => ControlFlow::Break(()),
                    false => ControlFlow::Continue(()),
                }
            };
            run(&mut progress, interrupt)
        });
        let stopped = listen(py, hears, told, &stop);
        let result = py.detach(|| worker.join());
        let result = result.unwrap_or_else(|panic| resume_unwind(panic));
        match stopped {
            Some(exception) => Err(exception),
            None => Ok(result),
        }
    })?;
    done.map_err(|error| raised(py, error))
}

/// Hears a run to its end. What is raised meanwhile asks it to stop.
fn listen(
    py: Python<'_>,
    mut hears: Receiver<String>,
    told: Option<&Bound<'_, PyAny>>,
    stop: &AtomicBool,
) -> Option<PyErr> {
    let mut stopped = None;
    loop {
        let (receiver, heard) = py.detach(move || {
            let heard = hears.recv_timeout(WAIT);
            (hears, heard)
        });
        hears = receiver;
        let minded = match (heard, told) {
            (Err(RecvTimeoutError::Disconnected), _) => return stopped,
            (Ok(stage), Some(told)) if stopped.is_none() => told.call1((stage,)).map(|_| ()),
            _ => Ok(()),
        };
        if let Err(exception) = minded.and_then(|()| py.check_signals()) {
            stop.store(true, Ordering::Relaxed);
            stopped.get_or_insert(exception);
        }
    }
}
