//! A device, and what has gone wrong with it.

use crate::Error;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Why an attempt failed.
pub(super) enum Fault {
    /// The device is gone; another one may serve.
    Lost(String),
    /// There is no memory for so much at once; less may fit.
    Full,
    /// The device has not answered for so long; another attempt would wait as long.
    Hung(Duration),
    /// No other attempt would do better.
    Final(Error),
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::Final(error)
    }
}

/// What an attempt gives.
pub(super) type Attempt<T> = Result<T, Fault>;

/// What has gone wrong first.
#[derive(Clone, Default)]
struct FirstFault(Arc<Mutex<Option<Fault>>>);

impl FirstFault {
    fn note(&self, fault: Fault) {
        let mut first = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(fault);
    }
}

/// A device and its queue.
pub(super) struct Context {
    /// The adapter's name.
    pub(super) name: String,
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    /// Length of a tick of its clock, s; none where it has no timestamp queries.
    pub(super) tick: Option<f64>,
    fault: FirstFault,
}

impl Context {
    /// A device of `adapter`.
    ///
    /// # Errors
    /// If the adapter gives none.
    pub(super) fn open(adapter: &wgpu::Adapter) -> Result<Self, Error> {
        let name = adapter.get_info().name;
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("servobee"),
            required_limits: adapter.limits(),
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            ..Default::default()
        };
        let (device, queue) =
            pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
                Error::failed(
                    format!("adapter \"{name}\" gives no device: {error}"),
                    "update its driver, or use --evaluator cpu",
                )
            })?;
        let fault = FirstFault::default();
        let of_device = fault.clone();
        device.set_device_lost_callback(move |_, message| of_device.note(Fault::Lost(message)));
        let of_calls = fault.clone();
        device.on_uncaptured_error(Arc::new(move |error| {
            of_calls.note(match error {
                wgpu::Error::OutOfMemory { .. } => Fault::Full,
                // What is done with a device that is gone is also an error.
                other => Fault::Lost(other.to_string()),
            });
        }));
        let timed = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
        let tick = timed.then(|| 1e-9 * f64::from(queue.get_timestamp_period()));
        Ok(Self {
            name,
            device,
            queue,
            tick,
            fault,
        })
    }

    /// Has [`Self::check`] find that there is no memory left, as the driver would.
    pub(super) fn run_out_of_memory(&self) {
        self.fault.note(Fault::Full);
    }

    /// # Errors
    /// What has gone wrong since this was asked last.
    pub(super) fn check(&self) -> Attempt<()> {
        let mut fault = self.fault.0.lock().unwrap_or_else(PoisonError::into_inner);
        fault.take().map_or(Ok(()), Err)
    }

    /// Waits until a submission is done.
    ///
    /// # Errors
    /// If the device fails, or has not answered after `timeout`.
    pub(super) fn wait(&self, submission: wgpu::SubmissionIndex, timeout: Duration) -> Attempt<()> {
        let wait = wgpu::PollType::Wait {
            submission_index: Some(submission),
            timeout: Some(timeout),
        };
        // wgpu panics where the driver loses the device under a wait.
        let polled = catch_unwind(AssertUnwindSafe(|| self.device.poll(wait)));
        self.check()?;
        match polled {
            Ok(Ok(_)) => Ok(()),
            Ok(Err(wgpu::PollError::Timeout)) => Err(Fault::Hung(timeout)),
            Ok(Err(error)) => Err(Fault::Lost(error.to_string())),
            Err(_) => Err(Fault::Lost("the driver has lost the device".into())),
        }
    }

    /// The bytes of a buffer that is mapped.
    ///
    /// # Errors
    /// If the device is gone.
    pub(super) fn mapped(&self, buffer: &wgpu::Buffer, size: u64) -> Attempt<wgpu::BufferView> {
        buffer
            .get_mapped_range(..size)
            .map_err(|error| Fault::Lost(error.to_string()))
    }

    /// A read-only storage buffer with `contents`.
    pub(super) fn storage(&self, label: &str, contents: &[u8]) -> wgpu::Buffer {
        let usage = wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST;
        // Written through the queue: to map a buffer that found no memory would panic.
        let buffer = self.buffer(label, (contents.len() as u64).max(4), usage);
        self.queue.write_buffer(&buffer, 0, contents);
        buffer
    }

    /// A buffer of `size` bytes.
    pub(super) fn buffer(&self, label: &str, size: u64, usage: wgpu::BufferUsages) -> wgpu::Buffer {
        self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(label),
            size,
            usage,
            mapped_at_creation: false,
        })
    }
}

/// A driver's message without its line breaks.
pub(super) fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}
