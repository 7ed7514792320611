"""Writes criterion.md beside this script: the medians of the last `cargo bench` of evaluators, search and diagnosis."""

import json
from pathlib import Path

HERE = Path(__file__).parent
GROUPS = ["population", "rows", "structure", "ask and tell", "fit", "64 fits", "identify 2000 rows"]


def number(value, units):
    for factor, unit in units:
        if value >= factor:
            break
    return f"{value / factor:.3g} {unit}"


def place(item):
    (group, function, value), _ = item
    size = int(value) if value and value.isdigit() else 0
    return GROUPS.index(group), size, value or "", function


def main():
    cases = {}
    for file in HERE.parent.glob("target/criterion/**/new/benchmark.json"):
        case = json.loads(file.read_text())
        median = json.loads(file.with_name("estimates.json").read_text())["median"]
        if case["group_id"] not in GROUPS:
            continue
        cases[case["group_id"], case["function_id"], case["value_str"]] = case["throughput"], median
    with open(HERE / "criterion.md", "w") as out:
        print("| group | case | median | 95 % interval | a second |\n|---|---|---|---|---|", file=out)
        for (group, function, value), (throughput, median) in sorted(cases.items(), key=place):
            interval = median["confidence_interval"]
            time = lambda nanoseconds: number(nanoseconds, [(1e9, "s"), (1e6, "ms"), (1e3, "µs"), (1, "ns")])
            rate = "-"
            if throughput:
                count = throughput["Elements"] / (median["point_estimate"] * 1e-9)
                rate = number(count, [(1e6, "million"), (1e3, "thousand"), (1, "")])
            name = function if value is None else f"{function}, {value}"
            low, high = (time(interval[bound]) for bound in ("lower_bound", "upper_bound"))
            print(f"| {group} | {name} | {time(median['point_estimate'])} | {low} .. {high} | {rate} |", file=out)


if __name__ == "__main__":
    main()
