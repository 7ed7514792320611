"""What a call says, as the extension takes it."""

import json
import os
import warnings
from collections.abc import Mapping, Sequence

from ._errors import refused
from ._report import Report

OPTIONS = (
    *("max_effects", "hold_out_share", "max_rows", "sample_interval", "skip_incomplete_rows", "accuracy", "limits"),
    *("about", "full_scale", "seed", "units", "language", "device"),
)


def known(function, options, names):
    """Refuses options that the function does not have."""
    for name in options:
        if name not in names:
            raise TypeError(f"{function}() has no option {name!r}; it has {', '.join(names)}")


# What a result does not depend on.
ASIDE = ("force", "resume", "task")


def told(function, **options):
    """What the extension is told, without what was not said."""
    if options.get("effects", "all") is None:
        raise refused("effects", "is None", 'give "all", "none" or a list of names')
    said = {name: value for name, value in options.items() if value is not None}
    arguments = [function, *(f"{name}={_line(value)}" for name, value in said.items() if name not in ASIDE)]
    if "maps" in said:
        said["maps"] = _maps(said["maps"])
    for name in ("model", "limits"):
        if name in said:
            said[name] = settings(name, said[name])
    if not isinstance(said.get("effects", ""), str):
        said["effects"] = ",".join(said["effects"]) or "none"
    if "sample_interval" in said:
        said["sample_interval"] = str(said["sample_interval"])
    if isinstance(said.get("about"), Mapping):
        # With a semicolon in the end it is known what separates.
        said["about"] = "".join(f"{name} = {value};" for name, value in said["about"].items()).rstrip(";")
    if isinstance(said.get("accuracy"), Mapping):
        said["accuracy"] = ", ".join(f"{name}={value} %" for name, value in said["accuracy"].items())
    return said | {"arguments": arguments}


def _maps(maps):
    if isinstance(maps, str):
        return [maps]
    if isinstance(maps, Mapping):
        return [f"{column}={channel}" for column, channel in maps.items()]
    if isinstance(maps, Sequence):
        return list(maps)
    raise refused("maps", f"is a {type(maps).__name__}", 'give {"x_cmd_mm": "command [mm]"} or ["x_cmd_mm=command [mm]"]')


def _line(value):
    """What a report says of an argument."""
    return str(value).partition("\n")[0]


def settings(name, value):
    """A file of settings: a path, or its text."""
    if isinstance(value, Report):
        return (name, value.model)
    if isinstance(value, Mapping):
        return (name, "".join(f"{json.dumps(key)} = {json.dumps(text)}\n" for key, text in value.items()))
    if isinstance(value, str) and ("\n" in value or "=" in value):
        return (name, value)
    if isinstance(value, (str, os.PathLike)):
        return os.fspath(value)
    raise refused(name, f"is a {type(value).__name__}", "give a path, the text of such a file, or a report")


def warn(words):
    """Warns whoever has called the function that calls this one."""
    for one in words:
        warnings.warn(one, stacklevel=3)
