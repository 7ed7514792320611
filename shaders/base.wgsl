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
struct Leap {
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

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t115 = length * 0.125f;
    let t116 = t115 * 1.0f;
    let t119 = (-(stiffness * 0.0f)) * t116;
    let t122 = (1.0f - (plant.rate * 0.0f)) * t116;
    let t125 = -((1.0f * plant.rate) * t116);
    let t129 = t115 * 0.5f;
    let t132 = (-(stiffness * t122)) * t129;
    let t135 = (t119 - (plant.rate * t122)) * t129;
    let t138 = -((t125 * plant.rate) * t129);
    let t143 = t115 * 0.33333334f;
    let t146 = (-(stiffness * t135)) * t143;
    let t149 = (t132 - (plant.rate * t135)) * t143;
    let t152 = -((t138 * plant.rate) * t143);
    let t157 = t115 * 0.25f;
    let t160 = (-(stiffness * t149)) * t157;
    let t163 = (t146 - (plant.rate * t149)) * t157;
    let t166 = -((t152 * plant.rate) * t157);
    let t171 = t115 * 0.2f;
    let t174 = (-(stiffness * t163)) * t171;
    let t177 = (t160 - (plant.rate * t163)) * t171;
    let t180 = -((t166 * plant.rate) * t171);
    let t184 = t115 * 0.16666667f;
    let t187 = (-(stiffness * t177)) * t184;
    let t190 = (t174 - (plant.rate * t177)) * t184;
    let t193 = -((t180 * plant.rate) * t184);
    let t198 = t115 * 0.14285715f;
    let t201 = (-(stiffness * t190)) * t198;
    let t204 = (t187 - (plant.rate * t190)) * t198;
    let t207 = -((t193 * plant.rate) * t198);
    let t211 = t115 * 0.125f;
    let t221 = (((((((0.0f + t119) + t132) + t146) + t160) + t174) + t187) + t201) + ((-(stiffness * t204)) * t211);
    let t222 = (((((((0.0f + t122) + t135) + t149) + t163) + t177) + t190) + t204) + ((t201 - (plant.rate * t204)) * t211);
    let t223 = (((((((0.0f - t125) - t138) - t152) - t166) - t180) - t193) - t207) - (-((t207 * plant.rate) * t211));
    let t224 = 2.0f * t221;
    let t229 = t224 + ((t221 * t221) - ((stiffness * t222) * t222));
    let t233 = t222 * (2.0f + (t224 - (plant.rate * t222)));
    let t235 = t223 * (2.0f - t223);
    let t236 = 2.0f * t229;
    let t241 = t236 + ((t229 * t229) - ((stiffness * t233) * t233));
    let t245 = t233 * (2.0f + (t236 - (plant.rate * t233)));
    let t247 = t235 * (2.0f - t235);
    let t248 = 2.0f * t241;
    let t257 = t245 * (2.0f + (t248 - (plant.rate * t245)));
    let t260 = plant.gain * plant.saturation;
    let t262 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t262), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t248 + ((t241 * t241) - ((stiffness * t245) * t245)), t257 * plant.rate, t257 * plant.gain, t247 * (2.0f - t247), t260 * length, t260 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t262 - 9.0f);
}

