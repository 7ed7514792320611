//! The valve without any effect.

use super::random::{Stream, random};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The command at full scale, V.
pub const FULL_SCALE: f64 = 10.0;
/// The pressure drop from P to T at which the flow is rated, bar.
pub const RATED_DROP: f64 = 10.0;

/// A servo valve: its spool and its flow are
///
/// ```text
/// z' = K sat(u - x, ±S)        x' = (z - x) / T        Q = Q_rated x / FULL_SCALE
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Valve {
    /// K, 1/s.
    pub gain: f64,
    /// T, s.
    pub time_constant: f64,
    /// S, V.
    pub saturation: f64,
    /// Load flow at full scale and rated drop, L/min.
    pub rated_flow: f64,
}

impl Default for Valve {
    fn default() -> Self {
        Self {
            gain: 200.0,
            time_constant: 0.003,
            saturation: 3.0,
            rated_flow: 60.0,
        }
    }
}

impl Valve {
    /// A plausible valve: K from 100 to 400 1/s, T from 1 to 6 ms, such that the damping ½/√(K T) is from 0.35 to 1.2,
    /// S from 1.5 to 8 V and a rated flow from 20 to 120 L/min.
    pub fn random(seed: u64) -> Self {
        let mut rng = random(seed, Stream::Valve);
        let mut valve = Self {
            gain: between(&mut rng, 100.0, 400.0),
            time_constant: between(&mut rng, 0.001, 0.006),
            saturation: between(&mut rng, 1.5, 8.0),
            rated_flow: between(&mut rng, 20.0, 120.0),
        };
        while !(0.35..=1.2).contains(&valve.damping()) {
            valve.gain = between(&mut rng, 100.0, 400.0);
            valve.time_constant = between(&mut rng, 0.001, 0.006);
        }
        valve
    }

    /// The natural frequency of the unsaturated loop, Hz.
    pub fn frequency(&self) -> f64 {
        (self.gain / self.time_constant).sqrt() / std::f64::consts::TAU
    }

    /// The damping ratio of the unsaturated loop.
    pub fn damping(&self) -> f64 {
        0.5 / (self.gain * self.time_constant).sqrt()
    }
}

/// A number from `low` to `high`, uniform in its logarithm.
fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(rng.random::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn random_valves_differ_and_lie_in_their_ranges() {
        let valves: Vec<Valve> = (0..200).map(Valve::random).collect();
        for valve in &valves {
            assert!((100.0..=400.0).contains(&valve.gain), "{valve:?}");
            assert!((0.001..=0.006).contains(&valve.time_constant), "{valve:?}");
            assert!((0.35..=1.2).contains(&valve.damping()), "{valve:?}");
            assert!((1.5..=8.0).contains(&valve.saturation), "{valve:?}");
            assert!((20.0..=120.0).contains(&valve.rated_flow), "{valve:?}");
        }
        assert_ne!(valves[0], valves[1]);
        assert_eq!(valves[7], Valve::random(7));
    }
}
