//! A structure with values for its parameters: its base model, and what is attached to it.

use super::actuator::Actuator;
use super::base::servo_valve::ServoValveEquations;
use super::base::{BaseEquations, Equations, Shown, WithEquations, each_base};
use super::declare::Given;
use super::effects::{Act, Port, Stage};
use super::free_form::Signal;
use super::ports::{Attached, Bare};
use super::{Complete, Initial, Input, Outputs, Real, Structure};

/// What a time loop moves. Every `input` has the command that acts, but for [`Dynamics::initial`] and
/// [`Dynamics::command`].
pub trait Dynamics<R: Real> {
    /// Whether a command can arrive late: what follows that is not compiled where it cannot.
    const DELAYS: bool;

    /// Calls `f`, as a function of its own where that is long.
    fn outlined<T>(f: impl FnOnce() -> T) -> T;

    /// The state at the first row, for its `input` and the outputs that are `measured` there.
    fn initial<const N: usize>(&self, input: &Input<R>, measured: &Outputs<R>) -> [R; N];

    /// The command that acts, when `command` has arrived: `state` remembers it.
    #[inline(always)]
    fn command(&self, _state: &mut [R], command: R) -> R {
        command
    }

    /// How long the command takes to arrive, s, where an effect delays it.
    #[inline(always)]
    fn delay(&self) -> Option<R> {
        None
    }

    /// The sign in which what can stick moves, or sets out to move; zero while it sticks, and where it cannot.
    #[inline(always)]
    fn slip_direction(&self, _state: &[R], _input: &Input<R>) -> R {
        R::constant(0.0)
    }

    /// How many of `N` states there is room for it has.
    fn states<const N: usize>(&self) -> usize;

    /// The time derivative of the state at this stage of an integration step, as far as it has states.
    fn derivative<const N: usize>(
        &self,
        state: &[R; N],
        input: &Input<R>,
        stage: &Stage<R>,
        slope: &mut [R; N],
    );

    /// What happens at the end of an integration `step` from `before` to `state`: the spool sticks or meets a stop, and
    /// what filters an output follows it. The `inputs` are those at the step's start and end.
    #[inline(always)]
    fn end_step(
        &self,
        _before: &[R],
        _state: &mut [R],
        _inputs: [&Input<R>; 2],
        _slip_direction: R,
        _step: R,
    ) {
    }

    /// What the filters of outputs follow; `None` where nothing filters an output.
    #[inline(always)]
    fn unfiltered(&self, _state: &[R], _input: &Input<R>) -> Option<Shown<R>> {
        None
    }

    /// What filters an output follows it for `step` seconds, straight from what was to what is.
    #[inline(always)]
    fn filter(&self, _state: &mut [R], _course: [&Shown<R>; 2], _step: R) {}

    /// How fast the state goes that the spool carries along in exact steps; `None` where it carries none.
    #[inline(always)]
    fn carried<const N: usize>(&self, _state: &[R; N], _input: &Input<R>) -> Option<R> {
        None
    }

    /// The outputs; those that are not observed are zero.
    fn observe(&self, state: &[R], input: &Input<R>) -> Outputs<R>;

    /// The actuator whose exact steps move the first of the `N` states of `structure`, where they do.
    fn exact_step<const N: usize>(&self, structure: &Structure) -> Option<&Actuator<R>>;
}

/// Which dynamics a time loop is compiled for.
pub trait View {
    /// The dynamics.
    type Plant<R: Real>: Dynamics<R>;

    /// The plant of `structure`, with values in the order of [`Structure::parameters`].
    fn new<R: Real>(structure: &Structure, values: &Complete<R>) -> Self::Plant<R>;

    /// The same by a function of its own: it has the declarations of all parameters, and every time loop begins with it.
    #[inline(always)]
    fn plant<R: Real>(structure: &Structure, values: &Complete<R>) -> Self::Plant<R> {
        R::outlined(
            #[inline(always)]
            || Self::new(structure, values),
        )
    }
}

