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
    let t306 = plant.gain * min(max(middle.command - t300, t292), plant.saturation);
    let t308 = ((state.integrator + (t296 * t295)) - t300) * plant.rate;
    let t318 = state.spool + (t296 * t308);
    let t322 = plant.gain * min(max(middle.command - t318, t292), plant.saturation);
    let t324 = ((state.integrator + (t296 * t306)) - t318) * plant.rate;
    let t330 = step * 1.0f;
    let t334 = state.spool + (t330 * t324);
    let t350 = step * 0.16666667f;
    return State(state.integrator + (t350 * (((t295 + (2.0f * t306)) + (2.0f * t322)) + (1.0f * (plant.gain * min(max(end.command - t334, t292), plant.saturation))))), state.spool + (t350 * (((t196 + (2.0f * t308)) + (2.0f * t324)) + (1.0f * (((state.integrator + (t330 * t322)) - t334) * plant.rate)))));
}

fn stride_of(plant: Plant, length: f32) -> Stride {
    let stiffness = plant.gain * plant.rate;
    let t373 = length * 0.125f;
    let t374 = t373 * 1.0f;
    let t377 = (-(stiffness * 0.0f)) * t374;
    let t380 = (1.0f - (plant.rate * 0.0f)) * t374;
    let t383 = -((1.0f * plant.rate) * t374);
    let t387 = t373 * 0.5f;
    let t390 = (-(stiffness * t380)) * t387;
    let t393 = (t377 - (plant.rate * t380)) * t387;
    let t396 = -((t383 * plant.rate) * t387);
    let t401 = t373 * 0.33333334f;
    let t404 = (-(stiffness * t393)) * t401;
    let t407 = (t390 - (plant.rate * t393)) * t401;
    let t410 = -((t396 * plant.rate) * t401);
    let t415 = t373 * 0.25f;
    let t418 = (-(stiffness * t407)) * t415;
    let t421 = (t404 - (plant.rate * t407)) * t415;
    let t424 = -((t410 * plant.rate) * t415);
    let t429 = t373 * 0.2f;
    let t432 = (-(stiffness * t421)) * t429;
    let t435 = (t418 - (plant.rate * t421)) * t429;
    let t438 = -((t424 * plant.rate) * t429);
    let t442 = t373 * 0.16666667f;
    let t445 = (-(stiffness * t435)) * t442;
    let t448 = (t432 - (plant.rate * t435)) * t442;
    let t451 = -((t438 * plant.rate) * t442);
    let t456 = t373 * 0.14285715f;
    let t459 = (-(stiffness * t448)) * t456;
    let t462 = (t445 - (plant.rate * t448)) * t456;
    let t465 = -((t451 * plant.rate) * t456);
    let t469 = t373 * 0.125f;
    let t479 = (((((((0.0f + t377) + t390) + t404) + t418) + t432) + t445) + t459) + ((-(stiffness * t462)) * t469);
    let t480 = (((((((0.0f + t380) + t393) + t407) + t421) + t435) + t448) + t462) + ((t459 - (plant.rate * t462)) * t469);
    let t481 = (((((((0.0f - t383) - t396) - t410) - t424) - t438) - t451) - t465) - (-((t465 * plant.rate) * t469));
    let t482 = 2.0f * t479;
    let t487 = t482 + ((t479 * t479) - ((stiffness * t480) * t480));
    let t491 = t480 * (2.0f + (t482 - (plant.rate * t480)));
    let t493 = t481 * (2.0f - t481);
    let t494 = 2.0f * t487;
    let t499 = t494 + ((t487 * t487) - ((stiffness * t491) * t491));
    let t503 = t491 * (2.0f + (t494 - (plant.rate * t491)));
    let t505 = t493 * (2.0f - t493);
    let t506 = 2.0f * t499;
    let t515 = t503 * (2.0f + (t506 - (plant.rate * t503)));
    let t518 = plant.gain * plant.saturation;
    let t520 = (stiffness * length) * length;
    return Stride(length, length * select(1.0f, 0.25f, ((max(sqrt(t520), length * plant.rate) * 0.95238096f) - 1.0f) > 0.0), t506 + ((t499 * t499) - ((stiffness * t503) * t503)), t515 * plant.rate, t515 * plant.gain, t505 * (2.0f - t505), t518 * length, t518 * plant.time_constant, 1.0f / (plant.gain * plant.time_constant), t520 - 9.0f);
}

fn exact_step(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32) -> ExactStep {
    let t195 = state.integrator - state.spool;
    let t537 = command - state.spool;
    let t538 = -t537;
    let t547 = select(-stride.slewed, stride.slewed, t537 > 0.0);
    let t553 = max(t537, t538) - plant.saturation;
    let t555 = state.integrator + select((stride.kept * (t538 + t195)) - (stride.fed * t538), t547, t553 > 0.0);
    let t558 = state.spool + select((stride.kept * t538) + (stride.followed * t195), t547 - ((select(-stride.lead, stride.lead, t537 > 0.0) - t195) * stride.faded), t553 > 0.0);
    let t559 = command - t558;
    let t565 = -t559;
    return ExactStep(t555, t558, select(min(((t538 * t538) + ((t195 * t195) * stride.softness)) - (plant.saturation * plant.saturation), max(max(t559, t565) - plant.saturation, max(stride.turns, -(t195 * (t555 - t558))))), plant.saturation - select(t565, t559, t537 > 0.0), t553 > 0.0));
}

