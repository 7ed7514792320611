// The physics of an actuator and a valve with an area table, all ports measured:
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
    flow: f32,
}

fn load_results(at: u32, stride: u32) -> Outputs {
    return Outputs(results[at + 0u * stride], results[at + 1u * stride]);
}

fn store_results(at: u32, stride: u32, value: Outputs) {
    results[at + 0u * stride] = value.spool;
    results[at + 1u * stride] = value.flow;
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
    opening_offset: f32,
    rate: f32,
    leakage: f32,
    orifice_coefficient: f32,
    first_area: f32,
    slope_1: f32,
    slope_2: f32,
    slope_3: f32,
    slope_4: f32,
    slope_5: f32,
}

fn prepare(candidate: u32, population: u32) -> Plant {
    let rate = 1.0f / candidates[1u * population + candidate];
    let leakage = constants[3u] * 0.0001f;
    let orifice_coefficient = constants[0u] * sqrt(2.0f / constants[1u]);
    let first_area = candidates[3u * population + candidate] * 0.0001f;
    let t32 = candidates[4u * population + candidate] * 0.0001f;
    let slope_1 = (t32 - first_area) / 10.0f;
    let t36 = candidates[5u * population + candidate] * 0.0001f;
    let slope_2 = (t36 - t32) / 15.0f;
    let t40 = candidates[6u * population + candidate] * 0.0001f;
    let slope_3 = (t40 - t36) / 25.0f;
    let t44 = candidates[7u * population + candidate] * 0.0001f;
    let slope_4 = (t44 - t40) / 30.0f;
    let slope_5 = ((candidates[8u * population + candidate] * 0.0001f) - t44) / 20.0f;
    return Plant(candidates[0u * population + candidate], candidates[1u * population + candidate], candidates[2u * population + candidate], constants[4u], rate, leakage, orifice_coefficient, first_area, slope_1, slope_2, slope_3, slope_4, slope_5);
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
    let t74 = input.supply * 100000.0f;
    let t75 = input.tank * 100000.0f;
    let t76 = input.a * 100000.0f;
    let t77 = input.b * 100000.0f;
    let t134 = t74 - t76;
    let t141 = (((t74 + t76) * 0.5f) + 101325.0f) * 0.001f;
    let t151 = t76 - t75;
    let t155 = (((t76 + t75) * 0.5f) + 101325.0f) * 0.001f;
    let t165 = t74 - t77;
    let t169 = (((t74 + t77) * 0.5f) + 101325.0f) * 0.001f;
    let t178 = t77 - t75;
    let t182 = (((t77 + t75) * 0.5f) + 101325.0f) * 0.001f;
    let opening_197 = state.spool * 10.0f;
    let t198 = plant.opening_offset + opening_197;
    let forward_area_224 = max(((((plant.first_area + (plant.slope_1 * min(max(t198 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t198 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t198 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t198 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t198 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t225 = plant.opening_offset - opening_197;
    let backward_area_251 = max(((((plant.first_area + (plant.slope_1 * min(max(t225 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t225 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t225 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t225 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t225 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t252 = forward_area_224 * plant.orifice_coefficient;
    let t256 = backward_area_251 * plant.orifice_coefficient;
    let flow_269 = (((((t252 * t134) / sqrt(sqrt((t134 * t134) + (t141 * t141)))) * 60000.0f) - (((t256 * t151) / sqrt(sqrt((t151 * t151) + (t155 * t155)))) * 60000.0f)) + ((((t252 * t178) / sqrt(sqrt((t178 * t178) + (t182 * t182)))) * 60000.0f) - (((t256 * t165) / sqrt(sqrt((t165 * t165) + (t169 * t169)))) * 60000.0f))) * 0.5f;
    return Outputs(state.spool, flow_269);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t196 = (state.integrator - state.spool) * plant.rate;
    let t292 = -plant.saturation;
    let t295 = plant.gain * min(max(start.command - state.spool, t292), plant.saturation);
    let t296 = step * 0.5f;
    let t300 = state.spool + (t296 * t196);
    let t304 = plant.gain * min(max(middle.command - t300, t292), plant.saturation);
    let t306 = ((state.integrator + (t296 * t295)) - t300) * plant.rate;
    let t314 = state.spool + (t296 * t306);
    let t318 = plant.gain * min(max(middle.command - t314, t292), plant.saturation);
    let t320 = ((state.integrator + (t296 * t304)) - t314) * plant.rate;
    let t325 = step * 1.0f;
    let t329 = state.spool + (t325 * t320);
    let t341 = step * 0.16666667f;
    return State(state.integrator + (t341 * (((t295 + (2.0f * t304)) + (2.0f * t318)) + (1.0f * (plant.gain * min(max(end.command - t329, t292), plant.saturation))))), state.spool + (t341 * (((t196 + (2.0f * t306)) + (2.0f * t320)) + (1.0f * (((state.integrator + (t325 * t318)) - t329) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t362 = length * 0.125f;
    let t363 = t362 * 1.0f;
    let t366 = (-(stiffness * 0.0f)) * t363;
    let t369 = (1.0f - (plant.rate * 0.0f)) * t363;
    let t372 = -((1.0f * plant.rate) * t363);
    let t376 = t362 * 0.5f;
    let t379 = (-(stiffness * t369)) * t376;
    let t382 = (t366 - (plant.rate * t369)) * t376;
    let t385 = -((t372 * plant.rate) * t376);
    let t390 = t362 * 0.33333334f;
    let t393 = (-(stiffness * t382)) * t390;
    let t396 = (t379 - (plant.rate * t382)) * t390;
    let t399 = -((t385 * plant.rate) * t390);
    let t404 = t362 * 0.25f;
    let t407 = (-(stiffness * t396)) * t404;
    let t410 = (t393 - (plant.rate * t396)) * t404;
    let t413 = -((t399 * plant.rate) * t404);
    let t418 = t362 * 0.2f;
    let t421 = (-(stiffness * t410)) * t418;
    let t424 = (t407 - (plant.rate * t410)) * t418;
    let t427 = -((t413 * plant.rate) * t418);
    let t431 = t362 * 0.16666667f;
    let t434 = (-(stiffness * t424)) * t431;
    let t437 = (t421 - (plant.rate * t424)) * t431;
    let t440 = -((t427 * plant.rate) * t431);
    let t445 = t362 * 0.14285715f;
    let t448 = (-(stiffness * t437)) * t445;
    let t451 = (t434 - (plant.rate * t437)) * t445;
    let t454 = -((t440 * plant.rate) * t445);
    let t458 = t362 * 0.125f;
    let t468 = (((((((0.0f + t366) + t379) + t393) + t407) + t421) + t434) + t448) + ((-(stiffness * t451)) * t458);
    let t469 = (((((((0.0f + t369) + t382) + t396) + t410) + t424) + t437) + t451) + ((t448 - (plant.rate * t451)) * t458);
    let t470 = (((((((0.0f - t372) - t385) - t399) - t413) - t427) - t440) - t454) - (-((t454 * plant.rate) * t458));
    let t471 = 2.0f * t468;
    let t476 = t471 + ((t468 * t468) - ((stiffness * t469) * t469));
    let t480 = t469 * (2.0f + (t471 - (plant.rate * t469)));
    let t482 = t470 * (2.0f - t470);
    let t483 = 2.0f * t476;
    let t488 = t483 + ((t476 * t476) - ((stiffness * t480) * t480));
    let t492 = t480 * (2.0f + (t483 - (plant.rate * t480)));
    let t494 = t482 * (2.0f - t482);
    let t495 = 2.0f * t488;
    let t504 = t492 * (2.0f + (t495 - (plant.rate * t492)));
    let t507 = plant.gain * plant.saturation;
    let t509 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t509), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t495 + ((t488 * t488) - ((stiffness * t492) * t492)), t504 * plant.rate, t504 * plant.gain, t494 * (2.0f - t494), t507 * length, t507 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t509 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t195 = state.integrator - state.spool;
    let t526 = command - state.spool;
    let t527 = -t526;
    let t536 = select(-stride.slewed, stride.slewed, t526 > 0.0);
    let t542 = max(t526, t527) - plant.saturation;
    let t544 = state.integrator + select((stride.kept * (t527 + t195)) - (stride.fed * t527), t536, t542 > 0.0);
    let t547 = state.spool + select((stride.kept * t527) + (stride.followed * t195), t536 - ((select(-stride.lead, stride.lead, t526 > 0.0) - t195) * stride.faded), t542 > 0.0);
    let t548 = command - t547;
    let t554 = -t548;
    return ExactStep(t544, t547, select(min(((t527 * t527) + ((t195 * t195) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t548, t554) - plant.saturation, max(stride.turns, -(t195 * (t544 - t547))))), plant.saturation - select(t554, t548, t526 > 0.0), t542 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t526 = command - state.spool;
    let t570 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t571 = t570 * plant.rate;
    let t572 = t570 * plant.gain;
    let t573 = (state.integrator - state.spool) * t571;
    let t574 = 0.0f - t573;
    let t577 = t526 + (0.001f * t574);
    let t580 = max(t577, -t577) - plant.saturation;
    let t581 = select(t572, 0.0f, t580 > 0.0);
    let t582 = t572 * plant.saturation;
    let t586 = select(t572 * t526, select(-t582, t582, t577 > 0.0), t580 > 0.0);
    let t589 = (t586 - t573) * (t571 * 0.5f);
    let t591 = t574 * (t581 * 0.5f);
    let t595 = (t591 - t589) * (t571 * 0.33333334f);
    let t597 = (-t589) * (t581 * 0.33333334f);
    let t601 = (t597 - t595) * (t571 * 0.25f);
    let t603 = (-t595) * (t581 * 0.25f);
    let t607 = (t603 - t601) * (t571 * 0.2f);
    let t609 = (-t601) * (t581 * 0.2f);
    let t613 = (t609 - t607) * (t571 * 0.16666667f);
    let t615 = (-t607) * (t581 * 0.16666667f);
    let t619 = (t615 - t613) * (t571 * 0.14285715f);
    let t621 = (-t613) * (t581 * 0.14285715f);
    let t623 = 1.0f * 1.0f;
    let t636 = t623 * t623;
    let t638 = ((state.integrator + (t586 * 1.0f)) + ((t591 + (t597 * 1.0f)) * t623)) + (((t603 + (t609 * 1.0f)) + ((t615 + (t621 * 1.0f)) * t623)) * t636);
    let t652 = ((state.spool + (t573 * 1.0f)) + ((t589 + (t595 * 1.0f)) * t623)) + (((t601 + (t607 * 1.0f)) + ((t613 + (t619 * 1.0f)) * t623)) * t636);
    let t655 = 0.0f - ((t638 - t652) * t571);
    let t660 = select(1.0f, t574 / (t574 - t655), (-(t574 * t655)) > 0.0);
    let t663 = t660 * t660;
    let t679 = (command + (0.0f * t660)) - (((state.spool + (t573 * t660)) + ((t589 + (t595 * t660)) * t663)) + (((t601 + (t607 * t660)) + ((t613 + (t619 * t660)) * t663)) * (t663 * t663)));
    let t682 = -t679;
    let t687 = select(plant.saturation - max(t679, t682), select(t682, t679, t577 > 0.0) - plant.saturation, t580 > 0.0);
    let t688 = select(t660, 1.0f, t687 > 0.0);
    let t689 = select(t679, (command + 0.0f) - t652, t687 > 0.0);
    let t690 = select(t689, t577, t580 > 0.0);
    let t693 = plant.saturation - select(-t689, t689, t690 > 0.0);
    let t695 = select(t693, -t693, t580 > 0.0);
    let t696 = left - t570;
    let t697 = -t695;
    let t699 = plant.saturation - select(-t526, t526, t690 > 0.0);
    let t702 = max(select(t699, -t699, t580 > 0.0), 0.0f);
    let t704 = select(-t574, t574, t690 > 0.0);
    let t708 = (-select(-t704, t704, t580 > 0.0)) * t688;
    let t725 = t688 * min(max((2.0f * t702) / max(t708 + sqrt(max((t708 * t708) - ((4.0f * ((t695 - t702) + t708)) * t702), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t726 = t725 * t725;
    let t739 = t726 * t726;
    let t755 = ((state.spool + (t573 * t725)) + ((t589 + (t595 * t725)) * t726)) + (((t601 + (t607 * t725)) + ((t613 + (t619 * t725)) * t726)) * t739);
    let t758 = (command + (0.0f * t725)) - t755;
    let t761 = plant.saturation - select(-t758, t758, t690 > 0.0);
    let t766 = 0.0f - (((((state.integrator + (t586 * t725)) + ((t591 + (t597 * t725)) * t726)) + (((t603 + (t609 * t725)) + ((t615 + (t621 * t725)) * t726)) * t739)) - t755) * t571);
    let t768 = select(-t766, t766, t690 > 0.0);
    let t770 = select(-t768, t768, t580 > 0.0);
    let t778 = max(min(max(t725 - ((select(t761, -t761, t580 > 0.0) * t770) / ((t770 * t770) + 1e-30f)), 0.0f), t688), 0.0001f);
    let t779 = t778 * t778;
    let t792 = t779 * t779;
    return ExactStep(select(t638, ((state.integrator + (t586 * t778)) + ((t591 + (t597 * t778)) * t779)) + (((t603 + (t609 * t778)) + ((t615 + (t621 * t778)) * t779)) * t792), t697 > 0.0), select(t652, ((state.spool + (t573 * t778)) + ((t589 + (t595 * t778)) * t779)) + (((t601 + (t607 * t778)) + ((t613 + (t619 * t778)) * t779)) * t792), t697 > 0.0), select(t696, t696 + (t570 * (1.0f - t778)), t697 > 0.0));
}

fn follow(plant: Plant, state: State, after: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    return State(after.integrator, after.spool);
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t830 = measured.spool - simulated.spool;
    let t834 = measured.flow - simulated.flow;
    return Outputs(sums.spool + (weight * (t830 * t830)), sums.flow + (weight * (t834 * t834)));
}

fn add(sums: Outputs, more: Outputs) -> Outputs {
    return Outputs(sums.spool + more.spool, sums.flow + more.flow);
}

fn response(simulated: Outputs) -> f32 {
    return f32(simulated.spool);
}

fn between(start: Input, end: Input, share: f32) -> Input {
    return Input(start.command + (share * (end.command - start.command)), start.supply + (share * (end.supply - start.supply)), start.tank + (share * (end.tank - start.tank)), start.a + (share * (end.a - start.a)), start.b + (share * (end.b - start.b)), start.temperature + (share * (end.temperature - start.temperature)), start.time + (share * (end.time - start.time)));
}