/// Any base model with whatever is attached to it.
#[derive(Debug)]
pub struct Whole;

impl View for Whole {
    type Plant<R: Real> = Plant<R>;

    #[inline(always)]
    fn new<R: Real>(structure: &Structure, values: &Complete<R>) -> Plant<R> {
        Plant::new(structure, values)
    }
}

/// A servo valve with nothing attached: it costs nothing more than itself.
#[derive(Debug)]
pub struct Alone;

impl View for Alone {
    type Plant<R: Real> = BarePlant<R>;

    #[inline(always)]
    fn new<R: Real>(structure: &Structure, values: &Complete<R>) -> BarePlant<R> {
        let base = structure
            .servo_valve()
            .expect("a servo valve was asked for");
        BarePlant {
            base: base.equations(&structure.setting(), &mut Given::new(values)),
            initial: structure.initial,
            observes_flow: structure.observes_flow(),
        }
    }
}

/// A structure with values for its parameters: what is computed once a candidate.
#[derive(Debug, Clone)]
pub struct Plant<R> {
    base: BaseEquations<R>,
    attached: Attached<R>,
    states: usize,
    initial: Initial,
    observes_flow: bool,
    /// Whether anything filters an output, and whether that is the flow.
    filters: (bool, bool),
    /// Whether exact steps of the spool carry a state along.
    carries: bool,
}

impl<R: Real> Plant<R> {
    /// The plant of `structure`, with values in the order of [`Structure::parameters`].
    #[inline(always)]
    pub fn new(structure: &Structure, values: &Complete<R>) -> Self {
        let mut given = Given::new(values);
        let base = BaseEquations::new(&structure.base, &structure.setting(), &mut given);
        let states = structure.base_states().len();
        let mut filtered = structure.filtered();
        Self {
            base,
            attached: Attached::new(
                &structure.effects,
                structure.free_form.as_ref(),
                states,
                &mut || given.next_value(),
            ),
            states: structure.states().len(),
            initial: structure.initial,
            observes_flow: structure.observes_flow(),
            filters: (
                filtered.clone().next().is_some(),
                filtered.any(|output| structure.shows_flow(output)),
            ),
            carries: structure.carries(),
        }
    }

    #[inline(always)]
    fn shown(&self, state: &[R], input: &Input<R>, flow: bool) -> Shown<R> {
        each_base!(BaseEquations, &self.base, base => base.shown(&self.attached, state, input, flow))
    }

    /// The command that acts when it has long been `command`, and what effects on it then remember.
    #[inline(always)]
    fn settled_command(&self, state: &mut [R], command: R) -> R {
        R::outlined(
            #[inline(always)]
            || {
                let mut command = command;
                for effect in &self.attached.effects {
                    let own = &mut state[effect.states.clone()];
                    effect.action.settled(own, command);
                    command = effect.action.command(own, command);
                }
                // What acts in steps gets the command that the others leave.
                for effect in &self.attached.effects {
                    if effect.in_steps {
                        let own = &mut state[effect.states.clone()];
                        effect.action.settled(own, command);
                    }
                }
                command
            },
        )
    }

    /// What filters an output starts settled on it.
    #[inline(always)]
    fn settle_outputs(&self, state: &mut [R], input: &Input<R>) {
        R::outlined(
            #[inline(always)]
            || {
                let shown = self.shown(state, input, true);
                let mut outputs = shown.outputs;
                for effect in &self.attached.effects {
                    if let Some(output) = effect.output {
                        let own = &mut state[effect.states.clone()];
                        effect.action.settled(own, outputs[output]);
                        outputs[output] =
                            effect.action.measure(own, outputs[output], &shown.moment);
                    }
                }
            },
        );
    }
}

impl<R: Real> Dynamics<R> for Plant<R> {
    const DELAYS: bool = true;

