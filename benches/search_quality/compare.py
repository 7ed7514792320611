"""Compares servobee's search with the package bees-algorithm and SciPy's differential evolution.

Every tool searches the same functions with the same shifts, bounds, seeds and number of evaluations.
Writes results.csv and table.md beside this script. Call: python compare.py [SEEDS]
"""

import csv
import datetime
import io
import math
import multiprocessing
import platform
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
from bees_algorithm import BeesAlgorithm, BeesParameters, SearchSpace
from scipy.optimize import differential_evolution
from scipy.stats import wilcoxon

HERE = Path(__file__).parent
OURS = "servobee"
SOLVED = 1e-10  # errors below are equal: differences there are rounding
SIGNIFICANT = 0.05


def sphere(x):
    return (x**2).sum(axis=1)


def rosenbrock(x):
    a, b = x[:, :-1], x[:, 1:]
    return (100 * (b - a**2) ** 2 + (1 - a) ** 2).sum(axis=1)


def rastrigin(x):
    return (x**2 + 10 - 10 * np.cos(2 * np.pi * x)).sum(axis=1)


def ackley(x):
    far = -20 * np.exp(-0.2 * np.sqrt((x**2).mean(axis=1)))
    return far - np.exp(np.cos(2 * np.pi * x).mean(axis=1)) + 20 + np.e


def griewank(x):
    waves = np.cos(x / np.sqrt(np.arange(1, x.shape[1] + 1))).prod(axis=1)
    return sphere(x) / 4000 - waves + 1


def schwefel(x):
    return (418.9828872724338 - x * np.sin(np.sqrt(np.abs(x)))).sum(axis=1)


FUNCTIONS = {
    "Sphere": (sphere, -5.12, 5.12),
    "Rosenbrock": (rosenbrock, -5.0, 10.0),
    "Rastrigin": (rastrigin, -5.12, 5.12),
    "Ackley": (ackley, -32.768, 32.768),
    "Griewank": (griewank, -600.0, 600.0),
    "Schwefel": (schwefel, -500.0, 500.0),
}


def split_mix(state):
    """The generator SplitMix64, from 0 to 1, as in search_quality.rs."""
    mask = (1 << 64) - 1
    while True:
        state = (state + 0x9E3779B97F4A7C15) & mask
        z = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & mask
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & mask
        yield ((z ^ (z >> 31)) >> 11) / (1 << 53)


class Problem:
    """A shifted function that counts its evaluations and forgets those beyond the budget."""

    def __init__(self, name, dimension, seed):
        self.function, self.low, self.high = FUNCTIONS[name]
        self.dimension, self.seed = dimension, seed
        self.budget = min(5000 * dimension, 50_000)
        self.evaluations, self.error = 0, math.inf
        width = self.high - self.low
        low, high = (-0.05, 0.0) if name == "Schwefel" else (-0.2, 0.2)
        numbers = split_mix((seed * 100 + dimension) * 10 + list(FUNCTIONS).index(name))
        self.shift = np.array([(low + (high - low) * next(numbers)) * width for _ in range(dimension)])

    def value(self, x):
        return self.function(x - self.shift)

    def __call__(self, x):
        values = self.value(x)
        within = values[: max(self.budget - self.evaluations, 0)]
        self.evaluations += len(within)
        self.error = min(self.error, within.min(initial=math.inf))
        return values

    def probe(self):
        place = self.low + 0.37 * (self.high - self.low)
        return self.value(np.full((1, self.dimension), place))[0]


def bees_algorithm(problem):
    """With the settings of `Settings::standard()`; ngh is there a part of half the range."""
    low, high = [problem.low] * problem.dimension, [problem.high] * problem.dimension
    parameters = BeesParameters.from_total_population(
        n_scouts=20,
        n_sites=10,
        n_elite_sites=3,
        n_foragers_elite=20,
        n_foragers_site=5,
        stagnation_limit=20,
        shrink_factor=0.2,
    )
    space = SearchSpace(lower=low, upper=high, initial_ngh=[0.2] * problem.dimension)
    search = BeesAlgorithm(
        problem, space, parameters, direction="minimize", vectorized=True, seed=problem.seed
    )
    while problem.evaluations < problem.budget:
        search.step()


