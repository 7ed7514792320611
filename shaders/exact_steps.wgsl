// From row to row in exact steps of the spool. The twin of src/evaluate/simulation/exact_step.rs.

// One exact step, in which the command begins at `command` and changes by `ramp` a second.
fn one_exact_step(plant: Plant, stride: Stride, before: State, command: f32, ramp: f32) -> State {
    var state = before;
    let whole = exact_step(plant, stride, before, command, ramp);
    if (!(whole.more > 0.0)) {
        state.integrator = whole.integrator;
        state.spool = whole.spool;
        return state;
    }
    var left = stride.length;
    for (var i = 0u; i < MOST_PARTS && left > 0.0; i++) {
        let part = turn(plant, stride, state, command + ramp * (stride.length - left), ramp, left);
        state.integrator = part.integrator;
        state.spool = part.spool;
        left = part.more;
    }
    return state;
}

// The stride of the last interval: records have few lengths of rows.
var<private> known: Stride;

// How many exact steps go from a row to the next.
fn exact_steps(sample: Sample) -> u32 {
    return (sample.substeps + (STEPS_OF_AN_EXACT_STEP - 1u)) / STEPS_OF_AN_EXACT_STEP;
}

// How long each of them is, s; after the last row comes none.
fn length_of(sample: Sample) -> f32 {
    if (STEPS_OF_AN_EXACT_STEP == 1u) {
        return sample.step;
    }
    return sample.step * f32(sample.substeps) / f32(max(exact_steps(sample), 1u));
}

// What comes before the rows from number `begin` on.
fn depart(plant: Plant, record: Series, begin: u32) {
    known = stride_of(plant, length_of(samples[record.first + begin]));
}

// Moves the spool from row `k` to the next. `input` is what acts at row `k`; row `acting` is the one whose command that is.
fn travel(plant: Plant, record: Series, before: State, input: Input, k: u32, acting: i32) -> State {
    let sample = samples[record.first + k];
    let count = exact_steps(sample);
    let length = length_of(sample);
    var state = before;
    if (DELAYED) {
        var now = input;
        var late = command_of(record, acting);
        var begin = 0.0;
        for (var piece = 0u; piece < sample.pieces; piece++) {
            let row = acting + i32(piece);
            var end = length;
            if (piece + 1u < sample.pieces) {
                end = length - max(-arrival(plant, record, row + 1, k + 1u), 0.0) * (1.0 / f32(count));
            }
            if (piece > 0u) {
                late = select(late, command_of(record, row), arrival(plant, record, row, k + 1u) <= 0.0);
                now.command = command(plant, state, late);
                state = remember(plant, state, late);
            }
            let stride = stride_of(plant, end - begin);
            for (var j = 0u; j < count; j++) {
                let old = state;
                state = one_exact_step(plant, stride, old, now.command, 0.0);
                if (FOLLOWED) {
                    state = follow(plant, old, state, now, now, now, stride.length);
                }
            }
            begin = end;
        }
        return state;
    }
    // Devices that run all branches would pay for this one at every row.
    if (!EVEN && known.length != length) {
        known = stride_of(plant, length);
    }
    var ramp = 0.0;
    var next = input;
    if (INTERPOLATED) {
        next = straight_to(sample, samples[record.first + k + 1u]);
        ramp = (next.command - sample.input.command) / (length * f32(count));
    }
    var start = input;
    for (var j = 0u; j < count; j++) {
        let old = state;
        state = one_exact_step(plant, known, old, input.command + ramp * (length * f32(j)), ramp);
        if (FOLLOWED) {
            var middle = input;
            var end = input;
            if (INTERPOLATED) {
                middle = between(sample.input, next, (f32(j) + 0.5) / f32(count));
                end = between(sample.input, next, f32(j + 1u) / f32(count));
            }
            state = follow(plant, old, state, start, middle, end, known.length);
            start = end;
        }
    }
    return state;
}
