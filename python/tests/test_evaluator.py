"""Costs of populations for other optimisers."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import servobee


@pytest.fixture(scope="module")
def evaluator(bench):
    return servobee.Evaluator(["delay"], bench, device="cpu")


@pytest.fixture(scope="module")
def population(evaluator):
    return evaluator.from_unit(np.random.default_rng(1).random((500, len(evaluator.names))))


def test_every_layout_and_dtype_gives_the_same_costs(evaluator, population):
    costs = evaluator.costs(population)
    assert costs.shape == (500,) and np.isfinite(costs).sum() > 400
    columns = evaluator.costs(population.T, layout="parameters,candidates")
    piece = evaluator.costs(np.ascontiguousarray(population.T), layout="parameters,candidates")
    strided = evaluator.costs(np.repeat(population, 2, axis=0)[::2])
    for same in (columns, piece, strided):
        np.testing.assert_array_equal(costs, same)
    single = population.astype(np.float32)
    np.testing.assert_array_equal(evaluator.costs(single), evaluator.costs(single.astype(np.float64)))


def test_shares_of_the_ranges_are_candidates_and_back(evaluator, population):
    low, high = np.array(evaluator.bounds).T
    count = len(low)
    np.testing.assert_allclose(evaluator.from_unit(np.stack([np.zeros(count), np.ones(count)])), [low, high], rtol=1e-12)
    half = dict(zip(evaluator.names, evaluator.from_unit(np.full(count, 0.5))))
    (gain,) = (one for one in evaluator.parameters if one.name == "gain")
    assert half["gain"] == pytest.approx((gain.low * gain.high) ** 0.5)
    assert half["delay"] == pytest.approx(0.05)
    np.testing.assert_allclose(evaluator.from_unit(evaluator.to_unit(population)), population, rtol=1e-9)
    columns = "parameters,candidates"
    np.testing.assert_array_equal(evaluator.to_unit(population.T, columns), evaluator.to_unit(population).T)


def test_the_least_cost_is_where_the_valve_is(evaluator, report):
    values = {one.name: one.value for one in report.parameters}
    found = np.array([[values[name] for name in evaluator.names]])
    beside = np.repeat(found, 2 * found.shape[1], axis=0)
    for k in range(found.shape[1]):
        beside[2 * k, k] *= 1.02
        beside[2 * k + 1, k] *= 0.98
    assert (evaluator.costs(beside) > evaluator.costs(found)).all()


def test_double_precision_agrees_with_single(bench, evaluator, population):
    double = servobee.Evaluator(["delay"], bench, device="cpu", dtype="float64")
    assert "f64" in double.device
    ratio = double.costs(population) / evaluator.costs(population)
    assert np.nanmedian(np.abs(ratio - 1)) < 1e-5


def test_what_diverges_says_so(evaluator):
    wild = np.array([evaluator.start, evaluator.start])
    wild[1, evaluator.names.index("time_constant")] = -1e-3
    costs, finished = evaluator.evaluate(wild)
    assert finished.tolist() == [True, False]
    assert np.isfinite(costs).tolist() == [True, False]


def test_ctrl_c_does_not_wait_for_a_population(evaluator, population):
    crowd = np.repeat(population, 2000, axis=0)
    begun = time.monotonic()
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        evaluator.costs(crowd)
    # What comes next is not answered with what was under way, nor after it.
    assert evaluator.costs(population[:1]).shape == (1,)
    assert time.monotonic() - begun < 12


@pytest.mark.skipif(os.environ.get("SERVOBEE_SKIP_GPU") == "1", reason="SERVOBEE_SKIP_GPU=1: the evaluator in Python on a GPU")
def test_a_gpu_gives_the_costs_of_the_cpu(bench, evaluator, population):
    gpu = servobee.Evaluator(["delay"], bench, device="gpu")
    assert gpu.device != evaluator.device
    some = population[:40]
    np.testing.assert_allclose(gpu.costs(some), evaluator.costs(some), rtol=1e-3)
    np.testing.assert_array_equal(gpu.costs(some.T, "parameters,candidates"), gpu.costs(some))


def test_without_a_gpu_it_is_said_how_to_go_on(bench):
    call = f"import servobee; servobee.Evaluator(None, {bench!r}, device='gpu')"
    without = os.environ | {"VK_DRIVER_FILES": "none", "VK_ICD_FILENAMES": "none"}
    ran = subprocess.run([sys.executable, "-c", call], env=without, capture_output=True, text=True)
    assert ran.returncode == 1
    assert "servobee._errors." in ran.stderr and "GPU" in ran.stderr, ran.stderr


def test_what_is_wrong_is_refused(evaluator, population, bench):
    for given, layout, words in [
        (population.T, "candidates,parameters", "say the other layout"),
        (population, "parameters,candidates", "say the other layout"),
        (population[0], "candidates,parameters", "1 dimensions"),
        (population.astype(int), "candidates,parameters", "int64"),
        (np.where(population == population[3, 1], np.nan, population), "candidates,parameters", "candidate 3, parameter 1"),
        (population, "rows", "layout"),
    ]:
        with pytest.raises(servobee.InputError, match=words):
            evaluator.costs(given, layout)
    with pytest.raises(servobee.InputError, match="dtype"):
        servobee.Evaluator(None, bench, dtype="float16")
    with pytest.raises(servobee.InputError, match="dealy"):
        servobee.Evaluator(["dealy"], bench)
    with pytest.raises(TypeError, match="no option 'max_effects'"):
        servobee.Evaluator(None, bench, max_effects=3)