    #[inline(always)]
    fn outlined<T>(f: impl FnOnce() -> T) -> T {
        R::outlined(f)
    }

    #[inline(always)]
    fn initial<const N: usize>(&self, input: &Input<R>, measured: &Outputs<R>) -> [R; N] {
        let mut state = [R::constant(0.0); N];
        let mut input = *input;
        // What begins at rest has long had no command.
        let long = match self.initial {
            Initial::Rest => R::constant(0.0),
            _ => input.command,
        };
        input.command = self.settled_command(&mut state, long);
        each_base!(BaseEquations, &self.base, base => {
            base.initial(&self.attached, &mut state, &input, measured, self.initial);
        });
        self.settle_outputs(&mut state, &input);
        state
    }

    #[inline(always)]
    fn command(&self, state: &mut [R], command: R) -> R {
        R::outlined(
            #[inline(always)]
            || {
                let mut command = command;
                for effect in &self.attached.effects {
                    let own = &mut state[effect.states.clone()];
                    command = effect.action.command(own, command);
                }
                match self.attached.correction_at(Port::Command) {
                    Some(correction) => command + correction.at(command),
                    None => command,
                }
            },
        )
    }

    #[inline(always)]
    fn delay(&self) -> Option<R> {
        for effect in &self.attached.effects {
            if let Some(delay) = effect.action.delay() {
                return Some(delay);
            }
        }
        None
    }

    #[inline(always)]
    fn slip_direction(&self, state: &[R], input: &Input<R>) -> R {
        each_base!(BaseEquations, &self.base, base => base.slip_direction(&self.attached, state, input))
    }

    #[inline(always)]
    fn states<const N: usize>(&self) -> usize {
        self.states.min(N)
    }

    #[allow(
        clippy::needless_range_loop,
        reason = "an iterator is not always inlined, and only what is inlined is compiled for wide vectors"
    )]
    #[inline(always)]
    fn derivative<const N: usize>(
        &self,
        state: &[R; N],
        input: &Input<R>,
        stage: &Stage<R>,
        slope: &mut [R; N],
    ) {
        for i in 0..self.states::<N>() {
            slope[i] = R::constant(0.0);
        }
        each_base!(BaseEquations, &self.base, base => {
            base.derivative(&self.attached, state, input, stage, slope);
        });
    }

    #[inline(always)]
    fn end_step(
        &self,
        before: &[R],
        state: &mut [R],
        inputs: [&Input<R>; 2],
        slip_direction: R,
        step: R,
    ) {
        R::outlined(
            #[inline(always)]
            || {
                each_base!(BaseEquations, &self.base, base => {
                    base.end_step(&self.attached, before, state, inputs, slip_direction, step);
                });
                if let Some(earlier) = self.unfiltered(before, inputs[0])
                    && let Some(later) = self.unfiltered(state, inputs[1])
                {
                    self.filter(state, [&earlier, &later], step);
                }
            },
        );
    }

    #[inline(always)]
    fn unfiltered(&self, state: &[R], input: &Input<R>) -> Option<Shown<R>> {
        let (any, flow) = self.filters;
        match any {
            true => Some(self.shown(state, input, flow)),
            false => None,
        }
    }

    #[inline(always)]
    fn filter(&self, state: &mut [R], [earlier, later]: [&Shown<R>; 2], step: R) {
        R::outlined(
            #[inline(always)]
            || {
                let (mut old, mut new) = (earlier.outputs, later.outputs);
                for effect in &self.attached.effects {
                    if let Some(output) = effect.output {
                        let own = &mut state[effect.states.clone()];
                        let value = old[output];
                        old[output] = effect.action.measure(own, value, &earlier.moment);
                        effect.action.filter(own, value, new[output], step);
                        new[output] = effect.action.measure(own, new[output], &later.moment);
                    }
                }
            },
        );
    }

    #[inline(always)]
    fn carried<const N: usize>(&self, state: &[R; N], input: &Input<R>) -> Option<R> {
        match self.carries {
            true => Some(
                each_base!(BaseEquations, &self.base, base => base.carried(&self.attached, state, input)),
            ),
            false => None,
        }
    }

    #[inline(always)]
    fn observe(&self, state: &[R], input: &Input<R>) -> Outputs<R> {
        R::outlined(
            #[inline(always)]
            || {
                let shown = self.shown(state, input, self.observes_flow);
                let mut outputs = shown.outputs;
                for effect in &self.attached.effects {
                    if let Some(output) = effect.output {
                        let own = &state[effect.states.clone()];
                        outputs[output] =
                            effect.action.measure(own, outputs[output], &shown.moment);
                    }
                }
                if let Some(correction) = self.attached.correction_at(Port::Measurement)
                    && let Some(output) = correction.output
                {
                    let signal = match correction.signal {
                        Signal::Command => input.command,
                        Signal::Time => input.time,
                        Signal::Speed => {
                            each_base!(BaseEquations, &self.base, base => base.speed(&self.attached, state, input))
                        }
                        Signal::Spool => shown.spool,
                    };
                    outputs[output] = outputs[output] + correction.at(signal);
                }
                outputs
            },
        )
    }

    #[inline(always)]
    fn exact_step<const N: usize>(&self, structure: &Structure) -> Option<&Actuator<R>> {
        match structure.has_exact_steps() {
            true => each_base!(BaseEquations, &self.base, base => base.exact_step(&self.attached)),
            false => None,
        }
    }
}

