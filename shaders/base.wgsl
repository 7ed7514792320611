// The physics of the actuator alone, as `Structure::actuator(10.0, "V")` has it:
// traced from src/model, to be composed with evaluate.wgsl. For reading; a test keeps it up to date.

struct Input {
    command: f32,
    supply: f32,
    tank: f32,
    a: f32,
    b: f32,
    temperature: f32,
    time: f32,
}

struct Measured {
    spool: f32,
    flow: f32,
    return_flow: f32,
    pressure_a: f32,
    pressure_b: f32,
    load_pressure: f32,
    position: f32,
}

struct Outputs {
    spool: f32,
}

fn load_results(at: u32, stride: u32) -> Outputs {
    return Outputs(results[at + 0u * stride]);
}

fn store_results(at: u32, stride: u32, value: Outputs) {
    results[at + 0u * stride] = value.spool;
}

struct State {
    integrator: f32,
    spool: f32,
}

fn load_states(at: u32, stride: u32) -> State {
    return State(states[at + 0u * stride], states[at + 1u * stride]);
}

fn store_states(at: u32, stride: u32, value: State) {
    states[at + 0u * stride] = value.integrator;
    states[at + 1u * stride] = value.spool;
}

fn diverged(state: State) -> bool {
    return !(abs(state.integrator) < STATE_LIMIT) || !(abs(state.spool) < STATE_LIMIT);
}

struct Stride {
    length: f32,
    part: f32,
    kept: f32,
    followed: f32,
    fed: f32,
    faded: f32,
    slewed: f32,
    lead: f32,
    softness: f32,
    turns: f32,
}

// Integrator and spool, and above zero: what is left to do.
struct ExactStep {
    integrator: f32,
    spool: f32,
    more: f32,
}

struct Plant {
    gain: f32,
    time_constant: f32,
    saturation: f32,
    rate: f32,
}

