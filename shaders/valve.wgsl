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
    let t72 = input.supply * 100000.0f;
    let t73 = input.tank * 100000.0f;
    let t74 = input.a * 100000.0f;
    let t75 = input.b * 100000.0f;
    let t132 = t72 - t74;
    let t139 = (((t72 + t74) * 0.5f) + 101325.0f) * 0.001f;
    let t149 = t74 - t73;
    let t153 = (((t74 + t73) * 0.5f) + 101325.0f) * 0.001f;
    let t163 = t72 - t75;
    let t167 = (((t72 + t75) * 0.5f) + 101325.0f) * 0.001f;
    let t176 = t75 - t73;
    let t180 = (((t75 + t73) * 0.5f) + 101325.0f) * 0.001f;
    let opening_195 = state.spool * 10.0f;
    let t196 = plant.opening_offset + opening_195;
    let forward_area_222 = max(((((plant.first_area + (plant.slope_1 * min(max(t196 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t196 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t196 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t196 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t196 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t223 = plant.opening_offset - opening_195;
    let backward_area_249 = max(((((plant.first_area + (plant.slope_1 * min(max(t223 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t223 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t223 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t223 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t223 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t250 = forward_area_222 * plant.orifice_coefficient;
    let t254 = backward_area_249 * plant.orifice_coefficient;
    let flow_267 = (((((t250 * t132) / sqrt(sqrt((t132 * t132) + (t139 * t139)))) * 60000.0f) - (((t254 * t149) / sqrt(sqrt((t149 * t149) + (t153 * t153)))) * 60000.0f)) + ((((t250 * t176) / sqrt(sqrt((t176 * t176) + (t180 * t180)))) * 60000.0f) - (((t254 * t163) / sqrt(sqrt((t163 * t163) + (t167 * t167)))) * 60000.0f))) * 0.5f;
    return Outputs(state.spool, flow_267);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t194 = (state.integrator - state.spool) * plant.rate;
    let t291 = -plant.saturation;
    let t294 = plant.gain * min(max(start.command - state.spool, t291), plant.saturation);
    let t300 = step * 0.5f;
    let t304 = state.spool + (t300 * t194);
    let t308 = ((state.integrator + (t300 * t294)) - t304) * plant.rate;
    let t314 = plant.gain * min(max(middle.command - t304, t291), plant.saturation);
    let t327 = state.spool + (t300 * t308);
    let t329 = ((state.integrator + (t300 * t314)) - t327) * plant.rate;
    let t334 = plant.gain * min(max(middle.command - t327, t291), plant.saturation);
    let t342 = step * 1.0f;
    let t346 = state.spool + (t342 * t329);
    let t367 = step * 0.16666667f;
    return State(state.integrator + (t367 * (((t294 + (2.0f * t314)) + (2.0f * t334)) + (1.0f * (plant.gain * min(max(end.command - t346, t291), plant.saturation))))), state.spool + (t367 * (((t194 + (2.0f * t308)) + (2.0f * t329)) + (1.0f * (((state.integrator + (t342 * t334)) - t346) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t390 = length * 0.125f;
    let t391 = t390 * 1.0f;
    let t394 = (-(stiffness * 0.0f)) * t391;
    let t397 = (1.0f - (plant.rate * 0.0f)) * t391;
    let t400 = -((1.0f * plant.rate) * t391);
    let t404 = t390 * 0.5f;
    let t407 = (-(stiffness * t397)) * t404;
    let t410 = (t394 - (plant.rate * t397)) * t404;
    let t413 = -((t400 * plant.rate) * t404);
    let t418 = t390 * 0.33333334f;
    let t421 = (-(stiffness * t410)) * t418;
    let t424 = (t407 - (plant.rate * t410)) * t418;
    let t427 = -((t413 * plant.rate) * t418);
    let t432 = t390 * 0.25f;
    let t435 = (-(stiffness * t424)) * t432;
    let t438 = (t421 - (plant.rate * t424)) * t432;
    let t441 = -((t427 * plant.rate) * t432);
    let t446 = t390 * 0.2f;
    let t449 = (-(stiffness * t438)) * t446;
    let t452 = (t435 - (plant.rate * t438)) * t446;
    let t455 = -((t441 * plant.rate) * t446);
    let t459 = t390 * 0.16666667f;
    let t462 = (-(stiffness * t452)) * t459;
    let t465 = (t449 - (plant.rate * t452)) * t459;
    let t468 = -((t455 * plant.rate) * t459);
    let t473 = t390 * 0.14285715f;
    let t476 = (-(stiffness * t465)) * t473;
    let t479 = (t462 - (plant.rate * t465)) * t473;
    let t482 = -((t468 * plant.rate) * t473);
    let t486 = t390 * 0.125f;
    let t496 = (((((((0.0f + t394) + t407) + t421) + t435) + t449) + t462) + t476) + ((-(stiffness * t479)) * t486);
    let t497 = (((((((0.0f + t397) + t410) + t424) + t438) + t452) + t465) + t479) + ((t476 - (plant.rate * t479)) * t486);
    let t498 = (((((((0.0f - t400) - t413) - t427) - t441) - t455) - t468) - t482) - (-((t482 * plant.rate) * t486));
    let t499 = 2.0f * t496;
    let t504 = t499 + ((t496 * t496) - ((stiffness * t497) * t497));
    let t508 = t497 * (2.0f + (t499 - (plant.rate * t497)));
    let t510 = t498 * (2.0f - t498);
    let t511 = 2.0f * t504;
    let t516 = t511 + ((t504 * t504) - ((stiffness * t508) * t508));
    let t520 = t508 * (2.0f + (t511 - (plant.rate * t508)));
    let t522 = t510 * (2.0f - t510);
    let t523 = 2.0f * t516;
    let t532 = t520 * (2.0f + (t523 - (plant.rate * t520)));
    let t535 = plant.gain * plant.saturation;
    let t537 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t537), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t523 + ((t516 * t516) - ((stiffness * t520) * t520)), t532 * plant.rate, t532 * plant.gain, t522 * (2.0f - t522), t535 * length, t535 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t537 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t193 = state.integrator - state.spool;
    let t554 = command - state.spool;
    let t555 = -t554;
    let t564 = select(-stride.slewed, stride.slewed, t554 > 0.0);
    let t570 = max(t554, t555) - plant.saturation;
    let t572 = state.integrator + select((stride.kept * (t555 + t193)) - (stride.fed * t555), t564, t570 > 0.0);
    let t575 = state.spool + select((stride.kept * t555) + (stride.followed * t193), t564 - ((select(-stride.lead, stride.lead, t554 > 0.0) - t193) * stride.faded), t570 > 0.0);
    let t576 = command - t575;
    let t582 = -t576;
    return ExactStep(t572, t575, select(min(((t555 * t555) + ((t193 * t193) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t576, t582) - plant.saturation, max(stride.turns, -(t193 * (t572 - t575))))), plant.saturation - select(t582, t576, t554 > 0.0), t570 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t554 = command - state.spool;
    let t598 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t599 = t598 * plant.rate;
    let t600 = t598 * plant.gain;
    let t601 = (state.integrator - state.spool) * t599;
    let t602 = 0.0f - t601;
    let t605 = t554 + (0.001f * t602);
    let t608 = max(t605, -t605) - plant.saturation;
    let t609 = select(t600, 0.0f, t608 > 0.0);
    let t610 = t600 * plant.saturation;
    let t614 = select(t600 * t554, select(-t610, t610, t605 > 0.0), t608 > 0.0);
    let t617 = (t614 - t601) * (t599 * 0.5f);
    let t619 = t602 * (t609 * 0.5f);
    let t623 = (t619 - t617) * (t599 * 0.33333334f);
    let t625 = (-t617) * (t609 * 0.33333334f);
    let t629 = (t625 - t623) * (t599 * 0.25f);
    let t631 = (-t623) * (t609 * 0.25f);
    let t635 = (t631 - t629) * (t599 * 0.2f);
    let t637 = (-t629) * (t609 * 0.2f);
    let t641 = (t637 - t635) * (t599 * 0.16666667f);
    let t643 = (-t635) * (t609 * 0.16666667f);
    let t647 = (t643 - t641) * (t599 * 0.14285715f);
    let t649 = (-t641) * (t609 * 0.14285715f);
    let t651 = 1.0f * 1.0f;
    let t664 = t651 * t651;
    let t666 = ((state.integrator + (t614 * 1.0f)) + ((t619 + (t625 * 1.0f)) * t651)) + (((t631 + (t637 * 1.0f)) + ((t643 + (t649 * 1.0f)) * t651)) * t664);
    let t680 = ((state.spool + (t601 * 1.0f)) + ((t617 + (t623 * 1.0f)) * t651)) + (((t629 + (t635 * 1.0f)) + ((t641 + (t647 * 1.0f)) * t651)) * t664);
    let t683 = 0.0f - ((t666 - t680) * t599);
    let t688 = select(1.0f, t602 / (t602 - t683), (-(t602 * t683)) > 0.0);
    let t691 = t688 * t688;
    let t707 = (command + (0.0f * t688)) - (((state.spool + (t601 * t688)) + ((t617 + (t623 * t688)) * t691)) + (((t629 + (t635 * t688)) + ((t641 + (t647 * t688)) * t691)) * (t691 * t691)));
    let t710 = -t707;
    let t715 = select(plant.saturation - max(t707, t710), select(t710, t707, t605 > 0.0) - plant.saturation, t608 > 0.0);
    let t716 = select(t688, 1.0f, t715 > 0.0);
    let t717 = select(t707, (command + 0.0f) - t680, t715 > 0.0);
    let t718 = select(t717, t605, t608 > 0.0);
    let t721 = plant.saturation - select(-t717, t717, t718 > 0.0);
    let t723 = select(t721, -t721, t608 > 0.0);
    let t724 = left - t598;
    let t725 = -t723;
    let t727 = plant.saturation - select(-t554, t554, t718 > 0.0);
    let t730 = max(select(t727, -t727, t608 > 0.0), 0.0f);
    let t732 = select(-t602, t602, t718 > 0.0);
    let t736 = (-select(-t732, t732, t608 > 0.0)) * t716;
    let t753 = t716 * min(max((2.0f * t730) / max(t736 + sqrt(max((t736 * t736) - ((4.0f * ((t723 - t730) + t736)) * t730), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t754 = t753 * t753;
    let t767 = t754 * t754;
    let t783 = ((state.spool + (t601 * t753)) + ((t617 + (t623 * t753)) * t754)) + (((t629 + (t635 * t753)) + ((t641 + (t647 * t753)) * t754)) * t767);
    let t786 = (command + (0.0f * t753)) - t783;
    let t789 = plant.saturation - select(-t786, t786, t718 > 0.0);
    let t794 = 0.0f - (((((state.integrator + (t614 * t753)) + ((t619 + (t625 * t753)) * t754)) + (((t631 + (t637 * t753)) + ((t643 + (t649 * t753)) * t754)) * t767)) - t783) * t599);
    let t796 = select(-t794, t794, t718 > 0.0);
    let t798 = select(-t796, t796, t608 > 0.0);
    let t806 = max(min(max(t753 - ((select(t789, -t789, t608 > 0.0) * t798) / ((t798 * t798) + 1e-30f)), 0.0f), t716), 0.0001f);
    let t807 = t806 * t806;
    let t820 = t807 * t807;
    return ExactStep(select(t666, ((state.integrator + (t614 * t806)) + ((t619 + (t625 * t806)) * t807)) + (((t631 + (t637 * t806)) + ((t643 + (t649 * t806)) * t807)) * t820), t725 > 0.0), select(t680, ((state.spool + (t601 * t806)) + ((t617 + (t623 * t806)) * t807)) + (((t629 + (t635 * t806)) + ((t641 + (t647 * t806)) * t807)) * t820), t725 > 0.0), select(t724, t724 + (t598 * (1.0f - t806)), t725 > 0.0));
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t860 = measured.spool - simulated.spool;
    let t864 = measured.flow - simulated.flow;
    return Outputs(sums.spool + (weight * (t860 * t860)), sums.flow + (weight * (t864 * t864)));
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
