"""Times other tools on the task of the bench `peers`, beside our evaluators and a stand-alone loop.

The task: z' = K sat(u - x, +-S), x' = (z - x) / T from the equilibrium with the first command, u held over 1000 rows of
1 ms, the sum over the rows of (target - x)^2, for 16 384 candidates (K, T, S). Slow tools get fewer candidates.

Everybody takes as many steps a row as an accuracy needs: the largest error of a trajectory, of full scale, that 90 % of
the candidates keep against a converged solution. Costs are checked against it, too. Writes results.csv and table.md
beside this script. Call: python compare.py [--rounds 5] [--break PEER]
"""

import argparse
import csv
import re
import datetime
import os
import platform
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version
from pathlib import Path

import numba
import numpy as np
from scipy.integrate import solve_ivp

# Must be set before JAX starts.
os.environ.setdefault("JAX_PLATFORMS", "cpu")
import diffrax
import jax
import jax.numpy as jnp

HERE = Path(__file__).parent
TARGETS = 1e-4, 1e-5  # errors of a trajectory, of full scale
STEPS = 5, 6, 7, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40  # integration steps a row that are tried
ROW = 1e-3  # s
FULL_SCALE = 10.0
TRAJECTORIES = 64
CHECKED = 2048  # candidates whose costs are checked
OURS = "servobee CPU f32"
OFF = 1.005  # what --break does to every gain
# Largest relative difference from the converged costs, in the median and for 90 % of the candidates. The rest are
# lightly damped in deep saturation, where fixed steps miss the converged cost.
TOLERANCE = {"median": 5e-5, "90 %": 2e-3}


def slopes(z, x, u, gain, rate, limit):
    error = min(max(u - x, -limit), limit)
    return gain * error, (z - x) * rate


def scalar(steps, dtype):
    """RK4 over one candidate for Numba: `spool` gets the trajectory where it has room for it."""
    slope = numba.njit(inline="always", fastmath=True)(slopes)
    step = dtype(ROW / steps)
    half, sixth, two = dtype(0.5) * step, step / dtype(6), dtype(2)

    @numba.njit(fastmath=True)
    def cost(commands, targets, gain, time_constant, limit, spool):
        rate = dtype(1) / time_constant
        z = x = commands[0]
        total = dtype(0)
        for k in range(len(commands)):
            if len(spool):
                spool[k] = x
            u = commands[k]
            total += (targets[k] - x) * (targets[k] - x)
            for _ in range(steps):
                za, xa = slope(z, x, u, gain, rate, limit)
                zb, xb = slope(z + half * za, x + half * xa, u, gain, rate, limit)
                zc, xc = slope(z + half * zb, x + half * xb, u, gain, rate, limit)
                zd, xd = slope(z + step * zc, x + step * xc, u, gain, rate, limit)
                z += sixth * (za + two * zb + two * zc + zd)
                x += sixth * (xa + two * xb + two * xc + xd)
        return total

    @numba.njit(parallel=True, fastmath=True)
    def all_costs(commands, targets, candidates, spools):
        costs = np.empty(len(candidates), candidates.dtype)
        for i in numba.prange(len(candidates)):
            gain, time_constant, limit = candidates[i]
            costs[i] = cost(commands, targets, gain, time_constant, limit, spools[i])
        return costs

    return all_costs


class Numba:
    def __init__(self, dtype, steps):
        self.dtype, self.steps_per_row, self.all_costs = dtype, steps, scalar(steps, dtype)

    def prepare(self, record, candidates):
        self.record = [np.ascontiguousarray(column, self.dtype) for column in record.T]
        self.candidates = np.ascontiguousarray(candidates, self.dtype)
        self.none = np.empty((len(candidates), 0), self.dtype)

    def costs(self):
        return self.all_costs(*self.record, self.candidates, self.none)

    def trajectories(self):
        spools = np.empty((len(self.candidates), len(self.record[0])), self.dtype)
        self.all_costs(*self.record, self.candidates, spools)
        return spools


