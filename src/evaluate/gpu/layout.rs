//! The shader's structs, field by field; a test holds their offsets against naga's.

use crate::model::{Input, Output};
use bytemuck::{Pod, Zeroable};

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

/// `Sample` of the shader, with its `Input`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct Sample {
    /// Length of the integration steps to the next row, s.
    pub step: f32,
    /// How many of them there are.
    pub substeps: u32,
    /// Length of the leaps to the next row, s.
    pub leap: f32,
    /// How many of them there are.
    pub leaps: u32,
    /// Pieces into which late commands can cut the interval to the next row.
    pub pieces: u32,
    /// Weight of the row's squared errors.
    pub weight: f32,
    /// Command, supply, tank, A, B, temperature and time.
    pub input: [f32; Input::<f64>::COUNT],
    /// What `f32` leaves of the time.
    pub time_rest: f32,
    /// Measured spool, flow and position.
    pub target: [f32; Output::COUNT],
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
const _: () = assert!(size_of::<Sample>() == 68);
const _: () = assert!(size_of::<Series>() == 12);
const _: () = assert!(size_of::<Tone>() == 24);
