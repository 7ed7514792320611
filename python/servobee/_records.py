"""Records from whatever holds them: files, pandas, polars, dictionaries of NumPy arrays."""

import os
from collections.abc import Mapping, Sequence

import numpy as np

from ._errors import refused


def as_list(records):
    """One record or several, as a list."""
    if records is None:
        return []
    if isinstance(records, Sequence) and not isinstance(records, (str, bytes)):
        return list(records)
    return [records]


def given(records, name="table"):
    """What the extension takes for `records`; one that is no file is called by this name."""
    records = as_list(records)
    several = len(records) > 1
    return [_one(record, f"{name} {k}" if several else name) for k, record in enumerate(records, 1)]


def _one(record, name):
    if isinstance(record, (str, os.PathLike)):
        return os.fspath(record)
    if isinstance(record, Mapping):
        columns = record.items()
    elif isinstance(record, np.ndarray) and record.dtype.names:
        columns = [(label, record[label]) for label in record.dtype.names]
    elif type(record).__module__.startswith("pandas") and hasattr(record, "columns"):
        columns = _of_pandas(record)
    elif type(record).__module__.startswith("polars") and hasattr(record, "get_columns"):
        columns = [(column.name, column.to_numpy()) for column in record.get_columns()]
    else:
        raise refused(
            name,
            f"is a {type(record).__name__}",
            "give a path, a DataFrame of pandas or polars, a dict of arrays, or an array whose fields have names",
        )
    return name, [(str(label), _column(name, label, values)) for label, values in columns]


def _of_pandas(frame):
    index = frame.index
    if type(index).__name__ in ("DatetimeIndex", "TimedeltaIndex"):
        yield index.name or ("time [s]" if type(index).__name__ == "TimedeltaIndex" else "time"), index.to_numpy()
    elif index.name is not None:
        # One without a name only counts rows.
        yield index.name, index.to_numpy()
    for label, column in frame.items():
        # Columns that know missing values of their own kind.
        numbers = column.dtype.kind in "fiu" and not isinstance(column.dtype, np.dtype)
        yield label, column.to_numpy(np.float64, na_value=np.nan) if numbers else column.to_numpy()


def _column(name, label, values):
    """A column as numbers in double precision, or as texts."""
    if isinstance(values, np.ma.MaskedArray):
        values = values.astype(np.float64).filled(np.nan)
    values = np.asarray(values)
    if values.ndim != 1:
        raise refused(f"{name}, column {label!r}", f"has {values.ndim} dimensions", "give one value for each row")
    if values.dtype.kind == "m":
        return np.ascontiguousarray(values / np.timedelta64(1, "s"), dtype=np.float64)
    if values.dtype.kind == "M":
        return [str(value) for value in values.astype("datetime64[ns]")]
    if values.dtype.kind in "fiub":
        return np.ascontiguousarray(values, dtype=np.float64)
    if values.dtype.kind == "c":
        raise refused(f"{name}, column {label!r}", "is complex", "give its real part")
    # Objects: numbers with None in between are numbers; all else is text, which no channel takes.
    try:
        return np.array([np.nan if value is None else float(value) for value in values])
    except (TypeError, ValueError):
        return ["" if value is None else str(value) for value in values]
