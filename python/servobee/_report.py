"""Results: every field of the report as an attribute, tables as DataFrames, and the page."""

import csv
import html
import io
import json

import numpy as np

from . import _servobee


class Fields(dict):
    """A part of a report: its fields are attributes, too."""

    def __getattr__(self, name):
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"there is no {name}; there are {', '.join(self)}") from None

    def __dir__(self):
        return [*super().__dir__(), *self]


def parsed(text):
    return json.loads(text, object_hook=Fields)


def frame(columns):
    """Columns by name as a DataFrame of pandas, or else of polars."""
    try:
        import pandas as library
    except ImportError:
        try:
            import polars as library
        except ImportError:
            raise ImportError("DataFrames need pandas or polars: pip install pandas") from None
    return library.DataFrame(columns)


def frame_of_rows(rows, names=None):
    rows = list(rows)
    names = names or list(dict.fromkeys(name for row in rows for name in row))
    return frame({name: [row.get(name) for row in rows] for name in names})


def frame_of_csv(text):
    """A table that servobee has written, to the last bit of its numbers."""
    head, *rows = csv.reader(io.StringIO(text))
    return frame({name: _numbers(cells) for name, cells in zip(head, zip(*rows))})


def _numbers(cells):
    try:
        return np.array([cell or "nan" for cell in cells], dtype=np.float64)
    except ValueError:
        return list(cells)


class Result:
    """What a run leaves: its report, whose fields are attributes, and its files."""

    _json = "report.json"
    _page = "report.html"

    def __init__(self, files):
        self._files = dict(files)
        self._document = parsed(self._files[self._json])

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return getattr(self._document, name)

    def __dir__(self):
        return [*super().__dir__(), *self._document]

    def to_dict(self):
        """The whole report."""
        return json.loads(self._files[self._json])

    @property
    def page(self):
        """The page as HTML, which needs nothing beside it."""
        return self._files[self._page]

    @property
    def contents(self):
        """What the files of the result hold, by name."""
        return dict(self._files)

    def save(self, folder, force=False):
        """Writes the files into `folder`, all or none; into one that exists only with `force`."""
        _servobee.write(folder, list(self._files.items()), force)

    def _repr_html_(self):
        page = html.escape(self.page, quote=True)
        return f'<iframe srcdoc="{page}" style="width: 100%; height: 800px; border: 0"></iframe>'


class Report(Result):
    """What was identified."""

    @property
    def model(self):
        """The result as the text of a model file, which `model=` takes back."""
        return self._files["model.toml"]

    @property
    def effect_names(self):
        """The names of the effects that were found, with the channel where one is on one."""
        names = ((effect.name, effect.get("channel")) for effect in self.effects)
        return [f"{name}.{channel}" if channel else name for name, channel in names]

    @property
    def parameters_frame(self):
        """The parameters: value, interval, and the base model's value."""
        return frame_of_rows(self.parameters)

    @property
    def errors_frame(self):
        """Errors of every channel, fitted and held out, before and after."""
        rows = [
            {"channel": channel, "data": side, "model": model, **score}
            for model in ("before", "after")
            for side in ("fit", "hold_out")
            for channel, score in self.error[model][side].items()
        ]
        return frame_of_rows(rows)

    @property
    def card_frame(self):
        """The figures of the valve card."""
        return frame_of_rows(self.card, ["label", "unit", "value", "low", "high"])

    @property
    def residuals_frame(self):
        """Every row of every record: measured, simulated before and after."""
        return frame_of_csv(self._files["residual.csv"])

    def __repr__(self):
        names = " and ".join(self.effect_names)
        return f"<servobee.Report: {self.verdict}{': ' + names if names else ''}>"


class Sheet(Result):
    """What the curves of a datasheet gave."""

    @property
    def parameters_frame(self):
        """The parameters of every curve: value and interval."""
        return frame_of_rows(self.parameters)

    def __repr__(self):
        return f"<servobee.Sheet: {', '.join(self.error.after.fit)}>"


class Comparison(Result):
    """What changed between two states of a valve."""

    _json = "compare.json"
    _page = "compare.html"

    def __repr__(self):
        return f"<servobee.Comparison: {self.answer}>"


class Simulation:
    """A record simulated with a model."""

    def __init__(self, text, channels):
        self.csv = text
        names = ("name", "unit", "rmse", "fit_percent", "integration_error")
        self.channels = [Fields(zip(names, channel)) for channel in channels]

    @property
    def frame(self):
        """Time, command, and every output: measured, where it is, and simulated."""
        return frame_of_csv(self.csv)

    def __repr__(self):
        return f"<servobee.Simulation: {', '.join(one.name for one in self.channels)}>"
