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
    let t284 = length * 0.125f;
    let t285 = t284 * 1.0f;
    let t288 = (-(stiffness * 0.0f)) * t285;
    let t291 = (1.0f - (plant.rate * 0.0f)) * t285;
    let t294 = -((1.0f * plant.rate) * t285);
    let t298 = t284 * 0.5f;
    let t301 = (-(stiffness * t291)) * t298;
    let t304 = (t288 - (plant.rate * t291)) * t298;
    let t307 = -((t294 * plant.rate) * t298);
    let t312 = t284 * 0.33333334f;
    let t315 = (-(stiffness * t304)) * t312;
    let t318 = (t301 - (plant.rate * t304)) * t312;
    let t321 = -((t307 * plant.rate) * t312);
    let t326 = t284 * 0.25f;
    let t329 = (-(stiffness * t318)) * t326;
    let t332 = (t315 - (plant.rate * t318)) * t326;
    let t335 = -((t321 * plant.rate) * t326);
    let t340 = t284 * 0.2f;
    let t343 = (-(stiffness * t332)) * t340;
    let t346 = (t329 - (plant.rate * t332)) * t340;
    let t349 = -((t335 * plant.rate) * t340);
    let t353 = t284 * 0.16666667f;
    let t356 = (-(stiffness * t346)) * t353;
    let t359 = (t343 - (plant.rate * t346)) * t353;
    let t362 = -((t349 * plant.rate) * t353);
    let t367 = t284 * 0.14285715f;
    let t370 = (-(stiffness * t359)) * t367;
    let t373 = (t356 - (plant.rate * t359)) * t367;
    let t376 = -((t362 * plant.rate) * t367);
    let t380 = t284 * 0.125f;
    let t390 = (((((((0.0f + t288) + t301) + t315) + t329) + t343) + t356) + t370) + ((-(stiffness * t373)) * t380);
    let t391 = (((((((0.0f + t291) + t304) + t318) + t332) + t346) + t359) + t373) + ((t370 - (plant.rate * t373)) * t380);
    let t392 = (((((((0.0f - t294) - t307) - t321) - t335) - t349) - t362) - t376) - (-((t376 * plant.rate) * t380));
    let t393 = 2.0f * t390;
    let t398 = t393 + ((t390 * t390) - ((stiffness * t391) * t391));
    let t402 = t391 * (2.0f + (t393 - (plant.rate * t391)));
    let t404 = t392 * (2.0f - t392);
    let t405 = 2.0f * t398;
    let t410 = t405 + ((t398 * t398) - ((stiffness * t402) * t402));
    let t414 = t402 * (2.0f + (t405 - (plant.rate * t402)));
    let t416 = t404 * (2.0f - t404);
    let t417 = 2.0f * t410;
    let t426 = t414 * (2.0f + (t417 - (plant.rate * t414)));
    let t429 = plant.gain * plant.saturation;
    let t431 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t431), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t417 + ((t410 * t410) - ((stiffness * t414) * t414)), t426 * plant.rate, t426 * plant.gain, t416 * (2.0f - t416), t429 * length, t429 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t431 - 9.0f);
}