class Numpy:
    """All candidates of a step at once, in f32."""

    def __init__(self, steps):
        self.steps_per_row = steps

    def prepare(self, record, candidates):
        self.record = record.astype(np.float32)
        self.gain, time_constant, self.limit = candidates.T.astype(np.float32)
        self.rate = 1 / time_constant

    def slopes(self, z, x, u):
        return self.gain * np.clip(u - x, -self.limit, self.limit), (z - x) * self.rate

    def spools(self):
        step = np.float32(ROW / self.steps_per_row)
        half, sixth = step / 2, step / 6
        z = x = np.full_like(self.gain, self.record[0, 0])
        for u in self.record[:, 0]:
            yield x
            for _ in range(self.steps_per_row):
                za, xa = self.slopes(z, x, u)
                zb, xb = self.slopes(z + half * za, x + half * xa, u)
                zc, xc = self.slopes(z + half * zb, x + half * xb, u)
                zd, xd = self.slopes(z + step * zc, x + step * xc, u)
                z = z + sixth * (za + 2 * zb + 2 * zc + zd)
                x = x + sixth * (xa + 2 * xb + 2 * xc + xd)

    def costs(self):
        total = np.zeros_like(self.gain)
        for target, x in zip(self.record[:, 1], self.spools(), strict=True):
            total += (target - x) ** 2
        return total

    def trajectories(self):
        return np.stack(list(self.spools()), axis=1)


class Jax:
    """jit of vmap over the candidates of lax.scan over the rows, in f32, with RK4 by hand."""

    def __init__(self, steps):
        self.steps_per_row = steps

    def stepper(self, slopes, step):
        """What takes z and x over a step under the command u."""
        half, sixth = step / 2, step / 6

        def advance(z, x, u):
            za, xa = slopes(z, x, u)
            zb, xb = slopes(z + half * za, x + half * xa, u)
            zc, xc = slopes(z + half * zb, x + half * xb, u)
            zd, xd = slopes(z + step * zc, x + step * xc, u)
            return z + sixth * (za + 2 * zb + 2 * zc + zd), x + sixth * (xa + 2 * xb + 2 * xc + xd)

        return advance

    def prepare(self, record, candidates):
        step = np.float32(ROW / self.steps_per_row)

        def simulate(candidate, record, keep):
            gain, time_constant, limit = candidate
            rate = 1 / time_constant
            advance = self.stepper(lambda z, x, u: (gain * jnp.clip(u - x, -limit, limit), (z - x) * rate), step)

            def row(state, sample):
                z, x, total = state
                u, target = sample
                total += (target - x) ** 2
                one = lambda state, _: (advance(*state, u), None)
                # Unrolled as far as that makes it faster.
                after, _ = jax.lax.scan(one, (z, x), None, length=self.steps_per_row, unroll=8)
                return (*after, total), x if keep else None

            start = record[0, 0]
            (_, _, total), spools = jax.lax.scan(row, (start, start, 0.0), (record[:, 0], record[:, 1]))
            return spools if keep else total

        self.arguments = jnp.asarray(candidates, jnp.float32), jnp.asarray(record, jnp.float32)
        cost = lambda candidate, record: simulate(candidate, record, keep=False)
        spool = lambda candidate, record: simulate(candidate, record, keep=True)
        self.all_costs = jax.jit(jax.vmap(cost, (0, None)))
        self.spools = jax.jit(jax.vmap(spool, (0, None)))

    def costs(self):
        return np.asarray(self.all_costs(*self.arguments).block_until_ready())

    def trajectories(self):
        return np.asarray(self.spools(*self.arguments))


class Diffrax(Jax):
    """The same with the steps of a solver of diffrax."""

    def __init__(self, solver, steps):
        super().__init__(steps)
        self.solver = solver

    def stepper(self, slopes, step):
        term = diffrax.ODETerm(lambda t, state, u: slopes(*state, u))

        def advance(z, x, u):
            # Each step begins anew: the command may have jumped before it.
            begun = self.solver.init(term, 0.0, step, (z, x), u)
            state, *_ = self.solver.step(term, 0.0, step, (z, x), u, begun, True)
            return state

        return advance


