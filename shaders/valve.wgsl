// The physics of an actuator and a valve with an area table, all ports measured:
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
    opening_offset: f32,
    rate: f32,
    leakage: f32,
    first_area: f32,
    slope_1: f32,
    slope_2: f32,
    slope_3: f32,
    slope_4: f32,
    slope_5: f32,
    orifice_coefficient: f32,
}

fn prepare(candidate: u32, population: u32) -> Plant {
    let rate = 1.0f / candidates[1u * population + candidate];
    let leakage = constants[3u] * 0.0001f;
    let first_area = candidates[3u * population + candidate] * 0.0001f;
    let t21 = candidates[4u * population + candidate] * 0.0001f;
    let slope_1 = (t21 - first_area) / 10.0f;
    let t25 = candidates[5u * population + candidate] * 0.0001f;
    let slope_2 = (t25 - t21) / 15.0f;
    let t29 = candidates[6u * population + candidate] * 0.0001f;
    let slope_3 = (t29 - t25) / 25.0f;
    let t33 = candidates[7u * population + candidate] * 0.0001f;
    let slope_4 = (t33 - t29) / 30.0f;
    let slope_5 = ((candidates[8u * population + candidate] * 0.0001f) - t33) / 20.0f;
    let orifice_coefficient = constants[0u] * sqrt(2.0f / constants[1u]);
    return Plant(candidates[0u * population + candidate], candidates[2u * population + candidate], constants[4u], rate, leakage, first_area, slope_1, slope_2, slope_3, slope_4, slope_5, orifice_coefficient);
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
    let opening = state.spool * 10.0f;
    let t69 = input.supply * 100000.0f;
    let t70 = input.tank * 100000.0f;
    let t71 = input.a * 100000.0f;
    let t72 = input.b * 100000.0f;
    let t73 = plant.opening_offset + opening;
    let forward_area = max(((((plant.first_area + (plant.slope_1 * min(max(t73 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t73 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t73 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t73 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t73 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t102 = plant.opening_offset - opening;
    let backward_area = max(((((plant.first_area + (plant.slope_1 * min(max(t102 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t102 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t102 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t102 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t102 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t129 = t69 - t71;
    let t136 = (((t69 + t71) * 0.5f) + 101325.0f) * 0.001f;
    let t137 = forward_area * plant.orifice_coefficient;
    let t146 = t71 - t70;
    let t150 = (((t71 + t70) * 0.5f) + 101325.0f) * 0.001f;
    let t151 = backward_area * plant.orifice_coefficient;
    let t160 = t69 - t72;
    let t164 = (((t69 + t72) * 0.5f) + 101325.0f) * 0.001f;
    let t173 = t72 - t70;
    let t177 = (((t72 + t70) * 0.5f) + 101325.0f) * 0.001f;
    let flow = (((((t137 * t129) / sqrt(sqrt((t129 * t129) + (t136 * t136)))) * 60000.0f) - (((t151 * t146) / sqrt(sqrt((t146 * t146) + (t150 * t150)))) * 60000.0f)) + ((((t137 * t173) / sqrt(sqrt((t173 * t173) + (t177 * t177)))) * 60000.0f) - (((t151 * t160) / sqrt(sqrt((t160 * t160) + (t164 * t164)))) * 60000.0f))) * 0.5f;
    return vec3<f32>(state.spool, flow, 0.0f);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t212 = -plant.saturation;
    let t215 = plant.gain * min(max(start.command - state.spool, t212), plant.saturation);
    let t217 = (state.integrator - state.spool) * plant.rate;
    let t218 = step * 0.5f;
    let t222 = state.spool + (t218 * t217);
    let t226 = plant.gain * min(max(middle.command - t222, t212), plant.saturation);
    let t228 = ((state.integrator + (t218 * t215)) - t222) * plant.rate;
    let t236 = state.spool + (t218 * t228);
    let t240 = plant.gain * min(max(middle.command - t236, t212), plant.saturation);
    let t242 = ((state.integrator + (t218 * t226)) - t236) * plant.rate;
    let t247 = step * 1.0f;
    let t251 = state.spool + (t247 * t242);
    let t263 = step * 0.16666667f;
    return State(state.integrator + (t263 * (((t215 + (2.0f * t226)) + (2.0f * t240)) + (1.0f * (plant.gain * min(max(end.command - t251, t212), plant.saturation))))), state.spool + (t263 * (((t217 + (2.0f * t228)) + (2.0f * t242)) + (1.0f * (((state.integrator + (t247 * t240)) - t251) * plant.rate)))));
}
