//! The valve's actuator: paper eq. 4-6, with the saturation of Simscape's "Proportional and Servo-Valve Actuator".

use super::Real;

/// Gain, lag and saturation in a unity feedback loop:
///
/// ```text
/// ż = K · sat(u − x, ±S)        ẋ = (z − x) / T
/// ```
///
/// `u` is the command, `x` the spool position in the same unit, `z` the integrator's output. The saturation acts on the
/// *error*, before the gain, so `z` slews at `K·S` at most. The DC gain is 1.
#[derive(Debug, Clone)]
pub struct Actuator<R> {
    gain: R,
    time_constant: R,
    rate: R,
    saturation: R,
}

impl<R: Real> Actuator<R> {
    /// `gain` K in 1/s, `time_constant` T in s, `saturation` S in the unit of the command; all positive.
    #[inline(always)]
    pub fn new(gain: R, time_constant: R, saturation: R) -> Self {
        Self {
            gain,
            time_constant,
            rate: (R::constant(1.0) / time_constant).named("rate"),
            saturation,
        }
    }

    /// Loop gain K, 1/s.
    #[inline(always)]
    pub fn gain(&self) -> R {
        self.gain
    }

    /// Lag T, s.
    #[inline(always)]
    pub fn time_constant(&self) -> R {
        self.time_constant
    }

    /// 1/T, 1/s.
    #[inline(always)]
    pub fn rate(&self) -> R {
        self.rate
    }

    /// Saturation S of the error, in the unit of the command.
    #[inline(always)]
    pub fn saturation(&self) -> R {
        self.saturation
    }

    /// `(ż, ẋ)` for the integrator `z`, the spool `x` and the command `u`.
    #[inline(always)]
    pub fn derivative(&self, z: R, x: R, u: R) -> (R, R) {
        let error = (u - x).clamp(-self.saturation, self.saturation);
        (self.gain * error, self.speed(z, x))
    }

    /// `ẋ` alone.
    #[inline(always)]
    pub fn speed(&self, z: R, x: R) -> R {
        (z - x) * self.rate
    }
}

/// Natural frequency ωn = √(K/T) of the unsaturated loop, rad/s (paper eq. 5).
pub fn natural_frequency(gain: f64, time_constant: f64) -> f64 {
    (gain / time_constant).sqrt()
}

/// Damping ratio ξ = ½ √(1/(K T)) of the unsaturated loop (paper eq. 6).
pub fn damping_ratio(gain: f64, time_constant: f64) -> f64 {
    0.5 / (gain * time_constant).sqrt()
}

/// Gain K (1/s) and lag T (s) of the unsaturated loop of this natural frequency (rad/s) and damping ratio.
pub(crate) fn gain_and_lag(natural_frequency: f64, damping_ratio: f64) -> [f64; 2] {
    let twice = 2.0 * damping_ratio;
    [natural_frequency / twice, 1.0 / (twice * natural_frequency)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn saturation_limits_the_slew_to_gain_times_saturation() {
        let actuator = Actuator::new(377.0, 0.002, 0.3);
        assert_eq!(actuator.derivative(0.0, 0.0, 10.0).0, 377.0 * 0.3);
        assert_eq!(actuator.derivative(0.0, 0.0, -10.0).0, -377.0 * 0.3);
        assert_eq!(actuator.derivative(0.0, 0.0, 0.1).0, 377.0 * 0.1);
    }

    #[test]
    fn equilibrium_has_unit_gain() {
        let actuator = Actuator::new(253.7128, 0.0211, 12.4498);
        assert_eq!(actuator.derivative(4.2, 4.2, 4.2), (0.0, 0.0));
    }

    #[test]
    fn the_published_valve_has_the_published_dynamics() {
        assert!((natural_frequency(253.7128, 0.0211) - 109.66).abs() < 0.01);
        assert!((damping_ratio(253.7128, 0.0211) - 0.216).abs() < 0.0005);
        let poles = (
            natural_frequency(253.7128, 0.0211),
            damping_ratio(253.7128, 0.0211),
        );
        let [gain, lag] = gain_and_lag(poles.0, poles.1);
        assert!((gain - 253.7128).abs() < 1e-9 && (lag - 0.0211).abs() < 1e-13);
    }
}
