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
    let t70 = input.supply * 100000.0f;
    let t71 = input.tank * 100000.0f;
    let t72 = input.a * 100000.0f;
    let t73 = input.b * 100000.0f;
    let t130 = t70 - t72;
    let t137 = (((t70 + t72) * 0.5f) + 101325.0f) * 0.001f;
    let t147 = t72 - t71;
    let t151 = (((t72 + t71) * 0.5f) + 101325.0f) * 0.001f;
    let t161 = t70 - t73;
    let t165 = (((t70 + t73) * 0.5f) + 101325.0f) * 0.001f;
    let t174 = t73 - t71;
    let t178 = (((t73 + t71) * 0.5f) + 101325.0f) * 0.001f;
    let opening_191 = state.spool * 10.0f;
    let t192 = plant.opening_offset + opening_191;
    let forward_area_218 = max(((((plant.first_area + (plant.slope_1 * min(max(t192 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t192 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t192 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t192 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t192 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t219 = plant.opening_offset - opening_191;
    let backward_area_245 = max(((((plant.first_area + (plant.slope_1 * min(max(t219 - 0.0f, 0.0f), 10.0f))) + (plant.slope_2 * min(max(t219 - 10.0f, 0.0f), 15.0f))) + (plant.slope_3 * min(max(t219 - 25.0f, 0.0f), 25.0f))) + (plant.slope_4 * min(max(t219 - 50.0f, 0.0f), 30.0f))) + (plant.slope_5 * min(max(t219 - 80.0f, 0.0f), 20.0f)), plant.leakage);
    let t246 = forward_area_218 * plant.orifice_coefficient;
    let t250 = backward_area_245 * plant.orifice_coefficient;
    let flow_263 = (((((t246 * t130) / sqrt(sqrt((t130 * t130) + (t137 * t137)))) * 60000.0f) - (((t250 * t147) / sqrt(sqrt((t147 * t147) + (t151 * t151)))) * 60000.0f)) + ((((t246 * t174) / sqrt(sqrt((t174 * t174) + (t178 * t178)))) * 60000.0f) - (((t250 * t161) / sqrt(sqrt((t161 * t161) + (t165 * t165)))) * 60000.0f))) * 0.5f;
    return Outputs(state.spool, flow_263);
}

fn advance(plant: Plant, state: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    let t287 = -plant.saturation;
    let t290 = plant.gain * min(max(start.command - state.spool, t287), plant.saturation);
    let t292 = (state.integrator - state.spool) * plant.rate;
    let t298 = step * 0.5f;
    let t302 = state.spool + (t298 * t292);
    let t310 = plant.gain * min(max(middle.command - t302, t287), plant.saturation);
    let t312 = ((state.integrator + (t298 * t290)) - t302) * plant.rate;
    let t325 = state.spool + (t298 * t312);
    let t330 = plant.gain * min(max(middle.command - t325, t287), plant.saturation);
    let t332 = ((state.integrator + (t298 * t310)) - t325) * plant.rate;
    let t340 = step * 1.0f;
    let t344 = state.spool + (t340 * t332);
    let t365 = step * 0.16666667f;
    return State(state.integrator + (t365 * (((t290 + (2.0f * t310)) + (2.0f * t330)) + (1.0f * (plant.gain * min(max(end.command - t344, t287), plant.saturation))))), state.spool + (t365 * (((t292 + (2.0f * t312)) + (2.0f * t332)) + (1.0f * (((state.integrator + (t340 * t330)) - t344) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t388 = length * 0.125f;
    let t389 = t388 * 1.0f;
    let t392 = (-(stiffness * 0.0f)) * t389;
    let t395 = (1.0f - (plant.rate * 0.0f)) * t389;
    let t398 = -((1.0f * plant.rate) * t389);
    let t402 = t388 * 0.5f;
    let t405 = (-(stiffness * t395)) * t402;
    let t408 = (t392 - (plant.rate * t395)) * t402;
    let t411 = -((t398 * plant.rate) * t402);
    let t416 = t388 * 0.33333334f;
    let t419 = (-(stiffness * t408)) * t416;
    let t422 = (t405 - (plant.rate * t408)) * t416;
    let t425 = -((t411 * plant.rate) * t416);
    let t430 = t388 * 0.25f;
    let t433 = (-(stiffness * t422)) * t430;
    let t436 = (t419 - (plant.rate * t422)) * t430;
    let t439 = -((t425 * plant.rate) * t430);
    let t444 = t388 * 0.2f;
    let t447 = (-(stiffness * t436)) * t444;
    let t450 = (t433 - (plant.rate * t436)) * t444;
    let t453 = -((t439 * plant.rate) * t444);
    let t457 = t388 * 0.16666667f;
    let t460 = (-(stiffness * t450)) * t457;
    let t463 = (t447 - (plant.rate * t450)) * t457;
    let t466 = -((t453 * plant.rate) * t457);
    let t471 = t388 * 0.14285715f;
    let t474 = (-(stiffness * t463)) * t471;
    let t477 = (t460 - (plant.rate * t463)) * t471;
    let t480 = -((t466 * plant.rate) * t471);
    let t484 = t388 * 0.125f;
    let t494 = (((((((0.0f + t392) + t405) + t419) + t433) + t447) + t460) + t474) + ((-(stiffness * t477)) * t484);
    let t495 = (((((((0.0f + t395) + t408) + t422) + t436) + t450) + t463) + t477) + ((t474 - (plant.rate * t477)) * t484);
    let t496 = (((((((0.0f - t398) - t411) - t425) - t439) - t453) - t466) - t480) - (-((t480 * plant.rate) * t484));
    let t497 = 2.0f * t494;
    let t502 = t497 + ((t494 * t494) - ((stiffness * t495) * t495));
    let t506 = t495 * (2.0f + (t497 - (plant.rate * t495)));
    let t508 = t496 * (2.0f - t496);
    let t509 = 2.0f * t502;
    let t514 = t509 + ((t502 * t502) - ((stiffness * t506) * t506));
    let t518 = t506 * (2.0f + (t509 - (plant.rate * t506)));
    let t520 = t508 * (2.0f - t508);
    let t521 = 2.0f * t514;
    let t530 = t518 * (2.0f + (t521 - (plant.rate * t518)));
    let t533 = plant.gain * plant.saturation;
    let t535 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t535), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t521 + ((t514 * t514) - ((stiffness * t518) * t518)), t530 * plant.rate, t530 * plant.gain, t520 * (2.0f - t520), t533 * length, t533 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t535 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t291 = state.integrator - state.spool;
    let t552 = command - state.spool;
    let t553 = -t552;
    let t562 = select(-stride.slewed, stride.slewed, t552 > 0.0);
    let t568 = max(t552, t553) - plant.saturation;
    let t570 = state.integrator + select((stride.kept * (t553 + t291)) - (stride.fed * t553), t562, t568 > 0.0);
    let t573 = state.spool + select((stride.kept * t553) + (stride.followed * t291), t562 - ((select(-stride.lead, stride.lead, t552 > 0.0) - t291) * stride.faded), t568 > 0.0);
    let t574 = command - t573;
    let t580 = -t574;
    return ExactStep(t570, t573, select(min(((t553 * t553) + ((t291 * t291) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t574, t580) - plant.saturation, max(stride.turns, -(t291 * (t570 - t573))))), plant.saturation - select(t580, t574, t552 > 0.0), t568 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t552 = command - state.spool;
    let t596 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t597 = t596 * plant.rate;
    let t598 = t596 * plant.gain;
    let t599 = (state.integrator - state.spool) * t597;
    let t600 = 0.0f - t599;
    let t603 = t552 + (0.001f * t600);
    let t606 = max(t603, -t603) - plant.saturation;
    let t607 = select(t598, 0.0f, t606 > 0.0);
    let t608 = t598 * plant.saturation;
    let t612 = select(t598 * t552, select(-t608, t608, t603 > 0.0), t606 > 0.0);
    let t615 = (t612 - t599) * (t597 * 0.5f);
    let t617 = t600 * (t607 * 0.5f);
    let t621 = (t617 - t615) * (t597 * 0.33333334f);
    let t623 = (-t615) * (t607 * 0.33333334f);
    let t627 = (t623 - t621) * (t597 * 0.25f);
    let t629 = (-t621) * (t607 * 0.25f);
    let t633 = (t629 - t627) * (t597 * 0.2f);
    let t635 = (-t627) * (t607 * 0.2f);
    let t639 = (t635 - t633) * (t597 * 0.16666667f);
    let t641 = (-t633) * (t607 * 0.16666667f);
    let t645 = (t641 - t639) * (t597 * 0.14285715f);
    let t647 = (-t639) * (t607 * 0.14285715f);
    let t649 = 1.0f * 1.0f;
    let t662 = t649 * t649;
    let t664 = ((state.integrator + (t612 * 1.0f)) + ((t617 + (t623 * 1.0f)) * t649)) + (((t629 + (t635 * 1.0f)) + ((t641 + (t647 * 1.0f)) * t649)) * t662);
    let t678 = ((state.spool + (t599 * 1.0f)) + ((t615 + (t621 * 1.0f)) * t649)) + (((t627 + (t633 * 1.0f)) + ((t639 + (t645 * 1.0f)) * t649)) * t662);
    let t681 = 0.0f - ((t664 - t678) * t597);
    let t686 = select(1.0f, t600 / (t600 - t681), (-(t600 * t681)) > 0.0);
    let t689 = t686 * t686;
    let t705 = (command + (0.0f * t686)) - (((state.spool + (t599 * t686)) + ((t615 + (t621 * t686)) * t689)) + (((t627 + (t633 * t686)) + ((t639 + (t645 * t686)) * t689)) * (t689 * t689)));
    let t708 = -t705;
    let t713 = select(plant.saturation - max(t705, t708), select(t708, t705, t603 > 0.0) - plant.saturation, t606 > 0.0);
    let t714 = select(t686, 1.0f, t713 > 0.0);
    let t715 = select(t705, (command + 0.0f) - t678, t713 > 0.0);
    let t716 = select(t715, t603, t606 > 0.0);
    let t719 = plant.saturation - select(-t715, t715, t716 > 0.0);
    let t721 = select(t719, -t719, t606 > 0.0);
    let t722 = left - t596;
    let t723 = -t721;
    let t725 = plant.saturation - select(-t552, t552, t716 > 0.0);
    let t728 = max(select(t725, -t725, t606 > 0.0), 0.0f);
    let t730 = select(-t600, t600, t716 > 0.0);
    let t734 = (-select(-t730, t730, t606 > 0.0)) * t714;
    let t751 = t714 * min(max((2.0f * t728) / max(t734 + sqrt(max((t734 * t734) - ((4.0f * ((t721 - t728) + t734)) * t728), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t752 = t751 * t751;
    let t765 = t752 * t752;
    let t781 = ((state.spool + (t599 * t751)) + ((t615 + (t621 * t751)) * t752)) + (((t627 + (t633 * t751)) + ((t639 + (t645 * t751)) * t752)) * t765);
    let t784 = (command + (0.0f * t751)) - t781;
    let t787 = plant.saturation - select(-t784, t784, t716 > 0.0);
    let t792 = 0.0f - (((((state.integrator + (t612 * t751)) + ((t617 + (t623 * t751)) * t752)) + (((t629 + (t635 * t751)) + ((t641 + (t647 * t751)) * t752)) * t765)) - t781) * t597);
    let t794 = select(-t792, t792, t716 > 0.0);
    let t796 = select(-t794, t794, t606 > 0.0);
    let t804 = max(min(max(t751 - ((select(t787, -t787, t606 > 0.0) * t796) / ((t796 * t796) + 1e-30f)), 0.0f), t714), 0.0001f);
    let t805 = t804 * t804;
    let t818 = t805 * t805;
    return ExactStep(select(t664, ((state.integrator + (t612 * t804)) + ((t617 + (t623 * t804)) * t805)) + (((t629 + (t635 * t804)) + ((t641 + (t647 * t804)) * t805)) * t818), t723 > 0.0), select(t678, ((state.spool + (t599 * t804)) + ((t615 + (t621 * t804)) * t805)) + (((t627 + (t633 * t804)) + ((t639 + (t645 * t804)) * t805)) * t818), t723 > 0.0), select(t722, t722 + (t596 * (1.0f - t804)), t723 > 0.0));
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t858 = measured.spool - simulated.spool;
    let t862 = measured.flow - simulated.flow;
    return Outputs(sums.spool + (weight * (t858 * t858)), sums.flow + (weight * (t862 * t862)));
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
