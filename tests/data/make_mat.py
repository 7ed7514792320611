"""Makes the files in mat/: one record saved as CSV, and in the ways in which MATLAB and Simulink save it as a MAT file.

Command in mV (whole numbers), spool and flow as any doubles, at 1 kHz but for a gap. SciPy writes what it can. What
MATLAB writes and SciPy does not is put together here from the published format: doubles stored as smaller integers, the
high byte first, an object of a class. SciPy reads them back, as a check.

Run, from the repository root:

    python3 -m venv mat-venv
    mat-venv/bin/pip install numpy==2.4.6 scipy==1.17.1
    mat-venv/bin/python tests/data/make_mat.py

Made with Python 3.11, numpy 2.4.6 and scipy 1.17.1. Another run writes the same files.
"""

import io
import struct
from pathlib import Path

import numpy as np
from scipy.io import loadmat, savemat

FOLDER = Path(__file__).parent / "mat"
ROWS = 60
SEED = 7

rng = np.random.default_rng(SEED)
time = np.delete(np.arange(ROWS + 5), range(40, 45)) / 1000
command = np.round(3000 * np.sin(np.arange(ROWS) / 4) + 500)
spool = command / 100 + rng.normal(size=ROWS)
flow = np.cumsum(rng.normal(size=ROWS)) * 1e-3
flow[5] = 1e300 / 3  # as large as a double can be used, and not short in decimals


def column(values):
    return np.asarray(values).reshape(-1, 1)


def save(name, variables, **options):
    """savemat, but for the date that it writes into the header."""
    file = io.BytesIO()
    savemat(file, variables, **options)
    content = bytearray(file.getvalue())
    if options.get("format", "5") == "5":
        content[:116] = b"MATLAB 5.0 MAT-file, made by make_mat.py".ljust(116)
    (FOLDER / name).write_bytes(content)


def by_scipy():
    units = {"command": "mV", "spool": "%", "flow": "L/min"}
    named = {"time": column(time), "command": column(command), "spool": column(spool), "flow": column(flow)}
    save("named.mat", {**named, "units": units})
    save("compressed.mat", {**named, "units": units}, do_compression=True)
    save("struct.mat", {"run": {**named, "units": units, "note": "made"}}, do_compression=True)
    short = {"t": time, "command": command, "spool": spool, "flow": flow, "units": {**units, "t": "s"}}
    save("short.mat", {"log": {"rig": {"bench": short}}})

    # "Structure with time": one struct with several signals, and one struct a signal.
    signals = np.zeros((1, 2), dtype=[("values", object), ("dimensions", object), ("label", object)])
    signals[0, 0] = (column(command), 1.0, "command [mV]")
    signals[0, 1] = (np.column_stack([spool, flow]), 2.0, "")
    save("simulink.mat", {"out": {"time": column(time), "signals": signals, "blockName": "valve/Scope"}})
    block = lambda values, label: {"time": column(time), "signals": {"values": column(values), "label": label}}
    blocks = {"u": block(command, "command [mV]"), "spool": block(spool, ""), "q": block(flow, "flow [L/min]")}
    save("blocks.mat", blocks, do_compression=True)

    def timeseries(values, unit, name):
        info = {"Units": unit}
        return {"Name": name, "Time": column(time * 1000), "TimeInfo": {"Units": "milliseconds"}, "Data": values, "DataInfo": info}

    series = {
        "command": timeseries(column(command), "mV", "unnamed"),
        "y": timeseries(spool.reshape(1, 1, -1), "%", "spool"),
        "flow": timeseries(flow, "L/min", ""),
    }
    save("timeseries.mat", series)

    cell = np.empty((1, 1), dtype=object)
    cell[0, 0] = column(spool)
    # Nothing that servobee knows by its name, and every class.
    save(
        "plain.mat",
        {
            "t": time,
            "u": column(command.astype(np.int16)),
            "x": np.column_stack([spool, flow]),
            "rows": np.vstack([spool, flow]),
            "i8": column(np.arange(ROWS, dtype=np.int8) - 30),
            "u8": column(np.arange(ROWS, dtype=np.uint8)),
            "u16": column(np.arange(ROWS, dtype=np.uint16) * 1000),
            "i32": column(np.arange(ROWS, dtype=np.int32) * -70000),
            "u32": column(np.arange(ROWS, dtype=np.uint32) * 70000),
            "i64": column(np.arange(ROWS, dtype=np.int64) * -(2**40)),
            "u64": column(np.arange(ROWS, dtype=np.uint64) * 2**40),
            "f32": column(np.arange(ROWS, dtype=np.float32) / 3),
            "on": column(np.arange(ROWS) % 2 == 0),
            "Ts": 0.001,
            "note": "a note",
            "lines": np.array(["ab", "cd"]),
            "z": column(spool + 1j),
            "cells": np.array([["a", "b"]], dtype=object),
            "cell": cell,
            "empty": np.zeros((0, 0)),
            "cube": np.zeros((2, 3, 4)),
        },
    )
    save("level4.mat", {"time": column(time)}, format="4")


