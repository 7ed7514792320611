// The loops that evaluate a population: one invocation integrates one candidate on one record, or on one tone.
// Before this text stands what src/evaluate/devices/wgsl.rs writes: the settings (constants), and what knows the fields of a
// structure:
//     struct Input, Measured, Outputs, State, Plant,
//     prepare, initial, command, remember, delay, observe, advance, diverged: the physics, traced from src/model,
//     first_position, add_errors, add, response, between: the channels,
//     load_states, store_states, load_results, store_results.
// After it stands how a state goes from row to row: exact_steps.wgsl where the spool moves in exact steps, otherwise steps.wgsl.
// The twin of these loops on the CPU is src/evaluate/simulation/simulate.rs; both sum in the same order.

// One row of a record.
struct Sample {
    step: f32,
    substeps: u32,
    pieces: u32,
    weight: f32,
    input: Input,
    time_rest: f32,
    jumps: u32,
    measured: Measured,
}

// A record: its rows in `samples`, and its sums of slices among all records'.
struct Series {
    first: u32,
    count: u32,
    slot: u32,
}

// A sine whose response is measured.
struct Tone {
    amplitude: f32,
    step: f32,
    substeps: u32,
    stride: u32,
    settle: u32,
    measure: u32,
}

// What one dispatch works on: candidates `first` to `last` of the population, rows `begin` to `end`, ends excluded.
struct Work {
    population: u32,
    items: u32,
    first: u32,
    last: u32,
    begin: u32,
    end: u32,
}

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> candidates: array<f32>;
@group(0) @binding(2) var<storage, read> constants: array<f32>;
@group(0) @binding(3) var<storage, read> samples: array<Sample>;
@group(0) @binding(4) var<storage, read> series: array<Series>;
@group(0) @binding(5) var<storage, read_write> states: array<f32>;
@group(0) @binding(6) var<storage, read_write> results: array<f32>;
@group(0) @binding(7) var<storage, read_write> status: array<u32>;
@group(0) @binding(8) var<storage, read> tones: array<Tone>;
@group(0) @binding(9) var<storage, read> wave: array<vec2<f32>>;

// Seconds from row `now` of a record to the arrival of the command of row `row`. The twin is
// src/evaluate/simulation/transport_delay.rs.
fn arrival(plant: Plant, record: Series, row: i32, now: u32) -> f32 {
    if (row >= i32(record.count)) {
        return 3.4e38;
    }
    let there = samples[record.first + u32(max(row, 0))];
    let here = samples[record.first + now];
    return ((there.input.time - here.input.time) + (there.time_rest - here.time_rest)) + delay(plant);
}

// A row that may lie outside the record.
fn sample_of(record: Series, row: i32) -> Sample {
    return samples[record.first + u32(clamp(row, 0, i32(record.count) - 1))];
}

// The command of a row that may lie outside the record.
fn command_of(record: Series, row: i32) -> f32 {
    return sample_of(record, row).input.command;
}

// Whether the command goes nowhere from a row until it jumps with the next.
fn keeps_its_command(sample: Sample) -> bool {
    return BETWEEN_JUMPS && sample.jumps != 0u;
}

// What drives the model just before the row after `sample`, where it goes straight there.
fn straight_to(sample: Sample, next: Sample) -> Input {
    var input = next.input;
    if (keeps_its_command(sample)) {
        input.command = sample.input.command;
    }
    return input;
}

// The interpolated command `after` seconds after row `now`, on the way from row `row` to the next.
fn command_after(plant: Plant, record: Series, row: i32, now: u32, after: f32) -> f32 {
    let value = command_of(record, row);
    if (row < 0 || keeps_its_command(sample_of(record, row))) {
        return value;
    }
    var lasts = 1.0;
    if (row + 1 < i32(record.count)) {
        let there = samples[record.first + u32(row)];
        let next = samples[record.first + u32(row) + 1u];
        lasts = (next.input.time - there.input.time) + (next.time_rest - there.time_rest);
    }
    let share = clamp((after - arrival(plant, record, row, now)) / lasts, 0.0, 1.0);
    return value + share * (command_of(record, row + 1) - value);
}