fn leap(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> Leap {
    let t216 = state.integrator - state.spool;
    let t448 = command - state.spool;
    let t449 = -t448;
    let t458 = select(-stride.slewed, stride.slewed, t448 > 0.0);
    let t464 = max(t448, t449) - plant.saturation;
    let t466 = state.integrator + select((stride.kept * (t449 + t216)) - (stride.fed * t449), t458, t464 > 0.0);
    let t469 = state.spool + select((stride.kept * t449) + (stride.followed * t216), t458 - ((select(-stride.lead, stride.lead, t448 > 0.0) - t216) * stride.faded), t464 > 0.0);
    let t470 = command - t469;
    let t476 = -t470;
    return Leap(t466, t469, select(min(((t449 * t449) + ((t216 * t216) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t470, t476) - plant.saturation, max(stride.turns, -(t216 * (t466 - t469))))), plant.saturation - select(t476, t470, t448 > 0.0), t464 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> Leap {
    let t448 = command - state.spool;
    let t492 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t493 = t492 * plant.rate;
    let t494 = t492 * plant.gain;
    let t495 = (state.integrator - state.spool) * t493;
    let t496 = 0.0f - t495;
    let t498 = t448 + (0.001f * t496);
    let t501 = max(t498, -t498) - plant.saturation;
    let t502 = select(t494, 0.0f, t501 > 0.0);
    let t503 = t494 * plant.saturation;
    let t507 = select(t494 * t448, select(-t503, t503, t498 > 0.0), t501 > 0.0);
    let t510 = (t507 - t495) * (t493 * 0.5f);
    let t512 = t496 * (t502 * 0.5f);
    let t516 = (t512 - t510) * (t493 * 0.33333334f);
    let t518 = (-t510) * (t502 * 0.33333334f);
    let t522 = (t518 - t516) * (t493 * 0.25f);
    let t524 = (-t516) * (t502 * 0.25f);
    let t528 = (t524 - t522) * (t493 * 0.2f);
    let t530 = (-t522) * (t502 * 0.2f);
    let t534 = (t530 - t528) * (t493 * 0.16666667f);
    let t536 = (-t528) * (t502 * 0.16666667f);
    let t540 = (t536 - t534) * (t493 * 0.14285715f);
    let t542 = (-t534) * (t502 * 0.14285715f);
    let t544 = 1.0f * 1.0f;
    let t557 = t544 * t544;
    let t559 = ((state.integrator + (t507 * 1.0f)) + ((t512 + (t518 * 1.0f)) * t544)) + (((t524 + (t530 * 1.0f)) + ((t536 + (t542 * 1.0f)) * t544)) * t557);
    let t573 = ((state.spool + (t495 * 1.0f)) + ((t510 + (t516 * 1.0f)) * t544)) + (((t522 + (t528 * 1.0f)) + ((t534 + (t540 * 1.0f)) * t544)) * t557);
    let t576 = 0.0f - ((t559 - t573) * t493);
    let t581 = select(1.0f, t496 / (t496 - t576), (-(t496 * t576)) > 0.0);
    let t584 = t581 * t581;
    let t600 = (command + (0.0f * t581)) - (((state.spool + (t495 * t581)) + ((t510 + (t516 * t581)) * t584)) + (((t522 + (t528 * t581)) + ((t534 + (t540 * t581)) * t584)) * (t584 * t584)));
    let t603 = -t600;
    let t608 = select(plant.saturation - max(t600, t603), select(t603, t600, t498 > 0.0) - plant.saturation, t501 > 0.0);
    let t609 = select(t581, 1.0f, t608 > 0.0);
    let t610 = select(t600, (command + 0.0f) - t573, t608 > 0.0);
    let t611 = select(t610, t498, t501 > 0.0);
    let t614 = plant.saturation - select(-t610, t610, t611 > 0.0);
    let t616 = select(t614, -t614, t501 > 0.0);
    let t617 = left - t492;
    let t618 = -t616;
    let t620 = plant.saturation - select(-t448, t448, t611 > 0.0);
    let t623 = max(select(t620, -t620, t501 > 0.0), 0.0f);
    let t625 = select(-t496, t496, t611 > 0.0);
    let t629 = (-select(-t625, t625, t501 > 0.0)) * t609;
    let t646 = t609 * min(max((2.0f * t623) / max(t629 + sqrt(max((t629 * t629) - ((4.0f * ((t616 - t623) + t629)) * t623), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t647 = t646 * t646;
    let t660 = t647 * t647;
    let t676 = ((state.spool + (t495 * t646)) + ((t510 + (t516 * t646)) * t647)) + (((t522 + (t528 * t646)) + ((t534 + (t540 * t646)) * t647)) * t660);
    let t679 = (command + (0.0f * t646)) - t676;
    let t682 = plant.saturation - select(-t679, t679, t611 > 0.0);
    let t687 = 0.0f - (((((state.integrator + (t507 * t646)) + ((t512 + (t518 * t646)) * t647)) + (((t524 + (t530 * t646)) + ((t536 + (t542 * t646)) * t647)) * t660)) - t676) * t493);
    let t689 = select(-t687, t687, t611 > 0.0);
    let t691 = select(-t689, t689, t501 > 0.0);
    let t699 = max(min(max(t646 - ((select(t682, -t682, t501 > 0.0) * t691) / ((t691 * t691) + 1e-30f)), 0.0f), t609), 0.0001f);
    let t700 = t699 * t699;
    let t713 = t700 * t700;
    return Leap(select(t559, ((state.integrator + (t507 * t699)) + ((t512 + (t518 * t699)) * t700)) + (((t524 + (t530 * t699)) + ((t536 + (t542 * t699)) * t700)) * t713), t618 > 0.0), select(t573, ((state.spool + (t495 * t699)) + ((t510 + (t516 * t699)) * t700)) + (((t522 + (t528 * t699)) + ((t534 + (t540 * t699)) * t700)) * t713), t618 > 0.0), select(t617, t617 + (t492 * (1.0f - t699)), t618 > 0.0));
}
