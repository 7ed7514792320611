//! Base models: what is simulated where no effect is attached.
//!
//! To add one: a file here that implements [`BaseModel`], [`WithEquations`] and [`Equations`], and its line in `base_models!` below. From
//! outside this crate: the same traits and [`register_base`].

mod own;
pub mod servo_valve;

pub use own::{OwnBase, register_base};
pub use servo_valve::ServoValve;

use super::actuator::Actuator;
use super::declare::Declare;
use super::effects::{Moment, Port, Stage};
use super::ports::{Attached, Ports};
use super::structure::Structure;
use super::{Initial, Input, Output, Outputs, Parameter, Real};
use crate::record::Channel;

/// A base model as it is described: which parts it has, not the values of its parameters.
pub trait BaseModel: Send + Sync + 'static {
    /// Its name in model files.
    fn name(&self) -> &'static str;

    /// What it consists of, in words that follow "the base model is".
    fn parts(&self) -> Vec<&'static str>;

    /// Names of its states, in their order.
    fn states(&self, structure: &Structure) -> Vec<&'static str>;

    /// Whether it has this port, beside those of command and measurement that every model has.
    fn has(&self, _port: Port) -> bool {
        false
    }

    /// The unit of `output`.
    fn unit<'a>(&'a self, structure: &'a Structure, output: Output) -> &'a str;

    /// Whether `output` is read off the flow at every instant, as an integrated position is not.
    fn shows_flow(&self, output: Output) -> bool {
        output == Output::Flow
    }

    /// Whether `output` follows from the flow of a valve, now or over time.
    fn follows_flow(&self, output: Output) -> bool {
        self.shows_flow(output)
    }

    /// Channels beside the command that have to be measured, as they drive it.
    fn driven_by(&self) -> &'static [Channel] {
        &[]
    }

    /// The fastest rate (1/s) of any candidate inside the bounds of `parameters`, as far as integration steps follow it.
    fn fastest_rate(&self, parameters: &[Parameter]) -> f64 {
        let rates = parameters.iter().filter_map(Parameter::fastest_rate);
        rates.fold(0.0, f64::max)
    }

    /// Whether its states move in exact steps where nothing is attached to how they move: see [`Equations::exact_step`].
    fn has_exact_step(&self, _structure: &Structure) -> bool {
        false
    }

    /// Names of the parameters that decide when an exact step meets an edge of its equations, the most telling first:
    /// candidates that have them alike meet it together.
    fn edges_follow(&self) -> &'static [&'static str] {
        &[]
    }
}

/// A base model with its equations.
pub trait WithEquations: BaseModel {
    /// The equations with values for the parameters.
    type Equations<R: Real>: Equations<R, Attached<R>> + 'static;

    /// Its equations. Each parameter is declared where its value is used, always in the same order.
    fn equations<R: Real>(
        &self,
        structure: &Structure,
        parameters: &mut dyn Declare<R>,
    ) -> Self::Equations<R>;
}

/// What a base model shows at one instant.
#[derive(Debug, Clone, Copy)]
pub struct Shown<R> {
    /// The outputs before their sensors; zero where they are not observed.
    pub outputs: Outputs<R>,
    /// The surroundings of what is measured.
    pub moment: Moment<R>,
    /// Spool position in the unit of the command, or what stands for it.
    pub spool: R,
}

/// A base model with values for its parameters. `state` begins with its own states, in the order of
/// [`BaseModel::states`]; those of the effects follow and belong to `ports`. Every `input` has the command that acts.
pub trait Equations<R: Real, P: Ports<R>> {
    /// The states at the first row, where the outputs that are measured there are `measured`; all are zero before.
    fn initial(
        &self,
        ports: &P,
        state: &mut [R],
        input: &Input<R>,
        measured: &Outputs<R>,
        initial: Initial,
    );

    /// The time derivative of the states at this stage of an integration step.
    fn derivative(
        &self,
        ports: &P,
        state: &[R],
        input: &Input<R>,
        stage: &Stage<R>,
        slope: &mut [R],
    );

    /// What it shows. What [shows its flow](BaseModel::shows_flow) may be left out where `flow` is not asked for.
    fn shown(&self, ports: &P, state: &[R], input: &Input<R>, flow: bool) -> Shown<R>;

    /// The sign in which what can stick moves, or sets out to move, from `state`; zero while it sticks.
    #[inline(always)]
    fn slip_direction(&self, _ports: &P, _state: &[R], _input: &Input<R>) -> R {
        R::constant(0.0)
    }

    /// What happens to its states at the end of an integration `step` from `before` to `state`: something sticks or meets
    /// a stop. The `inputs` are those at the step's start and end.
    #[inline(always)]
    fn end_step(
        &self,
        _ports: &P,
        _before: &[R],
        _state: &mut [R],
        _inputs: [&Input<R>; 2],
        _slip_direction: R,
        _step: R,
    ) {
    }

    /// The velocity of the spool, or of what stands for it.
    #[inline(always)]
    fn speed(&self, _ports: &P, _state: &[R], _input: &Input<R>) -> R {
        R::constant(0.0)
    }

    /// The actuator whose integrator and spool are the two states, where these are all that moves.
    #[inline(always)]
    fn exact_step(&self, _ports: &P) -> Option<&Actuator<R>> {
        None
    }
}

macro_rules! base_models {
    ($($module:ident :: $Type:ident => $Equations:ident),+ $(,)?) => {
        /// The base model of a structure.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Base {
            $(#[doc = concat!("[`", stringify!($module), "`].")] $Type($Type),)+
            /// One from outside this crate.
            Own(OwnBase),
        }

        $(impl From<$Type> for Base {
            fn from(base: $Type) -> Self {
                Self::$Type(base)
            }
        })+

        impl Base {
            /// The base model of this crate called `name`, with its default parts.
            fn built_in(name: &str) -> Option<Self> {
                $(if $Type::default().name() == name {
                    return Some($Type::default().into());
                })+
                None
            }
        }

        /// The equations of a structure's base model.
        #[derive(Debug, Clone)]
        pub(super) enum BaseEquations<R> {
            $($Type($module::$Equations<R>),)+
            Own(own::OwnEquations<R>),
        }

        /// What `$value` makes of the base model, whichever it is.
        macro_rules! each_base {
            ($Enum:ident, $base:expr, $name:ident => $value:expr) => {
                match $base { $($Enum::$Type($name) => $value,)+ $Enum::Own($name) => $value }
            };
        }

        impl<R: Real> BaseEquations<R> {
            /// The equations of `structure`'s base model.
            #[inline(always)]
            pub(super) fn new(structure: &Structure, parameters: &mut dyn Declare<R>) -> Self {
                match &structure.base {
                    $(Base::$Type(base) => Self::$Type(base.equations(structure, parameters)),)+
                    Base::Own(base) => Self::Own(base.equations(structure, parameters)),
                }
            }
        }
    };
}

base_models! {
    servo_valve::ServoValve => ServoValveEquations,
}
pub(super) use each_base;

impl Base {
    /// The base model called `name`: one of this crate, with its default parts, or one that has been
    /// [registered](register_base).
    pub fn named(name: &str) -> Option<Self> {
        Self::built_in(name).or_else(|| OwnBase::named(name).map(Self::Own))
    }

    /// Its name in model files.
    pub fn name(&self) -> &'static str {
        each_base!(Base, self, base => base.name())
    }
}
