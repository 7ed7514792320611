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
    let t499 = t448 + (0.001f * t496);
    let t502 = max(t499, -t499) - plant.saturation;
    let t503 = select(t494, 0.0f, t502 > 0.0);
    let t504 = t494 * plant.saturation;
    let t508 = select(t494 * t448, select(-t504, t504, t499 > 0.0), t502 > 0.0);
    let t511 = (t508 - t495) * (t493 * 0.5f);
    let t513 = t496 * (t503 * 0.5f);
    let t517 = (t513 - t511) * (t493 * 0.33333334f);
    let t519 = (-t511) * (t503 * 0.33333334f);
    let t523 = (t519 - t517) * (t493 * 0.25f);
    let t525 = (-t517) * (t503 * 0.25f);
    let t529 = (t525 - t523) * (t493 * 0.2f);
    let t531 = (-t523) * (t503 * 0.2f);
    let t535 = (t531 - t529) * (t493 * 0.16666667f);
    let t537 = (-t529) * (t503 * 0.16666667f);
    let t541 = (t537 - t535) * (t493 * 0.14285715f);
    let t543 = (-t535) * (t503 * 0.14285715f);
    let t545 = 1.0f * 1.0f;
    let t558 = t545 * t545;
    let t560 = ((state.integrator + (t508 * 1.0f)) + ((t513 + (t519 * 1.0f)) * t545)) + (((t525 + (t531 * 1.0f)) + ((t537 + (t543 * 1.0f)) * t545)) * t558);
    let t574 = ((state.spool + (t495 * 1.0f)) + ((t511 + (t517 * 1.0f)) * t545)) + (((t523 + (t529 * 1.0f)) + ((t535 + (t541 * 1.0f)) * t545)) * t558);
    let t577 = 0.0f - ((t560 - t574) * t493);
    let t582 = select(1.0f, t496 / (t496 - t577), (-(t496 * t577)) > 0.0);
    let t585 = t582 * t582;
    let t601 = (command + (0.0f * t582)) - (((state.spool + (t495 * t582)) + ((t511 + (t517 * t582)) * t585)) + (((t523 + (t529 * t582)) + ((t535 + (t541 * t582)) * t585)) * (t585 * t585)));
    let t604 = -t601;
    let t609 = select(plant.saturation - max(t601, t604), select(t604, t601, t499 > 0.0) - plant.saturation, t502 > 0.0);
    let t610 = select(t582, 1.0f, t609 > 0.0);
    let t611 = select(t601, (command + 0.0f) - t574, t609 > 0.0);
    let t612 = select(t611, t499, t502 > 0.0);
    let t615 = plant.saturation - select(-t611, t611, t612 > 0.0);
    let t617 = select(t615, -t615, t502 > 0.0);
    let t618 = left - t492;
    let t619 = -t617;
    let t621 = plant.saturation - select(-t448, t448, t612 > 0.0);
    let t624 = max(select(t621, -t621, t502 > 0.0), 0.0f);
    let t626 = select(-t496, t496, t612 > 0.0);
    let t630 = (-select(-t626, t626, t502 > 0.0)) * t610;
    let t647 = t610 * min(max((2.0f * t624) / max(t630 + sqrt(max((t630 * t630) - ((4.0f * ((t617 - t624) + t630)) * t624), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t648 = t647 * t647;
    let t661 = t648 * t648;
    let t677 = ((state.spool + (t495 * t647)) + ((t511 + (t517 * t647)) * t648)) + (((t523 + (t529 * t647)) + ((t535 + (t541 * t647)) * t648)) * t661);
    let t680 = (command + (0.0f * t647)) - t677;
    let t683 = plant.saturation - select(-t680, t680, t612 > 0.0);
    let t688 = 0.0f - (((((state.integrator + (t508 * t647)) + ((t513 + (t519 * t647)) * t648)) + (((t525 + (t531 * t647)) + ((t537 + (t543 * t647)) * t648)) * t661)) - t677) * t493);
    let t690 = select(-t688, t688, t612 > 0.0);
    let t692 = select(-t690, t690, t502 > 0.0);
    let t700 = max(min(max(t647 - ((select(t683, -t683, t502 > 0.0) * t692) / ((t692 * t692) + 1e-30f)), 0.0f), t610), 0.0001f);
    let t701 = t700 * t700;
    let t714 = t701 * t701;
    return Leap(select(t560, ((state.integrator + (t508 * t700)) + ((t513 + (t519 * t700)) * t701)) + (((t525 + (t531 * t700)) + ((t537 + (t543 * t700)) * t701)) * t714), t619 > 0.0), select(t574, ((state.spool + (t495 * t700)) + ((t511 + (t517 * t700)) * t701)) + (((t523 + (t529 * t700)) + ((t535 + (t541 * t700)) * t701)) * t714), t619 > 0.0), select(t618, t618 + (t492 * (1.0f - t700)), t619 > 0.0));
}

fn loss(error: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(error.x * error.x, error.y * error.y, error.z * error.z);
}
