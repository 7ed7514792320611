"""SciPy's differential evolution on servobee's evaluator: python differential_evolution.py RECORD."""

import sys

from scipy.optimize import differential_evolution

import servobee


def main(record):
    evaluator = servobee.Evaluator(["delay"], record)
    # SciPy has the candidates of a generation side by side.
    layout = "parameters,candidates"
    found = differential_evolution(
        lambda shares: evaluator.costs(evaluator.from_unit(shares, layout), layout),
        [(0, 1)] * len(evaluator.names),
        vectorized=True,
        updating="deferred",
        maxiter=150,
        popsize=10,
        polish=False,
        rng=1,
    )
    return dict(zip(evaluator.names, evaluator.from_unit(found.x)))


if __name__ == "__main__":
    print(main(sys.argv[1]))
