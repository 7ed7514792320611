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
    let t293 = -plant.saturation;
    let t296 = plant.gain * min(max(start.command - state.spool, t293), plant.saturation);
    let t297 = step * 0.5f;
    let t301 = state.spool + (t297 * t196);
    let t306 = plant.gain * min(max(middle.command - t301, t293), plant.saturation);
    let t308 = ((state.integrator + (t297 * t296)) - t301) * plant.rate;
    let t316 = state.spool + (t297 * t308);
    let t320 = plant.gain * min(max(middle.command - t316, t293), plant.saturation);
    let t322 = ((state.integrator + (t297 * t306)) - t316) * plant.rate;
    let t327 = step * 1.0f;
    let t331 = state.spool + (t327 * t322);
    let t344 = step * 0.16666667f;
    return State(state.integrator + (t344 * (((t296 + (2.0f * t306)) + (2.0f * t320)) + (1.0f * (plant.gain * min(max(end.command - t331, t293), plant.saturation))))), state.spool + (t344 * (((t196 + (2.0f * t308)) + (2.0f * t322)) + (1.0f * (((state.integrator + (t327 * t320)) - t331) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t365 = length * 0.125f;
    let t366 = t365 * 1.0f;
    let t369 = (-(stiffness * 0.0f)) * t366;
    let t372 = (1.0f - (plant.rate * 0.0f)) * t366;
    let t375 = -((1.0f * plant.rate) * t366);
    let t379 = t365 * 0.5f;
    let t382 = (-(stiffness * t372)) * t379;
    let t385 = (t369 - (plant.rate * t372)) * t379;
    let t388 = -((t375 * plant.rate) * t379);
    let t393 = t365 * 0.33333334f;
    let t396 = (-(stiffness * t385)) * t393;
    let t399 = (t382 - (plant.rate * t385)) * t393;
    let t402 = -((t388 * plant.rate) * t393);
    let t407 = t365 * 0.25f;
    let t410 = (-(stiffness * t399)) * t407;
    let t413 = (t396 - (plant.rate * t399)) * t407;
    let t416 = -((t402 * plant.rate) * t407);
    let t421 = t365 * 0.2f;
    let t424 = (-(stiffness * t413)) * t421;
    let t427 = (t410 - (plant.rate * t413)) * t421;
    let t430 = -((t416 * plant.rate) * t421);
    let t434 = t365 * 0.16666667f;
    let t437 = (-(stiffness * t427)) * t434;
    let t440 = (t424 - (plant.rate * t427)) * t434;
    let t443 = -((t430 * plant.rate) * t434);
    let t448 = t365 * 0.14285715f;
    let t451 = (-(stiffness * t440)) * t448;
    let t454 = (t437 - (plant.rate * t440)) * t448;
    let t457 = -((t443 * plant.rate) * t448);
    let t461 = t365 * 0.125f;
    let t471 = (((((((0.0f + t369) + t382) + t396) + t410) + t424) + t437) + t451) + ((-(stiffness * t454)) * t461);
    let t472 = (((((((0.0f + t372) + t385) + t399) + t413) + t427) + t440) + t454) + ((t451 - (plant.rate * t454)) * t461);
    let t473 = (((((((0.0f - t375) - t388) - t402) - t416) - t430) - t443) - t457) - (-((t457 * plant.rate) * t461));
    let t474 = 2.0f * t471;
    let t479 = t474 + ((t471 * t471) - ((stiffness * t472) * t472));
    let t483 = t472 * (2.0f + (t474 - (plant.rate * t472)));
    let t485 = t473 * (2.0f - t473);
    let t486 = 2.0f * t479;
    let t491 = t486 + ((t479 * t479) - ((stiffness * t483) * t483));
    let t495 = t483 * (2.0f + (t486 - (plant.rate * t483)));
    let t497 = t485 * (2.0f - t485);
    let t498 = 2.0f * t491;
    let t507 = t495 * (2.0f + (t498 - (plant.rate * t495)));
    let t510 = plant.gain * plant.saturation;
    let t512 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t512), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t498 + ((t491 * t491) - ((stiffness * t495) * t495)), t507 * plant.rate, t507 * plant.gain, t497 * (2.0f - t497), t510 * length, t510 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t512 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t195 = state.integrator - state.spool;
    let t529 = command - state.spool;
    let t530 = -t529;
    let t539 = select(-stride.slewed, stride.slewed, t529 > 0.0);
    let t545 = max(t529, t530) - plant.saturation;
    let t547 = state.integrator + select((stride.kept * (t530 + t195)) - (stride.fed * t530), t539, t545 > 0.0);
    let t550 = state.spool + select((stride.kept * t530) + (stride.followed * t195), t539 - ((select(-stride.lead, stride.lead, t529 > 0.0) - t195) * stride.faded), t545 > 0.0);
    let t551 = command - t550;
    let t557 = -t551;
    return ExactStep(t547, t550, select(min(((t530 * t530) + ((t195 * t195) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t551, t557) - plant.saturation, max(stride.turns, -(t195 * (t547 - t550))))), plant.saturation - select(t557, t551, t529 > 0.0), t545 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t529 = command - state.spool;
    let t573 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t574 = t573 * plant.rate;
    let t575 = t573 * plant.gain;
    let t576 = (state.integrator - state.spool) * t574;
    let t577 = 0.0f - t576;
    let t580 = t529 + (0.001f * t577);
    let t583 = max(t580, -t580) - plant.saturation;
    let t584 = select(t575, 0.0f, t583 > 0.0);
    let t585 = t575 * plant.saturation;
    let t589 = select(t575 * t529, select(-t585, t585, t580 > 0.0), t583 > 0.0);
    let t592 = (t589 - t576) * (t574 * 0.5f);
    let t594 = t577 * (t584 * 0.5f);
    let t598 = (t594 - t592) * (t574 * 0.33333334f);
    let t600 = (-t592) * (t584 * 0.33333334f);
    let t604 = (t600 - t598) * (t574 * 0.25f);
    let t606 = (-t598) * (t584 * 0.25f);
    let t610 = (t606 - t604) * (t574 * 0.2f);
    let t612 = (-t604) * (t584 * 0.2f);
    let t616 = (t612 - t610) * (t574 * 0.16666667f);
    let t618 = (-t610) * (t584 * 0.16666667f);
    let t622 = (t618 - t616) * (t574 * 0.14285715f);
    let t624 = (-t616) * (t584 * 0.14285715f);
    let t626 = 1.0f * 1.0f;
    let t639 = t626 * t626;
    let t641 = ((state.integrator + (t589 * 1.0f)) + ((t594 + (t600 * 1.0f)) * t626)) + (((t606 + (t612 * 1.0f)) + ((t618 + (t624 * 1.0f)) * t626)) * t639);
    let t655 = ((state.spool + (t576 * 1.0f)) + ((t592 + (t598 * 1.0f)) * t626)) + (((t604 + (t610 * 1.0f)) + ((t616 + (t622 * 1.0f)) * t626)) * t639);
    let t658 = 0.0f - ((t641 - t655) * t574);
    let t663 = select(1.0f, t577 / (t577 - t658), (-(t577 * t658)) > 0.0);
    let t666 = t663 * t663;
    let t682 = (command + (0.0f * t663)) - (((state.spool + (t576 * t663)) + ((t592 + (t598 * t663)) * t666)) + (((t604 + (t610 * t663)) + ((t616 + (t622 * t663)) * t666)) * (t666 * t666)));
    let t685 = -t682;
    let t690 = select(plant.saturation - max(t682, t685), select(t685, t682, t580 > 0.0) - plant.saturation, t583 > 0.0);
    let t691 = select(t663, 1.0f, t690 > 0.0);
    let t692 = select(t682, (command + 0.0f) - t655, t690 > 0.0);
    let t693 = select(t692, t580, t583 > 0.0);
    let t696 = plant.saturation - select(-t692, t692, t693 > 0.0);
    let t698 = select(t696, -t696, t583 > 0.0);
    let t699 = left - t573;
    let t700 = -t698;
    let t702 = plant.saturation - select(-t529, t529, t693 > 0.0);
    let t705 = max(select(t702, -t702, t583 > 0.0), 0.0f);
    let t707 = select(-t577, t577, t693 > 0.0);
    let t711 = (-select(-t707, t707, t583 > 0.0)) * t691;
    let t728 = t691 * min(max((2.0f * t705) / max(t711 + sqrt(max((t711 * t711) - ((4.0f * ((t698 - t705) + t711)) * t705), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t729 = t728 * t728;
    let t742 = t729 * t729;
    let t758 = ((state.spool + (t576 * t728)) + ((t592 + (t598 * t728)) * t729)) + (((t604 + (t610 * t728)) + ((t616 + (t622 * t728)) * t729)) * t742);
    let t761 = (command + (0.0f * t728)) - t758;
    let t764 = plant.saturation - select(-t761, t761, t693 > 0.0);
    let t769 = 0.0f - (((((state.integrator + (t589 * t728)) + ((t594 + (t600 * t728)) * t729)) + (((t606 + (t612 * t728)) + ((t618 + (t624 * t728)) * t729)) * t742)) - t758) * t574);
    let t771 = select(-t769, t769, t693 > 0.0);
    let t773 = select(-t771, t771, t583 > 0.0);
    let t781 = max(min(max(t728 - ((select(t764, -t764, t583 > 0.0) * t773) / ((t773 * t773) + 1e-30f)), 0.0f), t691), 0.0001f);
    let t782 = t781 * t781;
    let t795 = t782 * t782;
    return ExactStep(select(t641, ((state.integrator + (t589 * t781)) + ((t594 + (t600 * t781)) * t782)) + (((t606 + (t612 * t781)) + ((t618 + (t624 * t781)) * t782)) * t795), t700 > 0.0), select(t655, ((state.spool + (t576 * t781)) + ((t592 + (t598 * t781)) * t782)) + (((t604 + (t610 * t781)) + ((t616 + (t622 * t781)) * t782)) * t795), t700 > 0.0), select(t699, t699 + (t573 * (1.0f - t781)), t700 > 0.0));
}

fn follow(plant: Plant, state: State, after: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    return State(after.integrator, after.spool);
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t833 = measured.spool - simulated.spool;
    let t837 = measured.flow - simulated.flow;
    return Outputs(sums.spool + (weight * (t833 * t833)), sums.flow + (weight * (t837 * t837)));
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
