//! Data on the device: records, whole or window by window, and tones.

use super::context::Context;
use super::layout;
use crate::evaluate::problem::identity::DataIdentity;
use crate::evaluate::problem::{Data, Problem, SAMPLES_PER_PERIOD, Sample, Series, Tone, Wave};
use crate::evaluate::simulation::simulate::{CHUNK, SLICE};
use crate::{Error, Result};
use std::ops::Range;
use std::sync::Arc;

/// Bytes of a window of rows at most, where records do not fit into one buffer.
const WINDOW: u64 = 64 << 20;
/// How much data stays on the device for the next call: bytes, and data of how many problems, at most.
const KEPT: (u64, usize) = (256 << 20, 64);

/// Data on the device.
pub(super) enum Resident {
    Series(Records),
    Tones {
        tones: wgpu::Buffer,
        wave: wgpu::Buffer,
    },
}

/// Records on the device.
pub(super) struct Records {
    /// All rows, where they fit into one buffer.
    pub(super) whole: Option<Rows>,
    /// Rows of each record in a window.
    pub(super) window: u32,
    /// Rows of the longest record.
    pub(super) longest: u32,
    /// Integration steps of all records before each chunk of rows, and in all.
    pub(super) steps: Vec<u64>,
}

/// Rows of all records.
pub(super) struct Rows {
    pub(super) samples: wgpu::Buffer,
    pub(super) series: wgpu::Buffer,
}

/// What one candidate writes.
pub(super) struct Written {
    /// Records or tones; each has a status.
    pub(super) items: u32,
    /// Numbers of states that are kept between dispatches.
    pub(super) states: u64,
    /// Numbers of its results.
    pub(super) results: u64,
}

impl Written {
    /// What a candidate of `problem` writes.
    pub(super) fn of(problem: &Problem) -> Self {
        let structure = &problem.structure;
        match &*problem.data {
            Data::Series(all) => {
                let slices = |one: &Series| one.samples.len().div_ceil(SLICE);
                let slices = all.iter().map(slices).sum::<usize>();
                Self {
                    items: all.len() as u32,
                    states: (all.len() * structure.states().len().max(1)) as u64,
                    results: (slices * structure.observed.len()) as u64,
                }
            }
            Data::Tones(tones) => Self {
                items: tones.len() as u32,
                states: 1,
                results: 2 * tones.len() as u64,
            },
        }
    }
}

/// Bytes that `data` takes on a device.
pub(super) fn bytes(data: &Data) -> u64 {
    match data {
        Data::Series(all) => {
            let rows: usize = all.iter().map(|one| one.samples.len()).sum();
            (rows * size_of::<layout::Sample>()) as u64
        }
        // The table of sines is small.
        Data::Tones(_) => 0,
    }
}

impl Resident {
    fn new(context: &Context, data: &Data, largest: u64) -> Result<Self> {
        Ok(match data {
            Data::Series(all) => Self::Series(Records::new(context, all, largest)?),
            Data::Tones(tones) => tones_on(context, tones),
        })
    }

    fn bytes(&self) -> u64 {
        match self {
            Self::Series(records) => records.whole.as_ref().map_or(0, |rows| rows.samples.size()),
            Self::Tones { wave, .. } => wave.size(),
        }
    }
}

impl Records {
    /// # Errors
    /// If not even a chunk of every record fits into one buffer of `largest` bytes.
    fn new(context: &Context, all: &[Series], largest: u64) -> Result<Self> {
        let longest = all.iter().map(|one| one.samples.len()).max().unwrap_or(0);
        let mut steps = vec![0; longest.div_ceil(CHUNK) + 1];
        for one in all {
            for (k, sample) in one.samples.iter().enumerate() {
                steps[k / CHUNK + 1] += u64::from(sample.substeps);
            }
        }
        for chunk in 1..steps.len() {
            steps[chunk] += steps[chunk - 1];
        }
        let bytes = all.iter().map(|one| one.samples.len()).sum::<usize>() as u64
            * size_of::<layout::Sample>() as u64;
        let fits = bytes <= largest;
        let window = if fits {
            longest
        } else {
            // A window ends with the row after its last interval.
            let rows = largest.min(WINDOW) as usize / size_of::<layout::Sample>() / all.len();
            rows.saturating_sub(1) / CHUNK * CHUNK
        };
        if window == 0 {
            return Err(Error::failed(
                format!(
                    "{CHUNK} rows of {} records need more than {largest} bytes",
                    all.len()
                ),
                "use --evaluator cpu",
            ));
        }
        let whole = fits.then(|| {
            let (samples, series) = rows_of(all, 0..longest);
            Rows {
                samples: context.storage("samples", bytemuck::cast_slice(&samples)),
                series: context.storage("series", bytemuck::cast_slice(&series)),
            }
        });
        Ok(Self {
            whole,
            window: window as u32,
            longest: longest as u32,
            steps,
        })
    }
}