fn prepare(candidate: u32, population: u32) -> Plant {
    let rate = 1.0f / candidates[1u * population + candidate];
    return Plant(candidates[0u * population + candidate], candidates[1u * population + candidate], candidates[2u * population + candidate], rate);
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

fn observe(plant: Plant, state: State, input: Input) -> Outputs {
    return Outputs(state.spool);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t41 = -plant.saturation;
    let t44 = plant.gain * min(max(start.command - state.spool, t41), plant.saturation);
    let t46 = (state.integrator - state.spool) * plant.rate;
    let t48 = step * 0.5f;
    let t52 = state.spool + (t48 * t46);
    let t58 = plant.gain * min(max(middle.command - t52, t41), plant.saturation);
    let t60 = ((state.integrator + (t48 * t44)) - t52) * plant.rate;
    let t71 = state.spool + (t48 * t60);
    let t75 = plant.gain * min(max(middle.command - t71, t41), plant.saturation);
    let t77 = ((state.integrator + (t48 * t58)) - t71) * plant.rate;
    let t83 = step * 1.0f;
    let t87 = state.spool + (t83 * t77);
    let t103 = step * 0.16666667f;
    return State(state.integrator + (t103 * (((t44 + (2.0f * t58)) + (2.0f * t75)) + (1.0f * (plant.gain * min(max(end.command - t87, t41), plant.saturation))))), state.spool + (t103 * (((t46 + (2.0f * t60)) + (2.0f * t77)) + (1.0f * (((state.integrator + (t83 * t75)) - t87) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t126 = length * 0.125f;
    let t127 = t126 * 1.0f;
    let t130 = (-(stiffness * 0.0f)) * t127;
    let t133 = (1.0f - (plant.rate * 0.0f)) * t127;
    let t136 = -((1.0f * plant.rate) * t127);
    let t140 = t126 * 0.5f;
    let t143 = (-(stiffness * t133)) * t140;
    let t146 = (t130 - (plant.rate * t133)) * t140;
    let t149 = -((t136 * plant.rate) * t140);
    let t154 = t126 * 0.33333334f;
    let t157 = (-(stiffness * t146)) * t154;
    let t160 = (t143 - (plant.rate * t146)) * t154;
    let t163 = -((t149 * plant.rate) * t154);
    let t168 = t126 * 0.25f;
    let t171 = (-(stiffness * t160)) * t168;
    let t174 = (t157 - (plant.rate * t160)) * t168;
    let t177 = -((t163 * plant.rate) * t168);
    let t182 = t126 * 0.2f;
    let t185 = (-(stiffness * t174)) * t182;
    let t188 = (t171 - (plant.rate * t174)) * t182;
    let t191 = -((t177 * plant.rate) * t182);
    let t195 = t126 * 0.16666667f;
    let t198 = (-(stiffness * t188)) * t195;
    let t201 = (t185 - (plant.rate * t188)) * t195;
    let t204 = -((t191 * plant.rate) * t195);
    let t209 = t126 * 0.14285715f;
    let t212 = (-(stiffness * t201)) * t209;
    let t215 = (t198 - (plant.rate * t201)) * t209;
    let t218 = -((t204 * plant.rate) * t209);
    let t222 = t126 * 0.125f;
    let t232 = (((((((0.0f + t130) + t143) + t157) + t171) + t185) + t198) + t212) + ((-(stiffness * t215)) * t222);
    let t233 = (((((((0.0f + t133) + t146) + t160) + t174) + t188) + t201) + t215) + ((t212 - (plant.rate * t215)) * t222);
    let t234 = (((((((0.0f - t136) - t149) - t163) - t177) - t191) - t204) - t218) - (-((t218 * plant.rate) * t222));
    let t235 = 2.0f * t232;
    let t240 = t235 + ((t232 * t232) - ((stiffness * t233) * t233));
    let t244 = t233 * (2.0f + (t235 - (plant.rate * t233)));
    let t246 = t234 * (2.0f - t234);
    let t247 = 2.0f * t240;
    let t252 = t247 + ((t240 * t240) - ((stiffness * t244) * t244));
    let t256 = t244 * (2.0f + (t247 - (plant.rate * t244)));
    let t258 = t246 * (2.0f - t246);
    let t259 = 2.0f * t252;
    let t268 = t256 * (2.0f + (t259 - (plant.rate * t256)));
    let t271 = plant.gain * plant.saturation;
    let t273 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t273), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t259 + ((t252 * t252) - ((stiffness * t256) * t256)), t268 * plant.rate, t268 * plant.gain, t258 * (2.0f - t258), t271 * length, t271 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t273 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t45 = state.integrator - state.spool;
    let t290 = command - state.spool;
    let t291 = -t290;
    let t300 = select(-stride.slewed, stride.slewed, t290 > 0.0);
    let t306 = max(t290, t291) - plant.saturation;
    let t308 = state.integrator + select((stride.kept * (t291 + t45)) - (stride.fed * t291), t300, t306 > 0.0);
    let t311 = state.spool + select((stride.kept * t291) + (stride.followed * t45), t300 - ((select(-stride.lead, stride.lead, t290 > 0.0) - t45) * stride.faded), t306 > 0.0);
    let t312 = command - t311;
    let t318 = -t312;
    return ExactStep(t308, t311, select(min(((t291 * t291) + ((t45 * t45) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t312, t318) - plant.saturation, max(stride.turns, -(t45 * (t308 - t311))))), plant.saturation - select(t318, t312, t290 > 0.0), t306 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t290 = command - state.spool;
    let t334 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t335 = t334 * plant.rate;
    let t336 = t334 * plant.gain;
    let t337 = (state.integrator - state.spool) * t335;
    let t338 = 0.0f - t337;
    let t341 = t290 + (0.001f * t338);
    let t344 = max(t341, -t341) - plant.saturation;
    let t345 = select(t336, 0.0f, t344 > 0.0);
    let t346 = t336 * plant.saturation;
    let t350 = select(t336 * t290, select(-t346, t346, t341 > 0.0), t344 > 0.0);
    let t353 = (t350 - t337) * (t335 * 0.5f);
    let t355 = t338 * (t345 * 0.5f);
    let t359 = (t355 - t353) * (t335 * 0.33333334f);
    let t361 = (-t353) * (t345 * 0.33333334f);
    let t365 = (t361 - t359) * (t335 * 0.25f);
    let t367 = (-t359) * (t345 * 0.25f);
    let t371 = (t367 - t365) * (t335 * 0.2f);
    let t373 = (-t365) * (t345 * 0.2f);
    let t377 = (t373 - t371) * (t335 * 0.16666667f);
    let t379 = (-t371) * (t345 * 0.16666667f);
    let t383 = (t379 - t377) * (t335 * 0.14285715f);
    let t385 = (-t377) * (t345 * 0.14285715f);
    let t387 = 1.0f * 1.0f;
    let t400 = t387 * t387;
    let t402 = ((state.integrator + (t350 * 1.0f)) + ((t355 + (t361 * 1.0f)) * t387)) + (((t367 + (t373 * 1.0f)) + ((t379 + (t385 * 1.0f)) * t387)) * t400);
    let t416 = ((state.spool + (t337 * 1.0f)) + ((t353 + (t359 * 1.0f)) * t387)) + (((t365 + (t371 * 1.0f)) + ((t377 + (t383 * 1.0f)) * t387)) * t400);
    let t419 = 0.0f - ((t402 - t416) * t335);
    let t424 = select(1.0f, t338 / (t338 - t419), (-(t338 * t419)) > 0.0);
    let t427 = t424 * t424;
    let t443 = (command + (0.0f * t424)) - (((state.spool + (t337 * t424)) + ((t353 + (t359 * t424)) * t427)) + (((t365 + (t371 * t424)) + ((t377 + (t383 * t424)) * t427)) * (t427 * t427)));
    let t446 = -t443;
    let t451 = select(plant.saturation - max(t443, t446), select(t446, t443, t341 > 0.0) - plant.saturation, t344 > 0.0);
    let t452 = select(t424, 1.0f, t451 > 0.0);
    let t453 = select(t443, (command + 0.0f) - t416, t451 > 0.0);
    let t454 = select(t453, t341, t344 > 0.0);
    let t457 = plant.saturation - select(-t453, t453, t454 > 0.0);
    let t459 = select(t457, -t457, t344 > 0.0);
    let t460 = left - t334;
    let t461 = -t459;
    let t463 = plant.saturation - select(-t290, t290, t454 > 0.0);
    let t466 = max(select(t463, -t463, t344 > 0.0), 0.0f);
    let t468 = select(-t338, t338, t454 > 0.0);
    let t472 = (-select(-t468, t468, t344 > 0.0)) * t452;
    let t489 = t452 * min(max((2.0f * t466) / max(t472 + sqrt(max((t472 * t472) - ((4.0f * ((t459 - t466) + t472)) * t466), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t490 = t489 * t489;
    let t503 = t490 * t490;
    let t519 = ((state.spool + (t337 * t489)) + ((t353 + (t359 * t489)) * t490)) + (((t365 + (t371 * t489)) + ((t377 + (t383 * t489)) * t490)) * t503);
    let t522 = (command + (0.0f * t489)) - t519;
    let t525 = plant.saturation - select(-t522, t522, t454 > 0.0);
    let t530 = 0.0f - (((((state.integrator + (t350 * t489)) + ((t355 + (t361 * t489)) * t490)) + (((t367 + (t373 * t489)) + ((t379 + (t385 * t489)) * t490)) * t503)) - t519) * t335);
    let t532 = select(-t530, t530, t454 > 0.0);
    let t534 = select(-t532, t532, t344 > 0.0);
    let t543 = max(min(max(t489 - ((select(t525, -t525, t344 > 0.0) * t534) / ((t534 * t534) + 1e-30f)), 0.0f), t452), 0.0001f);
    let t544 = t543 * t543;
    let t557 = t544 * t544;
    return ExactStep(select(t402, ((state.integrator + (t350 * t543)) + ((t355 + (t361 * t543)) * t544)) + (((t367 + (t373 * t543)) + ((t379 + (t385 * t543)) * t544)) * t557), t461 > 0.0), select(t416, ((state.spool + (t337 * t543)) + ((t353 + (t359 * t543)) * t544)) + (((t365 + (t371 * t543)) + ((t377 + (t383 * t543)) * t544)) * t557), t461 > 0.0), select(t460, t460 + (t334 * (1.0f - t543)), t461 > 0.0));
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t591 = measured.spool - simulated.spool;
    return Outputs(sums.spool + (weight * (t591 * t591)));
}

fn add(sums: Outputs, more: Outputs) -> Outputs {
    return Outputs(sums.spool + more.spool);
}

fn response(simulated: Outputs) -> f32 {
    return f32(simulated.spool);
}

fn between(start: Input, end: Input, share: f32) -> Input {
    return Input(start.command + (share * (end.command - start.command)), start.supply + (share * (end.supply - start.supply)), start.tank + (share * (end.tank - start.tank)), start.a + (share * (end.a - start.a)), start.b + (share * (end.b - start.b)), start.temperature + (share * (end.temperature - start.temperature)), start.time + (share * (end.time - start.time)));
}
