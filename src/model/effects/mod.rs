//! The catalogue: what measured valves show and the base model lacks, one file an effect.
//!
//! An effect attaches at a [`Port`] and changes what passes there. Where two attach at the same port the one that stands
//! first in the catalogue acts first. At its neutral values an effect changes nothing, not even the last bit; one whose curve has
//! no straight part (`slew_limit~rounded`, `slew_limit~pilot`) changes less than 4e-5 of the range.

mod act;
mod curve;
mod effect;
mod entry;
mod host;
mod in_loop;
mod own;
mod register;
pub mod view;

pub use act::{Act, Moment, Motion, Port, Stage};
pub use effect::Effect;
pub use entry::{Entry, Scale, Trial};
pub use host::Host;
pub use own::Law;
pub use register::register;

use super::Real;

/// The entry of a form in an effect's file: `ENTRY` where it is not called otherwise.
macro_rules! entry_of {
    ($module:ident) => {
        $module::ENTRY
    };
    ($module:ident $entry:ident) => {
        $module::$entry
    };
}

/// What each effect's file brings in: its entries in the catalogue and their actions.
macro_rules! catalogue {
    ($($module:ident :: $Type:ident $(= $entry:ident)?),* $(,)?) => {
        /// All effects, in the order in which they act.
        pub const CATALOGUE: &[&Entry] = &[$(&entry_of!($module $($entry)?)),*];

        /// An effect with values for its parameters.
        #[derive(Debug, Clone)]
        pub(super) enum Action<R> {
            $(#[doc = stringify!($module)] $Type($module::$Type<R>),)*
            /// One of a user's own.
            Own(own::Own<R>),
        }

        impl<R: Real> Action<R> {
            /// The action of the effect called `name`, with the values that `next` gives for its parameters.
            #[inline(always)]
            pub(super) fn new(name: &str, mut next: impl FnMut() -> R) -> Self {
                $(if name == entry_of!($module $($entry)?).name {
                    return Self::$Type($module::$Type::new(next));
                })*
                Self::Own(own::Own::new(name, &mut next))
            }
        }

        impl<R: Real> Act<R> for Action<R> {
            #[inline(always)]
            fn delay(&self) -> Option<R> {
                match self { $(Self::$Type(effect) => Act::<R>::delay(effect),)* Self::Own(_) => None }
            }
            #[inline(always)]
            fn command(&self, own: &mut [R], command: R) -> R {
                match self { $(Self::$Type(effect) => effect.command(own, command),)* Self::Own(users) => users.0.command(own, command) }
            }
            #[inline(always)]
            fn acts_on_the_reference(&self) -> bool {
                match self { $(Self::$Type(effect) => Act::<R>::acts_on_the_reference(effect),)* Self::Own(users) => users.0.acts_on_the_reference() }
            }
            #[inline(always)]
            fn reference(&self, own: &[R], command: R, spool: R, stage: &Stage<R>) -> R {
                match self { $(Self::$Type(effect) => effect.reference(own, command, spool, stage),)* Self::Own(users) => users.0.reference(own, command, spool, stage) }
            }
            #[inline(always)]
            fn remember(&self, own: &mut [R], command: R, spool: R, stage: &Stage<R>) {
                match self { $(Self::$Type(effect) => effect.remember(own, command, spool, stage),)* Self::Own(users) => users.0.remember(own, command, spool, stage) }
            }
            #[inline(always)]
            fn settled_spool(&self, own: &mut [R], spool: R) {
                match self { $(Self::$Type(effect) => effect.settled_spool(own, spool),)* Self::Own(users) => users.0.settled_spool(own, spool) }
            }
            #[inline(always)]
            fn pulls(&self) -> bool {
                match self { $(Self::$Type(effect) => Act::<R>::pulls(effect),)* Self::Own(users) => users.0.pulls() }
            }
            #[inline(always)]
            fn feels_load(&self) -> bool {
                match self { $(Self::$Type(effect) => Act::<R>::feels_load(effect),)* Self::Own(users) => users.0.feels_load() }
            }
            #[inline(always)]
            fn drive(&self, own: &[R], drive: R, motion: &Motion<R>) -> R {
                match self { $(Self::$Type(effect) => effect.drive(own, drive, motion),)* Self::Own(users) => users.0.drive(own, drive, motion) }
            }
            #[inline(always)]
            fn speed(&self, own: &[R], speed: R, motion: &Motion<R>) -> R {
                match self { $(Self::$Type(effect) => effect.speed(own, speed, motion),)* Self::Own(users) => users.0.speed(own, speed, motion) }
            }
            #[inline(always)]
            fn follow(&self, own: &[R], speed: R, motion: &Motion<R>, slope: &mut [R]) {
                match self { $(Self::$Type(effect) => effect.follow(own, speed, motion, slope),)* Self::Own(users) => users.0.follow(own, speed, motion, slope) }
            }
            #[inline(always)]
            fn sticks(&self) -> bool {
                match self { $(Self::$Type(effect) => Act::<R>::sticks(effect),)* Self::Own(users) => users.0.sticks() }
            }
            #[inline(always)]
            fn slip_direction(&self, own: &[R], drive: R, motion: &Motion<R>) -> R {
                match self { $(Self::$Type(effect) => effect.slip_direction(own, drive, motion),)* Self::Own(users) => users.0.slip_direction(own, drive, motion) }
            }
            #[inline(always)]
            fn end_step(&self, own: &mut [R], lead: R, spool: R, drive: R, start: &Motion<R>, step: R) -> (R, R) {
                match self { $(Self::$Type(effect) => effect.end_step(own, lead, spool, drive, start, step),)* Self::Own(users) => users.0.end_step(own, lead, spool, drive, start, step) }
            }
            #[inline(always)]
            fn place(&self, own: &[R], spool: R, speed: R) -> R {
                match self { $(Self::$Type(effect) => effect.place(own, spool, speed),)* Self::Own(users) => users.0.place(own, spool, speed) }
            }
            #[inline(always)]
            fn seen(&self, own: &[R], spool: R, time: R) -> R {
                match self { $(Self::$Type(effect) => effect.seen(own, spool, time),)* Self::Own(users) => users.0.seen(own, spool, time) }
            }
            #[inline(always)]
            fn opening(&self, opening: R) -> R {
                match self { $(Self::$Type(effect) => effect.opening(opening),)* Self::Own(users) => users.0.opening(opening) }
            }
            #[inline(always)]
            fn supply(&self, own: &[R], supply: R) -> R {
                match self { $(Self::$Type(effect) => effect.supply(own, supply),)* Self::Own(users) => users.0.supply(own, supply) }
            }
            #[inline(always)]
            fn drawn(&self, own: &[R], flow: R, slope: &mut [R]) {
                match self { $(Self::$Type(effect) => effect.drawn(own, flow, slope),)* Self::Own(users) => users.0.drawn(own, flow, slope) }
            }
            #[inline(always)]
            fn delivered(&self, flow: R, moment: &Moment<R>) -> R {
                match self { $(Self::$Type(effect) => effect.delivered(flow, moment),)* Self::Own(users) => users.0.delivered(flow, moment) }
            }
            #[inline(always)]
            fn flow(&self, flow: R, moment: &Moment<R>) -> R {
                match self { $(Self::$Type(effect) => effect.flow(flow, moment),)* Self::Own(users) => users.0.flow(flow, moment) }
            }
            #[inline(always)]
            fn settled_supply(&self, own: &mut [R], flow: R) {
                match self { $(Self::$Type(effect) => effect.settled_supply(own, flow),)* Self::Own(users) => users.0.settled_supply(own, flow) }
            }
            #[inline(always)]
            fn settled(&self, own: &mut [R], value: R) {
                match self { $(Self::$Type(effect) => effect.settled(own, value),)* Self::Own(users) => users.0.settled(own, value) }
            }
            #[inline(always)]
            fn filter(&self, own: &mut [R], before: R, after: R, step: R) {
                match self { $(Self::$Type(effect) => effect.filter(own, before, after, step),)* Self::Own(users) => users.0.filter(own, before, after, step) }
            }
            #[inline(always)]
            fn measure(&self, own: &[R], value: R, moment: &Moment<R>) -> R {
                match self { $(Self::$Type(effect) => effect.measure(own, value, moment),)* Self::Own(users) => users.0.measure(own, value, moment) }
            }
        }
    };
}

mod asymmetric_gain;
mod command_hum;
mod command_lag;
mod compressibility;
mod dc_gain;
mod dead_band;
mod delay;
mod feed_forward;
mod feedback_curvature;
mod flow_force;
mod flow_saturation;
mod friction;
mod gain_curvature;
mod hysteresis;
mod integral_action;
mod leakage;
mod line_resonance;
mod null_bias;
mod overlap;
mod periodic_disturbance;
mod pilot_supply;
mod second_order;
mod sensor_curvature;
mod sensor_drift;
mod sensor_lag;
mod sensor_offset;
mod slew_limit;
mod spool_resonance;
mod stroke_limit;
mod supply_droop;
mod viscosity_drift;

catalogue! {
    delay::Delay,
    dead_band::DeadBand,
    dc_gain::DcGain,
    null_bias::NullBias,
    null_bias::NullBiasSettling = SETTLING,
    hysteresis::Hysteresis,
    command_lag::CommandLag,
    command_hum::CommandHum,
    command_hum::CommandHumWithOvertones = OVERTONE,
    feed_forward::FeedForward,
    slew_limit::SlewLimit,
    spool_resonance::SpoolResonance,
    spool_resonance::SpoolResonanceBehindLag = LAGGED,
    flow_force::FlowForce,
    friction::Friction,
    stroke_limit::StrokeLimit,
    overlap::Overlap,
    asymmetric_gain::AsymmetricGain,
    gain_curvature::GainCurvature,
    supply_droop::SupplyDroop,
    leakage::Leakage,
    viscosity_drift::ViscosityDrift,
    line_resonance::LineResonance,
    compressibility::Compressibility,
    sensor_lag::SensorLag,
    sensor_curvature::SensorCurvature,
    sensor_offset::SensorOffset,
    sensor_drift::SensorDrift,
    periodic_disturbance::PeriodicDisturbance,
    flow_force::FlowForceBehind = BEHIND,
    friction::FrictionBehind = BEHIND,
    slew_limit::SlewLimitBehind = BEHIND,
    stroke_limit::StrokeLimitBehind = BEHIND,
    stroke_limit::StrokeLimitOfSides = SIDES,
    stroke_limit::StrokeLimitOfCommand = COMMAND,
    stroke_limit::StrokeLimitElastic = ELASTIC,
    stroke_limit::StrokeLimitClipped = CLIPPED,
    slew_limit::SlewLimitRounded = ROUNDED,
    slew_limit::SlewLimitTanh = TANH,
    slew_limit::SlewLimitOfPilot = PILOT,
    slew_limit::SlewLimitOfSides = SIDES,
    slew_limit::SlewLimitOfCommand = COMMAND,
    command_lag::CommandLagOfSecondOrder = SECOND_ORDER,
    hysteresis::HysteresisOfFeedback = FEEDBACK,
    overlap::OverlapRounded = ROUNDED,
    overlap::OverlapOfEdges = EDGES,
    overlap::OverlapWithClearance = CLEARANCE,
    gain_curvature::GainKnee = KNEE,
    gain_curvature::GainShaped = SHAPED,
    gain_curvature::GainOfRoundPorts = ROUND,
    supply_droop::SupplyDroopTurbulent = TURBULENT,
    sensor_lag::SensorLagOfSecondOrder = SECOND_ORDER,
    feedback_curvature::FeedbackCurvature,
    flow_saturation::FlowSaturation,
    viscosity_drift::ViscosityDriftSettling = SETTLING,
    sensor_drift::SensorDriftSettling = SETTLING,
    periodic_disturbance::PeriodicDisturbanceWithOvertones = OVERTONE,
    integral_action::IntegralAction,
    integral_action::IntegralActionBeforeLimit = BEFORE,
    dead_band::DeadBandCompensated = COMPENSATED,
    flow_force::FlowForceOfAngle = ANGLE,
    hysteresis::HysteresisOfLinkage = LINKAGE,
    sensor_lag::SensorLagOfTurbine = TURBINE,
    line_resonance::LineResonanceOfShare = SHARE,
    slew_limit::SlewLimitUneven = UNEVEN,
    integral_action::IntegralActionTracked = TRACKING,
    integral_action::IntegralActionClamped = CLAMPING,
    integral_action::IntegralActionLimited = LIMITED,
    dc_gain::DcGainCreeping = CREEPING,
    slew_limit::SlewLimitOfRamps = RAMPS,
    flow_saturation::FlowSaturationChoked = CHOKED,
    supply_droop::SupplyDroopLimited = LIMITED,
    dc_gain::DcGainHeating = HEATING,
    hysteresis::HysteresisGradual = GRADUAL,
    hysteresis::HysteresisSpread = SPREAD,
    supply_droop::SupplyDroopOfAccumulator = ACCUMULATOR,
    gain_curvature::GainOfLaminarFlow = LAMINAR,
    delay::DelayOfLoop = LOOP,
    command_lag::CommandLagOfLoop = LOOP,
    hysteresis::HysteresisOfLoop = LOOP,
    asymmetric_gain::AsymmetricGainOfLoop = LOOP,
    asymmetric_gain::AsymmetricGainOfPilot = PILOT,
    hysteresis::HysteresisOfTransducer = TRANSDUCER,
    null_bias::NullBiasOfTransducer = TRANSDUCER,
    dc_gain::DcGainLeaking = LEAKING,
    stroke_limit::StrokeLimitRail = RAIL,
    gain_curvature::GainOfFlowNumber = TANH,
    pilot_supply::PilotSupply,
    null_bias::NullBiasOfPilot = PILOT,
    overlap::OverlapOfBridge = BRIDGE,
    dead_band::DeadBandOfFeedback = FEEDBACK,
    dead_band::DeadBandOfLoop = LOOP,
    flow_saturation::FlowSaturationOfSeries = SERIES,
    asymmetric_gain::AsymmetricSaturation = SATURATION,
    overlap::OverlapOfLeaking = LEAKING,
    integral_action::IntegralActionLeaking = LEAKING,
    null_bias::NullBiasOfSupply = SUPPLY,
    null_bias::NullBiasDrifting = DRIFTING,
}

/// The entry of the effect called `name`, of the catalogue or [registered](register).
pub fn entry(name: &str) -> Option<&'static Entry> {
    known().find(|entry| entry.name == name)
}

/// The entries of the catalogue, then those that have been [registered](register).
pub fn known() -> impl Iterator<Item = &'static Entry> {
    CATALOGUE.iter().copied().chain(own::registered())
}
