// The base model's exact step, written by hand in CUDA: what the composed shader is compared with where nvcc is there.
// Its twin is row.wgsl; the equations are those of src/model/exact_step.rs.
//
//     nvcc -O3 -o row row.cu && ./row work.bin        (work.bin: `gpu work FILE`)
//     g++ -O2 -x c++ -o row row.cu && ./row work.bin  (on the CPU, to check the arithmetic)
//
// Prints "rows_per_second largest_difference", the latter of the first costs from those of servobee's CPU in f64, for all
// but one candidate of a hundred: lightly damped ones in saturation make any rounding large.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <vector>

#ifdef __CUDACC__
#define DEVICE __device__ __forceinline__
#else
#define DEVICE static inline
#endif

struct Header {
    uint32_t population, rows, parts, compared;
    float length;
};

DEVICE float with_sign(float sign, float value) { return sign > 0.0f ? value : -value; }

DEVICE float series(const float *c, float at) {
    float square = at * at;
    float low = (c[0] + c[1] * at) + (c[2] + c[3] * at) * square;
    float high = (c[4] + c[5] * at) + (c[6] + c[7] * at) * square;
    return low + high * (square * square);
}

// The first part of what is `left` of a step; returns what is left then.
DEVICE float turn(float gain, float rate, float saturation, float longest, float &z, float &x, float u, float left) {
    float whole = left > longest * 1.0001f ? longest : left;
    float f = whole * rate, g = whole * gain, e0 = u - x;
    float spool[8], integrator[8];
    spool[0] = x;
    integrator[0] = z;
    spool[1] = (z - x) * f;
    float probe = e0 - 1e-3f * spool[1];
    bool beyond = fabsf(probe) > saturation;
    float back = beyond ? 0.0f : g;
    integrator[1] = beyond ? with_sign(probe, g * saturation) : g * e0;
#pragma unroll
    for (int n = 1; n < 7; n++) {
        spool[n + 1] = (integrator[n] - spool[n]) * (f * (1.0f / (n + 1)));
        integrator[n + 1] = -spool[n] * (back * (1.0f / (n + 1)));
    }
    float z_end = series(integrator, 1.0f), x_end = series(spool, 1.0f);
    float speed_end = -(z_end - x_end) * f;
    float peak = spool[1] * speed_end > 0.0f ? -spool[1] / (-spool[1] - speed_end) : 1.0f;
    float e_peak = u - series(spool, peak);
    float missed = beyond ? with_sign(probe, e_peak) - saturation : saturation - fabsf(e_peak);
    float last = missed > 0.0f ? 1.0f : peak;
    float e_last = missed > 0.0f ? u - x_end : e_peak;
    float side = beyond ? probe : e_last, inward = beyond ? -1.0f : 1.0f;
    float there = inward * (saturation - with_sign(side, e_last));
    if (there >= 0.0f) {
        z = z_end;
        x = x_end;
        return left - whole;
    }
    float inside = fmaxf(inward * (saturation - with_sign(side, e0)), 0.0f);
    float fall = -(inward * with_sign(side, spool[1])) * last;
    float bend = there - inside + fall;
    float root = sqrtf(fmaxf(fall * fall - 4.0f * bend * inside, 0.0f));
    float guess = last * fminf(fmaxf(2.0f * inside / fmaxf(fall + root, 1e-30f), 0.0f), 1.0f);
    float z_guess = series(integrator, guess), x_guess = series(spool, guess);
    float now = inward * (saturation - with_sign(side, u - x_guess));
    float slope = inward * with_sign(side, (z_guess - x_guess) * f);
    float share = guess - now * slope / (slope * slope + 1e-30f);
    share = fmaxf(fminf(fmaxf(share, 0.0f), last), 1e-4f);
    z = series(integrator, share);
    x = series(spool, share);
    return (left - whole) + whole * (1.0f - share);
}

