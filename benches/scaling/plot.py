"""Draws scaling.svg and writes table.md from results.csv, all beside this script. Needs matplotlib."""

import csv
from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

HERE = Path(__file__).parent
COLOURS = ["#0b5fa5", "#c2571a", "#3a7d44", "#7a4fa3"]
AXES = {"population": "candidates, of 1000 rows", "rows": "rows, for 1024 candidates"}

# The same file from the same figures.
plt.rcParams |= {"svg.fonttype": "none", "svg.hashsalt": "servobee", "font.size": 9}


def main():
    with open(HERE / "results.csv") as file:
        rows = list(csv.DictReader(file))
    names = list(dict.fromkeys(row["evaluator"] for row in rows))
    quantities = {"ns_per_candidate_row": "ns for a candidate's row", "peak_mib": "peak memory, MiB"}
    figure, plots = plt.subplots(2, 2, figsize=(8, 5.4), sharex="col", sharey="row")
    for plots_of_row, (quantity, label) in zip(plots, quantities.items(), strict=True):
        for plot, (axis, title) in zip(plots_of_row, AXES.items(), strict=True):
            for name, colour in zip(names, COLOURS):
                own = [r for r in rows if r["over"] == axis and r["evaluator"] == name and r[quantity]]
                x = [float(row[axis]) for row in own]
                plot.loglog(x, [float(row[quantity]) for row in own], "o-", color=colour, label=name, markersize=4)
            plot.grid(color="#dddddd", linewidth=0.6)
            if quantity == "peak_mib":
                plot.set_xlabel(title)
        plots_of_row[0].set_ylabel(label)
        plots_of_row[0].set_ylim(bottom=1)
    plots[0, 0].legend()
    figure.tight_layout()
    figure.savefig(HERE / "scaling.svg", metadata={"Date": None})

    with open(HERE / "table.md", "w") as file:
        print("| evaluator | candidates | rows | ns for a candidate's row | s | peak MiB |", file=file)
        print("|---" * 6 + "|", file=file)
        for row in rows:
            cells = "evaluator population rows ns_per_candidate_row seconds peak_mib".split()
            print("|", " | ".join(f"{row[cell]}" for cell in cells), "|", file=file)


if __name__ == "__main__":
    main()
