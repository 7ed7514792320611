"""How many candidates a second Python gets out of the evaluator, beside Rust: python speed.py, at the top of the sources."""

import subprocess
import time

import numpy as np

import servobee

RECORD = "tests/data/bench.csv"


def in_python(candidates, dtype, layout):
    evaluator = servobee.Evaluator(["delay"], RECORD, device="cpu")
    low, high = np.array(evaluator.bounds).T
    population = low + np.random.default_rng(1).random((candidates, len(low))) * (high - low)
    population = population.astype(dtype)
    if layout == "parameters,candidates":
        population = np.ascontiguousarray(population.T)
    evaluator.costs(population, layout)
    best = np.inf
    for _ in range(9):
        begun = time.perf_counter()
        evaluator.costs(population, layout)
        best = min(best, time.perf_counter() - begun)
    return candidates / best


def in_rust(candidates):
    call = ["cargo", "run", "--release", "--quiet", "--example", "population", "--", RECORD, str(candidates)]
    return float(subprocess.run(call, check=True, capture_output=True, text=True).stdout)


if __name__ == "__main__":
    for candidates in (1, 100, 10_000):
        rust = in_rust(candidates)
        print(f"{candidates} candidates: Rust {rust:.0f}/s")
        for dtype in ("float64", "float32"):
            for layout in ("candidates,parameters", "parameters,candidates"):
                python = in_python(candidates, dtype, layout)
                print(f"  Python, {dtype}, {layout}: {python:.0f}/s, {python / rust:.2f} of Rust")
