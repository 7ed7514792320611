"""Records of valves that share no code with servobee, and what it calls them.

    python benches/strangers/strangers.py --program target/release/servobee --seeds 1,2 [--only CAUSE;...] [--keep FOLDER]

Each cause is integrated here in steps of 10 us (Euler), most by another law than the catalogue's or at another place in the loop
(some that failed by their law have since been given a form: the rounded overlap, the cubic transducer, the smooth slew limit, the
pump that droops with the square of the flow), with a random valve, command, sampling rate, noise and set of measured channels. A
record of 6 s is fitted, another of 4 s under another command is held out. Prints a table in Markdown. Needs numpy and numba.

Commands are held between two rows; with --straight they go straight on, as what a generator gives, and the program has to see it.

With --left-out no effect is looked for that is a right name of what is planted: whatever is named then is named wrongly. Each
record measures spool and flow, and where the fault is located is compared with where it is. With --places no effect is looked
for at all, and only places are compared.
"""

import argparse
import csv
import json
import os
import subprocess
import tempfile
import time
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Callable

import numba
import numpy as np

STEP = 1e-5

LATE, PLAYS, PLAY_OF_FEEDBACK, SLEW, RAMP, SMOOTH_SLEW, LUGRE, DEAD_BAND = range(1, 9)
FORCE_IN_FRONT, KARNOPP, FORCE_BEHIND, SOFT_STOP, STOP, CLAMP, BIAS, JUMP, CUBIC, ALGEBRAIC_SLEW, TANH = range(9, 20)
LAPPED, ONE_EDGE, ROUND_EDGES, KNEE, SLOPES, UNDERLAP, PORT_SHAPE, SHIFT, ROUND_PORT, LEAKY_LAP = range(20, 30)
ACCUMULATOR, VOLUMES, LINE, WARM_UP, METER, RIPPLE, ZERO, HUNTING, SLIP, PUMP = range(30, 40)
TRANSDUCER, HUM, THERMAL, SQUARE, SAMPLED = range(40, 45)
COIL, FILTER, DEAD_COMMAND, MASS, LAGGING_MASS = range(45, 50)


@numba.njit(cache=True)
def limited(value, limit):
    return min(max(value, -limit), limit)


