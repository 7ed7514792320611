"""Compiles and simulates Modelica models with rumoca: reads sheets from a JSON file, writes what came out into another.

    python modelica.py SHEETS.json RESULTS.json
"""

import json
import sys

import numpy
import rumoca


def trajectory(sheet):
    """The outputs at the times of a sheet; after the event where there is one."""
    model = rumoca.Session().loads(sheet["text"], model="Bench")
    config = rumoca.SimConfig(rtol=1e-9, atol=1e-9, max_wall_seconds=60)
    time = numpy.array(sheet["time"])
    result = model.simulate(float(time[-1]), dt=float(time[1] - time[0]), config=config)
    places = numpy.searchsorted(result.time, time + 1e-9) - 1
    columns = dict(zip(result.names, result.to_numpy()))
    return [[float(columns[name][place]) for name in sheet["outputs"]] for place in places]


def main(sheets, results):
    with open(sheets) as file:
        sheets = json.load(file)
    found = []
    for sheet in sheets:
        try:
            found.append({"outputs": trajectory(sheet), "problem": None})
        except rumoca.RumocaError as error:
            found.append({"outputs": [], "problem": str(error)})
    with open(results, "w") as file:
        json.dump(found, file)


if __name__ == "__main__":
    main(*sys.argv[1:])