class Scipy:
    """solve_ivp from one change of the command to the next, which is kinder to it than from row to row."""

    steps_per_row = None

    def __init__(self, method, rtol, atol):
        self.options = {"method": method, "rtol": rtol, "atol": atol}

    def prepare(self, record, candidates):
        self.record, self.candidates = record, candidates
        self.changes = [0, *np.flatnonzero(np.diff(record[:, 0])) + 1, len(record) - 1]

    def spool(self, candidate):
        gain, time_constant, limit = candidate
        command = self.record[:, 0]
        state = [command[0], command[0]]
        spool = np.empty(len(command))
        spool[0] = command[0]
        for first, last in zip(self.changes, self.changes[1:]):
            # A change in the last row acts on nothing.
            if first == last:
                continue
            u = command[first]

            def slope(_, state):
                z, x = state
                return gain * min(max(u - x, -limit), limit), (z - x) / time_constant

            times = ROW * np.arange(last - first + 1)
            solved = solve_ivp(slope, (0, times[-1]), state, t_eval=times, **self.options)
            spool[first : last + 1] = solved.y[1]
            state = solved.y[:, -1]
        return spool

    def trajectories(self):
        return np.array([self.spool(candidate) for candidate in self.candidates])

    def costs(self):
        return ((self.record[:, 1] - self.trajectories()) ** 2).sum(axis=1)


# What is tried, with so many candidates that a run takes some seconds at most: a tool for each number of steps, or, where
# they are adaptive, for each tolerance.
OTHERS = {
    "SciPy solve_ivp RK45": ([Scipy("RK45", 10.0**-k, 10.0**-k) for k in range(4, 9)], 8),
    "NumPy over the population f32": ([Numpy(steps) for steps in STEPS], 4096),
    "Numba prange f64": ([Numba(np.float64, steps) for steps in STEPS], 16_384),
    "Numba prange f32": ([Numba(np.float32, steps) for steps in STEPS], 16_384),
    "JAX jit vmap scan f32": ([Jax(steps) for steps in STEPS], 16_384),
    "diffrax Heun f32": ([Diffrax(diffrax.Heun(), steps) for steps in STEPS], 16_384),
    "diffrax Tsit5 f32": ([Diffrax(diffrax.Tsit5(), steps) for steps in STEPS], 16_384),
}


def gains(name, broken):
    """What the candidates are multiplied by."""
    return [OFF if name == broken else 1.0, 1.0, 1.0]


def run_ours(folder, broken):
    """Runs the Rust bench: the seconds of its runs by peer, and the rest of what its table of results says."""
    call = ["cargo", "bench", "--quiet", "--bench", "peers", "--", folder]
    if broken not in (None, *OTHERS):
        call += ["--break", broken]
    subprocess.run(call, cwd=HERE.parent.parent, check=True, stdout=subprocess.DEVNULL)
    _, *rows = csv.reader(open(folder / "results.csv"))
    return {name: (float(steps), int(count), [float(s) for s in seconds]) for name, steps, count, *seconds in rows}


def chosen(name, record, candidates, exact):
    """Of a tool's numbers of steps the first that keeps each of the targets, with its errors."""
    tools, count = OTHERS[name]
    wanted, kept = list(TARGETS), {}
    for tool in tools:
        some = candidates[: min(count, TRAJECTORIES)]
        tool.prepare(record, some)
        errors = quantiles(np.abs(tool.trajectories() - exact[: len(some)]).max(axis=1) / FULL_SCALE)
        while wanted and errors["90 %"] <= wanted[0]:
            kept[wanted.pop(0)] = tool, errors
        if not wanted:
            break
    return kept


def family(name):
    """Of a stand-alone loop what it is called without its number of steps."""
    return re.sub(r" \d+ steps$", "", name)


