//! How long work will take, from how long work has taken.

/// Seconds that one integration step is taken to last before any has been measured: a slow CPU's.
const UNKNOWN: f64 = 1e-7;

/// How fast one shader ran when it was last measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pace {
    /// Simulations side by side.
    width: f64,
    /// Seconds an integration step, of all simulations together.
    per_step: f64,
}

impl Default for Pace {
    fn default() -> Self {
        Self {
            width: 1.0,
            per_step: UNKNOWN,
        }
    }
}

impl Pace {
    /// Longest that `steps` integration steps in `width` simulations side by side may take, s. Fewer simulations take
    /// as long as those that were measured where these did not fill the device; more take longer in proportion where
    /// they did.
    pub(super) fn seconds(&self, steps: f64, width: f64) -> f64 {
        steps * self.per_step * (self.width / width).max(1.0)
    }

    /// What `steps` integration steps in `width` simulations side by side show that took `seconds`.
    pub(super) fn measured(width: f64, steps: f64, seconds: f64) -> Self {
        Self {
            width,
            per_step: seconds / steps,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_never_hopes_for_more_than_was_measured() {
        let pace = Pace::measured(1000.0, 1e8, 1.0);
        assert!((pace.seconds(1e8, 1000.0) - 1.0).abs() < 1e-12);
        assert!((pace.seconds(1e8, 2000.0) - 1.0).abs() < 1e-12);
        // A tenth of them with as many steps each: no faster.
        assert!((pace.seconds(1e7, 100.0) - 1.0).abs() < 1e-12);
    }
}
