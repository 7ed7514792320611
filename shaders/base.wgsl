// The physics of the actuator alone, as `Structure::actuator(10.0, "V")` has it:
// traced from src/model, to be composed with evaluate.wgsl. For reading; a test keeps it up to date.

struct State {
    integrator: f32,
    spool: f32,
}

const STATES: u32 = 2u;

fn load(at: u32, stride: u32) -> State {
    return State(states[at + 0u * stride], states[at + 1u * stride]);
}

fn store(at: u32, stride: u32, state: State) {
    states[at + 0u * stride] = state.integrator;
    states[at + 1u * stride] = state.spool;
}

fn diverged(state: State) -> bool {
    return !(abs(state.integrator) < STATE_LIMIT) || !(abs(state.spool) < STATE_LIMIT);
}

struct Plant {
    gain: f32,
    saturation: f32,
    rate: f32,
}

fn prepare(candidate: u32, population: u32) -> Plant {
    let rate = 1.0f / candidates[1u * population + candidate];
    return Plant(candidates[0u * population + candidate], candidates[2u * population + candidate], rate);
}

fn initial(plant: Plant, input: Input, position: f32) -> State {
    return State(input.command, input.command);
}

fn command(plant: Plant, state: State, arrived: f32) -> f32 {
    return f32(arrived);
}

fn remember(plant: Plant, state: State, arrived: f32) -> State {
    return State(state.integrator, state.spool);
}

fn delay(plant: Plant) -> f32 {
    return f32(0.0f);
}

fn observe(plant: Plant, state: State, input: Input) -> vec3<f32> {
    return vec3<f32>(state.spool, 0.0f, 0.0f);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t41 = -plant.saturation;
    let t44 = plant.gain * min(max(start.command - state.spool, t41), plant.saturation);
    let t46 = (state.integrator - state.spool) * plant.rate;
    let t48 = step * 0.5f;
    let t52 = state.spool + (t48 * t46);
    let t56 = plant.gain * min(max(middle.command - t52, t41), plant.saturation);
    let t58 = ((state.integrator + (t48 * t44)) - t52) * plant.rate;
    let t67 = state.spool + (t48 * t58);
    let t71 = plant.gain * min(max(middle.command - t67, t41), plant.saturation);
    let t73 = ((state.integrator + (t48 * t56)) - t67) * plant.rate;
    let t78 = step * 1.0f;
    let t82 = state.spool + (t78 * t73);
    let t94 = step * 0.16666667f;
    return State(state.integrator + (t94 * (((t44 + (2.0f * t56)) + (2.0f * t71)) + (1.0f * (plant.gain * min(max(end.command - t82, t41), plant.saturation))))), state.spool + (t94 * (((t46 + (2.0f * t58)) + (2.0f * t73)) + (1.0f * (((state.integrator + (t78 * t71)) - t82) * plant.rate)))));
}