fn turn(plant: Plant, stride: Stride, state: State, command: f32, ramp: f32, left: f32) -> ExactStep {
    let t537 = command - state.spool;
    let t581 = select(left, stride.part, (left - (stride.part * 1.0001f)) > 0.0);
    let t582 = t581 * plant.rate;
    let t583 = t581 * plant.gain;
    let t584 = (state.integrator - state.spool) * t582;
    let t585 = 0.0f - t584;
    let t588 = t537 + (0.001f * t585);
    let t591 = max(t588, -t588) - plant.saturation;
    let t592 = select(t583, 0.0f, t591 > 0.0);
    let t593 = t583 * plant.saturation;
    let t597 = select(t583 * t537, select(-t593, t593, t588 > 0.0), t591 > 0.0);
    let t600 = (t597 - t584) * (t582 * 0.5f);
    let t602 = t585 * (t592 * 0.5f);
    let t606 = (t602 - t600) * (t582 * 0.33333334f);
    let t608 = (-t600) * (t592 * 0.33333334f);
    let t612 = (t608 - t606) * (t582 * 0.25f);
    let t614 = (-t606) * (t592 * 0.25f);
    let t618 = (t614 - t612) * (t582 * 0.2f);
    let t620 = (-t612) * (t592 * 0.2f);
    let t624 = (t620 - t618) * (t582 * 0.16666667f);
    let t626 = (-t618) * (t592 * 0.16666667f);
    let t630 = (t626 - t624) * (t582 * 0.14285715f);
    let t632 = (-t624) * (t592 * 0.14285715f);
    let t634 = 1.0f * 1.0f;
    let t647 = t634 * t634;
    let t649 = ((state.integrator + (t597 * 1.0f)) + ((t602 + (t608 * 1.0f)) * t634)) + (((t614 + (t620 * 1.0f)) + ((t626 + (t632 * 1.0f)) * t634)) * t647);
    let t663 = ((state.spool + (t584 * 1.0f)) + ((t600 + (t606 * 1.0f)) * t634)) + (((t612 + (t618 * 1.0f)) + ((t624 + (t630 * 1.0f)) * t634)) * t647);
    let t666 = 0.0f - ((t649 - t663) * t582);
    let t671 = select(1.0f, t585 / (t585 - t666), (-(t585 * t666)) > 0.0);
    let t674 = t671 * t671;
    let t690 = (command + (0.0f * t671)) - (((state.spool + (t584 * t671)) + ((t600 + (t606 * t671)) * t674)) + (((t612 + (t618 * t671)) + ((t624 + (t630 * t671)) * t674)) * (t674 * t674)));
    let t693 = -t690;
    let t698 = select(plant.saturation - max(t690, t693), select(t693, t690, t588 > 0.0) - plant.saturation, t591 > 0.0);
    let t699 = select(t671, 1.0f, t698 > 0.0);
    let t700 = select(t690, (command + 0.0f) - t663, t698 > 0.0);
    let t701 = select(t700, t588, t591 > 0.0);
    let t704 = plant.saturation - select(-t700, t700, t701 > 0.0);
    let t706 = select(t704, -t704, t591 > 0.0);
    let t707 = left - t581;
    let t708 = -t706;
    let t710 = plant.saturation - select(-t537, t537, t701 > 0.0);
    let t713 = max(select(t710, -t710, t591 > 0.0), 0.0f);
    let t715 = select(-t585, t585, t701 > 0.0);
    let t719 = (-select(-t715, t715, t591 > 0.0)) * t699;
    let t736 = t699 * min(max((2.0f * t713) / max(t719 + sqrt(max((t719 * t719) - ((4.0f * ((t706 - t713) + t719)) * t713), 0.0f)), 1e-30f), 0.0f), 1.0f);
    let t737 = t736 * t736;
    let t750 = t737 * t737;
    let t766 = ((state.spool + (t584 * t736)) + ((t600 + (t606 * t736)) * t737)) + (((t612 + (t618 * t736)) + ((t624 + (t630 * t736)) * t737)) * t750);
    let t769 = (command + (0.0f * t736)) - t766;
    let t772 = plant.saturation - select(-t769, t769, t701 > 0.0);
    let t777 = 0.0f - (((((state.integrator + (t597 * t736)) + ((t602 + (t608 * t736)) * t737)) + (((t614 + (t620 * t736)) + ((t626 + (t632 * t736)) * t737)) * t750)) - t766) * t582);
    let t779 = select(-t777, t777, t701 > 0.0);
    let t781 = select(-t779, t779, t591 > 0.0);
    let t789 = max(min(max(t736 - ((select(t772, -t772, t591 > 0.0) * t781) / ((t781 * t781) + 1e-30f)), 0.0f), t699), 0.0001f);
    let t790 = t789 * t789;
    let t803 = t790 * t790;
    return ExactStep(select(t649, ((state.integrator + (t597 * t789)) + ((t602 + (t608 * t789)) * t790)) + (((t614 + (t620 * t789)) + ((t626 + (t632 * t789)) * t790)) * t803), t708 > 0.0), select(t663, ((state.spool + (t584 * t789)) + ((t600 + (t606 * t789)) * t790)) + (((t612 + (t618 * t789)) + ((t624 + (t630 * t789)) * t790)) * t803), t708 > 0.0), select(t707, t707 + (t581 * (1.0f - t789)), t708 > 0.0));
}

fn follow(plant: Plant, state: State, after: State, start: Input, middle: Input, end: Input, step: f32) -> State {
    return State(after.integrator, after.spool);
}

fn first_position(measured: Measured) -> f32 {
    return f32(measured.position);
}

fn add_errors(sums: Outputs, weight: f32, measured: Measured, simulated: Outputs) -> Outputs {
    let t841 = measured.spool - simulated.spool;
    let t845 = measured.flow - simulated.flow;
    return Outputs(sums.spool + (weight * (t841 * t841)), sums.flow + (weight * (t845 * t845)));
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
