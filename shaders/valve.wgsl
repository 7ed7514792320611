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

fn observe(plant: Plant, state: State, input: Input) -> vec3<f32> {
    let opening = state.spool * 10.0f;
    let t65 = input.supply * 100000.0f;
    let t66 = input.tank * 100000.0f;
    let t67 = input.a * 100000.0f;
    let t68 = input.b * 100000.0f;
    let t69 = plant.opening_offset + opening;
    let forward_area = max(((((plant.first_area + (plant.slope_1 * min(max(t69 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t69 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t69 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t69 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t69 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t98 = plant.opening_offset - opening;
    let backward_area = max(((((plant.first_area + (plant.slope_1 * min(max(t98 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t98 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t98 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t98 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t98 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t125 = t65 - t67;
    let t132 = (((t65 + t67) * 0.5f) + 101325.0f) * 0.001f;
    let t133 = forward_area * plant.orifice_coefficient;
    let t142 = t67 - t66;
    let t146 = (((t67 + t66) * 0.5f) + 101325.0f) * 0.001f;
    let t147 = backward_area * plant.orifice_coefficient;
    let t156 = t65 - t68;
    let t160 = (((t65 + t68) * 0.5f) + 101325.0f) * 0.001f;
    let t169 = t68 - t66;
    let t173 = (((t68 + t66) * 0.5f) + 101325.0f) * 0.001f;
    let flow = (((((t133 * t125) / sqrt(sqrt((t125 * t125) + (t132 * t132)))) * 60000.0f) - (((t147 * t142) / sqrt(sqrt((t142 * t142) + (t146 * t146)))) * 60000.0f)) + ((((t133 * t169) / sqrt(sqrt((t169 * t169) + (t173 * t173)))) * 60000.0f) - (((t147 * t156) / sqrt(sqrt((t156 * t156) + (t160 * t160)))) * 60000.0f))) * 0.5f;
    return vec3<f32>(state.spool, flow, 0.0f);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t202 = -plant.saturation;
    let t205 = plant.gain * min(max(start.command - state.spool, t202), plant.saturation);
    let t207 = (state.integrator - state.spool) * plant.rate;
    let t208 = step * 0.5f;
    let t212 = state.spool + (t208 * t207);
    let t216 = plant.gain * min(max(middle.command - t212, t202), plant.saturation);
    let t218 = ((state.integrator + (t208 * t205)) - t212) * plant.rate;
    let t226 = state.spool + (t208 * t218);
    let t230 = plant.gain * min(max(middle.command - t226, t202), plant.saturation);
    let t232 = ((state.integrator + (t208 * t216)) - t226) * plant.rate;
    let t237 = step * 1.0f;
    let t241 = state.spool + (t237 * t232);
    let t253 = step * 0.16666667f;
    return State(state.integrator + (t253 * (((t205 + (2.0f * t216)) + (2.0f * t230)) + (1.0f * (plant.gain * min(max(end.command - t241, t202), plant.saturation))))), state.spool + (t253 * (((t207 + (2.0f * t218)) + (2.0f * t232)) + (1.0f * (((state.integrator + (t237 * t230)) - t241) * plant.rate)))));
}
