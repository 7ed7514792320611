//! Hydraulic oil: viscosity and density of an ISO VG class at a temperature.

use serde::Deserialize;

/// A mineral oil of an ISO VG class at a temperature.
///
/// ```
/// use servobee::model::Fluid;
///
/// let oil = Fluid { iso_vg: 46.0, temperature: 40.0 };
/// assert!((oil.viscosity() - 46.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fluid {
    /// The class: the kinematic viscosity at 40 °C, cSt (ISO 3448).
    pub iso_vg: f64,
    /// Its temperature, °C.
    #[serde(default = "forty")]
    pub temperature: f64,
}

fn forty() -> f64 {
    REFERENCE
}

/// Temperature at which a class is defined, °C.
const REFERENCE: f64 = 40.0;
/// What is added to a viscosity in cSt before its logarithms are taken, and the slope of the second of them over that of
/// the absolute temperature (Ubbelohde and Walther; ASTM D341): that of mineral oils of viscosity index 100.
const WALTHER: (f64, f64) = (0.7, 3.49);
/// Density of VG 32 at 40 °C, kg/m³, by how much it rises with each doubling of the class, and with each kelvin.
const DENSITY: (f64, f64, f64) = (858.0, 12.0, -0.6);

impl Fluid {
    /// Kinematic viscosity, cSt: `log log(ν + 0.7) = a − 3.49 log T`, with `a` from the class.
    pub fn viscosity(&self) -> f64 {
        let kelvin = |celsius: f64| celsius + 273.15;
        let ratio = kelvin(self.temperature) / kelvin(REFERENCE);
        let logarithm = (self.iso_vg + WALTHER.0).log10() * ratio.powf(-WALTHER.1);
        10f64.powf(logarithm) - WALTHER.0
    }

    /// Density, kg/m³, to within 1 % of common oils.
    pub fn density(&self) -> f64 {
        let (reference, doubling, kelvin) = DENSITY;
        reference + doubling * (self.iso_vg / 32.0).log2() + kelvin * (self.temperature - REFERENCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_oils_have_their_published_values() {
        for (iso_vg, temperature, viscosity, density) in [
            (32.0, 40.0, 31.8, 857.0),
            (32.0, 50.0, 22.0, 851.0),
            (32.0, 60.0, 16.0, 844.0),
            (46.0, 40.0, 45.7, 867.0),
            (46.0, 50.0, 30.3, 862.0),
            (46.0, 60.0, 21.4, 856.0),
        ] {
            let oil = Fluid {
                iso_vg,
                temperature,
            };
            let off = [
                oil.viscosity() / viscosity - 1.0,
                oil.density() / density - 1.0,
            ];
            assert!(
                off[0].abs() < 0.015 && off[1].abs() < 0.007,
                "{oil:?}: {off:?}"
            );
        }
    }
}
