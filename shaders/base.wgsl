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
    let t22 = (state.integrator - state.spool) * plant.rate;
    let t46 = -plant.saturation;
    let t49 = plant.gain * min(max(start.command - state.spool, t46), plant.saturation);
    let t51 = step * 0.5f;
    let t55 = state.spool + (t51 * t22);
    let t60 = plant.gain * min(max(middle.command - t55, t46), plant.saturation);
    let t62 = ((state.integrator + (t51 * t49)) - t55) * plant.rate;
    let t71 = state.spool + (t51 * t62);
    let t75 = plant.gain * min(max(middle.command - t71, t46), plant.saturation);
    let t77 = ((state.integrator + (t51 * t60)) - t71) * plant.rate;
    let t82 = step * 1.0f;
    let t86 = state.spool + (t82 * t77);
    let t99 = step * 0.16666667f;
    return State(state.integrator + (t99 * (((t49 + (2.0f * t60)) + (2.0f * t75)) + (1.0f * (plant.gain * min(max(end.command - t86, t46), plant.saturation))))), state.spool + (t99 * (((t22 + (2.0f * t62)) + (2.0f * t77)) + (1.0f * (((state.integrator + (t82 * t75)) - t86) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t120 = length * 0.125f;
    let t121 = t120 * 1.0f;
    let t124 = (-(stiffness * 0.0f)) * t121;
    let t127 = (1.0f - (plant.rate * 0.0f)) * t121;
    let t130 = -((1.0f * plant.rate) * t121);
    let t134 = t120 * 0.5f;
    let t137 = (-(stiffness * t127)) * t134;
    let t140 = (t124 - (plant.rate * t127)) * t134;
    let t143 = -((t130 * plant.rate) * t134);
    let t148 = t120 * 0.33333334f;
    let t151 = (-(stiffness * t140)) * t148;
    let t154 = (t137 - (plant.rate * t140)) * t148;
    let t157 = -((t143 * plant.rate) * t148);
    let t162 = t120 * 0.25f;
    let t165 = (-(stiffness * t154)) * t162;
    let t168 = (t151 - (plant.rate * t154)) * t162;
    let t171 = -((t157 * plant.rate) * t162);
    let t176 = t120 * 0.2f;
    let t179 = (-(stiffness * t168)) * t176;
    let t182 = (t165 - (plant.rate * t168)) * t176;
    let t185 = -((t171 * plant.rate) * t176);
    let t189 = t120 * 0.16666667f;
    let t192 = (-(stiffness * t182)) * t189;
    let t195 = (t179 - (plant.rate * t182)) * t189;
    let t198 = -((t185 * plant.rate) * t189);
    let t203 = t120 * 0.14285715f;
    let t206 = (-(stiffness * t195)) * t203;
    let t209 = (t192 - (plant.rate * t195)) * t203;
    let t212 = -((t198 * plant.rate) * t203);
    let t216 = t120 * 0.125f;
    let t226 = (((((((0.0f + t124) + t137) + t151) + t165) + t179) + t192) + t206) + ((-(stiffness * t209)) * t216);
    let t227 = (((((((0.0f + t127) + t140) + t154) + t168) + t182) + t195) + t209) + ((t206 - (plant.rate * t209)) * t216);
    let t228 = (((((((0.0f - t130) - t143) - t157) - t171) - t185) - t198) - t212) - (-((t212 * plant.rate) * t216));
    let t229 = 2.0f * t226;
    let t234 = t229 + ((t226 * t226) - ((stiffness * t227) * t227));
    let t238 = t227 * (2.0f + (t229 - (plant.rate * t227)));
    let t240 = t228 * (2.0f - t228);
    let t241 = 2.0f * t234;
    let t246 = t241 + ((t234 * t234) - ((stiffness * t238) * t238));
    let t250 = t238 * (2.0f + (t241 - (plant.rate * t238)));
    let t252 = t240 * (2.0f - t240);
    let t253 = 2.0f * t246;
    let t262 = t250 * (2.0f + (t253 - (plant.rate * t250)));
    let t265 = plant.gain * plant.saturation;
    let t267 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t267), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t253 + ((t246 * t246) - ((stiffness * t250) * t250)), t262 * plant.rate, t262 * plant.gain, t252 * (2.0f - t252), t265 * length, t265 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t267 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t21 = state.integrator - state.spool;
    let t284 = command - state.spool;
    let t285 = -t284;
    let t294 = select(-stride.slewed, stride.slewed, t284 > 0.0);
    let t300 = max(t284, t285) - plant.saturation;
    let t302 = state.integrator + select((stride.kept * (t285 + t21)) - (stride.fed * t285), t294, t300 > 0.0);
    let t305 = state.spool + select((stride.kept * t285) + (stride.followed * t21), t294 - ((select(-stride.lead, stride.lead, t284 > 0.0) - t21) * stride.faded), t300 > 0.0);
    let t306 = command - t305;
    let t312 = -t306;
    return ExactStep(t302, t305, select(min(((t285 * t285) + ((t21 * t21) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t306, t312) - plant.saturation, max(stride.turns, -(t21 * (t302 - t305))))), plant.saturation - select(t312, t306, t284 > 0.0), t300 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t284 = command - state.spool;
    let t328 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t329 = t328 * plant.rate;
    let t330 = t328 * plant.gain;
    let t331 = (state.integrator - state.spool) * t329;
    let t332 = 0.0f - t331;
    let t335 = t284 + (0.001f * t332);
    let t338 = max(t335, -t335) - plant.saturation;
    let t339 = select(t330, 0.0f, t338 > 0.0);
    let t340 = t330 * plant.saturation;
    let t344 = select(t330 * t284, select(-t340, t340, t335 > 0.0), t338 > 0.0);
    let t347 = (t344 - t331) * (t329 * 0.5f);
    let t349 = t332 * (t339 * 0.5f);
    let t353 = (t349 - t347) * (t329 * 0.33333334f);
    let t355 = (-t347) * (t339 * 0.33333334f);
    let t359 = (t355 - t353) * (t329 * 0.25f);
    let t361 = (-t353) * (t339 * 0.25f);
    let t365 = (t361 - t359) * (t329 * 0.2f);
    let t367 = (-t359) * (t339 * 0.2f);
    let t371 = (t367 - t365) * (t329 * 0.16666667f);
    let t373 = (-t365) * (t339 * 0.16666667f);
    let t377 = (t373 - t371) * (t329 * 0.14285715f);
    let t379 = (-t371) * (t339 * 0.14285715f);
    let t381 = 1.0f * 1.0f;
    let t394 = t381 * t381;
    let t396 = ((state.integrator + (t344 * 1.0f)) + ((t349 + (t355 * 1.0f)) * t381)) + (((t361 + (t367 * 1.0f)) + ((t373 + (t379 * 1.0f)) * t381)) * t394);
    let t410 = ((state.spool + (t331 * 1.0f)) + ((t347 + (t353 * 1.0f)) * t381)) + (((t359 + (t365 * 1.0f)) + ((t371 + (t377 * 1.0f)) * t381)) * t394);
    let t413 = 0.0f - ((t396 - t410) * t329);
    let t418 = select(1.0f, t332 / (t332 - t413), (-(t332 * t413)) > 0.0);
    let t421 = t418 * t418;
    let t437 = (command + (0.0f * t418)) - (((state.spool + (t331 * t418)) + ((t347 + (t353 * t418)) * t421)) + (((t359 + (t365 * t418)) + ((t371 + (t377 * t418)) * t421)) * (t421 * t421)));
    let t440 = -t437;
    let t445 = select(plant.saturation - max(t437, t440), select(t440, t437, t335 > 0.0) - plant.saturation, t338 > 0.0);
    let t446 = select(t418, 1.0f, t445 > 0.0);
    let t447 = select(t437, (command + 0.0f) - t410, t445 > 0.0);
    let t448 = select(t447, t335, t338 > 0.0);
    let t451 = plant.saturation - select(-t447, t447, t448 > 0.0);
    let t453 = select(t451, -t451, t338 > 0.0);
    let t454 = left - t328;
    let t455 = -t453;
    let t457 = plant.saturation - select(-t284, t284, t448 > 0.0);
    let t460 = max(select(t457, -t457, t338 > 0.0), 0.0f);
    let t462 = select(-t332, t332, t448 > 0.0);
    let t466 = (-select(-t462, t462, t338 > 0.0)) * t446;
    let t483 = t446 * min(max((2.0f * t460) / max(t466 + sqrt(max((t466 * t466) - ((4.0f * ((t453 - t460) + t466)) * t460), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t484 = t483 * t483;
    let t497 = t484 * t484;
    let t513 = ((state.spool + (t331 * t483)) + ((t347 + (t353 * t483)) * t484)) + (((t359 + (t365 * t483)) + ((t371 + (t377 * t483)) * t484)) * t497);
    let t516 = (command + (0.0f * t483)) - t513;
    let t519 = plant.saturation - select(-t516, t516, t448 > 0.0);
    let t524 = 0.0f - (((((state.integrator + (t344 * t483)) + ((t349 + (t355 * t483)) * t484)) + (((t361 + (t367 * t483)) + ((t373 + (t379 * t483)) * t484)) * t497)) - t513) * t329);
    let t526 = select(-t524, t524, t448 > 0.0);
    let t528 = select(-t526, t526, t338 > 0.0);
    let t537 = max(min(max(t483 - ((select(t519, -t519, t338 > 0.0) * t528) / ((t528 * t528) + 1e-30f)), 0.0f), t446), 0.0001f);
    let t538 = t537 * t537;
    let t551 = t538 * t538;
    return ExactStep(select(t396, ((state.integrator + (t344 * t537)) + ((t349 + (t355 * t537)) * t538)) + (((t361 + (t367 * t537)) + ((t373 + (t379 * t537)) * t538)) * t551), t455 > 0.0), select(t410, ((state.spool + (t331 * t537)) + ((t347 + (t353 * t537)) * t538)) + (((t359 + (t365 * t537)) + ((t371 + (t377 * t537)) * t538)) * t551), t455 > 0.0), select(t454, t454 + (t328 * (1.0f - t537)), t455 > 0.0));
}

fn follow(plant: Plant, state: State, after: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    return State(after.integrator, after.spool);
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t586 = measured.spool - simulated.spool;
    return Outputs(sums.spool + (weight * (t586 * t586)));
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
