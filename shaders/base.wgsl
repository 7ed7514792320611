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

fn loss(plant: Plant, error: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(error.x * error.x, error.y * error.y, error.z * error.z);
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
    let t121 = length * 0.125f;
    let t122 = t121 * 1.0f;
    let t125 = (-(stiffness * 0.0f)) * t122;
    let t128 = (1.0f - (plant.rate * 0.0f)) * t122;
    let t131 = -((1.0f * plant.rate) * t122);
    let t135 = t121 * 0.5f;
    let t138 = (-(stiffness * t128)) * t135;
    let t141 = (t125 - (plant.rate * t128)) * t135;
    let t144 = -((t131 * plant.rate) * t135);
    let t149 = t121 * 0.33333334f;
    let t152 = (-(stiffness * t141)) * t149;
    let t155 = (t138 - (plant.rate * t141)) * t149;
    let t158 = -((t144 * plant.rate) * t149);
    let t163 = t121 * 0.25f;
    let t166 = (-(stiffness * t155)) * t163;
    let t169 = (t152 - (plant.rate * t155)) * t163;
    let t172 = -((t158 * plant.rate) * t163);
    let t177 = t121 * 0.2f;
    let t180 = (-(stiffness * t169)) * t177;
    let t183 = (t166 - (plant.rate * t169)) * t177;
    let t186 = -((t172 * plant.rate) * t177);
    let t190 = t121 * 0.16666667f;
    let t193 = (-(stiffness * t183)) * t190;
    let t196 = (t180 - (plant.rate * t183)) * t190;
    let t199 = -((t186 * plant.rate) * t190);
    let t204 = t121 * 0.14285715f;
    let t207 = (-(stiffness * t196)) * t204;
    let t210 = (t193 - (plant.rate * t196)) * t204;
    let t213 = -((t199 * plant.rate) * t204);
    let t217 = t121 * 0.125f;
    let t227 = (((((((0.0f + t125) + t138) + t152) + t166) + t180) + t193) + t207) + ((-(stiffness * t210)) * t217);
    let t228 = (((((((0.0f + t128) + t141) + t155) + t169) + t183) + t196) + t210) + ((t207 - (plant.rate * t210)) * t217);
    let t229 = (((((((0.0f - t131) - t144) - t158) - t172) - t186) - t199) - t213) - (-((t213 * plant.rate) * t217));
    let t230 = 2.0f * t227;
    let t235 = t230 + ((t227 * t227) - ((stiffness * t228) * t228));
    let t239 = t228 * (2.0f + (t230 - (plant.rate * t228)));
    let t241 = t229 * (2.0f - t229);
    let t242 = 2.0f * t235;
    let t247 = t242 + ((t235 * t235) - ((stiffness * t239) * t239));
    let t251 = t239 * (2.0f + (t242 - (plant.rate * t239)));
    let t253 = t241 * (2.0f - t241);
    let t254 = 2.0f * t247;
    let t263 = t251 * (2.0f + (t254 - (plant.rate * t251)));
    let t266 = plant.gain * plant.saturation;
    let t268 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t268), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t254 + ((t247 * t247) - ((stiffness * t251) * t251)), t263 * plant.rate, t263 * plant.gain, t253 * (2.0f - t253), t266 * length, t266 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t268 - 9.0f);
}