def measure(folder, rounds, broken):
    """All peers' times, costs and errors. They take turns: what else the machine does meets all of them."""
    read = lambda name: np.loadtxt(folder / name, delimiter=",", skiprows=1)
    rows = lambda name: list(csv.reader(open(folder / name)))
    peers = {}
    for name, (steps, count, _) in run_ours(folder, broken).items():
        peers[name] = {"family": family(name), "steps_per_row": steps, "candidates": count, "seconds": [], "compile": 0.0}
        peers[name]["spools"] = []
    for name, costs in zip(rows("costs.csv")[0], read("costs.csv").T, strict=True):
        peers[name]["costs"] = costs
    for name, *spool in rows("trajectories.csv")[1:]:
        peers[name]["spools"].append([float(x) for x in spool])
    record, candidates = read("record.csv"), read("candidates.csv")
    exact, exact_spools = converged(record, candidates[:CHECKED])
    for peer in peers.values():
        if spools := peer.pop("spools"):
            errors = np.abs(np.array(spools) - exact_spools[: len(spools)]).max(axis=1)
            peer["error"] = quantiles(errors / FULL_SCALE)

    tools = {}
    for name, (_, count) in OTHERS.items():
        kept = chosen(name, record, candidates, exact_spools).values()
        for tool, errors in {id(tool): (tool, errors) for tool, errors in kept}.values():
            label = f"{name} {tool.steps_per_row} steps" if tool.steps_per_row else f"{name} {tool.options['rtol']:.0e}"
            tool.prepare(record, candidates[:count] * gains(name, broken))
            start = time.perf_counter()
            costs = np.asarray(tool.costs(), float)
            first = time.perf_counter() - start
            peers[label] = {"family": name, "steps_per_row": tool.steps_per_row, "candidates": count, "seconds": []}
            peers[label] |= {"costs": costs, "compile": first, "error": errors}
            tools[label] = tool
    for _ in range(rounds):
        for name, (_, _, seconds) in run_ours(folder, broken).items():
            peers[name]["seconds"] += seconds
        for label, tool in tools.items():
            start = time.perf_counter()
            tool.costs()
            peers[label]["seconds"].append(time.perf_counter() - start)
    for label in tools:
        peers[label]["compile"] = max(peers[label]["compile"] - float(np.median(peers[label]["seconds"])), 0.0)
    for peer in peers.values():
        peer["rate"] = peer["candidates"] / float(np.median(peer["seconds"]))
        peer["best"] = peer["candidates"] / min(peer["seconds"])
        peer["cost"] = quantiles(np.abs(peer["costs"][:CHECKED] / exact[: peer["candidates"]] - 1))
    return peers, len(record)


def converged(record, candidates):
    """Costs and the first trajectories by RK4 in f64 with 200 steps a row, proved by SciPy's DOP853 on some."""
    fine = Numba(np.float64, steps=200)
    fine.prepare(record, candidates[:TRAJECTORIES])
    spools = fine.trajectories()
    proof = Scipy("DOP853", 1e-12, 1e-12)
    proof.prepare(record, candidates[:8])
    difference = np.abs(spools[:8] - proof.trajectories()).max() / FULL_SCALE
    assert difference < 1e-6, f"the converged solution is off by {difference:.1e} of full scale"
    fine.prepare(record, candidates)
    return fine.costs(), spools


def quantiles(values):
    return dict(zip(("median", "90 %", "max"), np.quantile(values, [0.5, 0.9, 1.0]), strict=True))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--break", dest="broken", metavar="PEER", help="make one peer's gains 0.5 %% too large")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as directory:
        peers, rows = measure(Path(directory), arguments.rounds, arguments.broken)
    if arguments.broken not in (None, *peers, *OTHERS):
        parser.error(f"no peer is called so; there are {', '.join(peers)}")
    wrong = []
    for name, peer in peers.items():
        difference = ", ".join(f"{key} {value:.1e}" for key, value in peer["cost"].items())
        print(f"{name}: {peer['rate']:.0f} candidates/s, costs differ by {difference}")
        wrong += [name for key, most in TOLERANCE.items() if not peer["cost"][key] <= most][:1]
    if wrong:
        sys.exit(f"other costs than the converged solution's: {', '.join(wrong)}")
    if arguments.broken:
        sys.exit(f"the error in {arguments.broken} was not noticed")
    write(peers, rows)