fn leap(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> Leap {
    let t45 = state.integrator - state.spool;
    let t279 = command - state.spool;
    let t280 = -t279;
    let t289 = select(-stride.slewed, stride.slewed, t279 > 0.0);
    let t295 = max(t279, t280) - plant.saturation;
    let t297 = state.integrator + select((stride.kept * (t280 + t45)) - (stride.fed * t280), t289, t295 > 0.0);
    let t300 = state.spool + select((stride.kept * t280) + (stride.followed * t45), t289 - ((select(-stride.lead, stride.lead, t279 > 0.0) - t45) * stride.faded), t295 > 0.0);
    let t301 = command - t300;
    let t307 = -t301;
    return Leap(t297, t300, select(min(((t280 * t280) + ((t45 * t45) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t301, t307) - plant.saturation, max(stride.turns, -(t45 * (t297 - t300))))), plant.saturation - select(t307, t301, t279 > 0.0), t295 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> Leap {
    let t279 = command - state.spool;
    let t323 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t324 = t323 * plant.rate;
    let t325 = t323 * plant.gain;
    let t326 = (state.integrator - state.spool) * t324;
    let t327 = 0.0f - t326;
    let t330 = t279 + (0.001f * t327);
    let t333 = max(t330, -t330) - plant.saturation;
    let t334 = select(t325, 0.0f, t333 > 0.0);
    let t335 = t325 * plant.saturation;
    let t339 = select(t325 * t279, select(-t335, t335, t330 > 0.0), t333 > 0.0);
    let t342 = (t339 - t326) * (t324 * 0.5f);
    let t344 = t327 * (t334 * 0.5f);
    let t348 = (t344 - t342) * (t324 * 0.33333334f);
    let t350 = (-t342) * (t334 * 0.33333334f);
    let t354 = (t350 - t348) * (t324 * 0.25f);
    let t356 = (-t348) * (t334 * 0.25f);
    let t360 = (t356 - t354) * (t324 * 0.2f);
    let t362 = (-t354) * (t334 * 0.2f);
    let t366 = (t362 - t360) * (t324 * 0.16666667f);
    let t368 = (-t360) * (t334 * 0.16666667f);
    let t372 = (t368 - t366) * (t324 * 0.14285715f);
    let t374 = (-t366) * (t334 * 0.14285715f);
    let t376 = 1.0f * 1.0f;
    let t389 = t376 * t376;
    let t391 = ((state.integrator + (t339 * 1.0f)) + ((t344 + (t350 * 1.0f)) * t376)) + (((t356 + (t362 * 1.0f)) + ((t368 + (t374 * 1.0f)) * t376)) * t389);
    let t405 = ((state.spool + (t326 * 1.0f)) + ((t342 + (t348 * 1.0f)) * t376)) + (((t354 + (t360 * 1.0f)) + ((t366 + (t372 * 1.0f)) * t376)) * t389);
    let t408 = 0.0f - ((t391 - t405) * t324);
    let t413 = select(1.0f, t327 / (t327 - t408), (-(t327 * t408)) > 0.0);
    let t416 = t413 * t413;
    let t432 = (command + (0.0f * t413)) - (((state.spool + (t326 * t413)) + ((t342 + (t348 * t413)) * t416)) + (((t354 + (t360 * t413)) + ((t366 + (t372 * t413)) * t416)) * (t416 * t416)));
    let t435 = -t432;
    let t440 = select(plant.saturation - max(t432, t435), select(t435, t432, t330 > 0.0) - plant.saturation, t333 > 0.0);
    let t441 = select(t413, 1.0f, t440 > 0.0);
    let t442 = select(t432, (command + 0.0f) - t405, t440 > 0.0);
    let t443 = select(t442, t330, t333 > 0.0);
    let t446 = plant.saturation - select(-t442, t442, t443 > 0.0);
    let t448 = select(t446, -t446, t333 > 0.0);
    let t449 = left - t323;
    let t450 = -t448;
    let t452 = plant.saturation - select(-t279, t279, t443 > 0.0);
    let t455 = max(select(t452, -t452, t333 > 0.0), 0.0f);
    let t457 = select(-t327, t327, t443 > 0.0);
    let t461 = (-select(-t457, t457, t333 > 0.0)) * t441;
    let t478 = t441 * min(max((2.0f * t455) / max(t461 + sqrt(max((t461 * t461) - ((4.0f * ((t448 - t455) + t461)) * t455), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t479 = t478 * t478;
    let t492 = t479 * t479;
    let t508 = ((state.spool + (t326 * t478)) + ((t342 + (t348 * t478)) * t479)) + (((t354 + (t360 * t478)) + ((t366 + (t372 * t478)) * t479)) * t492);
    let t511 = (command + (0.0f * t478)) - t508;
    let t514 = plant.saturation - select(-t511, t511, t443 > 0.0);
    let t519 = 0.0f - (((((state.integrator + (t339 * t478)) + ((t344 + (t350 * t478)) * t479)) + (((t356 + (t362 * t478)) + ((t368 + (t374 * t478)) * t479)) * t492)) - t508) * t324);
    let t521 = select(-t519, t519, t443 > 0.0);
    let t523 = select(-t521, t521, t333 > 0.0);
    let t532 = max(min(max(t478 - ((select(t514, -t514, t333 > 0.0) * t523) / ((t523 * t523) + 1e-30f)), 0.0f), t441), 0.0001f);
    let t533 = t532 * t532;
    let t546 = t533 * t533;
    return Leap(select(t391, ((state.integrator + (t339 * t532)) + ((t344 + (t350 * t532)) * t533)) + (((t356 + (t362 * t532)) + ((t368 + (t374 * t532)) * t533)) * t546), t450 > 0.0), select(t405, ((state.spool + (t326 * t532)) + ((t342 + (t348 * t532)) * t533)) + (((t354 + (t360 * t532)) + ((t366 + (t372 * t532)) * t533)) * t546), t450 > 0.0), select(t449, t449 + (t323 * (1.0f - t532)), t450 > 0.0));
}

fn loss(error: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(error.x * error.x, error.y * error.y, error.z * error.z);
}
