// From row to row in integration steps.

// Integrates from row `k` to the next while commands arrive late; row `first`'s is the one that acts at row `k`.
fn interval(plant: Plant, record: Series, before: State, now: Input, k: u32, first: i32) -> State {
    let sample = samples[record.first + k];
    let next = samples[record.first + k + 1u];
    let seconds = (next.input.time - sample.input.time) + (next.time_rest - sample.time_rest);
    let whole = sample.step * f32(sample.substeps);
    var state = before;
    var input = now;
    var begin = 0.0;
    var late = command_of(record, first);
    if (INTERPOLATED) {
        late = command_after(plant, record, first, k, 0.0);
    }
    for (var piece = 0u; piece < sample.pieces; piece++) {
        let row = first + i32(piece);
        var end = whole;
        if (piece + 1u < sample.pieces) {
            end = whole - max(-arrival(plant, record, row + 1, k + 1u), 0.0);
        }
        let reached = whole - begin > 0.0;
        if (!INTERPOLATED && piece > 0u) {
            late = select(late, command_of(record, row), arrival(plant, record, row, k + 1u) <= 0.0);
            input.command = command(plant, state, late);
            state = remember(plant, state, late);
        }
        for (var j = 0u; j < sample.substeps; j++) {
            // What this step has of the piece.
            let left = sample.step * f32(sample.substeps - j);
            let since = max((begin - whole) + left, 0.0);
            let step = min((end - whole) + left, sample.step) - since;
            if (!(step > 0.0)) {
                continue;
            }
            var inputs = array<Input, 3>(input, input, input);
            if (INTERPOLATED) {
                for (var half = 0u; half < 3u; half++) {
                    let after = sample.step * f32(j) + (since + 0.5 * f32(half) * step);
                    var one = between(sample.input, next.input, after * (1.0 / seconds));
                    late = select(late, command_after(plant, record, row, k, after), reached);
                    one.command = command(plant, state, late);
                    state = remember(plant, state, late);
                    inputs[half] = one;
                }
            }
            state = advance(plant, state, inputs[0], inputs[1], inputs[2], step);
        }
        begin = end;
    }
    return state;
}

// What comes before the rows from number `begin` on: nothing.
fn depart(plant: Plant, record: Series, begin: u32) {
}

// Integrates from row `k` to the next. `input` is what acts at row `k`; row `acting` is the one whose command that is.
fn travel(plant: Plant, record: Series, before: State, input: Input, k: u32, acting: i32) -> State {
    if (DELAYED) {
        return interval(plant, record, before, input, k, acting);
    }
    let sample = samples[record.first + k];
    var state = before;
    if (INTERPOLATED) {
        let next = straight_to(sample, samples[record.first + k + 1u]);
        let half_step = 0.5 / f32(sample.substeps);
        for (var j = 0u; j < sample.substeps; j++) {
            var inputs: array<Input, 3>;
            for (var half = 0u; half < 3u; half++) {
                var one = between(sample.input, next, f32(2u * j + half) * half_step);
                let arrived = one.command;
                one.command = command(plant, state, arrived);
                state = remember(plant, state, arrived);
                inputs[half] = one;
            }
            state = advance(plant, state, inputs[0], inputs[1], inputs[2], sample.step);
        }
    } else {
        for (var j = 0u; j < sample.substeps; j++) {
            state = advance(plant, state, input, input, input, sample.step);
        }
    }
    return state;
}
