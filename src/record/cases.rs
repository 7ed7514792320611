//! Published reference cases: curves as files, beside this module, in the form a user's files have, and constants.

use super::{AreaCurve, FlowCurve, ResponseCurve, StepCurve};
use crate::Result;

/// The published result for the response of the D675 valve: K in 1/s, T in s and S in input units.
///
/// The input's scale is not published: full scale may be 10 or 100, and the phase depends on which.
pub const D675_ACTUATOR: [f64; 3] = [253.7128, 0.0211, 12.4498];

/// The amplitude of the D675 valve's published phase, in % of full scale.
pub const D675_AMPLITUDE: f64 = 90.0;

/// The flow coefficient behind [`d675_flow`].
pub const D675_FLOW_COEFFICIENT: f64 = 0.7;

/// The oil's density behind [`d675_flow`], in kg/m^3.
pub const D675_DENSITY: f64 = 850.0;

/// The pressure drop over each land behind [`d675_flow`], in bar.
pub const D675_LAND_PRESSURE: f64 = 5.0;

/// Where the search for the KBFDG5V valve's areas starts, in cm2: one at each opening of [`kbfdg5v_flow`].
pub const KBFDG5V_AREA_START: [f64; 11] = [0.0, 0.5, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0];

/// The area of the closed KBFDG5V valve, in m^2.
pub const KBFDG5V_AREA_LEAK: f64 = 1e-9;

/// The full scale of [`step`], in V.
pub const STEP_FULL_SCALE: f64 = 10.0;

/// Where the search for the step starts: K in 1/s, T in s and S in V.
pub const STEP_START: [f64; 3] = [200.0, 0.01, 5.0];

/// The lower bounds of the search for the step: K in 1/s, T in s and S in V.
pub const STEP_MINIMA: [f64; 3] = [25.0, 0.001, 0.5];

/// The published areas of the D675 valve, over openings that are assumed to be uniform.
pub fn d675_areas() -> AreaCurve {
    built_in(AreaCurve::parse(
        "d675_areas.csv",
        include_str!("cases/d675_areas.csv"),
    ))
}

/// The flow of the D675 valve that follows from [`d675_areas`].
pub fn d675_flow() -> FlowCurve {
    built_in(FlowCurve::parse(
        "d675_flow.csv",
        include_str!("cases/d675_flow.csv"),
    ))
}

/// The flow of the KBFDG5V-10 valve, digitised, with the weights of its published identification.
pub fn kbfdg5v_flow() -> FlowCurve {
    built_in(FlowCurve::parse(
        "kbfdg5v_flow.csv",
        include_str!("cases/kbfdg5v_flow.csv"),
    ))
}

/// A valve's phase at amplitudes of 100 and 40 %, digitised.
pub fn two_amplitude_response() -> ResponseCurve {
    built_in(ResponseCurve::parse(
        "two_amplitude_response.csv",
        include_str!("cases/two_amplitude_response.csv"),
    ))
}

/// A valve's answer to a step of full scale, digitised.
pub fn step() -> StepCurve {
    built_in(StepCurve::parse("step.csv", include_str!("cases/step.csv")))
}

/// The files are part of the program, and tests read them all.
fn built_in<T>(curve: Result<T>) -> T {
    curve.expect("a built-in case is well formed")
}
