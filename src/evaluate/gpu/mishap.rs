//! What tests let go wrong.

/// What can go wrong with a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mishap {
    /// It is lost before a submission.
    Lost,
    /// It has no memory for the buffers of a wave.
    OutOfMemory,
    /// It does not answer when a submission is waited for.
    Hang,
    /// Its driver refuses a shader.
    ShaderRefused,
}

/// The mishap that is to come, if any.
#[derive(Debug, Default)]
pub(super) struct Mishaps {
    planned: Option<Mishap>,
    after: u32,
    occasions: u32,
    times: u32,
}

impl Mishaps {
    /// `mishap` at the occasion for it that follows `after` others, and so on until it has come `times` times.
    pub(super) fn plan(mishap: Mishap, after: u32, times: u32) -> Self {
        Self {
            planned: Some(mishap),
            after,
            occasions: 0,
            times,
        }
    }

    /// Whether `mishap` comes at this occasion for it.
    pub(super) fn strikes(&mut self, mishap: Mishap) -> bool {
        if self.planned != Some(mishap) || self.times == 0 {
            return false;
        }
        self.occasions += 1;
        if self.occasions <= self.after {
            return false;
        }
        self.occasions = 0;
        self.times -= 1;
        true
    }
}
