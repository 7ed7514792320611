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
    let t294 = -plant.saturation;
    let t297 = plant.gain * min(max(start.command - state.spool, t294), plant.saturation);
    let t301 = step * 0.5f;
    let t305 = state.spool + (t301 * t196);
    let t309 = ((state.integrator + (t301 * t297)) - t305) * plant.rate;
    let t316 = plant.gain * min(max(middle.command - t305, t294), plant.saturation);
    let t328 = state.spool + (t301 * t309);
    let t330 = ((state.integrator + (t301 * t316)) - t328) * plant.rate;
    let t335 = plant.gain * min(max(middle.command - t328, t294), plant.saturation);
    let t343 = step * 1.0f;
    let t347 = state.spool + (t343 * t330);
    let t368 = step * 0.16666667f;
    return State(state.integrator + (t368 * (((t297 + (2.0f * t316)) + (2.0f * t335)) + (1.0f * (plant.gain * min(max(end.command - t347, t294), plant.saturation))))), state.spool + (t368 * (((t196 + (2.0f * t309)) + (2.0f * t330)) + (1.0f * (((state.integrator + (t343 * t335)) - t347) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t391 = length * 0.125f;
    let t392 = t391 * 1.0f;
    let t395 = (-(stiffness * 0.0f)) * t392;
    let t398 = (1.0f - (plant.rate * 0.0f)) * t392;
    let t401 = -((1.0f * plant.rate) * t392);
    let t405 = t391 * 0.5f;
    let t408 = (-(stiffness * t398)) * t405;
    let t411 = (t395 - (plant.rate * t398)) * t405;
    let t414 = -((t401 * plant.rate) * t405);
    let t419 = t391 * 0.33333334f;
    let t422 = (-(stiffness * t411)) * t419;
    let t425 = (t408 - (plant.rate * t411)) * t419;
    let t428 = -((t414 * plant.rate) * t419);
    let t433 = t391 * 0.25f;
    let t436 = (-(stiffness * t425)) * t433;
    let t439 = (t422 - (plant.rate * t425)) * t433;
    let t442 = -((t428 * plant.rate) * t433);
    let t447 = t391 * 0.2f;
    let t450 = (-(stiffness * t439)) * t447;
    let t453 = (t436 - (plant.rate * t439)) * t447;
    let t456 = -((t442 * plant.rate) * t447);
    let t460 = t391 * 0.16666667f;
    let t463 = (-(stiffness * t453)) * t460;
    let t466 = (t450 - (plant.rate * t453)) * t460;
    let t469 = -((t456 * plant.rate) * t460);
    let t474 = t391 * 0.14285715f;
    let t477 = (-(stiffness * t466)) * t474;
    let t480 = (t463 - (plant.rate * t466)) * t474;
    let t483 = -((t469 * plant.rate) * t474);
    let t487 = t391 * 0.125f;
    let t497 = (((((((0.0f + t395) + t408) + t422) + t436) + t450) + t463) + t477) + ((-(stiffness * t480)) * t487);
    let t498 = (((((((0.0f + t398) + t411) + t425) + t439) + t453) + t466) + t480) + ((t477 - (plant.rate * t480)) * t487);
    let t499 = (((((((0.0f - t401) - t414) - t428) - t442) - t456) - t469) - t483) - (-((t483 * plant.rate) * t487));
    let t500 = 2.0f * t497;
    let t505 = t500 + ((t497 * t497) - ((stiffness * t498) * t498));
    let t509 = t498 * (2.0f + (t500 - (plant.rate * t498)));
    let t511 = t499 * (2.0f - t499);
    let t512 = 2.0f * t505;
    let t517 = t512 + ((t505 * t505) - ((stiffness * t509) * t509));
    let t521 = t509 * (2.0f + (t512 - (plant.rate * t509)));
    let t523 = t511 * (2.0f - t511);
    let t524 = 2.0f * t517;
    let t533 = t521 * (2.0f + (t524 - (plant.rate * t521)));
    let t536 = plant.gain * plant.saturation;
    let t538 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t538), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t524 + ((t517 * t517) - ((stiffness * t521) * t521)), t533 * plant.rate, t533 * plant.gain, t523 * (2.0f - t523), t536 * length, t536 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t538 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t195 = state.integrator - state.spool;
    let t555 = command - state.spool;
    let t556 = -t555;
    let t565 = select(-stride.slewed, stride.slewed, t555 > 0.0);
    let t571 = max(t555, t556) - plant.saturation;
    let t573 = state.integrator + select((stride.kept * (t556 + t195)) - (stride.fed * t556), t565, t571 > 0.0);
    let t576 = state.spool + select((stride.kept * t556) + (stride.followed * t195), t565 - ((select(-stride.lead, stride.lead, t555 > 0.0) - t195) * stride.faded), t571 > 0.0);
    let t577 = command - t576;
    let t583 = -t577;
    return ExactStep(t573, t576, select(min(((t556 * t556) + ((t195 * t195) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t577, t583) - plant.saturation, max(stride.turns, -(t195 * (t573 - t576))))), plant.saturation - select(t583, t577, t555 > 0.0), t571 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t555 = command - state.spool;
    let t599 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t600 = t599 * plant.rate;
    let t601 = t599 * plant.gain;
    let t602 = (state.integrator - state.spool) * t600;
    let t603 = 0.0f - t602;
    let t606 = t555 + (0.001f * t603);
    let t609 = max(t606, -t606) - plant.saturation;
    let t610 = select(t601, 0.0f, t609 > 0.0);
    let t611 = t601 * plant.saturation;
    let t615 = select(t601 * t555, select(-t611, t611, t606 > 0.0), t609 > 0.0);
    let t618 = (t615 - t602) * (t600 * 0.5f);
    let t620 = t603 * (t610 * 0.5f);
    let t624 = (t620 - t618) * (t600 * 0.33333334f);
    let t626 = (-t618) * (t610 * 0.33333334f);
    let t630 = (t626 - t624) * (t600 * 0.25f);
    let t632 = (-t624) * (t610 * 0.25f);
    let t636 = (t632 - t630) * (t600 * 0.2f);
    let t638 = (-t630) * (t610 * 0.2f);
    let t642 = (t638 - t636) * (t600 * 0.16666667f);
    let t644 = (-t636) * (t610 * 0.16666667f);
    let t648 = (t644 - t642) * (t600 * 0.14285715f);
    let t650 = (-t642) * (t610 * 0.14285715f);
    let t652 = 1.0f * 1.0f;
    let t665 = t652 * t652;
    let t667 = ((state.integrator + (t615 * 1.0f)) + ((t620 + (t626 * 1.0f)) * t652)) + (((t632 + (t638 * 1.0f)) + ((t644 + (t650 * 1.0f)) * t652)) * t665);
    let t681 = ((state.spool + (t602 * 1.0f)) + ((t618 + (t624 * 1.0f)) * t652)) + (((t630 + (t636 * 1.0f)) + ((t642 + (t648 * 1.0f)) * t652)) * t665);
    let t684 = 0.0f - ((t667 - t681) * t600);
    let t689 = select(1.0f, t603 / (t603 - t684), (-(t603 * t684)) > 0.0);
    let t692 = t689 * t689;
    let t708 = (command + (0.0f * t689)) - (((state.spool + (t602 * t689)) + ((t618 + (t624 * t689)) * t692)) + (((t630 + (t636 * t689)) + ((t642 + (t648 * t689)) * t692)) * (t692 * t692)));
    let t711 = -t708;
    let t716 = select(plant.saturation - max(t708, t711), select(t711, t708, t606 > 0.0) - plant.saturation, t609 > 0.0);
    let t717 = select(t689, 1.0f, t716 > 0.0);
    let t718 = select(t708, (command + 0.0f) - t681, t716 > 0.0);
    let t719 = select(t718, t606, t609 > 0.0);
    let t722 = plant.saturation - select(-t718, t718, t719 > 0.0);
    let t724 = select(t722, -t722, t609 > 0.0);
    let t725 = left - t599;
    let t726 = -t724;
    let t728 = plant.saturation - select(-t555, t555, t719 > 0.0);
    let t731 = max(select(t728, -t728, t609 > 0.0), 0.0f);
    let t733 = select(-t603, t603, t719 > 0.0);
    let t737 = (-select(-t733, t733, t609 > 0.0)) * t717;
    let t754 = t717 * min(max((2.0f * t731) / max(t737 + sqrt(max((t737 * t737) - ((4.0f * ((t724 - t731) + t737)) * t731), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t755 = t754 * t754;
    let t768 = t755 * t755;
    let t784 = ((state.spool + (t602 * t754)) + ((t618 + (t624 * t754)) * t755)) + (((t630 + (t636 * t754)) + ((t642 + (t648 * t754)) * t755)) * t768);
    let t787 = (command + (0.0f * t754)) - t784;
    let t790 = plant.saturation - select(-t787, t787, t719 > 0.0);
    let t795 = 0.0f - (((((state.integrator + (t615 * t754)) + ((t620 + (t626 * t754)) * t755)) + (((t632 + (t638 * t754)) + ((t644 + (t650 * t754)) * t755)) * t768)) - t784) * t600);
    let t797 = select(-t795, t795, t719 > 0.0);
    let t799 = select(-t797, t797, t609 > 0.0);
    let t807 = max(min(max(t754 - ((select(t790, -t790, t609 > 0.0) * t799) / ((t799 * t799) + 1e-30f)), 0.0f), t717), 0.0001f);
    let t808 = t807 * t807;
    let t821 = t808 * t808;
    return ExactStep(select(t667, ((state.integrator + (t615 * t807)) + ((t620 + (t626 * t807)) * t808)) + (((t632 + (t638 * t807)) + ((t644 + (t650 * t807)) * t808)) * t821), t726 > 0.0), select(t681, ((state.spool + (t602 * t807)) + ((t618 + (t624 * t807)) * t808)) + (((t630 + (t636 * t807)) + ((t642 + (t648 * t807)) * t808)) * t821), t726 > 0.0), select(t725, t725 + (t599 * (1.0f - t807)), t726 > 0.0));
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
