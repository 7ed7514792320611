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
    let t58 = plant.gain * min(max(middle.command - t54, t45), plant.saturation);
    let t60 = ((state.integrator + (t50 * t48)) - t54) * plant.rate;
    let t69 = state.spool + (t50 * t60);
    let t73 = plant.gain * min(max(middle.command - t69, t45), plant.saturation);
    let t75 = ((state.integrator + (t50 * t58)) - t69) * plant.rate;
    let t80 = step * 1.0f;
    let t84 = state.spool + (t80 * t75);
    let t96 = step * 0.16666667f;
    return State(state.integrator + (t96 * (((t48 + (2.0f * t58)) + (2.0f * t73)) + (1.0f * (plant.gain * min(max(end.command - t84, t45), plant.saturation))))), state.spool + (t96 * (((t22 + (2.0f * t60)) + (2.0f * t75)) + (1.0f * (((state.integrator + (t80 * t73)) - t84) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t117 = length * 0.125f;
    let t118 = t117 * 1.0f;
    let t121 = (-(stiffness * 0.0f)) * t118;
    let t124 = (1.0f - (plant.rate * 0.0f)) * t118;
    let t127 = -((1.0f * plant.rate) * t118);
    let t131 = t117 * 0.5f;
    let t134 = (-(stiffness * t124)) * t131;
    let t137 = (t121 - (plant.rate * t124)) * t131;
    let t140 = -((t127 * plant.rate) * t131);
    let t145 = t117 * 0.33333334f;
    let t148 = (-(stiffness * t137)) * t145;
    let t151 = (t134 - (plant.rate * t137)) * t145;
    let t154 = -((t140 * plant.rate) * t145);
    let t159 = t117 * 0.25f;
    let t162 = (-(stiffness * t151)) * t159;
    let t165 = (t148 - (plant.rate * t151)) * t159;
    let t168 = -((t154 * plant.rate) * t159);
    let t173 = t117 * 0.2f;
    let t176 = (-(stiffness * t165)) * t173;
    let t179 = (t162 - (plant.rate * t165)) * t173;
    let t182 = -((t168 * plant.rate) * t173);
    let t186 = t117 * 0.16666667f;
    let t189 = (-(stiffness * t179)) * t186;
    let t192 = (t176 - (plant.rate * t179)) * t186;
    let t195 = -((t182 * plant.rate) * t186);
    let t200 = t117 * 0.14285715f;
    let t203 = (-(stiffness * t192)) * t200;
    let t206 = (t189 - (plant.rate * t192)) * t200;
    let t209 = -((t195 * plant.rate) * t200);
    let t213 = t117 * 0.125f;
    let t223 = (((((((0.0f + t121) + t134) + t148) + t162) + t176) + t189) + t203) + ((-(stiffness * t206)) * t213);
    let t224 = (((((((0.0f + t124) + t137) + t151) + t165) + t179) + t192) + t206) + ((t203 - (plant.rate * t206)) * t213);
    let t225 = (((((((0.0f - t127) - t140) - t154) - t168) - t182) - t195) - t209) - (-((t209 * plant.rate) * t213));
    let t226 = 2.0f * t223;
    let t231 = t226 + ((t223 * t223) - ((stiffness * t224) * t224));
    let t235 = t224 * (2.0f + (t226 - (plant.rate * t224)));
    let t237 = t225 * (2.0f - t225);
    let t238 = 2.0f * t231;
    let t243 = t238 + ((t231 * t231) - ((stiffness * t235) * t235));
    let t247 = t235 * (2.0f + (t238 - (plant.rate * t235)));
    let t249 = t237 * (2.0f - t237);
    let t250 = 2.0f * t243;
    let t259 = t247 * (2.0f + (t250 - (plant.rate * t247)));
    let t262 = plant.gain * plant.saturation;
    let t264 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t264), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t250 + ((t243 * t243) - ((stiffness * t247) * t247)), t259 * plant.rate, t259 * plant.gain, t249 * (2.0f - t249), t262 * length, t262 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t264 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t21 = state.integrator - state.spool;
    let t281 = command - state.spool;
    let t282 = -t281;
    let t291 = select(-stride.slewed, stride.slewed, t281 > 0.0);
    let t297 = max(t281, t282) - plant.saturation;
    let t299 = state.integrator + select((stride.kept * (t282 + t21)) - (stride.fed * t282), t291, t297 > 0.0);
    let t302 = state.spool + select((stride.kept * t282) + (stride.followed * t21), t291 - ((select(-stride.lead, stride.lead, t281 > 0.0) - t21) * stride.faded), t297 > 0.0);
    let t303 = command - t302;
    let t309 = -t303;
    return ExactStep(t299, t302, select(min(((t282 * t282) + ((t21 * t21) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t303, t309) - plant.saturation, max(stride.turns, -(t21 * (t299 - t302))))), plant.saturation - select(t309, t303, t281 > 0.0), t297 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t281 = command - state.spool;
    let t325 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t326 = t325 * plant.rate;
    let t327 = t325 * plant.gain;
    let t328 = (state.integrator - state.spool) * t326;
    let t329 = 0.0f - t328;
    let t332 = t281 + (0.001f * t329);
    let t335 = max(t332, -t332) - plant.saturation;
    let t336 = select(t327, 0.0f, t335 > 0.0);
    let t337 = t327 * plant.saturation;
    let t341 = select(t327 * t281, select(-t337, t337, t332 > 0.0), t335 > 0.0);
    let t344 = (t341 - t328) * (t326 * 0.5f);
    let t346 = t329 * (t336 * 0.5f);
    let t350 = (t346 - t344) * (t326 * 0.33333334f);
    let t352 = (-t344) * (t336 * 0.33333334f);
    let t356 = (t352 - t350) * (t326 * 0.25f);
    let t358 = (-t350) * (t336 * 0.25f);
    let t362 = (t358 - t356) * (t326 * 0.2f);
    let t364 = (-t356) * (t336 * 0.2f);
    let t368 = (t364 - t362) * (t326 * 0.16666667f);
    let t370 = (-t362) * (t336 * 0.16666667f);
    let t374 = (t370 - t368) * (t326 * 0.14285715f);
    let t376 = (-t368) * (t336 * 0.14285715f);
    let t378 = 1.0f * 1.0f;
    let t391 = t378 * t378;
    let t393 = ((state.integrator + (t341 * 1.0f)) + ((t346 + (t352 * 1.0f)) * t378)) + (((t358 + (t364 * 1.0f)) + ((t370 + (t376 * 1.0f)) * t378)) * t391);
    let t407 = ((state.spool + (t328 * 1.0f)) + ((t344 + (t350 * 1.0f)) * t378)) + (((t356 + (t362 * 1.0f)) + ((t368 + (t374 * 1.0f)) * t378)) * t391);
    let t410 = 0.0f - ((t393 - t407) * t326);
    let t415 = select(1.0f, t329 / (t329 - t410), (-(t329 * t410)) > 0.0);
    let t418 = t415 * t415;
    let t434 = (command + (0.0f * t415)) - (((state.spool + (t328 * t415)) + ((t344 + (t350 * t415)) * t418)) + (((t356 + (t362 * t415)) + ((t368 + (t374 * t415)) * t418)) * (t418 * t418)));
    let t437 = -t434;
    let t442 = select(plant.saturation - max(t434, t437), select(t437, t434, t332 > 0.0) - plant.saturation, t335 > 0.0);
    let t443 = select(t415, 1.0f, t442 > 0.0);
    let t444 = select(t434, (command + 0.0f) - t407, t442 > 0.0);
    let t445 = select(t444, t332, t335 > 0.0);
    let t448 = plant.saturation - select(-t444, t444, t445 > 0.0);
    let t450 = select(t448, -t448, t335 > 0.0);
    let t451 = left - t325;
    let t452 = -t450;
    let t454 = plant.saturation - select(-t281, t281, t445 > 0.0);
    let t457 = max(select(t454, -t454, t335 > 0.0), 0.0f);
    let t459 = select(-t329, t329, t445 > 0.0);
    let t463 = (-select(-t459, t459, t335 > 0.0)) * t443;
    let t480 = t443 * min(max((2.0f * t457) / max(t463 + sqrt(max((t463 * t463) - ((4.0f * ((t450 - t457) + t463)) * t457), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t481 = t480 * t480;
    let t494 = t481 * t481;
    let t510 = ((state.spool + (t328 * t480)) + ((t344 + (t350 * t480)) * t481)) + (((t356 + (t362 * t480)) + ((t368 + (t374 * t480)) * t481)) * t494);
    let t513 = (command + (0.0f * t480)) - t510;
    let t516 = plant.saturation - select(-t513, t513, t445 > 0.0);
    let t521 = 0.0f - (((((state.integrator + (t341 * t480)) + ((t346 + (t352 * t480)) * t481)) + (((t358 + (t364 * t480)) + ((t370 + (t376 * t480)) * t481)) * t494)) - t510) * t326);
    let t523 = select(-t521, t521, t445 > 0.0);
    let t525 = select(-t523, t523, t335 > 0.0);
    let t534 = max(min(max(t480 - ((select(t516, -t516, t335 > 0.0) * t525) / ((t525 * t525) + 1e-30f)), 0.0f), t443), 0.0001f);
    let t535 = t534 * t534;
    let t548 = t535 * t535;
    return ExactStep(select(t393, ((state.integrator + (t341 * t534)) + ((t346 + (t352 * t534)) * t535)) + (((t358 + (t364 * t534)) + ((t370 + (t376 * t534)) * t535)) * t548), t452 > 0.0), select(t407, ((state.spool + (t328 * t534)) + ((t344 + (t350 * t534)) * t535)) + (((t356 + (t362 * t534)) + ((t368 + (t374 * t534)) * t535)) * t548), t452 > 0.0), select(t451, t451 + (t325 * (1.0f - t534)), t452 > 0.0));
}

fn follow(plant: Plant, state: State, after: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    return State(after.integrator, after.spool);
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t582 = measured.spool - simulated.spool;
    return Outputs(sums.spool + (weight * (t582 * t582)));
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
