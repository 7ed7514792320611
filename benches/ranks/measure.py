"""Measures bytes and time of one generation on 1 to 4 ranks of one machine, and prints the tables of benches/ranks.md.

A generation is one population of the base model (3 parameters); each rank has one thread. What is sent is compared with the formula
of the page, and the script fails where it is off. Call, after bash tests/mpi.sh: python3 benches/ranks/measure.py
"""

import json
import os
import platform
import subprocess
from datetime import date
from pathlib import Path

PROGRAM = Path(__file__).parent.parent.parent / "target/mpi/servobee"
RANKS = 1, 2, 3, 4
ROWS = 100, 1000, 10000
SIZES = 1024, 16384, 65536
PARAMETERS = 3
SECONDS = 5  # for each number of ranks and rows, and each round
ROUNDS = 3  # of which the fastest counts: others may use the machine

# A rank has one thread. Open MPI wants to be told that it may run as root and more ranks than there are cores.
ALLOWED = {"RAYON_NUM_THREADS": "1", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}


def bench(ranks, rows):
    """What `servobee bench` says of all ranks together."""
    call = ["mpirun", "--oversubscribe", "-n", str(ranks), str(PROGRAM), "bench", "--evaluator", "cpu", "--json"]
    call += ["--samples", str(rows), "--seconds", str(SECONDS if ranks > 1 else 2 * SECONDS)]
    done = subprocess.run(call, env=os.environ | ALLOWED, check=True, capture_output=True, text=True)
    found = next(one for one in json.loads(done.stdout)["evaluators"] if "f32" in one["name"])
    return {one["population"]: one for one in found["results"]}


def processor():
    names = [line.split(":")[1].strip() for line in open("/proc/cpuinfo") if line.startswith("model name")]
    return f"{names[0] if names else platform.machine()}, {os.cpu_count()} cores"


def table(heads, rows):
    lines = [heads, ["---"] * len(heads), *rows]
    print("\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines), end="\n\n")


def main():
    launcher = subprocess.run(["mpirun", "--version"], capture_output=True, text=True).stdout.splitlines()[0]
    print(f"{processor()}; {launcher}; {date.today()}\n")
    rounds = [{(ranks, rows): bench(ranks, rows) for ranks in RANKS for rows in ROWS} for _ in range(ROUNDS)]
    found = rounds[0]
    for other in rounds[1:]:
        for case, sizes in other.items():
            for size, one in sizes.items():
                kept = found[case].setdefault(size, one)
                kept["seconds"] = min(kept["seconds"], one["seconds"])

    lines = []
    for ranks in RANKS[1:]:
        own = found[ranks, ROWS[1]]
        small, large = own[SIZES[0]]["bytes"][1], own[SIZES[2]]["bytes"][1]
        a_candidate = (large - small) / (SIZES[2] - SIZES[0])
        expected = 8 * (PARAMETERS + 1) * (ranks - 1) / ranks
        a_rank = (small - expected * SIZES[0]) / (ranks - 1)
        first = {rows: found[ranks, rows][64]["bytes"] for rows in ROWS[1:]}
        data = {rows: one[0] - one[1] for rows, one in first.items()}
        a_row = (data[ROWS[2]] - data[ROWS[1]]) / (ROWS[2] - ROWS[1]) / (ranks - 1)
        assert abs(a_candidate / expected - 1) < 1e-3, (a_candidate, expected)
        lines.append([ranks, f"{a_candidate:.2f}", f"{expected:.2f}", f"{a_rank:.0f}", f"{a_row:.1f}"])
    table(["ranks", "bytes a candidate", "8 (d + 1) (P - 1) / P", "bytes a rank", "bytes a row and rank, once"], lines)

    lines = []
    for rows in ROWS:
        for size in SIZES:
            times = [found[ranks, rows].get(size, {}).get("seconds") for ranks in RANKS]
            cells = ["-" if one is None else f"{1e3 * one:.3g}" for one in times]
            gain = "-" if None in times[:2] else f"{times[0] / times[1]:.2f}"
            lines.append([rows, size, *cells, gain])
    table(["rows", "candidates", *(f"{ranks} ranks, ms" for ranks in RANKS), "gain of 2"], lines)
    lines = [[rows, *(f"{1e6 * found[ranks, rows][64]['seconds']:.0f}" for ranks in RANKS)] for rows in ROWS]
    table(["rows", *(f"64 candidates on {ranks}, µs" for ranks in RANKS)], lines)

    rows, size = ROWS[1], SIZES[1]
    a_row = found[1, rows][size]["seconds"] / rows / size
    alone, both = (found[ranks, ROWS[0]][SIZES[2]] for ranks in (1, 2))
    copies = both["bytes"][1] / (both["seconds"] - alone["seconds"] / 2)
    print(f"c = {1e9 * a_row:.2f} ns; rank 0 packs, copies and unpacks {1e-9 * copies:.2f} GB/s\n")
    calculated(a_row, copies)


def calculated(a_row, copies):
    """Where the network ends the scaling, and what a generation of 1e9 candidates takes on 1000 ranks."""
    candidate = 8 * (PARAMETERS + 1)
    links = [("this machine's copies", copies, 2e-6), ("10 Gbit/s", 1.1e9, 30e-6), ("100 Gbit/s", 11e9, 5e-6)]
    lines = []
    for name, link, message in links:
        for rows in (1000, 10000, 250000):
            border = a_row * rows * link / candidate
            terms = a_row * rows * 1e9 / 1000, candidate * 1e9 * 0.999 / link, message * 999
            lines.append([name, rows, f"{border:.3g}", *(f"{one:.2g}" for one in terms), f"{sum(terms):.3g}"])
    heads = ["rank 0's link", "rows", "P where both are equal", "1000 ranks, 1e9 candidates: computing, s", "bytes, s", "messages, s"]
    table([*heads, "together, s"], lines)


if __name__ == "__main__":
    main()