fn leap(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> Leap {
    let t45 = state.integrator - state.spool;
    let t285 = command - state.spool;
    let t286 = -t285;
    let t295 = select(-stride.slewed, stride.slewed, t285 > 0.0);
    let t301 = max(t285, t286) - plant.saturation;
    let t303 = state.integrator + select((stride.kept * (t286 + t45)) - (stride.fed * t286), t295, t301 > 0.0);
    let t306 = state.spool + select((stride.kept * t286) + (stride.followed * t45), t295 - ((select(-stride.lead, stride.lead, t285 > 0.0) - t45) * stride.faded), t301 > 0.0);
    let t307 = command - t306;
    let t313 = -t307;
    return Leap(t303, t306, select(min(((t286 * t286) + ((t45 * t45) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t307, t313) - plant.saturation, max(stride.turns, -(t45 * (t303 - t306))))), plant.saturation - select(t313, t307, t285 > 0.0), t301 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> Leap {
    let t285 = command - state.spool;
    let t329 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t330 = t329 * plant.rate;
    let t331 = t329 * plant.gain;
    let t332 = (state.integrator - state.spool) * t330;
    let t333 = 0.0f - t332;
    let t336 = t285 + (0.001f * t333);
    let t339 = max(t336, -t336) - plant.saturation;
    let t340 = select(t331, 0.0f, t339 > 0.0);
    let t341 = t331 * plant.saturation;
    let t345 = select(t331 * t285, select(-t341, t341, t336 > 0.0), t339 > 0.0);
    let t348 = (t345 - t332) * (t330 * 0.5f);
    let t350 = t333 * (t340 * 0.5f);
    let t354 = (t350 - t348) * (t330 * 0.33333334f);
    let t356 = (-t348) * (t340 * 0.33333334f);
    let t360 = (t356 - t354) * (t330 * 0.25f);
    let t362 = (-t354) * (t340 * 0.25f);
    let t366 = (t362 - t360) * (t330 * 0.2f);
    let t368 = (-t360) * (t340 * 0.2f);
    let t372 = (t368 - t366) * (t330 * 0.16666667f);
    let t374 = (-t366) * (t340 * 0.16666667f);
    let t378 = (t374 - t372) * (t330 * 0.14285715f);
    let t380 = (-t372) * (t340 * 0.14285715f);
    let t382 = 1.0f * 1.0f;
    let t395 = t382 * t382;
    let t397 = ((state.integrator + (t345 * 1.0f)) + ((t350 + (t356 * 1.0f)) * t382)) + (((t362 + (t368 * 1.0f)) + ((t374 + (t380 * 1.0f)) * t382)) * t395);
    let t411 = ((state.spool + (t332 * 1.0f)) + ((t348 + (t354 * 1.0f)) * t382)) + (((t360 + (t366 * 1.0f)) + ((t372 + (t378 * 1.0f)) * t382)) * t395);
    let t414 = 0.0f - ((t397 - t411) * t330);
    let t419 = select(1.0f, t333 / (t333 - t414), (-(t333 * t414)) > 0.0);
    let t422 = t419 * t419;
    let t438 = (command + (0.0f * t419)) - (((state.spool + (t332 * t419)) + ((t348 + (t354 * t419)) * t422)) + (((t360 + (t366 * t419)) + ((t372 + (t378 * t419)) * t422)) * (t422 * t422)));
    let t441 = -t438;
    let t446 = select(plant.saturation - max(t438, t441), select(t441, t438, t336 > 0.0) - plant.saturation, t339 > 0.0);
    let t447 = select(t419, 1.0f, t446 > 0.0);
    let t448 = select(t438, (command + 0.0f) - t411, t446 > 0.0);
    let t449 = select(t448, t336, t339 > 0.0);
    let t452 = plant.saturation - select(-t448, t448, t449 > 0.0);
    let t454 = select(t452, -t452, t339 > 0.0);
    let t455 = left - t329;
    let t456 = -t454;
    let t458 = plant.saturation - select(-t285, t285, t449 > 0.0);
    let t461 = max(select(t458, -t458, t339 > 0.0), 0.0f);
    let t463 = select(-t333, t333, t449 > 0.0);
    let t467 = (-select(-t463, t463, t339 > 0.0)) * t447;
    let t484 = t447 * min(max((2.0f * t461) / max(t467 + sqrt(max((t467 * t467) - ((4.0f * ((t454 - t461) + t467)) * t461), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t485 = t484 * t484;
    let t498 = t485 * t485;
    let t514 = ((state.spool + (t332 * t484)) + ((t348 + (t354 * t484)) * t485)) + (((t360 + (t366 * t484)) + ((t372 + (t378 * t484)) * t485)) * t498);
    let t517 = (command + (0.0f * t484)) - t514;
    let t520 = plant.saturation - select(-t517, t517, t449 > 0.0);
    let t525 = 0.0f - (((((state.integrator + (t345 * t484)) + ((t350 + (t356 * t484)) * t485)) + (((t362 + (t368 * t484)) + ((t374 + (t380 * t484)) * t485)) * t498)) - t514) * t330);
    let t527 = select(-t525, t525, t449 > 0.0);
    let t529 = select(-t527, t527, t339 > 0.0);
    let t538 = max(min(max(t484 - ((select(t520, -t520, t339 > 0.0) * t529) / ((t529 * t529) + 1e-30f)), 0.0f), t447), 0.0001f);
    let t539 = t538 * t538;
    let t552 = t539 * t539;
    return Leap(select(t397, ((state.integrator + (t345 * t538)) + ((t350 + (t356 * t538)) * t539)) + (((t362 + (t368 * t538)) + ((t374 + (t380 * t538)) * t539)) * t552), t456 > 0.0), select(t411, ((state.spool + (t332 * t538)) + ((t348 + (t354 * t538)) * t539)) + (((t360 + (t366 * t538)) + ((t372 + (t378 * t538)) * t539)) * t552), t456 > 0.0), select(t455, t455 + (t329 * (1.0f - t538)), t456 > 0.0));
}
