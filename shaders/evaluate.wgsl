// The loops that evaluate a population: one invocation integrates one candidate on one record, or on one tone.
// Before this text stand the settings (constants) and the physics of the structure, traced from src/model:
//     struct Plant, struct State, STATES, prepare, initial, observe, advance, load, store, diverged.
// The twin of these loops on the CPU is src/evaluate/simulate.rs; both sum in the same order.

// What drives the model at one instant.
struct Input {
    command: f32,
    supply: f32,
    tank: f32,
    a: f32,
    b: f32,
}

// One row of a record.
struct Sample {
    step: f32,
    substeps: u32,
    weight: f32,
    input: Input,
    spool: f32,
    flow: f32,
    position: f32,
    padding: f32,
}

// A record's rows in `samples`.
struct Series {
    first: u32,
    count: u32,
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

// What one dispatch works on.
struct Work {
    population: u32,
    items: u32,
    slice: u32,
    padding: u32,
}

@group(0) @binding(0) var<uniform> work: Work;
@group(0) @binding(1) var<storage, read> candidates: array<f32>;
@group(0) @binding(2) var<storage, read> constants: array<f32>;
@group(0) @binding(3) var<storage, read> samples: array<Sample>;
@group(0) @binding(4) var<storage, read> series: array<Series>;
@group(0) @binding(5) var<storage, read_write> states: array<f32>;
@group(0) @binding(6) var<storage, read_write> results: array<vec4<f32>>;
@group(0) @binding(7) var<storage, read> tones: array<Tone>;
@group(0) @binding(8) var<storage, read> wave: array<vec2<f32>>;

fn between(start: Input, end: Input, share: f32) -> Input {
    return Input(
        start.command + share * (end.command - start.command),
        start.supply + share * (end.supply - start.supply),
        start.tank + share * (end.tank - start.tank),
        start.a + share * (end.a - start.a),
        start.b + share * (end.b - start.b),
    );
}

// Integrates one slice of a record. The result is the sum of weighted squared errors of the three outputs, and 1 in
// the fourth component where a state has diverged.
@compute @workgroup_size(64)
fn evaluate_series(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = id.x;
    let item = id.y;
    if (candidate >= work.population) {
        return;
    }
    let record = series[item];
    let begin = work.slice * SLICE;
    if (begin >= record.count) {
        return;
    }
    let end = min(begin + SLICE, record.count);
    let stride = work.population * work.items;
    let at = item * work.population + candidate;
    let plant = prepare(candidate, work.population);

    var state: State;
    var failed = false;
    if (work.slice == 0u) {
        let first = samples[record.first];
        state = initial(plant, first.input, first.position);
    } else {
        state = load(at, stride);
        failed = diverged(state);
    }
    var sum = vec3<f32>(0.0);
    var chunk = vec3<f32>(0.0);
    for (var k = begin; k < end && !failed; k++) {
        let sample = samples[record.first + k];
        let target_values = vec3<f32>(sample.spool, sample.flow, sample.position);
        let error = (target_values - observe(plant, state, sample.input)) * OBSERVED;
        chunk += sample.weight * error * error;
        if ((k + 1u) % CHUNK == 0u || k + 1u == end) {
            sum += chunk;
            chunk = vec3<f32>(0.0);
        }
        if (k + 1u < record.count) {
            if (INTERPOLATED) {
                let next = samples[record.first + k + 1u].input;
                let half_step = 0.5 / f32(sample.substeps);
                for (var j = 0u; j < sample.substeps; j++) {
                    let start = between(sample.input, next, f32(2u * j) * half_step);
                    let middle = between(sample.input, next, f32(2u * j + 1u) * half_step);
                    let stop = between(sample.input, next, f32(2u * j + 2u) * half_step);
                    state = advance(plant, state, start, middle, stop, sample.step);
                }
            } else {
                for (var j = 0u; j < sample.substeps; j++) {
                    state = advance(plant, state, sample.input, sample.input, sample.input, sample.step);
                }
            }
        }
        failed = diverged(state);
    }
    store(at, stride, state);
    results[work.slice * stride + at] = vec4<f32>(sum, select(0.0, 1.0, failed));
}

fn sine(tone: Tone, half_step: u32) -> vec2<f32> {
    return wave[half_step * tone.stride];
}

fn command(tone: Tone, half_step: u32) -> Input {
    return Input(tone.amplitude * sine(tone, half_step).x, 0.0, 0.0, 0.0, 0.0);
}

// Correlates the response to a tone with the sine. The result is the in-phase and the quadrature part per unit of
// command amplitude, and 1 in the fourth component where a state has diverged.
@compute @workgroup_size(64)
fn evaluate_tones(@builtin(global_invocation_id) id: vec3<u32>) {
    let candidate = id.x;
    let item = id.y;
    if (candidate >= work.population) {
        return;
    }
    let tone = tones[item];
    let plant = prepare(candidate, work.population);
    var state = initial(plant, command(tone, 0u), 0.0);
    var failed = false;
    var sum = vec2<f32>(0.0);
    for (var period = 0u; period < tone.settle + tone.measure && !failed; period++) {
        var chunk = vec2<f32>(0.0);
        for (var k = 0u; k < SAMPLES_PER_PERIOD; k++) {
            let first = 2u * k * tone.substeps;
            var start = command(tone, first);
            chunk += observe(plant, state, start).x * sine(tone, first);
            for (var j = 0u; j < tone.substeps; j++) {
                let end = command(tone, first + 2u * j + 2u);
                state = advance(plant, state, start, command(tone, first + 2u * j + 1u), end, tone.step);
                start = end;
            }
        }
        if (period >= tone.settle) {
            sum += chunk;
        }
        failed = diverged(state);
    }
    let norm = 2.0 / f32(tone.measure * SAMPLES_PER_PERIOD) / tone.amplitude;
    results[item * work.population + candidate] = vec4<f32>(sum * norm, 0.0, select(0.0, 1.0, failed));
}
