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
    return Plant(candidates[0u * population + candidate], candidates[1u * population + candidate], candidates[2u * population + candidate], constants[4u], rate, leakage, first_area, slope_1, slope_2, slope_3, slope_4, slope_5, orifice_coefficient);
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

fn loss(plant: Plant, error: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(error.x * error.x, error.y * error.y, error.z * error.z);
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

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t290 = length * 0.125f;
    let t291 = t290 * 1.0f;
    let t294 = (-(stiffness * 0.0f)) * t291;
    let t297 = (1.0f - (plant.rate * 0.0f)) * t291;
    let t300 = -((1.0f * plant.rate) * t291);
    let t304 = t290 * 0.5f;
    let t307 = (-(stiffness * t297)) * t304;
    let t310 = (t294 - (plant.rate * t297)) * t304;
    let t313 = -((t300 * plant.rate) * t304);
    let t318 = t290 * 0.33333334f;
    let t321 = (-(stiffness * t310)) * t318;
    let t324 = (t307 - (plant.rate * t310)) * t318;
    let t327 = -((t313 * plant.rate) * t318);
    let t332 = t290 * 0.25f;
    let t335 = (-(stiffness * t324)) * t332;
    let t338 = (t321 - (plant.rate * t324)) * t332;
    let t341 = -((t327 * plant.rate) * t332);
    let t346 = t290 * 0.2f;
    let t349 = (-(stiffness * t338)) * t346;
    let t352 = (t335 - (plant.rate * t338)) * t346;
    let t355 = -((t341 * plant.rate) * t346);
    let t359 = t290 * 0.16666667f;
    let t362 = (-(stiffness * t352)) * t359;
    let t365 = (t349 - (plant.rate * t352)) * t359;
    let t368 = -((t355 * plant.rate) * t359);
    let t373 = t290 * 0.14285715f;
    let t376 = (-(stiffness * t365)) * t373;
    let t379 = (t362 - (plant.rate * t365)) * t373;
    let t382 = -((t368 * plant.rate) * t373);
    let t386 = t290 * 0.125f;
    let t396 = (((((((0.0f + t294) + t307) + t321) + t335) + t349) + t362) + t376) + ((-(stiffness * t379)) * t386);
    let t397 = (((((((0.0f + t297) + t310) + t324) + t338) + t352) + t365) + t379) + ((t376 - (plant.rate * t379)) * t386);
    let t398 = (((((((0.0f - t300) - t313) - t327) - t341) - t355) - t368) - t382) - (-((t382 * plant.rate) * t386));
    let t399 = 2.0f * t396;
    let t404 = t399 + ((t396 * t396) - ((stiffness * t397) * t397));
    let t408 = t397 * (2.0f + (t399 - (plant.rate * t397)));
    let t410 = t398 * (2.0f - t398);
    let t411 = 2.0f * t404;
    let t416 = t411 + ((t404 * t404) - ((stiffness * t408) * t408));
    let t420 = t408 * (2.0f + (t411 - (plant.rate * t408)));
    let t422 = t410 * (2.0f - t410);
    let t423 = 2.0f * t416;
    let t432 = t420 * (2.0f + (t423 - (plant.rate * t420)));
    let t435 = plant.gain * plant.saturation;
    let t437 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t437), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t423 + ((t416 * t416) - ((stiffness * t420) * t420)), t432 * plant.rate, t432 * plant.gain, t422 * (2.0f - t422), t435 * length, t435 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t437 - 9.0f);
}

