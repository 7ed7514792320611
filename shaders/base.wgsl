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
    let t45 = -plant.saturation;
    let t48 = plant.gain * min(max(start.command - state.spool, t45), plant.saturation);
    let t50 = step * 0.5f;
    let t54 = state.spool + (t50 * t22);
    let t60 = plant.gain * min(max(middle.command - t54, t45), plant.saturation);
    let t62 = ((state.integrator + (t50 * t48)) - t54) * plant.rate;
    let t73 = state.spool + (t50 * t62);
    let t77 = plant.gain * min(max(middle.command - t73, t45), plant.saturation);
    let t79 = ((state.integrator + (t50 * t60)) - t73) * plant.rate;
    let t85 = step * 1.0f;
    let t89 = state.spool + (t85 * t79);
    let t105 = step * 0.16666667f;
    return State(state.integrator + (t105 * (((t48 + (2.0f * t60)) + (2.0f * t77)) + (1.0f * (plant.gain * min(max(end.command - t89, t45), plant.saturation))))), state.spool + (t105 * (((t22 + (2.0f * t62)) + (2.0f * t79)) + (1.0f * (((state.integrator + (t85 * t77)) - t89) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t128 = length * 0.125f;
    let t129 = t128 * 1.0f;
    let t132 = (-(stiffness * 0.0f)) * t129;
    let t135 = (1.0f - (plant.rate * 0.0f)) * t129;
    let t138 = -((1.0f * plant.rate) * t129);
    let t142 = t128 * 0.5f;
    let t145 = (-(stiffness * t135)) * t142;
    let t148 = (t132 - (plant.rate * t135)) * t142;
    let t151 = -((t138 * plant.rate) * t142);
    let t156 = t128 * 0.33333334f;
    let t159 = (-(stiffness * t148)) * t156;
    let t162 = (t145 - (plant.rate * t148)) * t156;
    let t165 = -((t151 * plant.rate) * t156);
    let t170 = t128 * 0.25f;
    let t173 = (-(stiffness * t162)) * t170;
    let t176 = (t159 - (plant.rate * t162)) * t170;
    let t179 = -((t165 * plant.rate) * t170);
    let t184 = t128 * 0.2f;
    let t187 = (-(stiffness * t176)) * t184;
    let t190 = (t173 - (plant.rate * t176)) * t184;
    let t193 = -((t179 * plant.rate) * t184);
    let t197 = t128 * 0.16666667f;
    let t200 = (-(stiffness * t190)) * t197;
    let t203 = (t187 - (plant.rate * t190)) * t197;
    let t206 = -((t193 * plant.rate) * t197);
    let t211 = t128 * 0.14285715f;
    let t214 = (-(stiffness * t203)) * t211;
    let t217 = (t200 - (plant.rate * t203)) * t211;
    let t220 = -((t206 * plant.rate) * t211);
    let t224 = t128 * 0.125f;
    let t234 = (((((((0.0f + t132) + t145) + t159) + t173) + t187) + t200) + t214) + ((-(stiffness * t217)) * t224);
    let t235 = (((((((0.0f + t135) + t148) + t162) + t176) + t190) + t203) + t217) + ((t214 - (plant.rate * t217)) * t224);
    let t236 = (((((((0.0f - t138) - t151) - t165) - t179) - t193) - t206) - t220) - (-((t220 * plant.rate) * t224));
    let t237 = 2.0f * t234;
    let t242 = t237 + ((t234 * t234) - ((stiffness * t235) * t235));
    let t246 = t235 * (2.0f + (t237 - (plant.rate * t235)));
    let t248 = t236 * (2.0f - t236);
    let t249 = 2.0f * t242;
    let t254 = t249 + ((t242 * t242) - ((stiffness * t246) * t246));
    let t258 = t246 * (2.0f + (t249 - (plant.rate * t246)));
    let t260 = t248 * (2.0f - t248);
    let t261 = 2.0f * t254;
    let t270 = t258 * (2.0f + (t261 - (plant.rate * t258)));
    let t273 = plant.gain * plant.saturation;
    let t275 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t275), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t261 + ((t254 * t254) - ((stiffness * t258) * t258)), t270 * plant.rate, t270 * plant.gain, t260 * (2.0f - t260), t273 * length, t273 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t275 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t21 = state.integrator - state.spool;
    let t292 = command - state.spool;
    let t293 = -t292;
    let t302 = select(-stride.slewed, stride.slewed, t292 > 0.0);
    let t308 = max(t292, t293) - plant.saturation;
    let t310 = state.integrator + select((stride.kept * (t293 + t21)) - (stride.fed * t293), t302, t308 > 0.0);
    let t313 = state.spool + select((stride.kept * t293) + (stride.followed * t21), t302 - ((select(-stride.lead, stride.lead, t292 > 0.0) - t21) * stride.faded), t308 > 0.0);
    let t314 = command - t313;
    let t320 = -t314;
    return ExactStep(t310, t313, select(min(((t293 * t293) + ((t21 * t21) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t314, t320) - plant.saturation, max(stride.turns, -(t21 * (t310 - t313))))), plant.saturation - select(t320, t314, t292 > 0.0), t308 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t292 = command - state.spool;
    let t336 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t337 = t336 * plant.rate;
    let t338 = t336 * plant.gain;
    let t339 = (state.integrator - state.spool) * t337;
    let t340 = 0.0f - t339;
    let t343 = t292 + (0.001f * t340);
    let t346 = max(t343, -t343) - plant.saturation;
    let t347 = select(t338, 0.0f, t346 > 0.0);
    let t348 = t338 * plant.saturation;
    let t352 = select(t338 * t292, select(-t348, t348, t343 > 0.0), t346 > 0.0);
    let t355 = (t352 - t339) * (t337 * 0.5f);
    let t357 = t340 * (t347 * 0.5f);
    let t361 = (t357 - t355) * (t337 * 0.33333334f);
    let t363 = (-t355) * (t347 * 0.33333334f);
    let t367 = (t363 - t361) * (t337 * 0.25f);
    let t369 = (-t361) * (t347 * 0.25f);
    let t373 = (t369 - t367) * (t337 * 0.2f);
    let t375 = (-t367) * (t347 * 0.2f);
    let t379 = (t375 - t373) * (t337 * 0.16666667f);
    let t381 = (-t373) * (t347 * 0.16666667f);
    let t385 = (t381 - t379) * (t337 * 0.14285715f);
    let t387 = (-t379) * (t347 * 0.14285715f);
    let t389 = 1.0f * 1.0f;
    let t402 = t389 * t389;
    let t404 = ((state.integrator + (t352 * 1.0f)) + ((t357 + (t363 * 1.0f)) * t389)) + (((t369 + (t375 * 1.0f)) + ((t381 + (t387 * 1.0f)) * t389)) * t402);
    let t418 = ((state.spool + (t339 * 1.0f)) + ((t355 + (t361 * 1.0f)) * t389)) + (((t367 + (t373 * 1.0f)) + ((t379 + (t385 * 1.0f)) * t389)) * t402);
    let t421 = 0.0f - ((t404 - t418) * t337);
    let t426 = select(1.0f, t340 / (t340 - t421), (-(t340 * t421)) > 0.0);
    let t429 = t426 * t426;
    let t445 = (command + (0.0f * t426)) - (((state.spool + (t339 * t426)) + ((t355 + (t361 * t426)) * t429)) + (((t367 + (t373 * t426)) + ((t379 + (t385 * t426)) * t429)) * (t429 * t429)));
    let t448 = -t445;
    let t453 = select(plant.saturation - max(t445, t448), select(t448, t445, t343 > 0.0) - plant.saturation, t346 > 0.0);
    let t454 = select(t426, 1.0f, t453 > 0.0);
    let t455 = select(t445, (command + 0.0f) - t418, t453 > 0.0);
    let t456 = select(t455, t343, t346 > 0.0);
    let t459 = plant.saturation - select(-t455, t455, t456 > 0.0);
    let t461 = select(t459, -t459, t346 > 0.0);
    let t462 = left - t336;
    let t463 = -t461;
    let t465 = plant.saturation - select(-t292, t292, t456 > 0.0);
    let t468 = max(select(t465, -t465, t346 > 0.0), 0.0f);
    let t470 = select(-t340, t340, t456 > 0.0);
    let t474 = (-select(-t470, t470, t346 > 0.0)) * t454;
    let t491 = t454 * min(max((2.0f * t468) / max(t474 + sqrt(max((t474 * t474) - ((4.0f * ((t461 - t468) + t474)) * t468), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t492 = t491 * t491;
    let t505 = t492 * t492;
    let t521 = ((state.spool + (t339 * t491)) + ((t355 + (t361 * t491)) * t492)) + (((t367 + (t373 * t491)) + ((t379 + (t385 * t491)) * t492)) * t505);
    let t524 = (command + (0.0f * t491)) - t521;
    let t527 = plant.saturation - select(-t524, t524, t456 > 0.0);
    let t532 = 0.0f - (((((state.integrator + (t352 * t491)) + ((t357 + (t363 * t491)) * t492)) + (((t369 + (t375 * t491)) + ((t381 + (t387 * t491)) * t492)) * t505)) - t521) * t337);
    let t534 = select(-t532, t532, t456 > 0.0);
    let t536 = select(-t534, t534, t346 > 0.0);
    let t545 = max(min(max(t491 - ((select(t527, -t527, t346 > 0.0) * t536) / ((t536 * t536) + 1e-30f)), 0.0f), t454), 0.0001f);
    let t546 = t545 * t545;
    let t559 = t546 * t546;
    return ExactStep(select(t404, ((state.integrator + (t352 * t545)) + ((t357 + (t363 * t545)) * t546)) + (((t369 + (t375 * t545)) + ((t381 + (t387 * t545)) * t546)) * t559), t463 > 0.0), select(t418, ((state.spool + (t339 * t545)) + ((t355 + (t361 * t545)) * t546)) + (((t367 + (t373 * t545)) + ((t379 + (t385 * t545)) * t546)) * t559), t463 > 0.0), select(t462, t462 + (t336 * (1.0f - t545)), t463 > 0.0));
}

fn follow(plant: Plant, state: State, after: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    return State(after.integrator, after.spool);
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t593 = measured.spool - simulated.spool;
    return Outputs(sums.spool + (weight * (t593 * t593)));
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