def evolution(problem, polish):
    """SciPy's defaults but for vectorised calls, which need deferred updating. No early stop."""
    population = 15 * problem.dimension
    budget = problem.budget * (0.9 if polish else 1.0)  # the rest is for the polish
    differential_evolution(
        lambda x: problem(x.T) if x.ndim == 2 else problem(x[None, :])[0],
        [(problem.low, problem.high)] * problem.dimension,
        maxiter=int(budget // population) - 1,
        tol=0.0,
        polish=polish,
        vectorized=True,
        updating="deferred",
        rng=problem.seed,
    )


TOOLS = {
    "bees-algorithm": bees_algorithm,
    "SciPy DE": lambda problem: evolution(problem, polish=False),
    "SciPy DE + polish": lambda problem: evolution(problem, polish=True),
}


def run(task):
    tool, name, dimension, seed = task
    problem = Problem(name, dimension, seed)
    TOOLS[tool](problem)
    return *task, problem.evaluations, problem.error


def ours(seeds):
    """Runs the Rust bench and checks that both languages mean the same functions."""
    call = ["cargo", "bench", "--quiet", "--bench", "search_quality", "--", str(seeds)]
    output = subprocess.run(call, cwd=HERE.parent.parent, check=True, capture_output=True, text=True)
    for row in csv.DictReader(io.StringIO(output.stdout)):
        name, dimension, seed = row["function"], int(row["dimension"]), int(row["seed"])
        probe = Problem(name, dimension, seed).probe()
        assert math.isclose(float(row["probe"]), probe, rel_tol=1e-9), row
        yield row["tool"], name, dimension, seed, int(row["evaluations"]), float(row["error"])


def holm(p_values):
    """Holm's step-down adjustment: the chance of any false alarm stays at the level asked for."""
    order = np.argsort(p_values)
    steps = np.asarray(p_values)[order] * np.arange(len(order), 0, -1)
    adjusted = np.empty(len(order))
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1.0)
    return adjusted


def compare(errors):
    """Which of our errors differ from the other tools': pairs of the same seed, and so shift."""
    cases, p_values = [], []
    for tool, name, dimension in errors:
        if tool == OURS:
            continue
        pair = [
            np.log10(np.maximum(errors[key, name, dimension], SOLVED)) for key in (OURS, tool)
        ]
        difference = pair[0] - pair[1]
        cases.append((tool, name, dimension, difference))
        p_values.append(wilcoxon(difference).pvalue if difference.any() else 1.0)
    verdicts = {}
    for (*case, difference), p in zip(cases, holm(p_values), strict=True):
        # The sign of the rank sum, which is what the test looks at.
        ranks = np.argsort(np.argsort(np.abs(difference))) + 1
        better = (ranks * np.sign(difference)).sum() < 0
        verdict = "=" if p > SIGNIFICANT else "better" if better else "worse"
        verdicts[tuple(case)] = verdict, p
    return verdicts


def main():
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    rows = list(ours(seeds))
    tasks = [
        (tool, name, dimension, seed)
        for tool in TOOLS
        for name in FUNCTIONS
        for dimension in (2, 10, 30)
        for seed in range(seeds)
    ]
    with multiprocessing.Pool() as pool:
        rows += pool.imap_unordered(run, tasks, chunksize=10)

    errors, evaluations = {}, {}
    for tool, name, dimension, seed, count, error in sorted(rows):
        errors.setdefault((tool, name, dimension), []).append(error)
        evaluations.setdefault((tool, name, dimension), []).append(count)
    errors = {key: np.maximum(values, 0.0) for key, values in errors.items()}
    verdicts = compare(errors)
    tools = [OURS, "servobee 2009", *TOOLS]

    with open(HERE / "results.csv", "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            "function dimension tool runs median_evaluations error_q1 error_median error_q3"
            " servobee_is p_holm".split()
        )
        for name in FUNCTIONS:
            for dimension in (2, 10, 30):
                for tool in tools:
                    key = tool, name, dimension
                    quartiles = [f"{q:.3e}" for q in np.percentile(errors[key], [25, 50, 75])]
                    verdict, p = verdicts.get(key, ("", None))
                    writer.writerow(
                        [name, dimension, tool, len(errors[key]), int(np.median(evaluations[key]))]
                        + quartiles
                        + [verdict, "" if p is None else f"{p:.2g}"]
                    )

    with open(HERE / "table.md", "w") as file:
        packages = ", ".join(f"{p} {version(p)}" for p in ("bees_algorithm", "scipy", "numpy"))
        rust = subprocess.run(["rustc", "--version"], capture_output=True, text=True).stdout.strip()
        print(
            f"`python benches/search_quality/compare.py {seeds}`, {datetime.date.today()}, {packages}, "
            f"Python {platform.python_version()}, {rust}.\n",
            file=file,
        )
        print("| function | d |", " | ".join(tools), "|", file=file)
        print("|---|---|" + "---|" * len(tools), file=file)
        for name in FUNCTIONS:
            for dimension in (2, 10, 30):
                cells = []
                for tool in tools:
                    q1, median, q3 = np.percentile(errors[tool, name, dimension], [25, 50, 75])
                    mark = {"better": " ▲", "worse": " ▼"}
                    verdict = verdicts.get((tool, name, dimension), ("", None))[0]
                    cells.append(f"{median:.1e} ({q1:.0e}…{q3:.0e}){mark.get(verdict, '')}")
                print(f"| {name} | {dimension} |", " | ".join(cells), "|", file=file)
        counts = [""] + [
            " / ".join(
                str(sum(v == wanted for (t, *_), (v, _) in verdicts.items() if t == tool))
                for wanted in ("better", "=", "worse")
            )
            for tool in tools[1:]
        ]
        print("| better / = / worse | |", " | ".join(counts), "|", file=file)


if __name__ == "__main__":
    main()
