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
    let t40 = -plant.saturation;
    let t43 = plant.gain * min(max(start.command - state.spool, t40), plant.saturation);
    let t45 = (state.integrator - state.spool) * plant.rate;
    let t47 = step * 0.5f;
    let t51 = state.spool + (t47 * t45);
    let t55 = plant.gain * min(max(middle.command - t51, t40), plant.saturation);
    let t57 = ((state.integrator + (t47 * t43)) - t51) * plant.rate;
    let t66 = state.spool + (t47 * t57);
    let t70 = plant.gain * min(max(middle.command - t66, t40), plant.saturation);
    let t72 = ((state.integrator + (t47 * t55)) - t66) * plant.rate;
    let t77 = step * 1.0f;
    let t81 = state.spool + (t77 * t72);
    let t93 = step * 0.16666667f;
    return State(state.integrator + (t93 * (((t43 + (2.0f * t55)) + (2.0f * t70)) + (1.0f * (plant.gain * min(max(end.command - t81, t40), plant.saturation))))), state.spool + (t93 * (((t45 + (2.0f * t57)) + (2.0f * t72)) + (1.0f * (((state.integrator + (t77 * t70)) - t81) * plant.rate)))));
}