@numba.njit(cache=True)
def simulated(u, gain, lag, saturation, flow_gain, cause, p, every, straight):
    """Spool, V, and flow, L/min, at each row of the command `u`, which is held between two of them or goes straight on."""
    spool, flow = np.empty(u.size), np.empty(u.size)
    z = x = v = 0.0
    plays, ring = np.zeros(4), np.zeros(4096)
    ramp = bristle = q1 = q2 = rate = current = rising = 0.0
    supply, place, t = 1.0, 0, 0.0
    for k in range(u.size * every):
        row = k // every
        c = u[row]
        if straight and row + 1 < u.size:
            c += (u[row + 1] - u[row]) * (k % every) / every
        if cause == LATE:
            ring[place] = c
            c = ring[(place - int(p[0] / STEP)) % 4096]
            place = (place + 1) % 4096
        elif cause == PLAYS:
            total = 0.0
            for m in range(4):
                half = p[0] * (m + 1) / 4
                plays[m] = max(c - half, min(c + half, plays[m]))
                total += plays[m]
            c = total / 4
        elif cause == RAMP:
            ramp += limited(c - ramp, p[0] * STEP)
            c = ramp
        elif cause == CLAMP:
            c = limited(c, p[0])
        elif cause == BIAS:
            c += p[0]
        elif cause == JUMP and abs(c) <= p[0]:
            c = 0.0
        elif cause == COIL:
            current += (c - current) / p[0] * STEP
            c = current
        elif cause == FILTER:
            corner = 2 * np.pi * p[0]
            rising += corner * (corner * (c - current) - 1.6 * rising) * STEP
            current += rising * STEP
            c = current
        elif cause == DEAD_COMMAND:
            c -= limited(c, p[0])
        fed_back = x
        if cause == PLAY_OF_FEEDBACK:
            plays[0] = max(x - p[0], min(x + p[0], plays[0]))
            fed_back = plays[0]
        elif cause == CUBIC:
            fed_back = x + p[0] * x**3 / 100
        elif cause == TANH:
            fed_back = p[0] * np.tanh(x / p[0])
        error = limited(c - fed_back, saturation)
        if cause == DEAD_BAND:
            error -= p[0] * np.tanh(2 * error / p[0])
        drive = gain * error
        if cause == MASS or cause == LAGGING_MASS:
            # v'' / w^2 + 2 D v' / w + v = drive; or behind the lag, where z - x stays the lag's share of the drive.
            w = 2 * np.pi * p[0]
            pulls = (z - x) / lag if cause == LAGGING_MASS else drive
            rate += STEP * w * (w * (pulls - v) - 2 * p[1] * rate)
            drive += v - pulls if cause == LAGGING_MASS else 0.0
        if cause == FORCE_IN_FRONT:
            drive -= gain * p[0] * x
        z += drive * STEP
        speed = (z - x) / lag
        if cause == SLEW:
            speed = limited(speed, p[0])
        elif cause == SMOOTH_SLEW:
            speed = p[0] * np.tanh(speed / p[0])
        elif cause == ALGEBRAIC_SLEW:
            speed /= np.sqrt(1 + (speed / p[0]) ** 2)
        elif cause == LUGRE:
            # (z - x) = s0 w + s1 w' + T x', w' = x' - |x'| s0 w / g(x'); the stiction is 1.3 of the Coulomb friction.
            stiffness, damping = p[0] / 0.003, 0.1 * lag
            most = p[0] * (1 + 0.3 * np.exp(-((v * lag / 0.01) ** 2)))
            v = (z - x - stiffness * bristle) / (lag + damping)
            bristle += (v - abs(v) * stiffness * bristle / most) * STEP
            bristle = limited(bristle, 1.5 * p[0] / stiffness)
            speed = v
        elif cause == KARNOPP:
            pull = z - x
            if abs(v) < 1e-9:
                speed = 0.0 if abs(pull) <= 1.3 * p[0] else (pull - np.sign(pull) * p[0]) / lag
            else:
                speed = (pull - np.sign(v) * p[0]) / lag
                if speed * v < 0:
                    speed = 0.0
            v = speed
        elif cause == FORCE_BEHIND:
            speed = (z - x - p[0] * x) / lag
        elif cause == MASS or cause == LAGGING_MASS:
            v += rate * STEP
            speed = v
        x += speed * STEP
        if cause == SOFT_STOP and abs(x) > p[0]:
            x -= (x - np.sign(x) * p[0]) * STEP / 2e-4
        elif cause == STOP:
            x = limited(x, p[0])
        h = x
        if cause == LAPPED:
            h = x - limited(x, p[0])
        elif cause == ONE_EDGE and x < 0:
            h = x + min(-x, p[0])
        elif cause == ROUND_EDGES:
            h = np.sign(x) * (np.hypot(x, p[0]) - p[0])
        elif cause == KNEE:
            h = p[0] * x if abs(x) < 4 else x + np.sign(x) * 4 * (p[0] - 1)
        elif cause == SLOPES:
            h = x * (1 + np.sign(x) * p[0])
        elif cause == UNDERLAP:
            h = x + p[0] * limited(x, 0.5)
        elif cause == PORT_SHAPE:
            h = x + p[0] * np.sin(0.1 * np.pi * x)
        elif cause == SHIFT:
            h = x + p[0]
        elif cause == ROUND_PORT:
            h = 10 * np.sign(x) * (abs(x) / 10) ** p[0]
        elif cause == LEAKY_LAP:
            h = x - 0.9 * limited(x, p[0])
        q = flow_gain * h
        size = abs(q) / (10 * flow_gain)
        if cause == ACCUMULATOR:
            supply += STEP / p[1] * (1 - p[0] * size - supply)
            q *= np.sqrt(max(supply, 0.1))
        elif cause == VOLUMES:
            q1 += STEP / p[0] * (q - q1)
            q2 += STEP / p[0] * (q1 - q2)
            q = q2
        elif cause == LINE or cause == METER or cause == TRANSDUCER:
            w = 2 * np.pi * p[0]
            damping = 0.05 if cause == LINE else 0.7
            seen = x if cause == TRANSDUCER else q
            rate += STEP * w * (w * (seen - q1) - 2 * damping * rate)
            q1 += STEP * rate
            if cause != TRANSDUCER:
                q = q1
        elif cause == WARM_UP:
            q *= 1 + p[0] * (1 - np.exp(-t / 3))
        elif cause == RIPPLE:
            turn = 2 * np.pi * p[1] * t
            q += p[0] * (np.sin(turn) + 0.3 * np.sin(2 * turn))
        elif cause == ZERO:
            q += p[0]
        elif cause == HUNTING:
            q *= 1 + p[0] * np.sin(0.4 * np.pi * t)
        elif cause == SLIP:
            q -= p[0] * np.sqrt(size) * np.sign(q)
        elif cause == PUMP:
            q *= np.sqrt(max(1 - p[0] * size**2, 0.1))
        shown = x
        if cause == TRANSDUCER:
            shown = q1
        elif cause == HUM:
            shown += p[0] * np.sin(2 * np.pi * p[1] * t)
        elif cause == THERMAL:
            shown += p[0] * (1 - np.exp(-t / 4))
        elif cause == SQUARE:
            shown += p[0] * x * x / 10
        elif cause == SAMPLED:
            ring[place] = x
            shown = ring[(place - int(p[0] / STEP)) % 4096]
            place = (place + 1) % 4096
        if k % every == 0:
            spool[row], flow[row] = shown, q
        t += STEP
    return spool, flow


