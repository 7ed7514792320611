import pathlib
import signal

import pandas
import pytest

import servobee

HERE = pathlib.Path(__file__).parent


@pytest.fixture(scope="session")
def bench():
    """The record of the test bench: it was made with a delay of 4.7 ms and a gain of 250 1/s."""
    return str(HERE.parent.parent / "tests/data/bench.csv")


@pytest.fixture(scope="session")
def table(bench):
    return pandas.read_csv(bench, comment="#")


@pytest.fixture(scope="session")
def report(bench):
    return servobee.identify(bench, effects=["delay", "null_bias"], device="cpu")


@pytest.fixture(scope="session")
def plain(bench):
    """The base model alone, without a diagnosis."""
    with pytest.warns(UserWarning, match="the intervals assume that the model is complete"):
        return servobee.identify(bench, effects="none", device="cpu")


@pytest.fixture(autouse=True, scope="session")
def interrupts():
    """Ctrl-C interrupts also where a shell has started the tests as a background job, which ignores it."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
