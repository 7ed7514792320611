//! Flow through an orifice: paper eq. 1 with a smooth transition from turbulent to laminar.

use super::Real;
use std::f64::consts::PI;

/// Atmospheric pressure, Pa.
pub const ATMOSPHERE: f64 = 101_325.0;
/// Reynolds number at which the flow turns turbulent.
pub const CRITICAL_REYNOLDS: f64 = 12.0;
/// Pressure ratio at which the flow turns turbulent.
pub const LAMINAR_RATIO: f64 = 0.999;

/// What decides where the flow turns laminar.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Transition {
    /// A pressure ratio: pcr = (p_avg + p_atm) (1 − [`LAMINAR_RATIO`]).
    #[default]
    PressureRatio,
    /// A Reynolds number: pcr = ρ/2 (Re_cr ν / (Cd D_h))², D_h = √(4A/π).
    Reynolds,
}

/// The fluid and the orifice's edge, in SI units.
#[derive(Debug, Clone)]
pub struct Orifice<R> {
    transition: Transition,
    /// Cd √(2/ρ)
    coefficient: R,
    /// ρ/2 (Re_cr ν / Cd)² π/4: pcr · A for [`Transition::Reynolds`].
    critical_force: R,
}

impl<R: Real> Orifice<R> {
    /// `discharge` Cd, `density` ρ in kg/m³, `viscosity` ν in m²/s.
    #[inline(always)]
    pub fn new(transition: Transition, discharge: R, density: R, viscosity: R) -> Self {
        let reynolds = R::constant(CRITICAL_REYNOLDS) * viscosity / discharge;
        Self {
            transition,
            coefficient: (discharge * (R::constant(2.0) / density).sqrt())
                .named("orifice_coefficient"),
            critical_force: (density * reynolds * reynolds * R::constant(PI / 8.0))
                .named("critical_force"),
        }
    }

    /// Flow in m³/s from pressure `from` to pressure `to` (Pa, gauge) through `area` (m²):
    ///
    /// ```text
    /// q = Cd A √(2/ρ) p / (p² + pcr²)^¼
    /// ```
    ///
    /// which is eq. 1 for |p| ≫ pcr and linear in p for |p| ≪ pcr.
    #[inline(always)]
    pub fn flow(&self, area: R, from: R, to: R) -> R {
        let drop = from - to;
        let critical = match self.transition {
            Transition::PressureRatio => {
                let average = (from + to) * R::constant(0.5) + R::constant(ATMOSPHERE);
                average * R::constant(1.0 - LAMINAR_RATIO)
            }
            Transition::Reynolds => self.critical_force / area,
        };
        area * self.coefficient * drop / (drop * drop + critical * critical).sqrt().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn orifice(transition: Transition) -> Orifice<f64> {
        Orifice::new(transition, 0.7, 850.0, 18e-6)
    }

    #[test]
    fn far_from_the_transition_it_is_the_square_root_law() {
        for transition in [Transition::PressureRatio, Transition::Reynolds] {
            let q = orifice(transition).flow(7.598e-4, 5e5, 0.0);
            assert!((q / (0.7 * 7.598e-4 * (2.0 * 5e5 / 850.0f64).sqrt()) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn flow_is_odd_in_the_drop_and_laminar_near_zero() {
        for transition in [Transition::PressureRatio, Transition::Reynolds] {
            let orifice = orifice(transition);
            let (forth, back) = (orifice.flow(1e-4, 2e5, 1e5), orifice.flow(1e-4, 1e5, 2e5));
            assert_eq!(forth, -back);
            let ratio = orifice.flow(1e-8, 2e-3, 0.0) / orifice.flow(1e-8, 1e-3, 0.0);
            assert!((ratio - 2.0).abs() < 1e-6, "{ratio}");
        }
    }

    #[test]
    fn published_area_gives_the_published_flow() {
        let q = orifice(Transition::PressureRatio).flow(7.598e-4, 5e5, 0.0);
        assert!((q * 6e4 - 1095.0).abs() < 0.5);
    }
}