class ByHand:
    """A MAT file of level 5, element by element, in either byte order."""

    def __init__(self, order):
        self.order = order
        version = struct.pack(order + "H", 0x0100) + (b"IM" if order == "<" else b"MI")
        self.content = b"MATLAB 5.0 MAT-file, made by make_mat.py".ljust(116) + bytes(8) + version

    def element(self, kind, data):
        if 0 < len(data) <= 4:
            return struct.pack(self.order + "I", len(data) << 16 | kind) + data.ljust(4, b"\0")
        padded = data + bytes(-len(data) % 8)
        return struct.pack(self.order + "II", kind, len(data)) + padded

    def numbers(self, kind, code, values):
        return self.element(kind, struct.pack(f"{self.order}{len(values)}{code}", *values))

    def flags(self, array_class):
        return self.numbers(6, "I", [array_class, 0])

    def text(self, text):
        return self.element(1, text.encode())

    def double(self, name, values, kind, code):
        """An array of doubles, stored as integers of another type where they are some."""
        values = [int(value) for value in values] if code != "d" else list(values)
        size = self.numbers(5, "i", [len(values), 1])
        parts = self.flags(6) + size + self.text(name) + self.numbers(kind, code, values)
        self.content += self.element(14, parts)

    def object(self, name, of_class):
        """A reference to an object, and the nameless variable that holds what it hides."""
        size = self.numbers(5, "i", [6, 1])
        reference = self.flags(13) + size + self.text("") + self.numbers(6, "I", [0xDD000000, 2, 1, 1, 1, 1])
        parts = self.flags(17) + self.text(name) + self.text("MCOS") + self.text(of_class)
        self.content += self.element(14, parts + self.element(14, reference))
        hidden = self.flags(9) + self.numbers(5, "i", [1, 16]) + self.text("") + self.element(2, bytes(range(16)))
        self.content += self.element(14, hidden)

    def save(self, name):
        (FOLDER / name).write_bytes(self.content)


def by_hand():
    for name, order in [("stored_small.mat", "<"), ("big_endian.mat", ">")]:
        file = ByHand(order)
        file.double("time", time, 9, "d")
        file.double("command", command, 3, "h")
        file.double("spool", spool, 9, "d")
        file.double("count", range(ROWS), 2, "B")
        file.save(name)
        read = loadmat(FOLDER / name)
        for variable, values in [("time", time), ("command", command), ("spool", spool), ("count", range(ROWS))]:
            assert np.array_equal(read[variable][:, 0], values), (name, variable)

    file = ByHand("<")
    file.double("gain", [1.5], 9, "d")
    file.object("ts", "timeseries")
    file.save("object.mat")


def as_csv():
    rows = zip(time, command, spool, flow)
    lines = [",".join(repr(float(value)) for value in row) for row in rows]
    header = "time [s],command [mV],spool [%],flow [L/min]"
    (FOLDER / "record.csv").write_text("\n".join([header, *lines]) + "\n")


FOLDER.mkdir(exist_ok=True)
by_scipy()
by_hand()
as_csv()
