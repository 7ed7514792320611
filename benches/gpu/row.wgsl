// The base model's exact step, written by hand for one held command and rows that are all alike: the least that a kernel
// of this arithmetic does. What the composed shader is compared with; the equations are those of src/model/exact_step.rs.

struct Work {
    population: u32,
    rows: u32,
    length: f32,
    parts: u32,
}

@group(0) @binding(0) var<uniform> work: Work;
// Gain, time constant and saturation, each of all candidates.
@group(0) @binding(1) var<storage, read> candidates: array<f32>;
// Command and measured spool.
@group(0) @binding(2) var<storage, read> rows: array<vec2<f32>>;
@group(0) @binding(3) var<storage, read_write> costs: array<f32>;

fn signed(sign: f32, value: f32) -> f32 {
    return select(-value, value, sign > 0.0);
}

struct Series {
    low: vec4<f32>,
    high: vec4<f32>,
}

fn value(terms: Series, at: f32) -> f32 {
    let square = at * at;
    let low = (terms.low.x + terms.low.y * at) + (terms.low.z + terms.low.w * at) * square;
    let high = (terms.high.x + terms.high.y * at) + (terms.high.z + terms.high.w * at) * square;
    return low + high * (square * square);
}

// The first part of what is `left` of a step: integrator, spool, what is left then.
fn turn(gain: f32, rate: f32, saturation: f32, longest: f32, z: f32, x: f32, u: f32, left: f32) -> vec3<f32> {
    let whole = select(left, longest, left > longest * 1.0001);
    let f = whole * rate;
    let g = whole * gain;
    let e0 = u - x;
    let x1 = (z - x) * f;
    let probe = e0 - 1e-3 * x1;
    let beyond = abs(probe) > saturation;
    let back = select(g, 0.0, beyond);
    let z1 = select(g * e0, signed(probe, g * saturation), beyond);
    let x2 = (z1 - x1) * (f * 0.5);
    let z2 = -x1 * (back * 0.5);
    let x3 = (z2 - x2) * (f / 3.0);
    let z3 = -x2 * (back / 3.0);
    let x4 = (z3 - x3) * (f * 0.25);
    let z4 = -x3 * (back * 0.25);
    let x5 = (z4 - x4) * (f * 0.2);
    let z5 = -x4 * (back * 0.2);
    let x6 = (z5 - x5) * (f / 6.0);
    let z6 = -x5 * (back / 6.0);
    let x7 = (z6 - x6) * (f / 7.0);
    let z7 = -x6 * (back / 7.0);
    let spool = Series(vec4(x, x1, x2, x3), vec4(x4, x5, x6, x7));
    let integrator = Series(vec4(z, z1, z2, z3), vec4(z4, z5, z6, z7));
    let z_end = value(integrator, 1.0);
    let x_end = value(spool, 1.0);
    let speed_end = -(z_end - x_end) * f;
    let peak = select(1.0, -x1 / (-x1 - speed_end), x1 * speed_end > 0.0);
    let e_peak = u - value(spool, peak);
    let missed = select(saturation - abs(e_peak), signed(probe, e_peak) - saturation, beyond);
    let last = select(peak, 1.0, missed > 0.0);
    let e_last = select(e_peak, u - x_end, missed > 0.0);
    let side = select(e_last, probe, beyond);
    let inward = select(1.0, -1.0, beyond);
    let there = inward * (saturation - signed(side, e_last));
    if (there >= 0.0) {
        return vec3(z_end, x_end, left - whole);
    }
    let inside = max(inward * (saturation - signed(side, e0)), 0.0);
    let fall = -(inward * signed(side, x1)) * last;
    let bend = there - inside + fall;
    let root = sqrt(max(fall * fall - 4.0 * bend * inside, 0.0));
    let guess = last * clamp(2.0 * inside / max(fall + root, 1e-30), 0.0, 1.0);
    let z_guess = value(integrator, guess);
    let x_guess = value(spool, guess);
    let now = inward * (saturation - signed(side, u - x_guess));
    let slope = inward * signed(side, (z_guess - x_guess) * f);
    let share = max(clamp(guess - now * slope / (slope * slope + 1e-30), 0.0, last), 1e-4);
    return vec3(value(integrator, share), value(spool, share), (left - whole) + whole * (1.0 - share));
}

@compute @workgroup_size(64)
fn integrate(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= work.population) {
        return;
    }
    let gain = candidates[id.x];
    let lag = candidates[work.population + id.x];
    let saturation = candidates[2u * work.population + id.x];
    let rate = 1.0 / lag;
    let stiffness = gain * rate;
    // The matrix exponential of an eighth of a row, squared three times.
    let short = work.length * 0.125;
    var number = 1.0;
    var multiple = 0.0;
    var kept = 0.0;
    var course = 0.0;
    var term = 1.0;
    var faded = 0.0;
    for (var n = 1u; n <= 8u; n++) {
        let part = short / f32(n);
        let next = -(stiffness * multiple) * part;
        multiple = (number - rate * multiple) * part;
        number = next;
        term = -(term * rate * part);
        kept += number;
        course += multiple;
        faded -= term;
    }
    for (var n = 0u; n < 3u; n++) {
        let before = kept;
        kept = 2.0 * kept + (kept * kept - stiffness * course * course);
        course = course * (2.0 + (2.0 * before - rate * course));
        faded = faded * (2.0 - faded);
    }
    let followed = course * rate;
    let fed = course * gain;
    let slewed = gain * saturation * work.length;
    let lead = gain * saturation * lag;
    let softness = 1.0 / (gain * lag);
    let radians = stiffness * work.length * work.length;
    let longest = work.length * select(1.0, 0.25, max(sqrt(radians), work.length * rate) > 1.05);

    var z = rows[0].x;
    var x = z;
    var sum = 0.0;
    var chunk = 0.0;
    for (var k = 0u; k < work.rows; k++) {
        let row = rows[k];
        let error = row.y - x;
        chunk += error * error;
        if ((k + 1u) % 128u == 0u || k + 1u == work.rows) {
            sum += chunk;
            chunk = 0.0;
        }
        let ahead = z - x;
        let behind = x - row.x;
        let beyond = abs(behind) > saturation;
        let slew = signed(-behind, slewed);
        let z_new = z + select(kept * (behind + ahead) - fed * behind, slew, beyond);
        let x_new = x + select(kept * behind + followed * ahead, slew - (signed(-behind, lead) - ahead) * faded, beyond);
        let behind_new = x_new - row.x;
        let energy = behind * behind + ahead * ahead * softness - saturation * saturation;
        let turned = max(radians - 9.0, -(ahead * (z_new - x_new)));
        let left_linear = min(energy, max(abs(behind_new) - saturation, turned));
        let left_saturation = saturation - signed(-behind, -behind_new);
        if (select(left_linear, left_saturation, beyond) > 0.0) {
            var left = work.length;
            for (var i = 0u; i < work.parts && left > 0.0; i++) {
                let part = turn(gain, rate, saturation, longest, z, x, row.x, left);
                z = part.x;
                x = part.y;
                left = part.z;
            }
        } else {
            z = z_new;
            x = x_new;
        }
    }
    costs[id.x] = sum;
}
