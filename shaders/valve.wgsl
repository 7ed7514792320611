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
    let t68 = input.supply * 100000.0f;
    let t69 = input.tank * 100000.0f;
    let t70 = input.a * 100000.0f;
    let t71 = input.b * 100000.0f;
    let t72 = plant.opening_offset + opening;
    let forward_area = max(((((plant.first_area + (plant.slope_1 * min(max(t72 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t72 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t72 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t72 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t72 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t101 = plant.opening_offset - opening;
    let backward_area = max(((((plant.first_area + (plant.slope_1 * min(max(t101 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t101 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t101 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t101 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t101 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t128 = t68 - t70;
    let t135 = (((t68 + t70) * 0.5f) + 101325.0f) * 0.001f;
    let t136 = forward_area * plant.orifice_coefficient;
    let t145 = t70 - t69;
    let t149 = (((t70 + t69) * 0.5f) + 101325.0f) * 0.001f;
    let t150 = backward_area * plant.orifice_coefficient;
    let t159 = t68 - t71;
    let t163 = (((t68 + t71) * 0.5f) + 101325.0f) * 0.001f;
    let t172 = t71 - t69;
    let t176 = (((t71 + t69) * 0.5f) + 101325.0f) * 0.001f;
    let flow = (((((t136 * t128) / sqrt(sqrt((t128 * t128) + (t135 * t135)))) * 60000.0f) - (((t150 * t145) / sqrt(sqrt((t145 * t145) + (t149 * t149)))) * 60000.0f)) + ((((t136 * t172) / sqrt(sqrt((t172 * t172) + (t176 * t176)))) * 60000.0f) - (((t150 * t159) / sqrt(sqrt((t159 * t159) + (t163 * t163)))) * 60000.0f))) * 0.5f;
    return vec3<f32>(state.spool, flow, 0.0f);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t211 = -plant.saturation;
    let t214 = plant.gain * min(max(start.command - state.spool, t211), plant.saturation);
    let t216 = (state.integrator - state.spool) * plant.rate;
    let t217 = step * 0.5f;
    let t221 = state.spool + (t217 * t216);
    let t225 = plant.gain * min(max(middle.command - t221, t211), plant.saturation);
    let t227 = ((state.integrator + (t217 * t214)) - t221) * plant.rate;
    let t235 = state.spool + (t217 * t227);
    let t239 = plant.gain * min(max(middle.command - t235, t211), plant.saturation);
    let t241 = ((state.integrator + (t217 * t225)) - t235) * plant.rate;
    let t246 = step * 1.0f;
    let t250 = state.spool + (t246 * t241);
    let t262 = step * 0.16666667f;
    return State(state.integrator + (t262 * (((t214 + (2.0f * t225)) + (2.0f * t239)) + (1.0f * (plant.gain * min(max(end.command - t250, t211), plant.saturation))))), state.spool + (t262 * (((t216 + (2.0f * t227)) + (2.0f * t241)) + (1.0f * (((state.integrator + (t246 * t239)) - t250) * plant.rate)))));
}
