//! What a base model is: its description and its equations.

use crate::model::actuator::Actuator;
use crate::model::declare::Declare;
use crate::model::effects::{Moment, Port, Stage};
use crate::model::ports::{Attached, Ports};
use crate::model::setting::{Initial, Setting};
use crate::model::{Input, Output, Outputs, Parameter, Real};
use crate::record::Channel;

/// A base model as it is described: which parts it has, not the values of its parameters.
pub trait BaseModel: Send + Sync + 'static {
    /// Its name in model files.
    fn name(&self) -> &'static str;

    /// What it consists of, in words that follow "the base model is".
    fn parts(&self) -> Vec<&'static str>;

    /// Names of its states, in their order.
    fn states(&self, setting: &Setting) -> Vec<&'static str>;

    /// Whether it has this port, beside those of command and measurement that every model has.
    fn has(&self, _port: Port) -> bool {
        false
    }

    /// The unit of `output`.
    fn unit<'a>(&'a self, setting: &Setting<'a>, output: Output) -> &'a str;

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
    fn has_exact_step(&self, _setting: &Setting) -> bool {
        false
    }

    /// Whether a state is carried along by those that do: see [`Equations::carried`].
    fn carries(&self, _setting: &Setting) -> bool {
        false
    }

    /// Numbers of its states that are shifted together where the spool is led along a measured one.
    fn led(&self) -> &'static [usize] {
        &[]
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
        setting: &Setting,
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

    /// The actuator whose integrator and spool are the first two states, where these move by themselves.
    #[inline(always)]
    fn exact_step(&self, _ports: &P) -> Option<&Actuator<R>> {
        None
    }

    /// How fast the third state goes, where it follows the first two and acts on neither; zero where there is none.
    #[inline(always)]
    fn carried(&self, _ports: &P, _state: &[R], _input: &Input<R>) -> R {
        R::constant(0.0)
    }
}