fn leap(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> Leap {
    let t216 = state.integrator - state.spool;
    let t454 = command - state.spool;
    let t455 = -t454;
    let t464 = select(-stride.slewed, stride.slewed, t454 > 0.0);
    let t470 = max(t454, t455) - plant.saturation;
    let t472 = state.integrator + select((stride.kept * (t455 + t216)) - (stride.fed * t455), t464, t470 > 0.0);
    let t475 = state.spool + select((stride.kept * t455) + (stride.followed * t216), t464 - ((select(-stride.lead, stride.lead, t454 > 0.0) - t216) * stride.faded), t470 > 0.0);
    let t476 = command - t475;
    let t482 = -t476;
    return Leap(t472, t475, select(min(((t455 * t455) + ((t216 * t216) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t476, t482) - plant.saturation, max(stride.turns, -(t216 * (t472 - t475))))), plant.saturation - select(t482, t476, t454 > 0.0), t470 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> Leap {
    let t454 = command - state.spool;
    let t498 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t499 = t498 * plant.rate;
    let t500 = t498 * plant.gain;
    let t501 = (state.integrator - state.spool) * t499;
    let t502 = 0.0f - t501;
    let t504 = t454 + (0.001f * t502);
    let t507 = max(t504, -t504) - plant.saturation;
    let t508 = select(t500, 0.0f, t507 > 0.0);
    let t509 = t500 * plant.saturation;
    let t513 = select(t500 * t454, select(-t509, t509, t504 > 0.0), t507 > 0.0);
    let t516 = (t513 - t501) * (t499 * 0.5f);
    let t518 = t502 * (t508 * 0.5f);
    let t522 = (t518 - t516) * (t499 * 0.33333334f);
    let t524 = (-t516) * (t508 * 0.33333334f);
    let t528 = (t524 - t522) * (t499 * 0.25f);
    let t530 = (-t522) * (t508 * 0.25f);
    let t534 = (t530 - t528) * (t499 * 0.2f);
    let t536 = (-t528) * (t508 * 0.2f);
    let t540 = (t536 - t534) * (t499 * 0.16666667f);
    let t542 = (-t534) * (t508 * 0.16666667f);
    let t546 = (t542 - t540) * (t499 * 0.14285715f);
    let t548 = (-t540) * (t508 * 0.14285715f);
    let t550 = 1.0f * 1.0f;
    let t563 = t550 * t550;
    let t565 = ((state.integrator + (t513 * 1.0f)) + ((t518 + (t524 * 1.0f)) * t550)) + (((t530 + (t536 * 1.0f)) + ((t542 + (t548 * 1.0f)) * t550)) * t563);
    let t579 = ((state.spool + (t501 * 1.0f)) + ((t516 + (t522 * 1.0f)) * t550)) + (((t528 + (t534 * 1.0f)) + ((t540 + (t546 * 1.0f)) * t550)) * t563);
    let t582 = 0.0f - ((t565 - t579) * t499);
    let t587 = select(1.0f, t502 / (t502 - t582), (-(t502 * t582)) > 0.0);
    let t590 = t587 * t587;
    let t606 = (command + (0.0f * t587)) - (((state.spool + (t501 * t587)) + ((t516 + (t522 * t587)) * t590)) + (((t528 + (t534 * t587)) + ((t540 + (t546 * t587)) * t590)) * (t590 * t590)));
    let t609 = -t606;
    let t614 = select(plant.saturation - max(t606, t609), select(t609, t606, t504 > 0.0) - plant.saturation, t507 > 0.0);
    let t615 = select(t587, 1.0f, t614 > 0.0);
    let t616 = select(t606, (command + 0.0f) - t579, t614 > 0.0);
    let t617 = select(t616, t504, t507 > 0.0);
    let t620 = plant.saturation - select(-t616, t616, t617 > 0.0);
    let t622 = select(t620, -t620, t507 > 0.0);
    let t623 = left - t498;
    let t624 = -t622;
    let t626 = plant.saturation - select(-t454, t454, t617 > 0.0);
    let t629 = max(select(t626, -t626, t507 > 0.0), 0.0f);
    let t631 = select(-t502, t502, t617 > 0.0);
    let t635 = (-select(-t631, t631, t507 > 0.0)) * t615;
    let t652 = t615 * min(max((2.0f * t629) / max(t635 + sqrt(max((t635 * t635) - ((4.0f * ((t622 - t629) + t635)) * t629), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t653 = t652 * t652;
    let t666 = t653 * t653;
    let t682 = ((state.spool + (t501 * t652)) + ((t516 + (t522 * t652)) * t653)) + (((t528 + (t534 * t652)) + ((t540 + (t546 * t652)) * t653)) * t666);
    let t685 = (command + (0.0f * t652)) - t682;
    let t688 = plant.saturation - select(-t685, t685, t617 > 0.0);
    let t693 = 0.0f - (((((state.integrator + (t513 * t652)) + ((t518 + (t524 * t652)) * t653)) + (((t530 + (t536 * t652)) + ((t542 + (t548 * t652)) * t653)) * t666)) - t682) * t499);
    let t695 = select(-t693, t693, t617 > 0.0);
    let t697 = select(-t695, t695, t507 > 0.0);
    let t705 = max(min(max(t652 - ((select(t688, -t688, t507 > 0.0) * t697) / ((t697 * t697) + 1e-30f)), 0.0f), t615), 0.0001f);
    let t706 = t705 * t705;
    let t719 = t706 * t706;
    return Leap(select(t565, ((state.integrator + (t513 * t705)) + ((t518 + (t524 * t705)) * t706)) + (((t530 + (t536 * t705)) + ((t542 + (t548 * t705)) * t706)) * t719), t624 > 0.0), select(t579, ((state.spool + (t501 * t705)) + ((t516 + (t522 * t705)) * t706)) + (((t528 + (t534 * t705)) + ((t540 + (t546 * t705)) * t706)) * t719), t624 > 0.0), select(t623, t623 + (t498 * (1.0f - t705)), t624 > 0.0));
}
