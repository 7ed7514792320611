"""Finds the parameters of electro-hydraulic servo valves, and names the effect that a model lacks."""

from ._calls import (
    batch,
    compare,
    datasheet,
    effects,
    export,
    identify,
    simulate,
    synthesize,
)
from ._errors import Error, InputError, RunError
from ._evaluator import Evaluator
from ._report import Comparison, Report, Sheet, Simulation

__all__ = [
    "Comparison",
    "Error",
    "Evaluator",
    "InputError",
    "Report",
    "RunError",
    "Sheet",
    "Simulation",
    "batch",
    "compare",
    "datasheet",
    "effects",
    "export",
    "identify",
    "simulate",
    "synthesize",
]
