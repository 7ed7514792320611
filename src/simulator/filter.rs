//! Linear filters, exact or nearly so for an input that is straight within a step.

use super::planted::Form;

/// A first-order lag τ y' = u − y.
#[derive(Debug, Clone)]
pub(super) struct Lag {
    time_constant: f64,
    input: f64,
    /// The output.
    pub(super) value: f64,
}

impl Lag {
    /// A lag of `time_constant` s > 0, in equilibrium with zero.
    pub(super) fn new(time_constant: f64) -> Self {
        Self {
            time_constant,
            input: 0.0,
            value: 0.0,
        }
    }

    /// Those of the form `form`, one behind the other, which together are `whole` s late.
    pub(super) fn in_a_row(form: Form, whole: f64) -> Vec<Self> {
        match form {
            Form::SecondOrder => vec![Self::new(whole / 2.0), Self::new(whole / 2.0)],
            _ => vec![Self::new(whole)],
        }
    }

    /// Puts it in equilibrium with `input`.
    pub(super) fn rest(&mut self, input: f64) {
        (self.input, self.value) = (input, input);
    }

    /// Lets the input jump to `input`, which the output follows from then on.
    pub(super) fn jump(&mut self, input: f64) {
        self.input = input;
    }

    /// Moves on by `h` s, in which the input goes straight to `input`: exact.
    pub(super) fn advance(&mut self, input: f64, h: f64) -> f64 {
        let behind = (input - self.input) / h * self.time_constant;
        let decay = (-h / self.time_constant).exp();
        self.value = input - behind + decay * (self.value - self.input + behind);
        self.input = input;
        self.value
    }
}

/// A pole pair y'' = ω²(u − y) − 2ζω y'.
#[derive(Debug, Clone)]
pub(super) struct PolePair {
    frequency: f64,
    damping: f64,
    input: f64,
    rate: f64,
    /// The output.
    pub(super) value: f64,
}

impl PolePair {
    /// A pole pair of natural `frequency` in Hz, in equilibrium with zero.
    pub(super) fn new(frequency: f64, damping: f64) -> Self {
        Self {
            frequency: std::f64::consts::TAU * frequency,
            damping,
            input: 0.0,
            rate: 0.0,
            value: 0.0,
        }
    }

    /// Puts it in equilibrium with `input`.
    pub(super) fn rest(&mut self, input: f64) {
        (self.input, self.value, self.rate) = (input, input, 0.0);
    }

    /// Moves on by `h` s, in which the input goes straight to `input`.
    pub(super) fn advance(&mut self, input: f64, h: f64) -> f64 {
        let (start, omega, damping) = (self.input, self.frequency, self.damping);
        [self.value, self.rate] = runge_kutta([self.value, self.rate], h, |[y, rate], share| {
            let u = start + share * (input - start);
            [rate, omega * (omega * (u - y) - 2.0 * damping * rate)]
        });
        self.input = input;
        self.value
    }
}

/// One classical Runge-Kutta step of `h`; `slope` gets the state and the share of the step that has passed.
pub(super) fn runge_kutta<const N: usize>(
    state: [f64; N],
    h: f64,
    slope: impl Fn([f64; N], f64) -> [f64; N],
) -> [f64; N] {
    let moved = |by: f64, k: [f64; N]| std::array::from_fn(|i| state[i] + by * k[i]);
    let a = slope(state, 0.0);
    let b = slope(moved(h / 2.0, a), 0.5);
    let c = slope(moved(h / 2.0, b), 0.5);
    let d = slope(moved(h, c), 1.0);
    std::array::from_fn(|i| state[i] + h / 6.0 * (a[i] + 2.0 * b[i] + 2.0 * c[i] + d[i]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lag_follows_a_step_and_a_ramp_as_the_exponential_says() {
        let mut lag = Lag::new(0.02);
        lag.rest(0.0);
        lag.jump(1.0);
        for _ in 0..1000 {
            lag.advance(1.0, 2e-5);
        }
        assert!((lag.value - (1.0 - (-1f64).exp())).abs() < 1e-12);
        let mut lag = Lag::new(0.02);
        for k in 1..=500 {
            lag.advance(f64::from(k) * 1e-3, 1e-3);
        }
        assert!((lag.value - 0.48).abs() < 1e-11, "{}", lag.value);
    }

    #[test]
    fn a_pole_pair_rings_at_its_damped_frequency() {
        let (frequency, damping) = (120.0, 0.1);
        let mut pair = PolePair::new(frequency, damping);
        pair.input = 1.0;
        let omega = std::f64::consts::TAU * frequency;
        let damped = omega * (1.0f64 - damping * damping).sqrt();
        for k in 1..=2000 {
            let y = pair.advance(1.0, 2e-5);
            let t = f64::from(k) * 2e-5;
            let ring = (damped * t).cos() + damping * omega / damped * (damped * t).sin();
            let exact = 1.0 - (-damping * omega * t).exp() * ring;
            assert!((y - exact).abs() < 1e-8, "{y} {exact}");
        }
    }
}
