"""A problem for pyPESTO, whose multi-start optimisers it opens: python pypesto_problem.py RECORD."""

import sys

import numpy as np
import pypesto
import pypesto.optimize

import servobee

STEP = 1e-5


def problem(record):
    evaluator = servobee.Evaluator(["delay"], record, device="cpu", dtype="float64")
    count = len(evaluator.names)

    def cost(shares):
        return evaluator.costs(evaluator.from_unit(shares[np.newaxis]))[0]

    def gradient(shares):
        # All its differences are one population.
        ahead = np.clip(shares + STEP * np.eye(count), 0, 1)
        behind = np.clip(shares - STEP * np.eye(count), 0, 1)
        costs = evaluator.costs(evaluator.from_unit(np.concatenate([ahead, behind])))
        return (costs[:count] - costs[count:]) / np.diag(ahead - behind)

    asked = pypesto.Problem(
        objective=pypesto.Objective(fun=cost, grad=gradient),
        lb=np.zeros(count),
        ub=np.ones(count),
        x_names=evaluator.names,
        x_guesses=evaluator.to_unit([evaluator.start]),
    )
    return asked, evaluator


def main(record):
    asked, evaluator = problem(record)
    result = pypesto.optimize.minimize(
        problem=asked,
        optimizer=pypesto.optimize.ScipyOptimizer(method="L-BFGS-B", options={"maxiter": 60}),
        n_starts=3,
        progress_bar=False,
    )
    return dict(zip(asked.x_names, evaluator.from_unit(result.optimize_result.x[0])))


if __name__ == "__main__":
    print(main(sys.argv[1]))