def best_of_each(peers, target):
    """Of every family the fastest that keeps the target, the fastest first. Costs are all that a GPU gives: its errors are
    those of the same steps on the CPU."""
    best = {}
    for name, peer in peers.items():
        if peer.get("error", {"90 %": 0.0})["90 %"] <= target:
            best[peer["family"]] = max(best.get(peer["family"], name), name, key=lambda name: peers[name]["rate"])
    return sorted(best.values(), key=lambda name: -peers[name]["rate"])


def write(peers, rows):
    ours = peers[OURS]
    with open(HERE / "results.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            "error peer candidates runs steps_per_row compile_seconds candidates_per_second best_candidates_per_second"
            " row_steps_per_second ours_over_peer best_ours_over_best_peer"
            " error_median error_90 error_max cost_median cost_90 cost_max".split()
        )
        for target in TARGETS:
            for name in best_of_each(peers, target):
                peer = peers[name]
                ratios = ours["rate"] / peer["rate"], ours["best"] / peer["best"]
                numbers = peer["compile"], peer["rate"], peer["best"], peer["rate"] * rows, *ratios
                errors = [f"{e:.2e}" for e in peer["error"].values()] if "error" in peer else [""] * 3
                costs = [f"{value:.2e}" for value in peer["cost"].values()]
                head = f"{target:g}", name, peer["candidates"], len(peer["seconds"]), peer["steps_per_row"] or ""
                writer.writerow([*head, *(f"{n:.4g}" for n in numbers), *errors, *costs])
    with open(HERE / "table.md", "w") as file:
        packages = ", ".join(f"{p} {version(p)}" for p in ("jax", "diffrax", "numba", "numpy", "scipy"))
        rust = subprocess.run(["rustc", "--version"], capture_output=True, text=True).stdout.split()[1]
        print(
            f"`python benches/peers/compare.py`, {datetime.date.today()}, {os.cpu_count()} cores, {packages}, "
            f"Python {platform.python_version()}, rustc {rust}. Ours: {OURS}. Everybody takes the fewest steps a row, of "
            f"{', '.join(map(str, STEPS))}, with which 90 % of the candidates keep the error.",
            file=file,
        )
        for target in TARGETS:
            print(f"\nErrors up to {target:g} of full scale:\n", file=file)
            table(peers, best_of_each(peers, target), ours, rows, file)


def table(peers, names, ours, rows, file):
    heads = ["peer", "steps a row", "candidates/s: median", "best run", "million row-steps/s"]
    heads += ["ours / peer", "of best runs", "compile, s"]
    heads += ["trajectory error: median, 90 %, max", "cost: median, 90 %, max"]
    print("|", " | ".join(heads), "|", file=file)
    print("|---" * len(heads) + "|", file=file)
    spread = lambda of: ", ".join(f"{value:.0e}" for value in of.values()) if of else "-"
    for name in names:
        peer = peers[name]
        cells = [
            name,
            f"{peer['steps_per_row']:g}" if peer["steps_per_row"] else "adaptive",
            f"{peer['rate']:,.0f}",
            f"{peer['best']:,.0f}",
            f"{peer['rate'] * rows / 1e6:.3g}",
            f"{ours['rate'] / peer['rate']:.3g}",
            f"{ours['best'] / peer['best']:.3g}",
            f"{peer['compile']:.1f}" if peer["family"] in OTHERS else "-",
            spread(peer.get("error")),
            spread(peer["cost"]),
        ]
        print("|", " | ".join(cells), "|", file=file)


if __name__ == "__main__":
    main()
