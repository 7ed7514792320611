"""Whether a diagnosis says the same with other seeds, and with fitted and held-out rows exchanged.

    python3 benches/repeat.py --program target/release/servobee --seed 401 > benches/repeat.md

Each record of the scorecard's --seed is identified with ten seeds of the search; then its halves, each fitted with the other held
out. The same: verdict and names, where a cause may stand for those it is tied with. Inside: values of free parameters within the 95 %
interval of the first run, of all that are compared; a value at a bound has none.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

CASES = [
    "null/1", "single/null_bias/3x/1", "single/delay/3x/1", "single/command_lag/3x/1", "single/dead_band/3x/1",
    "single/hysteresis/3x/1", "single/friction/3x/1", "single/slew_limit/3x/1", "single/stroke_limit/3x/1",
    "single/flow_force/3x/1", "single/feedback_curvature/3x/1", "single/overlap/3x/1", "single/gain_curvature/3x/1",
    "single/asymmetric_gain/3x/1", "single/supply_droop/3x/1", "single/leakage/3x/1", "single/viscosity_drift/3x/1",
    "single/line_resonance/3x/1", "single/compressibility/3x/1", "single/sensor_lag.spool/3x/1",
    "single/sensor_drift.flow/3x/1", "single/periodic_disturbance.flow/3x/1",
]  # fmt: skip
SEEDS = range(1, 11)


def run(program, *arguments):
    done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True)
    if done.returncode:
        raise SystemExit(f"servobee {' '.join(map(str, arguments))}: {done.stderr}")


def identified(program, folder, *arguments):
    run(program, "identify", *arguments, "--evaluator", "cpu", "--out", folder / "result", "--force")
    return json.loads((folder / "result/report.json").read_text())


def says(report):
    """Verdict, and of each cause the names that it can have."""
    names = [{effect["name"], *effect["tied_with"]} for effect in report["effects"]]
    return report["verdict"], names


def same(some, others):
    (verdict, names), (other_verdict, other_names) = says(some), says(others)
    left = list(other_names)
    for name in names:
        fits = next((other for other in left if name & other), None)
        if fits is None:
            return False
        left.remove(fits)
    return verdict == other_verdict and not left


def inside(first, other):
    """How many values of `other` lie in the intervals of `first`, and of how many."""
    values = {one["name"]: one["value"] for one in other["parameters"] if not one["at_bound"]}
    free = [one for one in first["parameters"] if not one["fixed"] and not one["at_bound"] and one["name"] in values]
    free = [one for one in free if one["low"] is not None and one["high"] is not None]
    return sum(one["low"] <= values[one["name"]] <= one["high"] for one in free), len(free)


def halves(record, folder):
    head, *rows = record.read_text().splitlines(keepends=True)
    for name, part in ("first", rows[: len(rows) // 2]), ("second", rows[len(rows) // 2 :]):
        path = folder / f"{name}.csv"
        path.write_text(head + "".join(part))
        yield path


def worded(report):
    verdict, names = says(report)
    return f"{verdict} {' + '.join(sorted(' or '.join(sorted(one)) for one in names))}".strip()


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", default="target/release/servobee")
    parser.add_argument("--seed", type=int, default=401)
    asked = parser.parse_args()
    version = subprocess.run([asked.program, "--version"], capture_output=True, text=True).stdout.strip()
    print(f"# The same again\n\n`python3 benches/repeat.py --seed {asked.seed}`, {version}; what is counted stands in the script.\n")
    print("| record | says | same with ten seeds | inside | halves exchanged | say the same | inside |\n|---|---|---|---|---|---|---|")
    sums = [[0, 0] for _ in range(4)]
    for case in CASES:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            run(asked.program, "scorecard", "--seed", asked.seed, "--case", case, "--write", folder)
            (record,) = folder.glob("*.csv")
            first, *others = (identified(asked.program, folder, record, "--seed", seed) for seed in SEEDS)
            alike = sum(same(first, other) for other in others) + 1
            seeds = [sum(column) for column in zip(*(inside(first, other) for other in others if same(first, other)))] or [0, 0]
            one, two = halves(record, folder)
            there = identified(asked.program, folder, one, "--hold-out", two)
            back = identified(asked.program, folder, two, "--hold-out", one)
            exchanged = [sum(column) for column in zip(inside(there, back), inside(back, there))]
        both = worded(there) if same(there, back) else f"{worded(there)}; {worded(back)}"
        found = [[alike, len(SEEDS)], seeds, [int(same(there, back)), 1], exchanged]
        for total, (hits, count) in zip(sums, found):
            total[0], total[1] = total[0] + hits, total[1] + count
        cells = [f"{hits} of {count}" for hits, count in found]
        print(f"| {case} | {worded(first)} | {cells[0]} | {cells[1]} | {both} | {cells[2]} | {cells[3]} |", flush=True)
    totals = [f"{hits} of {count}" for hits, count in sums]
    print(f"| all | | {totals[0]} | {totals[1]} | | {totals[2]} | {totals[3]} |")


if __name__ == "__main__":
    main()
