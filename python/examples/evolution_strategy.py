"""CMA-ES (the package cma) on servobee's evaluator, inside the bounds: python evolution_strategy.py RECORD."""

import sys

import cma
import numpy as np

import servobee


def main(record):
    evaluator = servobee.Evaluator(["delay"], record)
    strategy = cma.CMAEvolutionStrategy(
        evaluator.to_unit(evaluator.start),
        0.2,
        {"bounds": [0, 1], "seed": 1, "popsize": 40, "maxiter": 60, "verbose": -9},
    )
    while not strategy.stop():
        shares = strategy.ask()
        strategy.tell(shares, evaluator.costs(evaluator.from_unit(shares)).tolist())
    return dict(zip(evaluator.names, evaluator.from_unit(np.array(strategy.result.xbest))))


if __name__ == "__main__":
    print(main(sys.argv[1]))