/// A servo valve with nothing attached.
#[derive(Debug, Clone)]
pub struct BarePlant<R> {
    base: ServoValveEquations<R>,
    initial: Initial,
    observes_flow: bool,
}

/// So many states are an actuator's alone, and with more it carries one along: known when its loops are compiled.
const AN_ACTUATOR: usize = 2;

impl<R: Real> BarePlant<R> {
    #[inline(always)]
    fn actuator(&self) -> &Actuator<R> {
        self.base.exact_step(&Bare).expect("an actuator")
    }
}

impl<R: Real> Dynamics<R> for BarePlant<R> {
    const DELAYS: bool = false;

    #[inline(always)]
    fn outlined<T>(f: impl FnOnce() -> T) -> T {
        f()
    }

    #[inline(always)]
    fn initial<const N: usize>(&self, input: &Input<R>, measured: &Outputs<R>) -> [R; N] {
        let mut state = [R::constant(0.0); N];
        self.base
            .initial(&Bare, &mut state, input, measured, self.initial);
        state
    }

    #[inline(always)]
    fn states<const N: usize>(&self) -> usize {
        N
    }

    #[inline(always)]
    fn derivative<const N: usize>(
        &self,
        state: &[R; N],
        input: &Input<R>,
        stage: &Stage<R>,
        slope: &mut [R; N],
    ) {
        *slope = [R::constant(0.0); N];
        if N == AN_ACTUATOR {
            let actuator = self.actuator();
            (slope[0], slope[1]) = actuator.derivative(state[0], state[1], input.command);
            return;
        }
        self.base.derivative(&Bare, state, input, stage, slope);
    }

    #[inline(always)]
    fn carried<const N: usize>(&self, state: &[R; N], input: &Input<R>) -> Option<R> {
        match N > AN_ACTUATOR {
            true => Some(self.base.carried(&Bare, state, input)),
            false => None,
        }
    }

    #[inline(always)]
    fn observe(&self, state: &[R], input: &Input<R>) -> Outputs<R> {
        self.base
            .shown(&Bare, state, input, self.observes_flow)
            .outputs
    }

    #[inline(always)]
    fn exact_step<const N: usize>(&self, _: &Structure) -> Option<&Actuator<R>> {
        match N >= AN_ACTUATOR {
            true => Some(self.actuator()),
            false => None,
        }
    }
}