// Integrates a slice of a record, or some chunks of it. The results are the slice's sums so far of what the errors of each
// output cost; the status is the record's.
@compute @workgroup_size(WORKGROUP)
fn evaluate_series(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = work.first + id.x;
    let item = id.y;
    if (candidate >= work.last) {
        return;
    }
    let record = series[item];
    let begin = work.begin;
    if (begin >= record.count) {
        return;
    }
    let end = min(work.end, record.count);
    let stride = work.population * work.items;
    let at = item * work.population + candidate;
    let plant = prepare(candidate, work.population);

    var state: State;
    var ended = FINISHED;
    if (begin == 0u) {
        let first = samples[record.first];
        state = initial(plant, first.input, first_position(first.measured));
    } else {
        state = load_states(at, stride);
        ended = status[at];
    }
    // The row whose command acts.
    var acting = i32(begin);
    if (DELAYED) {
        while (acting >= 0 && arrival(plant, record, acting, begin) > 0.0) {
            acting--;
        }
    }
    let place = (record.slot + begin / SLICE) * OUTPUTS * work.population + candidate;
    var sum = Outputs();
    if (begin % SLICE != 0u) {
        sum = load_results(place, work.population);
    }
    var chunk = Outputs();
    depart(plant, record, begin);
    for (var k = begin; k < end && ended == FINISHED; k++) {
        let sample = samples[record.first + k];
        var arrived = sample.input.command;
        if (DELAYED) {
            while (acting < i32(k) && arrival(plant, record, acting + 1, k) <= 0.0) {
                acting++;
            }
            arrived = command_of(record, acting);
            if (INTERPOLATED) {
                arrived = command_after(plant, record, acting, k, 0.0);
            }
        }
        var input = sample.input;
        input.command = command(plant, state, arrived);
        state = remember(plant, state, arrived);
        chunk = add_errors(chunk, sample.weight, sample.measured, observe(plant, state, input));
        if ((k + 1u) % CHUNK == 0u || k + 1u == end) {
            sum = add(sum, chunk);
            chunk = Outputs();
        }
        if (k + 1u < record.count) {
            state = travel(plant, record, state, input, k, acting);
        }
        ended = select(FINISHED, DIVERGED, diverged(state));
    }
    store_states(at, stride, state);
    store_results(place, work.population, sum);
    status[at] = ended;
}

fn sine(tone: Tone, half_step: u32) -> vec2<f32> {
    return wave[half_step * tone.stride];
}

fn tone_input(tone: Tone, half_step: u32) -> Input {
    var input = Input();
    input.command = tone.amplitude * sine(tone, half_step).x;
    return input;
}

// Correlates the response to a tone with the sine. The results are the in-phase and the quadrature part per unit of command
// amplitude; the status is the tone's.
@compute @workgroup_size(WORKGROUP)
fn evaluate_tones(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = work.first + id.x;
    let item = id.y;
    if (candidate >= work.last) {
        return;
    }
    let tone = tones[item];
    let plant = prepare(candidate, work.population);
    var state = initial(plant, tone_input(tone, 0u), 0.0);
    var ended = FINISHED;
    var sum = vec2<f32>(0.0);
    for (var period = 0u; period < tone.settle + tone.measure && ended == FINISHED; period++) {
        var chunk = vec2<f32>(0.0);
        for (var k = 0u; k < SAMPLES_PER_PERIOD; k++) {
            let first = 2u * k * tone.substeps;
            var start = tone_input(tone, first);
            chunk += response(observe(plant, state, start)) * sine(tone, first);
            for (var j = 0u; j < tone.substeps; j++) {
                let end = tone_input(tone, first + 2u * j + 2u);
                state = advance(plant, state, start, tone_input(tone, first + 2u * j + 1u), end, tone.step);
                start = end;
            }
        }
        if (period >= tone.settle) {
            sum += chunk;
        }
        ended = select(FINISHED, DIVERGED, diverged(state));
    }
    let norm = 2.0 / f32(tone.measure * SAMPLES_PER_PERIOD) / tone.amplitude;
    let place = 2u * item * work.population + candidate;
    results[place] = sum.x * norm;
    results[place + work.population] = sum.y * norm;
    status[item * work.population + candidate] = ended;
}
