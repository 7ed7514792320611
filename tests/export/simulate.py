"""Validates and simulates FMUs with FMPy: reads cases from a JSON file, writes what came out into another.

    python simulate.py CASES.json RESULTS.json

Each case is driven the way a record is: the inputs of a row are set, the outputs of that row are read, and one step goes to
the next row.
"""

import json
import shutil
import sys

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.validation import validate_fmu


class Unit:
    """An unpacked FMU, its variables by name."""

    def __init__(self, path):
        self.description = fmpy.read_model_description(path)
        self.folder = fmpy.extract(path)
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.messages = []

    def instance(self, name="instance"):
        slave = FMU2Slave(
            guid=self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        slave.instantiate(callbacks=self.callbacks())
        return slave

    def callbacks(self):
        from fmpy.fmi2 import (
            calloc,
            fmi2CallbackAllocateMemoryTYPE,
            fmi2CallbackFreeMemoryTYPE,
            fmi2CallbackFunctions,
            fmi2CallbackLoggerTYPE,
            free,
        )

        def log(environment, name, status, category, message):
            self.messages.append(message.decode())

        functions = fmi2CallbackFunctions()
        functions.logger = fmi2CallbackLoggerTYPE(log)
        functions.allocateMemory = fmi2CallbackAllocateMemoryTYPE(calloc)
        functions.freeMemory = fmi2CallbackFreeMemoryTYPE(free)
        return functions

    def close(self):
        shutil.rmtree(self.folder, ignore_errors=True)


class Run:
    """An instance on its way along a case's rows."""

    def __init__(self, unit, case, parts=(1.0,), parameters=None):
        self.unit, self.case, self.parts = unit, case, parts
        self.slave = unit.instance()
        self.inputs = [unit.references[name] for name in case["inputs"]]
        self.outputs = [unit.references[name] for name in case["outputs"]]
        self.begin(parameters or {})

    def begin(self, parameters):
        values = {**self.case["parameters"], **parameters}
        self.slave.setupExperiment(startTime=self.case["time"][0])
        self.slave.setReal([self.unit.references[name] for name in values], list(values.values()))
        self.slave.enterInitializationMode()
        self.set(0, 0.0)
        self.slave.exitInitializationMode()

    def set(self, row, share):
        """Sets the inputs that are due `share` of the way from a row to the next."""
        rows = self.case["rows"]
        values, time = rows[row], self.case["time"]
        if self.case["interpolated"] and row + 1 < len(rows):
            change = [after - now for now, after in zip(values, rows[row + 1])]
            if self.case["keeps"][row]:
                change[self.case["inputs"].index("command")] = 0.0
            values = [now + share * by for now, by in zip(values, change)]
            self.slave.setReal(self.inputs, values)
            seconds = time[row + 1] - time[row]
            slopes = [by / seconds for by in change]
            self.slave.setRealInputDerivatives(self.inputs, [1] * len(slopes), slopes)
        else:
            self.slave.setReal(self.inputs, values)

    def row(self, row):
        """The outputs of a row, after which the instance goes on to the next."""
        self.set(row, 0.0)
        outputs = self.slave.getReal(self.outputs)
        time = self.case["time"]
        if row + 1 < len(time):
            seconds, share = time[row + 1] - time[row], 0.0
            for part in self.parts:
                if share:
                    self.set(row, share)
                now = time[row] + share * seconds
                self.slave.doStep(now, seconds if part == 1.0 else part * seconds)
                share += part
        return outputs

    def all(self):
        return [self.row(row) for row in range(len(self.case["time"]))]

    def close(self):
        self.slave.freeInstance()


def changed(unit, case):
    """For each parameter that the case names: the trajectory after a change of it."""
    results = {}
    for name, value in case["changes"].items():
        run = Run(unit, case, parameters={name: value})
        results[name] = run.all()
        run.close()
    return results


def side_by_side(unit, case):
    """Two instances that take turns, one of which goes back to an earlier state and is then started anew."""
    first, second = Run(unit, case), Run(unit, case)
    rows = len(case["time"])
    ahead = [first.row(row) for row in range(rows // 2)]
    behind = [second.row(row) for row in range(rows // 4)]
    state = first.slave.getFMUState()
    ahead += [first.row(row) for row in range(rows // 2, rows)]
    behind += [second.row(row) for row in range(rows // 4, rows)]
    first.slave.setFMUState(state)
    again = ahead[: rows // 2] + [first.row(row) for row in range(rows // 2, rows)]
    first.slave.freeFMUState(state)
    first.slave.reset()
    first.begin({})
    anew = first.all()
    first.close()
    second.close()
    return {"ahead": ahead, "behind": behind, "again": again, "anew": anew}


def refused(unit, case):
    """What the FMU says to calls that it must refuse."""
    names = {}

    def attempt(name, call):
        unit.messages.clear()
        try:
            call()
            names[name] = "accepted"
        except Exception:
            names[name] = " ".join(unit.messages)

    run = Run(unit, case)
    gain = unit.references["gain"]
    attempt("parameter while stepping", lambda: run.slave.setReal([gain], [1.0]))
    attempt("step backwards", lambda: run.slave.doStep(0.0, -1.0))
    run.slave.setReal(run.inputs, [float("nan")] * len(run.inputs))
    attempt("not a number", lambda: run.slave.doStep(0.0, 1e-3))
    attempt("step after failure", lambda: run.slave.doStep(0.0, 1e-3))
    run.slave.reset()
    attempt("parameter out of bounds", lambda: run.slave.setReal([gain], [1e99]))
    run.close()
    return names


def by_a_master(case):
    """The trajectory that FMPy's own master gives, which sets inputs, steps, and reads outputs."""
    import numpy

    names = ["time"] + case["inputs"]
    inputs = numpy.array(
        [(time, *row) for time, row in zip(case["time"], case["rows"])],
        dtype=[(name, numpy.float64) for name in names],
    )
    time = case["time"]
    result = fmpy.simulate_fmu(
        case["fmu"],
        start_time=time[0],
        stop_time=time[-1],
        output_interval=time[1] - time[0],
        input=inputs,
        output=case["outputs"],
        set_input_derivatives=case["interpolated"],
    )
    return [[float(row[name]) for name in case["outputs"]] for row in result]


def main(cases, results):
    with open(cases) as file:
        cases = json.load(file)
    found = []
    for case in cases:
        result = {"problems": [str(problem) for problem in validate_fmu(case["fmu"])]}
        unit = Unit(case["fmu"])
        run = Run(unit, case)
        result["outputs"] = run.all()
        run.close()
        result["changed"] = changed(unit, case)
        if case["master"]:
            result["master"] = by_a_master(case)
        if case["thorough"]:
            result.update(side_by_side(unit, case))
            run = Run(unit, case, parts=(0.31, 0.19, 0.5))
            result["parts"] = run.all()
            run.close()
            result["refused"] = refused(unit, case)
        unit.close()
        found.append(result)
    with open(results, "w") as file:
        json.dump(found, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