@dataclass(frozen=True)
class Cause:
    """What is planted, the names that are right for it (none: it is in no catalogue), and how strong it is."""

    code: int
    names: tuple
    low: float
    high: float
    second: tuple = (0.0, 0.0)


LAGS = ("sensor_lag", "compressibility", "delay")
CAUSES = {
    "nothing": Cause(0, (), 0, 0),
    "delay by a clock of its own": Cause(LATE, ("delay",), 0.002, 0.006),
    "hysteresis of Prandtl and Ishlinskii": Cause(PLAYS, ("hysteresis",), 0.1, 0.4),
    "play in the feedback": Cause(PLAY_OF_FEEDBACK, ("hysteresis",), 0.05, 0.25),
    "slew limit behind the integrator": Cause(SLEW, ("slew_limit",), 60, 160),
    "slew limit of the command": Cause(RAMP, ("slew_limit",), 60, 160),
    "smooth slew limit": Cause(SMOOTH_SLEW, ("slew_limit",), 100, 250),
    "LuGre friction": Cause(LUGRE, ("friction",), 0.1, 0.5),
    "smooth dead band of the error": Cause(DEAD_BAND, ("friction", "hysteresis"), 0.03, 0.15),
    "flow force in front": Cause(FORCE_IN_FRONT, ("flow_force",), 0.02, 0.1),
    "Karnopp friction": Cause(KARNOPP, ("friction",), 0.1, 0.5),
    "flow force behind": Cause(FORCE_BEHIND, ("flow_force",), 0.1, 0.4),
    "elastic stop": Cause(SOFT_STOP, ("stroke_limit",), 5, 7),
    "stop, integrator running on": Cause(STOP, ("stroke_limit",), 5, 7),
    "amplifier that clamps": Cause(CLAMP, ("stroke_limit",), 5, 7),
    "null bias": Cause(BIAS, ("null_bias",), 0.1, 0.4),
    "dead band that jumps": Cause(JUMP, ("dead_band",), 0.2, 0.5),
    "cubic transducer in the loop": Cause(CUBIC, ("feedback_curvature",), 0.05, 0.15),
    "overlap": Cause(LAPPED, ("overlap",), 0.1, 0.5),
    "overlap of one edge": Cause(ONE_EDGE, ("overlap",), 0.2, 0.6),
    "rounded overlap": Cause(ROUND_EDGES, ("overlap",), 0.2, 0.6),
    "knee": Cause(KNEE, ("gain_curvature",), 0.5, 0.8),
    "two slopes": Cause(SLOPES, ("asymmetric_gain",), 0.03, 0.1),
    "underlap": Cause(UNDERLAP, ("overlap", "gain_curvature"), 0.3, 0.8),
    "port shape": Cause(PORT_SHAPE, ("gain_curvature",), 0.2, 0.8),
    "offset of the opening": Cause(SHIFT, ("null_bias", "sensor_offset"), 0.1, 0.3),
    "droop of an accumulator": Cause(ACCUMULATOR, ("supply_droop",), 0.1, 0.3, (0.05, 0.4)),
    "two volumes": Cause(VOLUMES, LAGS, 0.001, 0.003),
    "line": Cause(LINE, ("line_resonance",), 30, 80),
    "warming up": Cause(WARM_UP, ("viscosity_drift",), 0.05, 0.12),
    "flow meter of second order": Cause(METER, LAGS, 20, 60),
    "ripple with an overtone": Cause(RIPPLE, ("periodic_disturbance",), 0.3, 1.0, (15, 70)),
    "zero of the flow meter": Cause(ZERO, ("sensor_offset",), 0.3, 1.0),
    "hunting supply": Cause(HUNTING, (), 0.03, 0.1),
    "slip of the flow meter": Cause(SLIP, (), 0.5, 2.0),
    "spool sensor of second order": Cause(TRANSDUCER, ("sensor_lag", "delay"), 50, 120),
    "hum": Cause(HUM, ("periodic_disturbance",), 0.05, 0.2, (20, 90)),
    "thermal drift": Cause(THERMAL, ("sensor_drift",), 0.1, 0.3),
    "square spool sensor": Cause(SQUARE, ("sensor_curvature",), 0.05, 0.2),
    "algebraic slew limit": Cause(ALGEBRAIC_SLEW, ("slew_limit",), 100, 250),
    "transducer in the loop that flattens": Cause(TANH, ("feedback_curvature",), 12, 25),
    "round port": Cause(ROUND_PORT, ("gain_curvature",), 1.1, 1.5),
    "overlap that leaks": Cause(LEAKY_LAP, ("overlap", "gain_curvature"), 0.2, 0.6),
    "pump that droops with the square of the flow": Cause(PUMP, ("supply_droop",), 0.1, 0.3),
    "late spool sensor": Cause(SAMPLED, ("sensor_lag", "delay"), 0.002, 0.006),
    "coil": Cause(COIL, ("command_lag",), 0.001, 0.004),
    "filter of the amplifier": Cause(FILTER, ("command_lag",), 40, 150),
    "dead band of the amplifier": Cause(DEAD_COMMAND, ("dead_band",), 0.1, 0.5),
    "mass on oil": Cause(MASS, ("spool_resonance",), 100, 200, (0.3, 0.7)),
    "mass on oil behind the lag": Cause(LAGGING_MASS, ("spool_resonance",), 120, 250, (0.3, 0.7)),
}
# What the catalogue has another name for, where nothing tells the two apart.
ALIKE = [{"null_bias", "sensor_offset"}, {"flow_force", "dc_gain"}, {"asymmetric_gain", "null_bias"}]
COMMANDS = ["chirp", "multisine", "steps", "triangle", "noise", "mixed"]


