//! Where the time of a call went.

/// Where the time of a call went, s.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Timings {
    /// Composing and compiling shaders that were not known.
    pub compile: f64,
    /// Bringing data and candidates to the device, as far as the host does it.
    pub upload: f64,
    /// Bytes of records and tones that were not on the device.
    pub uploaded: u64,
    /// The submissions that integrate.
    pub kernel: f64,
    /// Whether the device's own clock timed these; otherwise the host's did.
    pub on_device: bool,
    /// How many they were.
    pub submissions: u32,
    /// The longest of them.
    pub longest: f64,
    /// From their end until the costs were there.
    pub readback: f64,
}
