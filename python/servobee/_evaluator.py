"""Costs of whole populations, for other optimisers."""

import json

import numpy as np

from . import _servobee
from ._errors import refused
from ._options import known, told, warn
from ._records import given
from ._report import Fields


OPTIONS = ("hold_out_share", "max_rows", "sample_interval", "skip_incomplete_rows", "full_scale")


class Evaluator:
    """Costs of whole populations on records, for optimisers of one's own.

    `structure` is None for the base model that the records ask for, a list of effects that it has, a path or the text of a
    model file, or a report. `device` is "auto", "cpu" or "gpu"; `dtype` "float32", as searches compute, or "float64", on the
    CPU. A cost is the sum of squared errors, each channel in units of how much it varies; infinite where a candidate diverges.
    As in `identify`, the last 30 % of each record are held out, and cost nothing; `hold_out_share` says how much.

    Options: hold_out_share, max_rows, sample_interval, skip_incomplete_rows, full_scale.
    """

    def __init__(self, structure, records, *, device="auto", dtype="float32", maps=None, **options):
        if isinstance(structure, (list, tuple)):
            structure = f"[structure]\neffects = {json.dumps(list(structure))}\n"
        if dtype not in ("float32", "float64"):
            raise refused("dtype", f"is {dtype!r}", 'give "float32" or "float64"')
        if dtype == "float64" and device == "gpu":
            raise refused("dtype", "a GPU computes in float32", 'say device="cpu" or dtype="float32"')
        known("Evaluator", options, OPTIONS)
        double = dtype == "float64"
        said = told("Evaluator", maps=maps, model=structure, device=device, double=double, **options)
        self._own = _servobee.Evaluator(given(records), said)
        self.parameters = [Fields(parameter) for parameter in self._own.parameters]
        self.names = [parameter.name for parameter in self.parameters]
        self.bounds = [(parameter.low, parameter.high) for parameter in self.parameters]
        self.start = [parameter.start for parameter in self.parameters]
        self.device = self._own.device
        self.rows = self._own.rows

    def from_unit(self, shares, layout="candidates,parameters"):
        """Candidates whose parameters lie at these shares, 0 to 1, of their ranges. Where a range goes over decades they are
        shares of its logarithm: so the searches of servobee see it, and so others find the way."""
        low, high, ratios = self._ranges(layout)
        start, end = _on_scale(low, ratios), _on_scale(high, ratios)
        at = start + np.asarray(shares) * (end - start)
        return np.clip(np.where(ratios, np.exp(np.where(ratios, at, 0.0)), at), low, high)

    def to_unit(self, population, layout="candidates,parameters"):
        """The shares of their ranges at which the parameters of candidates lie."""
        low, high, ratios = self._ranges(layout)
        start, end = _on_scale(low, ratios), _on_scale(high, ratios)
        return (_on_scale(np.asarray(population), ratios) - start) / (end - start)

    def _ranges(self, layout):
        rows = [(one.low, one.high, one.logarithmic) for one in self.parameters]
        ranges = [np.array(column) for column in zip(*rows)]
        return [column[:, np.newaxis] for column in ranges] if _columns(layout) else ranges

    def costs(self, population, layout="candidates,parameters"):
        """The cost of every candidate. `population` has the shape that `layout` names: "candidates,parameters" or
        "parameters,candidates"; float32 or float64."""
        return self.evaluate(population, layout)[0]

    def evaluate(self, population, layout="candidates,parameters"):
        """The cost of every candidate, and beside it whether its simulation ran to the end."""
        columns = _columns(layout)
        population = np.asarray(population)
        if population.dtype not in (np.float32, np.float64) or population.ndim != 2:
            problem = f"has {population.ndim} dimensions of {population.dtype}"
            raise refused("population", problem, "give two of float32 or float64")
        costs, finished, words = self._own.evaluate(population, columns)
        warn(words)
        return costs, finished

    def __repr__(self):
        return f"<servobee.Evaluator: {', '.join(self.names)} on {self.rows} rows, {self.device}>"


def _columns(layout):
    """Whether each column is a candidate."""
    if layout not in ("candidates,parameters", "parameters,candidates"):
        raise refused("layout", f"is {layout!r}", 'give "candidates,parameters" or "parameters,candidates"')
    return layout == "parameters,candidates"


def _on_scale(values, ratios):
    """The logarithm of those that go by ratios."""
    return np.where(ratios, np.log(np.where(ratios, values, 1.0)), values)