def command(kind, rows, per_second, random, reach):
    t = np.arange(rows) / per_second
    seconds = rows / per_second
    if kind == "chirp":
        end = random.uniform(12, 30)
        phase = 2 * np.pi * (0.2 * t + (end - 0.2) * t * t / (2 * seconds))
        return reach * np.sin(phase) * (1 - 0.6 * t / seconds)
    if kind == "multisine":
        lines = np.geomspace(0.3, random.uniform(15, 30), 14)
        total = sum(np.sin(2 * np.pi * f * t + random.uniform(0, 6.28)) / np.sqrt(f) for f in lines)
        return reach * total / np.abs(total).max()
    if kind == "steps":
        u, k = np.zeros(rows), int(0.2 * per_second)
        while k < rows:
            length = int(random.uniform(0.06, 0.35) * per_second)
            u[k : k + length] = random.choice([-1, 1]) * reach * random.choice([0.1, 0.25, 0.5, 0.75, 1.0])
            k += length
        return u
    if kind == "triangle":
        u = np.zeros(rows)
        for begin, end in ((0, 0.35), (0.35, 0.7), (0.7, 1.0)):
            part = (t >= begin * seconds) & (t < end * seconds)
            turns = (t[part] - begin * seconds) * random.uniform(0.5, 6)
            u[part] = reach * random.uniform(0.2, 1.0) * (1 - 4 * np.abs((turns + 0.25) % 1 - 0.5))
        return u
    if kind == "noise":
        white, y = random.normal(size=rows), np.empty(rows)
        keep = np.exp(-2 * np.pi * random.uniform(4, 12) / per_second)
        a = b = 0.0
        for k in range(rows):
            a = keep * a + (1 - keep) * white[k]
            b = keep * b + (1 - keep) * a
            y[k] = b
        return reach * y / np.abs(y).max()
    half = rows // 2
    parts = [command("multisine", half, per_second, random, reach), command("steps", rows - half, per_second, random, reach)]
    return np.concatenate(parts)


