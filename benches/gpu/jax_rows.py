"""The base model in JAX on the device that JAX finds, on the work that `gpu work FILE` writes: RK4 in f32, jit, vmap, scan.

    python jax_rows.py work.bin 5     # integration steps a row; prints "rows_per_second difference device"

The difference is that of the costs from servobee's in f64, which 90 % of the candidates are below.
"""

import sys
import time
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np


def read(path):
    data = open(path, "rb").read()
    population, rows, _, compared = np.frombuffer(data, np.uint32, 4)
    (length,) = np.frombuffer(data, np.float32, 1, 16)
    at = 20
    record = np.frombuffer(data, np.float32, 2 * rows, at).reshape(rows, 2)
    at += 8 * int(rows)
    candidates = np.frombuffer(data, np.float32, 3 * population, at).reshape(3, population)
    at += 12 * int(population)
    return float(length), record, candidates, np.frombuffer(data, np.float64, compared, at)


@partial(jax.jit, static_argnums=(2, 3))
def costs(candidates, record, length, steps):
    h = length / steps

    def one(gain, lag, saturation):
        def speed(z, x, u):
            return gain * jnp.clip(u - x, -saturation, saturation), (z - x) / lag

        def row(state, now):
            u, target = now
            z, x, total = state
            total = total + (target - x) ** 2
            for _ in range(steps):
                a = speed(z, x, u)
                b = speed(z + h / 2 * a[0], x + h / 2 * a[1], u)
                c = speed(z + h / 2 * b[0], x + h / 2 * b[1], u)
                d = speed(z + h * c[0], x + h * c[1], u)
                z = z + h / 6 * (a[0] + 2 * b[0] + 2 * c[0] + d[0])
                x = x + h / 6 * (a[1] + 2 * b[1] + 2 * c[1] + d[1])
            return (z, x, total), None

        start = (record[0, 0], record[0, 0], jnp.float32(0))
        return jax.lax.scan(row, start, (record[:, 0], record[:, 1]))[0][2]

    return jax.vmap(one)(*candidates)


def main():
    length, record, candidates, expected = read(sys.argv[1])
    steps = int(sys.argv[2])
    candidates, record = jnp.asarray(candidates), jnp.asarray(record)
    found = np.asarray(costs(candidates, record, length, steps))
    seconds = []
    for _ in range(5):
        start = time.perf_counter()
        costs(candidates, record, length, steps).block_until_ready()
        seconds.append(time.perf_counter() - start)
    off = np.quantile(np.abs(found[: len(expected)] / expected - 1), 0.9)
    rate = candidates.shape[1] * record.shape[0] / np.median(seconds)
    print(f"{rate:.4g} {off:.2g} {jax.devices()[0].device_kind}")
    if off > 1e-2:
        sys.exit(f"jax_rows.py: costs are off by {off:.2g} with {steps} steps a row")


main()
