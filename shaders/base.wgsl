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

fn observe(plant: Plant, state: State, input: Input) -> vec3<f32> {
    return vec3<f32>(state.spool, 0.0f, 0.0f);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t31 = -plant.saturation;
    let t34 = plant.gain * min(max(start.command - state.spool, t31), plant.saturation);
    let t36 = (state.integrator - state.spool) * plant.rate;
    let t38 = step * 0.5f;
    let t42 = state.spool + (t38 * t36);
    let t46 = plant.gain * min(max(middle.command - t42, t31), plant.saturation);
    let t48 = ((state.integrator + (t38 * t34)) - t42) * plant.rate;
    let t57 = state.spool + (t38 * t48);
    let t61 = plant.gain * min(max(middle.command - t57, t31), plant.saturation);
    let t63 = ((state.integrator + (t38 * t46)) - t57) * plant.rate;
    let t68 = step * 1.0f;
    let t72 = state.spool + (t68 * t63);
    let t84 = step * 0.16666667f;
    return State(state.integrator + (t84 * (((t34 + (2.0f * t46)) + (2.0f * t61)) + (1.0f * (plant.gain * min(max(end.command - t72, t31), plant.saturation))))), state.spool + (t84 * (((t36 + (2.0f * t48)) + (2.0f * t63)) + (1.0f * (((state.integrator + (t68 * t61)) - t72) * plant.rate)))));
}
