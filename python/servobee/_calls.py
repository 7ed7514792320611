"""The functions of the package."""

import os

from . import _servobee
from ._dask import on_workers
from ._options import OPTIONS, known, settings, told, warn
from ._progress import Progress
from ._records import as_list, given
from ._report import Comparison, Report, Sheet, Simulation, frame_of_csv, parsed


def identify(
    records,
    hold_out=None,
    *,
    maps=None,
    model=None,
    effects="all",
    progress=None,
    **options,
):
    """Fits a model to records, finds out which effects it lacks, and scores it on data that was held out.

    `records` and `hold_out` are paths, DataFrames of pandas or polars, dictionaries of arrays, or lists of these. Columns
    name channel and unit, ``time [s]``, ``command [V]``, ``spool [V]``; `maps` says what others are:
    ``{"x_cmd_mm": "command [mm]"}`` or ``["i=command [%] *12.5 -150"]``. `model` is a path, the text of a model file, or a
    report. `effects` is "all", "none" or a list of names; effects of one's own are written in Rust. `progress` is True for a
    bar of tqdm, or a function that is told each stage; Ctrl-C stops the run.

    Options: max_effects, hold_out_share, max_rows, sample_interval, skip_incomplete_rows, accuracy, limits, about,
    full_scale, seed, units, language, device ("auto", "cpu", "gpu", "gpu:1", or several at once: "gpu:0+gpu:1", "gpu:all").
    """
    known("identify", options, OPTIONS)
    said = told("identify", maps=maps, model=model, effects=effects, **options)
    with Progress(progress, "identify") as progress:
        files = _servobee.identify(given(records), given(hold_out, "held-out table"), said, progress)
    report = Report(files)
    warn(report.warnings)
    return report


def compare(before, after, *, maps=None, model=None, effects="all", progress=None, **options):
    """Compares a valve before and after: one model fitted to both, and what changed. Options as of `identify`."""
    known("compare", options, OPTIONS)
    said = told("compare", maps=maps, model=model, effects=effects, **options)
    with Progress(progress, "compare") as progress:
        files = _servobee.compare(given(before, "table before"), given(after, "table after"), said, progress)
    comparison = Comparison(files)
    warn(comparison.warnings)
    return comparison


def batch(
    files,
    out,
    *,
    baseline=None,
    force=False,
    resume=False,
    task=None,
    client=None,
    maps=None,
    model=None,
    effects="all",
    progress=None,
    **options,
):
    """Identifies many files, each on its own, and writes index.html, batch.csv, batch.json and a report for each into the
    folder `out`. Returns what batch.json has. A file that is refused or fails has a row, too. Options as of `identify`.

    With `client`, a Client of Dask, its workers take the files: they need servobee and the same paths, and share nothing but
    `out`. What a worker that dies leaves undone another one does, and the result is the same. `task` is "3/40" for every 40th
    file, from the third on, as one task of a job array; `resume=True` without it gathers what the tasks have done.
    """
    known("batch", options, OPTIONS)
    said = told(
        "batch",
        maps=maps,
        model=model,
        effects=effects,
        baseline=None if baseline is None else os.fspath(baseline),
        force=force,
        resume=resume,
        task=task,
        **options,
    )
    files, out = [os.fspath(one) for one in as_list(files)], os.fspath(out)
    with Progress(progress, "batch") as progress:
        if client is not None:
            on_workers(client, files, out, said, progress)
            said["resume"] = True
        text, words = _servobee.batch(files, out, said, progress)
    warn(words)
    return parsed(text)


def simulate(model, record, *, maps=None, sample_interval=None, skip_incomplete_rows=False):
    """Simulates a record with a model, and compares the two."""
    said = told(
        "simulate",
        maps=maps,
        sample_interval=sample_interval,
        skip_incomplete_rows=skip_incomplete_rows,
    )
    text, channels, remarks = _servobee.simulate(settings("model", model), given(record)[0], said)
    warn(remarks)
    return Simulation(text, channels)


def export(model, out, *, force=False):
    """Exports a model; the ending of `out` names the format: .fmu, .mo, .m (Simscape) or .c."""
    remark = _servobee.export(settings("model", model), out, force)
    warn([remark] if remark else [])


SYNTHESIZE = (
    *("outsiders", "command", "seconds", "rate", "noise", "noise_colour", "quantise", "spool_unit", "meter"),
    *("flow", "seed", "random_valve", "gain", "time_constant", "saturation", "rated_flow"),
)


def synthesize(effects=(), **options):
    """A bench record with planted effects, such as "delay=0.002", from equations other than the model's, as a DataFrame.

    Options: outsiders, command, seconds, rate, noise, noise_colour, quantise, spool_unit, meter, flow, seed, random_valve,
    gain, time_constant, saturation, rated_flow; as of `servobee synthesize --help`.
    """
    known("synthesize", options, SYNTHESIZE)
    said = dict(options)
    for name, value in (("effects", effects), ("outsiders", options.get("outsiders", ()))):
        said[name] = value.split(",") if isinstance(value, str) else list(value)
    return frame_of_csv(_servobee.synthesize(said))


DATASHEET = (
    *("case", "flow", "response", "step", "drop", "amplitude", "stream", "full_scale", "seed", "units", "language"),
    "device",
)


def datasheet(*, progress=None, **options):
    """Fits a valve's parameters to the curves of a datasheet: `flow`, `response` and `step` are paths of CSV files, or `case`
    names a published valve.

    Other options: drop, amplitude, stream, full_scale, seed, units, language, device; as of `servobee datasheet --help`.
    """
    known("datasheet", options, DATASHEET)
    said = {name: value for name, value in options.items() if value is not None}
    said["arguments"] = ["datasheet", *(f"{name}={value}" for name, value in said.items())]
    with Progress(progress, "datasheet") as progress:
        files, words = _servobee.datasheet(said, progress)
    warn(words)
    return Sheet(files)


def effects():
    """The effects that are known: name, port, summary, equation, shows, confused, source."""
    return parsed(_servobee.effects())
