"""Makes bench.csv, a record as a test bench would give it, without servobee.

A valve on a bench follows a command of steps, triangles and chirps of many amplitudes, both ways. Spool and flow are
measured at 1 kHz. The command reaches the valve DELAY seconds late, which the file does not say: servobee has to find
out. The last 30 % of the record, which servobee holds out, hold every kind of command again.

    z' = K sat(u(t - DELAY) - x, +-S)      x' = (z - x) / T      u held between samples, at rest at the start
    q  = Cd A sqrt(2 p / rho) x / x_full   |x| <= x_full, p = half of the rated drop at each land

Run, from the repository root:

    python3 -m venv bench-venv
    bench-venv/bin/pip install numpy==2.4.6
    bench-venv/bin/python tests/data/make_bench.py

Made with Python 3.11 and numpy 2.4.6. The noise is seeded: another run writes the same file.
"""

from pathlib import Path

import numpy as np

GAIN = 250.0  # K, 1/s
TIME_CONSTANT = 0.004  # T, s
SATURATION = 1.5  # S, V
FULL_SCALE = 10.0  # V
DELAY = 0.0047  # s

DISCHARGE_COEFFICIENT = 0.7
DENSITY = 850.0  # kg/m3
RATED_DROP = 10.0  # bar, from P to T
MAX_AREA = 0.4  # cm2

INTERVAL = 1e-3  # s between samples
STEP = 1e-5  # s of integration, of which INTERVAL and DELAY are multiples
NOISE = 0.003  # standard deviation, of full scale
SEED = 20240611


def steps(seconds, levels):
    """Every level for the same time."""
    return np.repeat(levels, round(seconds / INTERVAL / len(levels)))


def triangle(seconds, amplitude):
    """Up, down past zero and back."""
    phase = np.arange(round(seconds / INTERVAL)) * INTERVAL / seconds
    return np.interp(phase, [0, 0.25, 0.75, 1], [0, amplitude, -amplitude, 0])


def chirp(seconds, amplitude, low, high):
    """A sine whose frequency rises from low to high Hz, logarithmically."""
    time = np.arange(round(seconds / INTERVAL)) * INTERVAL
    rate = np.log(high / low) / seconds
    return amplitude * np.sin(2 * np.pi * low / rate * np.expm1(rate * time))


def command():
    """The command in V, as the file has it."""
    parts = [
        np.zeros(600),
        steps(1.2, [0.5, -0.5, 2.0, -1.0, 5.0, -5.0, 9.0, -8.0, 3.0, 0.0]),
        triangle(0.6, 4.0),
        triangle(0.3, -9.0),
        chirp(0.5, 0.8, 3.0, 80.0),
        chirp(0.5, 3.0, 3.0, 50.0),
        chirp(0.5, 8.0, 3.0, 30.0),
        steps(0.6, [0.8, 4.0, -3.0, 7.0, -7.0, 0.0]),
        triangle(0.4, -6.0),
        chirp(0.4, 1.5, 4.0, 70.0),
        chirp(0.4, 6.0, 3.0, 30.0),
    ]
    return np.round(np.concatenate(parts), 3)


def spool(command):
    """The spool in V at every sample: classical Runge-Kutta, whose steps end where the delayed command jumps."""
    per_sample, late = round(INTERVAL / STEP), round(DELAY / STEP)

    def slope(z, x, u):
        return GAIN * min(max(u - x, -SATURATION), SATURATION), (z - x) / TIME_CONSTANT

    z = x = float(command[0])
    positions = []
    for k in range(len(command)):
        positions.append(x)
        for i in range(k * per_sample, (k + 1) * per_sample):
            u = float(command[max(i - late, 0) // per_sample])
            z1, x1 = slope(z, x, u)
            z2, x2 = slope(z + STEP / 2 * z1, x + STEP / 2 * x1, u)
            z3, x3 = slope(z + STEP / 2 * z2, x + STEP / 2 * x2, u)
            z4, x4 = slope(z + STEP * z3, x + STEP * x3, u)
            z += STEP / 6 * (z1 + 2 * z2 + 2 * z3 + z4)
            x += STEP / 6 * (x1 + 2 * x2 + 2 * x3 + x4)
    return np.array(positions)


def main():
    u = command()
    x = spool(u)
    speed = np.sqrt(2 * RATED_DROP / 2 * 1e5 / DENSITY)  # m/s
    rated_flow = DISCHARGE_COEFFICIENT * MAX_AREA * 1e-4 * speed * 6e4  # L/min
    q = rated_flow * np.clip(x / FULL_SCALE, -1, 1)

    noise = np.random.Generator(np.random.PCG64(SEED)).standard_normal((2, len(u)))
    x = x + NOISE * FULL_SCALE * noise[0]
    q = q + NOISE * rated_flow * noise[1]
    rows = (
        f"{k * INTERVAL:.3f},{u[k]:g},{x[k]:.3f},{q[k]:.2f}\n" for k in range(len(u))
    )
    text = "time [s],command [V],spool [V],flow [L/min]\n" + "".join(rows)
    Path(__file__).with_name("bench.csv").write_text(text, newline="")
    print(f"{len(u)} rows, {len(text) / 1e3:.0f} kB, rated flow {rated_flow:.2f} L/min")


if __name__ == "__main__":
    main()