DEVICE float cost(const Header &work, const float *candidates, const float *rows, uint32_t candidate) {
    float gain = candidates[candidate];
    float lag = candidates[work.population + candidate];
    float saturation = candidates[2 * work.population + candidate];
    float rate = 1.0f / lag, stiffness = gain * rate, part_of = work.length * 0.125f;
    float number = 1, multiple = 0, kept = 0, course = 0, term = 1, faded = 0;
    for (int n = 1; n <= 8; n++) {
        float part = part_of / n, next = -(stiffness * multiple) * part;
        multiple = (number - rate * multiple) * part;
        number = next;
        term = -(term * rate * part);
        kept += number;
        course += multiple;
        faded -= term;
    }
    for (int n = 0; n < 3; n++) {
        float before = kept;
        kept = 2 * kept + (kept * kept - stiffness * course * course);
        course = course * (2 + (2 * before - rate * course));
        faded = faded * (2 - faded);
    }
    float followed = course * rate, fed = course * gain, slewed = gain * saturation * work.length;
    float lead = gain * saturation * lag, softness = 1 / (gain * lag);
    float radians = stiffness * work.length * work.length;
    float longest = work.length * (fmaxf(sqrtf(radians), work.length * rate) > 1.05f ? 0.25f : 1.0f);

    float z = rows[0], x = z, sum = 0, chunk = 0;
    for (uint32_t k = 0; k < work.rows; k++) {
        float u = rows[2 * k], error = rows[2 * k + 1] - x;
        chunk += error * error;
        if ((k + 1) % 128 == 0 || k + 1 == work.rows) {
            sum += chunk;
            chunk = 0;
        }
        float ahead = z - x, behind = x - u;
        bool beyond = fabsf(behind) > saturation;
        float slew = with_sign(-behind, slewed);
        float z_new = z + (beyond ? slew : kept * (behind + ahead) - fed * behind);
        float x_new =
            x + (beyond ? slew - (with_sign(-behind, lead) - ahead) * faded : kept * behind + followed * ahead);
        float energy = behind * behind + ahead * ahead * softness - saturation * saturation;
        float turned = fmaxf(radians - 9.0f, -(ahead * (z_new - x_new)));
        float left_linear = fminf(energy, fmaxf(fabsf(x_new - u) - saturation, turned));
        float left_saturation = saturation - with_sign(-behind, u - x_new);
        if ((beyond ? left_saturation : left_linear) > 0.0f) {
            float left = work.length;
            for (uint32_t i = 0; i < work.parts && left > 0.0f; i++)
                left = turn(gain, rate, saturation, longest, z, x, u, left);
        } else {
            z = z_new;
            x = x_new;
        }
    }
    return sum;
}

#ifdef __CUDACC__
__global__ void integrate(Header work, const float *candidates, const float *rows, float *costs) {
    uint32_t candidate = blockIdx.x * blockDim.x + threadIdx.x;
    if (candidate < work.population) costs[candidate] = cost(work, candidates, rows, candidate);
}

static void check(cudaError_t error) {
    if (error == cudaSuccess) return;
    fprintf(stderr, "row.cu: %s\n", cudaGetErrorString(error));
    exit(1);
}
#endif

template <class T> static std::vector<T> read(FILE *file, size_t count) {
    std::vector<T> all(count);
    if (fread(all.data(), sizeof(T), count, file) != count) {
        fprintf(stderr, "row.cu: the file of the work is too short\n");
        exit(1);
    }
    return all;
}

int main(int count, char **arguments) {
    FILE *file = count == 2 ? fopen(arguments[1], "rb") : nullptr;
    if (!file) {
        fprintf(stderr, "row.cu: usage: row FILE, which `gpu work FILE` writes\n");
        return 2;
    }
    Header work = read<Header>(file, 1)[0];
    auto rows = read<float>(file, 2 * work.rows);
    auto candidates = read<float>(file, 3 * size_t(work.population));
    auto expected = read<double>(file, work.compared);
    std::vector<float> costs(work.population);
    std::vector<double> seconds;
#ifdef __CUDACC__
    float *on_device[3];
    const size_t sizes[3] = {candidates.size() * 4, rows.size() * 4, costs.size() * 4};
    for (int i = 0; i < 3; i++) check(cudaMalloc(&on_device[i], sizes[i]));
    check(cudaMemcpy(on_device[0], candidates.data(), sizes[0], cudaMemcpyHostToDevice));
    check(cudaMemcpy(on_device[1], rows.data(), sizes[1], cudaMemcpyHostToDevice));
    cudaEvent_t begin, end;
    check(cudaEventCreate(&begin));
    check(cudaEventCreate(&end));
    for (int run = 0; run < 8; run++) {
        check(cudaEventRecord(begin));
        integrate<<<(work.population + 127) / 128, 128>>>(work, on_device[0], on_device[1], on_device[2]);
        check(cudaEventRecord(end));
        check(cudaEventSynchronize(end));
        check(cudaGetLastError());
        float milliseconds;
        check(cudaEventElapsedTime(&milliseconds, begin, end));
        if (run > 0) seconds.push_back(1e-3 * milliseconds);
    }
    check(cudaMemcpy(costs.data(), on_device[2], sizes[2], cudaMemcpyDeviceToHost));
#else
    auto begin = std::chrono::steady_clock::now();
    for (uint32_t i = 0; i < work.population; i++) costs[i] = cost(work, candidates.data(), rows.data(), i);
    seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
#endif
    std::sort(seconds.begin(), seconds.end());
    std::vector<double> differences;
    for (uint32_t i = 0; i < work.compared; i++) differences.push_back(std::fabs(costs[i] / expected[i] - 1));
    std::sort(differences.begin(), differences.end());
    double off = differences[size_t(0.99 * (differences.size() - 1))];
    printf("%.4g %.2g\n", double(work.population) * work.rows / seconds[seconds.size() / 2], off);
    return off < 1e-4 ? 0 : 1;
}