/// The rows in `range` of each record and the one after them, and where they are.
pub(super) fn rows_of(
    all: &[Series],
    range: Range<usize>,
) -> (Vec<layout::Sample>, Vec<layout::Series>) {
    let mut samples: Vec<layout::Sample> = Vec::new();
    let mut series = Vec::new();
    let mut slot = 0;
    for one in all {
        let count = one.samples.len();
        let begin = range.start.min(count);
        let end = (range.end + 1).min(count);
        series.push(layout::Series {
            first: (samples.len() as u32).wrapping_sub(begin as u32),
            count: count as u32,
            slot,
        });
        slot += count.div_ceil(SLICE) as u32;
        samples.extend(one.samples[begin..end].iter().map(row));
    }
    (samples, series)
}

fn row(sample: &Sample) -> layout::Sample {
    layout::Sample {
        step: sample.step as f32,
        substeps: sample.substeps,
        pieces: sample.pieces,
        weight: sample.weight as f32,
        input: sample.input.numbers().map(|value| value as f32),
        time_rest: (sample.input.time - f64::from(sample.input.time as f32)) as f32,
        jumps: sample.jumps.into(),
        measured: sample.target.0.map(|value| value as f32),
    }
}

fn tones_on(context: &Context, tones: &[Tone]) -> Resident {
    let wave = Wave::new(tones);
    let table: Vec<[f32; 2]> = wave
        .table
        .iter()
        .map(|pair| pair.map(|value| value as f32))
        .collect();
    let entry = |tone: &Tone| layout::Tone {
        amplitude: tone.amplitude as f32,
        step: (1.0 / (tone.frequency * f64::from(SAMPLES_PER_PERIOD * tone.substeps))) as f32,
        substeps: tone.substeps,
        stride: wave.substeps / tone.substeps,
        settle: tone.settle,
        measure: tone.measure,
    };
    let entries: Vec<layout::Tone> = tones.iter().map(entry).collect();
    Resident::Tones {
        tones: context.storage("tones", bytemuck::cast_slice(&entries)),
        wave: context.storage("wave", bytemuck::cast_slice(&table)),
    }
}

/// The data that are on the device, the last used last.
#[derive(Default)]
pub(super) struct ResidentData {
    known: Vec<(DataIdentity, Arc<Resident>)>,
}

impl ResidentData {
    /// `data` on the device: uploaded now and its bytes added to `uploaded`, unless it is there already.
    ///
    /// # Errors
    /// If it does not fit.
    pub(super) fn upload(
        &mut self,
        context: &Context,
        data: &Arc<Data>,
        largest: u64,
        uploaded: &mut u64,
    ) -> Result<Arc<Resident>> {
        let identity = DataIdentity::of(data);
        let entry = match self.known.iter().position(|(known, _)| *known == identity) {
            Some(at) => self.known.remove(at),
            None => {
                let resident = Resident::new(context, data, largest)?;
                *uploaded += resident.bytes();
                (identity, Arc::new(resident))
            }
        };
        let resident = entry.1.clone();
        self.known.push(entry);
        Ok(resident)
    }

    /// Forgets what nobody can ask for any more, and what was used longest ago where there is too much.
    pub(super) fn trim(&mut self) {
        self.known.retain(|(data, _)| data.is_alive());
        let (most, count) = KEPT;
        let mut bytes = 0;
        let keep = self
            .known
            .iter()
            .rev()
            .take(count)
            .take_while(|(_, resident)| {
                bytes += resident.bytes();
                bytes <= most
            });
        let forgotten = self.known.len() - keep.count();
        self.known.drain(..forgotten);
    }
}
