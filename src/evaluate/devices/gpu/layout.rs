//! The shader's structs, field by field, and its bindings; a test holds the offsets of the fields against naga's.

use crate::evaluate::simulation::physics::INPUTS;
use crate::model::Output;
use bytemuck::{Pod, Zeroable};

/// The numbers of the shader's bindings.
pub(super) mod binding {
    pub(crate) const WORK: u32 = 0;
    pub(crate) const CANDIDATES: u32 = 1;
    pub(crate) const CONSTANTS: u32 = 2;
    pub(crate) const SAMPLES: u32 = 3;
    pub(crate) const SERIES: u32 = 4;
    pub(crate) const STATES: u32 = 5;
    pub(crate) const RESULTS: u32 = 6;
    pub(crate) const STATUS: u32 = 7;
    pub(crate) const TONES: u32 = 8;
    pub(crate) const WAVE: u32 = 9;

    /// The storage buffers of `evaluate_series`.
    pub(crate) const OF_SERIES: [u32; 7] = [
        CANDIDATES, CONSTANTS, SAMPLES, SERIES, STATES, RESULTS, STATUS,
    ];
    /// The storage buffers of `evaluate_tones`.
    pub(crate) const OF_TONES: [u32; 6] = [CANDIDATES, CONSTANTS, RESULTS, STATUS, TONES, WAVE];
    /// Those that the shader writes.
    pub(crate) const WRITTEN: [u32; 3] = [STATES, RESULTS, STATUS];
}

/// `Work` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Work {
    /// Candidates in the buffers.
    pub population: u32,
    /// Records or tones.
    pub items: u32,
    /// The candidates of this dispatch: its first.
    pub first: u32,
    /// One past its last.
    pub last: u32,
    /// Its first row.
    pub begin: u32,
    /// One past its last row.
    pub end: u32,
}

/// `Sample` of the shader, with its `Input` and `Measured`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Sample {
    /// Length of the integration steps to the next row, s.
    pub step: f32,
    /// How many of them there are.
    pub substeps: u32,
    /// Pieces into which late commands can cut the interval to the next row.
    pub pieces: u32,
    /// Weight of the row's squared errors.
    pub weight: f32,
    /// What drives the model, in the order of [`INPUTS`].
    pub input: [f32; INPUTS.len()],
    /// What `f32` leaves of the time.
    pub time_rest: f32,
    /// Whether the command jumps with the next row.
    pub jumps: u32,
    /// The measured outputs, in the order of [`Output::ALL`].
    pub measured: [f32; Output::COUNT],
}

/// `Series` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Series {
    /// Where its first row is in the buffer of samples; modulo 2^32, where it would be before a window of later rows.
    pub first: u32,
    /// How many rows it has.
    pub count: u32,
    /// Its first sum among all records' sums of slices.
    pub slot: u32,
}

/// `Tone` of the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Tone {
    /// Amplitude, in the unit of the command.
    pub amplitude: f32,
    /// Length of an integration step, s.
    pub step: f32,
    /// Steps between two correlated samples.
    pub substeps: u32,
    /// Entries of the table of sines for each half step.
    pub stride: u32,
    /// Periods before the correlation begins.
    pub settle: u32,
    /// Periods that are correlated.
    pub measure: u32,
}

// The sizes that the shader's arrays step by.
const _: () = assert!(size_of::<Work>() == 24);
const _: () = assert!(size_of::<Sample>() == 4 * (6 + INPUTS.len() + Output::ALL.len()));
const _: () = assert!(size_of::<Series>() == 12);
const _: () = assert!(size_of::<Tone>() == 24);
