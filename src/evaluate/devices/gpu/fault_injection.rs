//! Faults of a device that tests inject.

/// What can go wrong with a device.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InjectedFault {
    /// It is lost before a submission.
    Lost,
    /// It has no memory for the buffers of a batch.
    OutOfMemory,
    /// It does not answer when a submission is waited for.
    Hang,
    /// Its driver refuses a shader.
    ShaderRefused,
}

/// The fault that is to be injected, if any.
#[derive(Debug, Default)]
pub(super) struct FaultInjection {
    planned: Option<InjectedFault>,
    after: u32,
    occasions: u32,
    times: u32,
}

impl FaultInjection {
    /// Injects `fault` when it could occur for the time that follows `after` others, and so on until it has occurred `times`
    /// times.
    pub(super) fn new(fault: InjectedFault, after: u32, times: u32) -> Self {
        Self {
            planned: Some(fault),
            after,
            occasions: 0,
            times,
        }
    }

    /// Whether `fault` occurs now, where it could.
    pub(super) fn occurs(&mut self, fault: InjectedFault) -> bool {
        if self.planned != Some(fault) || self.times == 0 {
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