def right_names(cause):
    """The names that are right, and those that nothing tells from them."""
    right = set(cause.names)
    for pair in ALIKE:
        right |= pair if pair & right else set()
    return right


def true_place(cause):
    """Where it acts, of the three places that cuts at the measured spool tell apart."""
    if TRANSDUCER <= cause.code <= SAMPLED:
        return "spool_sensor"
    return "behind_spool" if LAPPED <= cause.code <= PUMP else "before_spool"


def write_records(folder, name, seed, both=False, straight=False):
    """The record to fit and the one to hold out, and a text with what they are made of; `both`: of both channels; `straight`: the
    command is not held."""
    cause = CAUSES[name]
    random = np.random.default_rng([seed, list(CAUSES).index(name)])
    per_second = int(random.choice([500, 1000, 1000, 2000]))
    gain, lag = random.uniform(100, 300), random.uniform(0.0015, 0.005)
    saturation = random.choice([1e9, random.uniform(3, 8)])
    if gain * lag > 1.2:
        lag = 1 / gain
    flow_gain, noise = random.uniform(2, 8), random.uniform(0.02, 0.04)
    strength = random.uniform(cause.low, cause.high)
    if cause.code in (WARM_UP, THERMAL):
        strength *= random.choice([-1, 1])
    p = np.array([strength, random.uniform(*cause.second)])
    kinds = [random.choice(COMMANDS), random.choice(COMMANDS)]
    if set(kinds) <= {"steps", "triangle"}:
        kinds[1] = "multisine"
    choices = ["spool", "flow", "both", "both", "both"]
    if LAPPED <= cause.code <= SLIP:
        choices.remove("spool")
    if cause.code >= TRANSDUCER:
        choices.remove("flow")
    channels = random.choice(choices)
    if both:
        channels = "both"
    paths = []
    for part, kind, seconds in (("fit", kinds[0], 6), ("hold", kinds[1], 4)):
        rows = seconds * per_second
        u = command(kind, rows, per_second, random, random.uniform(7, 9.5))
        u[: int(0.3 * per_second)] = 0
        every = int(round(1 / STEP / per_second))
        spool, flow = simulated(u, gain, lag, saturation, flow_gain, cause.code, p, every, straight)
        columns = {"time [s]": np.arange(rows) / per_second, "command [V]": u}
        if channels != "flow":
            columns["spool [V]"] = spool + noise * random.normal(size=rows)
        if channels != "spool":
            columns["flow [L/min]"] = flow + noise * flow_gain * random.normal(size=rows)
        paths.append(os.path.join(folder, f"{name.replace(' ', '_').replace(',', '')}_{seed}_{part}.csv"))
        with open(paths[-1], "w", newline="") as file:
            lines = csv.writer(file)
            lines.writerow(columns)
            lines.writerows([f"{value:.6g}" for value in row] for row in zip(*columns.values()))
    return paths, f"{channels}, {kinds[0]} / {kinds[1]}, {per_second} Hz"


