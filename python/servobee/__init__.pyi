from collections.abc import Callable, Iterable, Mapping, Sequence
from os import PathLike
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Path = str | PathLike[str]
_Record = _Path | Mapping[str, Any] | Any
_Records = _Record | Sequence[_Record]
_Maps = str | Mapping[str, str] | Iterable[str] | None
_Settings = _Path | Mapping[str, str] | Report | None
_Effects = str | Sequence[str]
_Progress = bool | Callable[[str], object] | None
_Device = str
_Language = Literal["en", "de"]
_Layout = Literal["candidates,parameters", "parameters,candidates"]

class Error(Exception):
    place: str
    problem: str
    remedy: str

class InputError(Error, ValueError): ...
class RunError(Error, RuntimeError): ...

class Fields(dict[str, Any]):
    def __getattr__(self, name: str) -> Any: ...

class Result:
    def __getattr__(self, name: str) -> Any: ...
    def to_dict(self) -> dict[str, Any]: ...
    @property
    def page(self) -> str: ...
    @property
    def contents(self) -> dict[str, str]: ...
    def save(self, folder: _Path, force: bool = False) -> None: ...
    def _repr_html_(self) -> str: ...

class Report(Result):
    @property
    def model(self) -> str: ...
    @property
    def effect_names(self) -> list[str]: ...
    @property
    def parameters_frame(self) -> Any: ...
    @property
    def errors_frame(self) -> Any: ...
    @property
    def card_frame(self) -> Any: ...
    @property
    def residuals_frame(self) -> Any: ...

class Sheet(Result):
    @property
    def parameters_frame(self) -> Any: ...

class Comparison(Result): ...

class Simulation:
    csv: str
    channels: list[Fields]
    @property
    def frame(self) -> Any: ...

class Evaluator:
    parameters: list[Fields]
    names: list[str]
    bounds: list[tuple[float, float]]
    start: list[float]
    device: str
    rows: int
    def from_unit(self, shares: ArrayLike, layout: _Layout = ...) -> NDArray[np.float64]: ...
    def to_unit(self, population: ArrayLike, layout: _Layout = ...) -> NDArray[np.float64]: ...
    def __init__(
        self,
        structure: _Settings | Sequence[str],
        records: _Records,
        *,
        device: _Device = "auto",
        dtype: Literal["float32", "float64"] = "float32",
        maps: _Maps = None,
        hold_out_share: float | None = None,
        max_rows: int | None = None,
        sample_interval: float | str | None = None,
        skip_incomplete_rows: bool = False,
        full_scale: float | None = None,
    ) -> None: ...
    def costs(
        self, population: NDArray[np.float32] | NDArray[np.float64], layout: _Layout = ...
    ) -> NDArray[np.float64]: ...
    def evaluate(
        self, population: NDArray[np.float32] | NDArray[np.float64], layout: _Layout = ...
    ) -> tuple[NDArray[np.float64], NDArray[np.bool_]]: ...

def identify(
    records: _Records,
    hold_out: _Records | None = None,
    *,
    maps: _Maps = None,
    model: _Settings = None,
    effects: _Effects = "all",
    progress: _Progress = None,
    max_effects: int | None = None,
    hold_out_share: float | None = None,
    max_rows: int | None = None,
    sample_interval: float | str | None = None,
    skip_incomplete_rows: bool = False,
    accuracy: str | Mapping[str, float] | None = None,
    limits: _Settings = None,
    about: str | Mapping[str, str] | None = None,
    full_scale: float | None = None,
    seed: int | None = None,
    units: str | None = None,
    language: _Language | None = None,
    device: _Device | None = None,
) -> Report: ...
def compare(
    before: _Records,
    after: _Records,
    *,
    maps: _Maps = None,
    model: _Settings = None,
    effects: _Effects = "all",
    progress: _Progress = None,
    max_effects: int | None = None,
    hold_out_share: float | None = None,
    max_rows: int | None = None,
    sample_interval: float | str | None = None,
    skip_incomplete_rows: bool = False,
    accuracy: str | Mapping[str, float] | None = None,
    limits: _Settings = None,
    about: str | Mapping[str, str] | None = None,
    full_scale: float | None = None,
    seed: int | None = None,
    units: str | None = None,
    language: _Language | None = None,
    device: _Device | None = None,
) -> Comparison: ...
def batch(
    files: _Path | Sequence[_Path],
    out: _Path,
    *,
    baseline: _Path | None = None,
    force: bool = False,
    resume: bool = False,
    task: str | None = None,
    client: Any = None,
    maps: _Maps = None,
    model: _Settings = None,
    effects: _Effects = "all",
    progress: _Progress = None,
    max_effects: int | None = None,
    hold_out_share: float | None = None,
    max_rows: int | None = None,
    sample_interval: float | str | None = None,
    skip_incomplete_rows: bool = False,
    accuracy: str | Mapping[str, float] | None = None,
    limits: _Settings = None,
    about: str | Mapping[str, str] | None = None,
    full_scale: float | None = None,
    seed: int | None = None,
    units: str | None = None,
    language: _Language | None = None,
    device: _Device | None = None,
) -> Fields: ...
def simulate(
    model: _Settings,
    record: _Record,
    *,
    maps: _Maps = None,
    sample_interval: float | str | None = None,
    skip_incomplete_rows: bool = False,
) -> Simulation: ...
def export(model: _Settings, out: _Path, *, force: bool = False) -> None: ...
def synthesize(
    effects: _Effects = (),
    *,
    outsiders: _Effects = (),
    command: Literal["bench", "multisine", "chirp", "steps", "triangle"] = "bench",
    seconds: float = 8.0,
    rate: float = 1000.0,
    noise: float = 0.3,
    noise_colour: float | None = None,
    quantise: int | None = None,
    spool_unit: Literal["V", "%"] = "V",
    meter: Literal["load", "supply"] = "load",
    flow: bool = True,
    seed: int = 1,
    random_valve: bool = False,
    gain: float | None = None,
    time_constant: float | None = None,
    saturation: float | None = None,
    rated_flow: float | None = None,
) -> Any: ...
def datasheet(
    *,
    case: Literal["d675", "kbfdg5v", "two-amplitude", "step"] | None = None,
    flow: _Path | None = None,
    response: _Path | None = None,
    step: _Path | None = None,
    drop: float | None = None,
    amplitude: float | None = None,
    stream: Literal["paper", "settled"] = "paper",
    full_scale: float | None = None,
    seed: int | None = None,
    units: str | None = None,
    language: _Language | None = None,
    device: _Device | None = None,
    progress: _Progress = None,
) -> Sheet: ...
def effects() -> list[Fields]: ...