def judged(report, cause):
    """right, partly, unexplained, missed or wrong; and the names as the report has them."""
    named, outcomes = [], []
    right = right_names(cause)
    for effect in report["effects"]:
        plain = {one.split("~")[0].split(".")[0] for one in [effect["name"], *effect["tied_with"]]}
        named.append(" or ".join([effect["name"], *effect["tied_with"]]))
        outcomes.append(bool(plain & right))
    text = ", ".join(named)
    verdict = report["verdict"]
    if not outcomes:
        expected = "none" if cause.code == 0 else "unexplained"
        alike = verdict == expected and not right
        return ("right" if alike else {"none": "missed"}.get(verdict, verdict)), text
    if not any(outcomes):
        return f"wrong ({verdict})", text
    extra = "" if all(outcomes) else ", and more"
    return ("right" if verdict == "found" else verdict) + extra, text


def main():
    parse = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parse.add_argument("--program", default="target/release/servobee")
    parse.add_argument("--seeds", default="1")
    parse.add_argument("--only", default=";".join(CAUSES), help="names, separated by semicolons")
    parse.add_argument("--threads", type=int, default=2)
    parse.add_argument("--straight", action="store_true", help="commands that go straight from row to row, where they are held otherwise")
    parse.add_argument("--keep", help="a folder for the records")
    instead = parse.add_mutually_exclusive_group()
    instead.add_argument("--left-out", action="store_true", help="look for no effect that is a right name")
    instead.add_argument("--places", action="store_true", help="look for no effect, only for the place")
    asked = parse.parse_args()
    cut = asked.left_out or asked.places
    program = os.path.abspath(asked.program)
    listed = json.loads(subprocess.run([program, "effects", "--json"], capture_output=True, text=True, check=True).stdout)
    # What shows in the pressure line alone cannot be asked for.
    catalogue = [effect["name"] for effect in listed if effect["name"] != "leakage"]
    tasks = [(name, int(seed)) for seed in asked.seeds.split(",") for name in asked.only.split(";")]

    def run(folder, name, seed):
        cause = CAUSES[name]
        (fit, hold), about = write_records(folder, name, seed, cut, asked.straight)
        began = time.monotonic()
        call = [program, "identify", fit, "--hold-out", hold, "--evaluator", "cpu", "--json", "--quiet"]
        if asked.left_out:
            others = [one for one in catalogue if one.split("~")[0].split(".")[0] not in right_names(cause)]
            call += ["--effects", ",".join(others)]
            cause = replace(cause, names=())
        elif asked.places:
            call += ["--effects", "none"]
        ran = subprocess.run(call, capture_output=True, text=True, env={**os.environ, "RAYON_NUM_THREADS": "1"})
        seconds = time.monotonic() - began
        if ran.returncode:
            return name, seed, about, f"exit {ran.returncode}", ran.stderr.strip()[-200:], "", seconds
        report = json.loads(ran.stdout)
        outcome, named = judged(report, cause)
        errors = [effect["error_before"] for effect in report["effects"][:1]]
        errors += [effect["error_after"] for effect in report["effects"][-1:]]
        place = (report.get("located") or {}).get("place", "")
        if cut:
            true = true_place(cause) if cause.code else ""
            told = "right" if place == true else "wrong" if place else "none"
            places[told] += 1
            place += " (wrong)" if told == "wrong" else ""
        ratio = " -> ".join(f"{error:.2f}" for error in errors)
        where = "; ".join(filter(None, [named, place])) if cut else named or place
        return name, seed, about, outcome, where, ratio, seconds

    keep = asked.keep or tempfile.mkdtemp()
    os.makedirs(keep, exist_ok=True)
    print("| planted | seed | record | outcome | named, or where | error | s |\n|---|---|---|---|---|---|---|")
    counts, places = Counter(), Counter()
    with ThreadPoolExecutor(asked.threads) as pool:
        for name, seed, about, outcome, named, ratio, seconds in pool.map(lambda task: run(keep, *task), tasks):
            print(f"| {name} | {seed} | {about} | {outcome} | {named} | {ratio} | {seconds:.0f} |", flush=True)
            counts[outcome] += 1
    print("\n" + ", ".join(f"{count} {outcome}" for outcome, count in counts.most_common()))
    if places:
        print("place: " + ", ".join(f"{count} {which}" for which, count in places.most_common()))


if __name__ == "__main__":
    main()
