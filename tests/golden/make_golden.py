"""Reference solutions for servobee's physics, made without servobee.

The product's CPU and GPU paths read one physics source, so their agreement says nothing about the physics.
The numbers here come from a second implementation, written from the equations alone:

    actuator   z' = K sat(u - x, +-S)      x' = (z - x) / T
    orifice    q  = Cd A sqrt(2/rho) p / (p^2 + pcr^2)^(1/4)
    valve      opening h = x0 + x for P-A and B-T, h = x0 - x for P-B and A-T

Run, from the repository root:

    python3 -m venv golden-venv
    golden-venv/bin/pip install -r tests/golden/requirements.txt
    golden-venv/bin/python tests/golden/make_golden.py

Made on 2026-11-21 with Python 3.11.7, numpy 2.4.6, scipy 1.17.1. It writes the CSV files beside itself, takes about
a minute, draws no system randomness and stops with an error where two methods disagree by more than ERROR_LIMIT.

Every CSV starts with `#` lines: what it is, the parameters as key=value, and the error estimate. Then one header line.

Two methods, always
-------------------
Actuator, exact (the values written). Inside one region of the saturation the actuator is linear, so it is solved in
closed form, and the instants at which u - x crosses +-S are found by root finding:

    linear, |u - x| <= S      T x'' + x' + K x = K u:   x = xp + c1 exp(s1 t) + c2 exp(s2 t),  T s^2 + s + K = 0
                              u = a + b t:              xp = a + b t - b/K,   zp = xp + b T
                              u = Im(C exp(i w t)):     Xp = K C / (K - T w^2 + i w),   Zp = (1 + i w T) Xp
    saturated, u - x > S      z = z0 + K S t,           x = z0 + K S (t - T) + (x0 - z0 + K S T) exp(-t/T)
    saturated, u - x < -S     the same with -S for S

Actuator, integrated (the check). scipy's DOP853, rtol 1e-12, atol 1e-14, restarted at every time stamp and, by terminal
events, at every crossing of +-S. `error` in the comment lines is max |exact - integrated| / max |exact|.
A third run knows nothing of regions: Radau (rtol 1e-11, atol 1e-13) on the right-hand side with a plain clip, restarted
at the time stamps only, its steps limited to 1 ms. It is `error_radau_clip`, looser because it steps over the kinks.

Static flows are computed with 50 decimal digits and compared with binary doubles.

Closed form in saturation (kinks.csv)
-------------------------------------
At rest, command stepped to U > S at t = 0. Until u - x falls to S:
    z = K S t          x = K S (t - T (1 - exp(-t/T)))
The saturation is left at t_kink, where x = U - S:
    t_kink = T (c + W0(-exp(-c))),   c = 1 + (U - S) / (K S T)      (W0: the principal branch of Lambert's W)
    x_kink = U - S,   z_kink = K S t_kink,   x'_kink = (z_kink - x_kink) / T
From then on, with r = t - t_kink, d = 1/(2 T), w = sqrt(K/T - d^2), for 4 K T > 1 and while |u - x| <= S:
    x = U - exp(-d r) (S cos(w r) + ((d S - x'_kink) / w) sin(w r))

Samples and time
----------------
A row holds the command and the state AT the row's time. `input=held`: the row's command acts from its time to the next
row's. `input=interpolated`: the command runs straight to the next row's. `start=rest`: z = x = 0 at the first row,
whatever its command. `start=equilibrium`: z = x = first command.
"""

import math
from decimal import Decimal, getcontext
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import lambertw

HERE = Path(__file__).resolve().parent
ERROR_LIMIT = 1e-9
PAPER = (253.7128, 0.0211, 12.4498)
DEFAULTS_10 = (377.0, 0.002, 3.0)  # block defaults, S = 0.3 of a full scale of 10
ORIGIN = (200.0, 0.01, 5.0)

getcontext().prec = 50


# ---------------------------------------------------------------- writing

def write(name, comments, header, rows):
    lines = [f"# {c}" for c in comments] + [",".join(header)]
    for row in rows:
        lines.append(",".join(v if isinstance(v, str) else f"{float(v):.12g}" for v in row))
    (HERE / name).write_text("\n".join(lines) + "\n")
    print(f"{name}: {len(rows)} rows; {comments[-1]}", flush=True)


def printed(values, digits):
    """Values as they will be read back from the CSV: what is solved is what is written."""
    return np.array([float(f"{round(float(v), digits):.12g}") for v in values])


def error_text(error, between):
    assert error < ERROR_LIMIT, (error, between)
    return f"error={error:.1e} relative_to=max {between}"


# ---------------------------------------------------------------- inputs over one segment, local time

class Line:
    def __init__(self, a, b):
        self.a, self.b, self.rate = a, b, 0.0

    def u(self, t):
        return self.a + self.b * t

    def du(self, t):
        return self.b + 0.0 * t

    def particular(self, K, T):
        a, b = self.a, self.b
        return (lambda t: a + b * t - b / K), (lambda t: a + b * t - b / K + b * T)

    def later(self, t):
        return Line(self.a + self.b * t, self.b)


class Sine:
    def __init__(self, amplitude, w, phase):
        self.amplitude, self.w, self.phase, self.rate = amplitude, w, phase, w

    def u(self, t):
        return self.amplitude * np.sin(self.w * t + self.phase)

    def du(self, t):
        return self.amplitude * self.w * np.cos(self.w * t + self.phase)

    def particular(self, K, T):
        w = self.w
        X = K * self.amplitude * np.exp(1j * self.phase) / (K - T * w * w + 1j * w)
        Z = X * (1 + 1j * w * T)
        return (lambda t: np.imag(X * np.exp(1j * w * t))), (lambda t: np.imag(Z * np.exp(1j * w * t)))

    def later(self, t):
        return Sine(self.amplitude, self.w, self.phase + self.w * t)


# ---------------------------------------------------------------- method 1: closed form region by region

class Piece:
    """The actuator inside one region of the saturation, from (z0, x0) at local time 0."""

    def __init__(self, par, region, z0, x0, inp):
        K, T, S = par
        self.par, self.region, self.inp = par, region, inp
        if region == 0:
            root = np.sqrt(complex(1 - 4 * K * T))
            s1, s2 = (-1 + root) / (2 * T), (-1 - root) / (2 * T)
            xp, zp = inp.particular(K, T)
            dx, dz = x0 - xp(0.0), z0 - zp(0.0)
            c1 = ((dz - dx) / T - s2 * dx) / (s1 - s2)
            c2 = dx - c1
            self.x = lambda t: xp(t) + np.real(c1 * np.exp(s1 * t) + c2 * np.exp(s2 * t))
            self.z = lambda t: zp(t) + np.real(c1 * (1 + T * s1) * np.exp(s1 * t) + c2 * (1 + T * s2) * np.exp(s2 * t))
        else:
            ks = region * K * S
            self.z = lambda t: z0 + ks * t
            # expm1 keeps the digits where t << T
            self.x = lambda t: x0 + ks * t - (x0 - z0 + ks * T) * (-np.expm1(-t / T))

    def e(self, t):
        return self.inp.u(t) - self.x(t)

    def de(self, t):
        return self.inp.du(t) - (self.z(t) - self.x(t)) / self.par[1]


def region_of(e, S):
    return 1 if e > S else -1 if e < -S else 0


def exits(region):
    """(sign of e, sign of S, next region): the region is left when sign_e * e + sign_s * S becomes positive."""
    return {0: [(1, -1, 1), (-1, -1, -1)], 1: [(-1, 1, 0)], -1: [(1, 1, 0)]}[region]


ROOT = dict(xtol=1e-17, rtol=8.9e-16, maxiter=300)


def first_exit(piece, h):
    """Earliest time in (0, h] at which the piece leaves its region, and the region after; None if it stays."""
    K, T, S = piece.par
    scale = min(T, math.sqrt(T / K), 1 / piece.inp.rate if piece.inp.rate else math.inf)
    n = max(2, math.ceil(h / (scale / 10)))
    t = np.linspace(0.0, h, n + 1)
    e, de = piece.e(t), piece.de(t)
    best = None
    for se, ss, after in exits(piece.region):
        g, dg = se * e + ss * S, se * de
        f = lambda s: se * piece.e(s) + ss * S
        df = lambda s: se * piece.de(s)
        candidates = np.nonzero((g[1:] > 0) | ((dg[:-1] > 0) & (dg[1:] < 0)))[0]
        for k in candidates:
            lo, hi = t[k], t[k + 1]
            if g[k + 1] <= 0:  # a maximum inside the step
                hi = brentq(df, lo, hi, **ROOT)
                if f(hi) <= 0:
                    continue
            if f(lo) > 0:  # just after a crossing, a rounding error outside: look from the minimum
                assert k == 0 and f(lo) < 1e-9, (k, f(lo))
                if df(lo) >= 0:  # not going back inside at all
                    lo = hi = 0.0
                else:
                    lo = brentq(df, lo, hi, **ROOT)
                    if f(lo) > 0:
                        lo = hi = 0.0
            root = brentq(f, lo, hi, **ROOT) if hi > lo else 0.0
            if best is None or root < best[0]:
                best = (root, after)
            break
    return best


def exact_segment(par, state, inp, h, pieces=None, t0=0.0):
    z, x = state
    region = region_of(inp.u(0.0) - x, par[2])
    done, guard = 0.0, 0
    while True:
        piece = Piece(par, region, z, x, inp)
        left = h - done
        out = first_exit(piece, left) if left > 0 else None
        step = left if out is None else out[0]
        if pieces is not None and step > 0:
            pieces.append((t0 + done, step, piece))
        z, x = float(piece.z(step)), float(piece.x(step))
        if out is None:
            return (z, x)
        guard = guard + 1 if step == 0 else 0
        assert guard < 3, "chattering"
        done += step
        inp = inp.later(step)
        region = out[1]


# ---------------------------------------------------------------- method 2: DOP853 with events

def dop_segment(par, state, inp, h, extra=None):
    """`state` = (z, x, further...); `extra(t, z, x)` gives the derivatives of the further states."""
    K, T, S = par
    y = np.array(state, dtype=float)
    region = region_of(inp.u(0.0) - y[1], S)
    t = 0.0
    max_step = min(h, T, 0.3 / inp.rate if inp.rate else math.inf)
    while t < h:
        def rhs(s, y):
            e = inp.u(s) - y[1]
            dz = K * e if region == 0 else K * S * region
            d = [dz, (y[0] - y[1]) / T]
            return d if extra is None else d + list(extra(s, y[0], y[1]))
        events = []
        for se, ss, _ in exits(region):
            def event(s, y, se=se, ss=ss):
                return se * (inp.u(s) - y[1]) + ss * S
            event.terminal, event.direction = True, 1
            events.append(event)
        sol = solve_ivp(rhs, (t, h), y, method="DOP853", rtol=1e-12, atol=1e-14, events=events, max_step=max_step)
        assert sol.status >= 0, sol.message
        t, y = float(sol.t[-1]), sol.y[:, -1]
        if sol.status == 1:
            fired = [i for i, te in enumerate(sol.t_events) if len(te)]
            region = exits(region)[fired[0]][2]
    return tuple(y)


# ---------------------------------------------------------------- method 3: Radau on the clipped right-hand side

def radau_segment(par, state, inp, h):
    K, T, S = par

    def rhs(s, y):
        return [K * min(max(inp.u(s) - y[1], -S), S), (y[0] - y[1]) / T]

    sol = solve_ivp(rhs, (0.0, h), state, method="Radau", rtol=1e-11, atol=1e-13, max_step=1e-3)
    assert sol.success, sol.message
    return tuple(sol.y[:, -1])


# ---------------------------------------------------------------- 1. actuator records

def inputs(t, u, held):
    return [Line(u[i], 0.0 if held else (u[i + 1] - u[i]) / (t[i + 1] - t[i])) for i in range(len(t) - 1)]


def solve_record(par, t, u, held, start, segment, pieces=None):
    state = (0.0, 0.0) if start == "rest" else (u[0], u[0])
    xs = [state[1]]
    for i, inp in enumerate(inputs(t, u, held)):
        if pieces is None:
            state = segment(par, state, inp, t[i + 1] - t[i])
        else:
            state = segment(par, state, inp, t[i + 1] - t[i], pieces, t[i])
        xs.append(state[1])
    return np.array(xs)


class Draw:
    """A small linear congruential generator, so that the records depend on no library's random numbers."""

    def __init__(self, seed):
        self.s = seed

    def below(self, n):
        self.s = (self.s * 6364136223846793005 + 1442695040888963407) % 2**64
        return (self.s >> 33) % n


def keys(par):
    return f"K={par[0]:.12g} T={par[1]:.12g} S={par[2]:.12g}"


def actuator_file(name, what, par, t, u, held, start, closed=None):
    pieces = []
    x = solve_record(par, t, u, held, start, exact_segment, pieces)
    check = solve_record(par, t, u, held, start, dop_segment)
    top = np.max(np.abs(x))
    error = np.max(np.abs(x - check)) / top
    radau = np.max(np.abs(x - solve_record(par, t, u, held, start, radau_segment))) / top
    assert radau < 1e-7, radau
    kinks = sum(1 for a, b in zip(pieces, pieces[1:]) if a[2].region != b[2].region)
    saturated = sum(h for _, h, p in pieces if p.region) / (t[-1] - t[0])
    comments = [
        what,
        f"{keys(par)} input={'held' if held else 'interpolated'} start={start}",
        f"saturation_changes={kinks} saturated_share={saturated:.4g}",
        f"error_radau_clip={radau:.1e}",
    ]
    if closed is not None:
        other = np.max(np.abs(x - closed(t))) / top
        comments.append(f"error_against_second_order_closed_form={other:.1e}")
        assert other < 1e-12
    print(f"  without events: {radau:.1e}")
    comments.append(error_text(error, "between the closed form by regions and DOP853"))
    write(name, comments, ["time [s]", "command [V]", "spool [V]"], list(zip(t, u, x)))


def make_actuator():
    huge = 1e6
    K, T = PAPER[:2]
    wn, xi = math.sqrt(K / T), 0.5 / math.sqrt(K * T)
    wd = wn * math.sqrt(1 - xi * xi)

    def under(t):
        return 0.5 * (1 - np.exp(-xi * wn * t) * (np.cos(wd * t) + xi / math.sqrt(1 - xi * xi) * np.sin(wd * t)))

    t = printed(np.arange(401) * 0.001, 6)
    actuator_file("actuator_linear.csv", "Step of 0.5 V from rest, saturation out of reach: the linear limit.",
                  (K, T, huge), t, np.full(401, 0.5), True, "rest", under)

    K2, T2 = 20.0, 0.005
    root = math.sqrt(1 - 4 * K2 * T2)
    a, b = (1 - root) / (2 * T2), (1 + root) / (2 * T2)
    actuator_file("actuator_linear_overdamped.csv", "Step of 1 V from rest, K T < 1/4: two real poles.",
                  (K2, T2, huge), t[:301], np.full(301, 1.0), True, "rest",
                  lambda t: 1 - (b * np.exp(-a * t) - a * np.exp(-b * t)) / (b - a))

    t = printed(np.arange(801) * 0.001, 6)
    u = np.select([t < 0.01, t < 0.3, t < 0.55], [0.0, 10.0, -10.0], 10.0)
    actuator_file("actuator_step_paper.csv", "Steps 0, 10, -10, 10 V with the paper's parameters. A step of 10 V from "
                  "rest stays inside S; the reversals of 20 V saturate.", PAPER, t, u, True, "rest")

    t = printed(np.arange(501) * 0.002, 6)
    u = np.select([t < 0.01, t < 0.25, t < 0.65], [0.0, 10.0, -10.0], 0.0)
    actuator_file("actuator_step_saturated.csv", "Steps 0, 10, -10, 0 V with the block defaults, S = 0.3 in volts: "
                  "slews almost all the time.", (377.0, 0.002, 0.3), t, u, True, "rest")

    draw, u = Draw(1), []
    while len(u) < 2001:
        u += [(draw.below(9) - 4) * 2.5] * (1 + draw.below(40))
    u = np.array(u[:2001])
    assert u[0] != 0
    t = printed(np.arange(2001) * 0.001, 6)
    actuator_file("actuator_random_held.csv", "Random levels held for random times, 1 kHz, out of equilibrium at the "
                  "first row.", (PAPER[0], PAPER[1], 5.0), t, u, True, "rest")

    t = printed(np.arange(601) * 0.002, 6)
    u = printed(np.interp(t, [0, 0.2, 0.3, 0.5, 0.54, 0.58, 0.62, 0.9, 1.2], [-4, 8, -8, 8, -8, 8, -8, -8, 3]), 6)
    actuator_file("actuator_triangle.csv", "Triangles of several slopes, interpolated, from equilibrium at -4 V.",
                  (ORIGIN[0], ORIGIN[1], 1.5), t, u, False, "equilibrium")

    t = printed(np.arange(1001) * 0.001, 6)
    u = printed(9 * np.sin(2 * math.pi * (0.5 * t + 0.5 * 34.5 * t * t)), 4)
    actuator_file("actuator_chirp.csv", "Chirp 0.5 to 35 Hz, 9 V, interpolated between 1 kHz samples.",
                  PAPER, t, u, False, "rest")

    draw, times, u, now, level = Draw(7), [], [], 0.0, 6.0
    for i in range(400):
        times.append(now)
        u.append(level)
        now += 0.06 if i % 97 == 96 else 0.0002 + draw.below(6801) * 1e-6
        if draw.below(6) == 0:
            level = (draw.below(2001) - 1000) / 100.0
        elif draw.below(3) == 0:
            level = min(10.0, max(-10.0, level + (draw.below(201) - 100) / 100.0))
    t, u = printed(times, 6), printed(u, 4)
    for held in (True, False):
        actuator_file(f"actuator_uneven_{'held' if held else 'interpolated'}.csv",
                      "Uneven time stamps, 0.2 to 7 ms with gaps of 60 ms, first command 6 V.",
                      ORIGIN, t, u, held, "rest" if held else "equilibrium")

    t = printed(np.arange(301) * 0.001, 6)
    actuator_file("actuator_step_origin.csv", "Step of 10 V from rest with the starting values of the method's authors.",
                  ORIGIN, t, np.full(301, 10.0), True, "rest")


# ---------------------------------------------------------------- 6. kinks in closed form

def make_kinks():
    rows, notes, error = [], [], 0.0
    for case, (par, U, end) in enumerate([(PAPER, 20.0, 0.08), ((377.0, 0.002, 0.3), 10.0, 0.12), (ORIGIN, 10.0, 0.05)]):
        K, T, S = par
        c = 1 + (U - S) / (K * S * T)
        t_kink = T * (c + float(np.real(lambertw(-math.exp(-c)))))
        x_kink, z_kink = U - S, K * S * t_kink
        v = (z_kink - x_kink) / T
        d = 1 / (2 * T)
        w = math.sqrt(K / T - d * d)
        notes.append(f"case={case} {keys(par)} step={U:.12g} t_kink={t_kink:.12g} x_kink={x_kink:.12g} "
                     f"z_kink={z_kink:.12g} input=held start=rest")
        t = printed(np.linspace(0, end, 61), 9)
        state, last, worst, top = (0.0, 0.0), 0.0, 0.0, 0.0
        for now in t:
            if now <= t_kink:
                x, z, region = K * S * (now - T * -math.expm1(-now / T)), K * S * now, "saturated"
            else:
                r = now - t_kink
                b = (d * S - v) / w
                f = math.exp(-d * r)
                x = U - f * (S * math.cos(w * r) + b * math.sin(w * r))
                dx = f * (d * (S * math.cos(w * r) + b * math.sin(w * r)) + w * (S * math.sin(w * r) - b * math.cos(w * r)))
                z, region = x + T * dx, "linear"
                assert abs(U - x) <= S, (case, now)
            if now > last:
                state, last = dop_segment(par, state, Line(U, 0.0), now - last), now
            worst, top = max(worst, abs(x - state[1]), abs(z - state[0])), max(top, abs(x), abs(z))
            rows.append((str(case), now, U, x, z, region))
        error = max(error, worst / top)
    write("kinks.csv", ["Step from rest to U > S: the saturation and the way out of it in closed form "
                        "(formulas in make_golden.py).", *notes,
                        error_text(error, "between the closed form and DOP853")],
          ["case", "time [s]", "command [V]", "spool [V]", "z [V]", "region"], rows)


# ---------------------------------------------------------------- 2. orifice, in 50 digits

D = Decimal
PI = D("3.14159265358979323846264338327950288419716939937510582097494459")
CD, RHO, NU, RE_CR, B_LAM, P_ATM, A_LEAK = (D("0.7"), D(850), D("18e-6"), D(12), D("0.999"), D(101325), D("1e-12"))
BAR, LPM, CM2 = D(100000), D(60000), D("1e-4")


def dec(v):
    return v if isinstance(v, D) else D(f"{float(v):.12g}")


def pcr_of(form, area, p_average):
    if form == "ratio":
        return (p_average + P_ATM) * (1 - B_LAM)
    diameter = (4 * area / PI).sqrt()
    return RHO / 2 * (RE_CR * NU / (CD * diameter)) ** 2


def orifice(form, area, p_up, p_down):
    p = p_up - p_down
    pcr = pcr_of(form, area, (p_up + p_down) / 2)
    return CD * area * (2 / RHO).sqrt() * p / (p * p + pcr * pcr).sqrt().sqrt()


def orifice_double(form, area, p_up, p_down):
    p_up, p_down = float(p_up), float(p_down)
    return orifice_double_drop(form, float(area), p_up - p_down, (p_up + p_down) / 2)


def orifice_double_drop(form, area, p, average):
    if form == "ratio":
        pcr = (average + 101325.0) * (1 - 0.999)
    else:
        pcr = 425.0 * (12 * 18e-6 / (0.7 * math.sqrt(4 * area / math.pi))) ** 2
    return 0.7 * area * math.sqrt(2 / 850.0) * p / (p * p + pcr * pcr) ** 0.25


FLUID = "Cd=0.7 rho=850 nu_cSt=18 Re_cr=12 B_lam=0.999 p_atm_Pa=101325 A_leak_m2=1e-12"


def make_orifice():
    side = [10.0**k for k in range(-6, 0)] + [0.003, 0.03, 0.2, 0.5, 1, 2, 5, 10, 35, 70, 140, 210, 280, 350]
    drops = sorted([-p for p in side] + [0.0] + side)
    rows, worst, limit = [], 0.0, D(0)
    cases = [("ratio", a, p) for a in ("1e-8", "7.598") for p in (0, 5, 175)]
    cases += [("reynolds", a, 0) for a in ("1e-8", "0.001", "1", "7.598")]
    for form, area, average in cases:
        a, m = D(area) * CM2, D(average) * BAR
        pcr = pcr_of(form, a, m)
        for drop in drops:
            p = dec(drop) * BAR
            q = orifice(form, a, m + p / 2, m - p / 2)
            other = orifice_double_drop(form, float(a), float(p), float(m))
            if q:
                worst = max(worst, abs(other / float(q) - 1))
            sharp = CD * a * (2 * abs(p) / RHO).sqrt() * (1 if p >= 0 else -1)
            if abs(p) >= 10 * pcr:
                limit = max(limit, abs(1 - q / sharp) / (pcr / p) ** 2)
            rows.append((form, area, average, drop, pcr / BAR, q * LPM, sharp * LPM))
    write("orifice.csv", [
        "One orifice: flow against pressure drop, laminar transition by pressure ratio and by Reynolds number.",
        FLUID + " units=bar,L/min,cm2",
        "ratio: pcr = (average_pressure + p_atm)(1 - B_lam), average_pressure is GAUGE and held fixed over the sweep; "
        "(average column unused for reynolds).",
        "reynolds: pcr = (rho/2)(Re_cr nu/(Cd Dh))^2, Dh = sqrt(4 area/pi).",
        "limits: |p| >> pcr: flow = turbulent = Cd A sqrt(2|p|/rho) sign(p), relative deviation < 0.25 (pcr/p)^2, "
        f"largest seen for |p| >= 10 pcr: {float(limit):.4f} (pcr/p)^2; |p| << pcr: Cd A sqrt(2/rho) p/sqrt(pcr).",
        error_text(worst, "between 50 decimal digits and binary doubles (the doubles' error; written digits are exact)"),
    ], ["form", "area [cm2]", "average_pressure [bar]", "pressure_drop [bar]", "critical_pressure [bar]", "flow [L/min]",
        "turbulent_flow [L/min]"], rows)


# ---------------------------------------------------------------- 3. valve

D675 = [D(s) for s in "0 0 0 0.6983 1.1992 1.6193 2.1000 2.6000 3.0724 3.6808 4.2893 4.7984 5.2496 5.7222 6.0858 6.5140 "
        "6.8634 7.1390 7.4000 7.5980".split()]
A_MAX = D("7.598")


def area_of(kind, h, h_max):
    """Area in m2 at the opening h in %."""
    if kind == "linear":
        a = min(h, h_max) * A_MAX / h_max * CM2 if h > 0 else D(0)
    else:
        s = min(max(h / 100, D(0)), D(1)) * (len(D675) - 1)
        k = min(int(s), len(D675) - 2)
        a = (D675[k] + (s - k) * (D675[k + 1] - D675[k])) * CM2
    return max(a, A_LEAK)


def series(form, a1, a2, ps, pr):
    """Flow through two orifices in series and the pressure between them, by bisection in 50 digits."""
    lo, hi = min(ps, pr), max(ps, pr)
    f = lambda p: orifice(form, a1, ps, p) - orifice(form, a2, p, pr)  # falls with p
    for _ in range(175):
        mid = (lo + hi) / 2
        if f(mid) > 0:
            lo = mid
        else:
            hi = mid
    mid = (lo + hi) / 2
    assert abs(f(mid)) <= D("1e-30"), f(mid)
    return (orifice(form, a1, ps, mid) if a1 < a2 else orifice(form, a2, mid, pr)), mid


SPOOLS = [-100, -95, -80, -65, -50, -30, -20, -16, -13, -10, -5, -2, -1, 0,
          0.5, 2, 3, 7, 10, 13, 16, 20, 40, 65, 80, 90, 100]
RATED, HIGH, LOADED, OVER, UNDER = (10, 0, 5, 5), (210, 0, 105, 105), (210, 5, 180, 40), (210, 0, 230, 20), (50, 10, 5, 55)


def make_valve():
    combos = [("ratio", kind, 100, x0, RATED) for kind in ("linear", "table") for x0 in (0, 2, -2)]
    combos += [("ratio", "linear", 80, 0, HIGH), ("ratio", "table", 100, 2, HIGH)]
    for p in (LOADED, OVER, UNDER):
        combos += [("ratio", "linear", 100, 2, p), ("ratio", "table", 100, -2, p)]
    combos += [("reynolds", "linear", 100, -2, LOADED), ("reynolds", "table", 100, 2, UNDER)]
    header = ["form", "area", "h_max [%]", "x0 [%]", "supply_pressure [bar]", "return_pressure [bar]", "pressure_a [bar]",
              "pressure_b [bar]", "spool [%]", "q_pa [L/min]", "q_at [L/min]", "q_pb [L/min]", "q_bt [L/min]"]
    derived = ["port_a [L/min]", "port_b [L/min]", "load [L/min]", "supply [L/min]"]
    table = ("table: areas_cm2=" + ";".join(str(a) for a in D675) + " at equal openings 0..100 %, linear between, end values "
             "held, not less than A_leak (h_max unused)")
    shared = [
        FLUID + f" A_max_cm2={A_MAX} units=bar,L/min,cm2",
        "opening: h = x0 + x for P-A and B-T, h = x0 - x for P-B and A-T (in % of stroke)",
        "linear: A = max(min(h, h_max) A_max/h_max, A_leak) for h > 0, else A_leak",
        table,
        "pressures are gauge; the form ratio takes each orifice's own average pressure (p_up + p_down)/2",
        "flows: positive in the order of the name; port_a = q_pa - q_at, port_b = q_bt - q_pb, load = (port_a + port_b)/2",
    ]

    def flows(fn, form, kind, h_max, x0, p, x):
        ps, pr, pa, pb = (D(v) * BAR for v in p)
        plus, minus = (area_of(kind, D(x0) + s * D(str(x)), D(h_max)) for s in (1, -1))
        return [fn(form, plus, ps, pa), fn(form, minus, pa, pr), fn(form, minus, ps, pb), fn(form, plus, pb, pr)]

    rows, worst = [], 0.0
    for form, kind, h_max, x0, p in combos:
        for x in SPOOLS:
            q = flows(orifice, form, kind, h_max, x0, p, x)
            for a, b in zip(q, flows(orifice_double, form, kind, h_max, x0, p, x)):
                if a:
                    worst = max(worst, abs(b / float(a) - 1))
            pa, at, pb, bt = q
            out = [pa, at, pb, bt, pa - at, bt - pb, (pa - at + bt - pb) / 2, pa + pb]
            rows.append((form, kind, h_max, x0, *p, x, *(v * LPM for v in out)))
    between = "between 50 decimal digits and binary doubles, per orifice (the doubles' error; written digits are exact)"
    write("valve.csv", ["Four-way valve, four orifices: flows over the spool position.", *shared,
                        "supply = q_pa + q_pb", error_text(worst, between)], header + derived, rows)

    combos = [("ratio", kind, 100, x0, RATED) for kind in ("linear", "table") for x0 in (0, 2, -2)]
    combos += [("ratio", "linear", 100, 2, LOADED), ("ratio", "table", 100, 20, LOADED), ("reynolds", "linear", 100, 2, HIGH)]
    rows, worst = [], 0.0
    for form, kind, h_max, x0, p in combos:
        ps, pr = D(p[0]) * BAR, D(p[1]) * BAR
        for x in SPOOLS[::2]:
            pa, at, pb, bt = flows(orifice, form, kind, h_max, x0, p, x)
            a1 = area_of(kind, D(x0) - D(str(x)), D(h_max))
            a2 = area_of(kind, D(x0) + D(str(x)), D(h_max))
            pt, mid = series(form, a1, a2, ps, pr)
            # the check: the same series flow by brentq in doubles
            f = lambda s: orifice_double(form, a1, ps, s) - orifice_double(form, a2, s, pr)
            root = brentq(f, float(pr), float(ps), xtol=1e-14, rtol=8.9e-16)
            other = orifice_double(form, a1, ps, root) if a1 < a2 else orifice_double(form, a2, root, pr)
            worst = max(worst, abs(other / float(pt) - 1))
            out = [pa, at, pb, bt, pa - at, bt - pb, (pa - at + bt - pb) / 2, pa + pb + pt, pt]
            rows.append((form, kind, h_max, x0, *p, x, *(v * LPM for v in out), mid / BAR))
    write("valve_six.csv", ["Four-way valve, six orifices: P-T1 (opening x0 - x) and T1-T (opening x0 + x) in series.",
                            *shared, "supply = q_pa + q_pb + q_pt; q_pt is the flow through both, pressure_t1 between them",
                            error_text(worst, "of q_pt, between 50-digit bisection and brentq in doubles")],
          header + derived + ["q_pt [L/min]", "pressure_t1 [bar]"], rows)


# ---------------------------------------------------------------- 4. position

GAUSS_X, GAUSS_W = np.polynomial.legendre.leggauss(12)


def gauss(f, a, b):
    m, r = (a + b) / 2, (b - a) / 2
    return r * float(np.sum(GAUSS_W * f(m + r * GAUSS_X)))


def make_position():
    par, a_max, h_max, a_leak, piston = DEFAULTS_10, 1e-4, 8.0, 1e-12, 5e-3
    gain = 0.7 * math.sqrt(2 / 850.0)

    def unit(p_up, p_down):  # flow per area
        p, pcr = p_up - p_down, ((p_up + p_down) / 2 + 101325.0) * (1 - 0.999)
        return gain * p / math.sqrt(math.hypot(p, pcr))

    c_pa, c_at = unit(10e5, 5e5), unit(5e5, 0.0)  # P-B as P-A, B-T as A-T: pa = pb

    def load(x):
        plus = np.maximum(np.clip(x, 0, h_max) * a_max / h_max, a_leak)
        minus = np.maximum(np.clip(-x, 0, h_max) * a_max / h_max, a_leak)
        return (c_pa + c_at) / 2 * (plus - minus)

    t = printed(np.arange(501) * 0.002, 6)
    u = np.select([t < 0.02, t < 0.2, t < 0.3, t < 0.5, t < 0.7], [0.0, 5.0, 9.5, -3.0, -10.0], 1.5)
    u = printed(u + np.where(t >= 0.8, 2 * np.sin(2 * math.pi * 7 * (t - 0.8)), 0.0), 6)
    state, position, xs, ys = (0.0, 0.0), 0.0, [0.0], [0.0]
    check, cs = (0.0, 0.0, 0.0), [0.0]
    for i, inp in enumerate(inputs(t, u, True)):
        h, pieces = t[i + 1] - t[i], []
        state = exact_segment(par, state, inp, h, pieces)
        for _, length, piece in pieces:
            edges = list(np.linspace(0, length, max(2, math.ceil(length / 2e-4)) + 1))
            for level in (0.0, h_max, -h_max, a_leak * h_max / a_max, -a_leak * h_max / a_max):
                g = piece.x(np.array(edges)) - level
                for k in np.nonzero(g[:-1] * g[1:] < 0)[0]:
                    edges.append(brentq(lambda s: float(piece.x(s)) - level, edges[k], edges[k + 1], **ROOT))
                edges.sort()
            position += sum(gauss(lambda s: load(piece.x(s)), a, b) for a, b in zip(edges, edges[1:])) / piston
        check = dop_segment(par, check, inp, h, lambda s, z, x: (float(load(x)) / piston,))
        xs.append(state[1])
        ys.append(position)
        cs.append(check[2])
    xs, ys, cs = np.array(xs), np.array(ys), np.array(cs)
    error = np.max(np.abs(ys - cs)) / np.max(np.abs(ys))
    write("position.csv", [
        "Actuator, four-way valve at 5 bar per land (pressures fixed), piston: position = integral of load flow / area.",
        f"{keys(par)} input=held start=rest full_scale=10 A_max_cm2=1 h_max={h_max:.12g} piston_cm2=50 x0=0 form=ratio "
        "supply_pressure=10 return_pressure=0 pressure_a=5 pressure_b=5 area=linear",
        FLUID + " (h_max in volts of spool, 80 % of full scale; clamped beyond)",
        error_text(error, "of position, between Gauss quadrature over the closed form and DOP853"),
    ], ["time [s]", "command [V]", "spool [V]", "flow [L/min]", "position [mm]"],
        list(zip(t, u, xs, load(xs) * 6e4, ys * 1e3)))


# ---------------------------------------------------------------- 5. frequency response

FREQUENCIES = [1.0, 2.0, 5.0, 7.0, 10.0, 14.5, 20.0, 30.0, 40.0, 50.0, 57.0, 70.0]
RESPONSES = [(PAPER, 9.0), (PAPER, 4.0), (PAPER, 10.0), (PAPER, 90.0),
             (DEFAULTS_10, 9.0), (DEFAULTS_10, 4.0), (DEFAULTS_10, 10.0)]


def settle(par, amplitude, f):
    """Periodic state under a continuous sine, reached from rest; and the number of periods it took."""
    period, state = 1 / f, (0.0, 0.0)
    inp = Sine(amplitude, 2 * math.pi * f, 0.0)
    quiet = 0
    for n in range(1, 5001):
        new = exact_segment(par, state, inp, period)
        move = max(abs(a - b) for a, b in zip(new, state)) / amplitude
        state = new
        quiet = quiet + 1 if move < 1e-13 else 0
        if quiet == 3:
            return state, n
    raise RuntimeError(f"no periodic state: {par} {amplitude} {f}: still moving {move}")


def settled(par, amplitude, f, check=False):
    """Fundamental of x against the sine: complex gain; and with `check` its difference from DOP853 over one period."""
    w, period = 2 * math.pi * f, 1 / f
    state, periods = settle(par, amplitude, f)
    pieces, inp = [], Sine(amplitude, w, 0.0)
    exact_segment(par, state, inp, period, pieces)
    X = 0j
    for t0, length, piece in pieces:
        n = max(1, math.ceil(length / (min(par[1], math.sqrt(par[1] / par[0]), 1 / w) / 4)))
        for k in range(n):
            a, b = length * k / n, length * (k + 1) / n
            X += gauss(lambda s: piece.x(s) * np.cos(w * (t0 + s)), a, b)
            X -= 1j * gauss(lambda s: piece.x(s) * np.sin(w * (t0 + s)), a, b)
    # x ~ Im(G A exp(iwt)): the integral of x exp(-iwt) over a period is G A period / (2i)
    G = X * 2j / (amplitude * period)
    if not check:
        return G
    end = dop_segment(par, (*state, 0.0, 0.0), inp, period,
                      lambda s, z, x: (x * math.cos(w * s), -x * math.sin(w * s)))
    other = complex(end[2], end[3]) * 2j / (amplitude * period)
    drift = max(abs(end[0] - state[0]), abs(end[1] - state[1])) / amplitude
    share = sum(h for _, h, p in pieces if p.region) / period
    return G, max(abs(other / G - 1), drift / abs(G)), periods, share


def degrees(G):
    """Phase in (-360, 0]."""
    d = math.degrees(np.angle(G))
    return d - 360 if d > 1e-9 else d


def stream(par, amplitude, f, between, state, segment=exact_segment):
    """The paper's excitation at one frequency: 40 samples a period, 4 periods, the first discarded."""
    w, n = 2 * math.pi * f, 40
    dt = 1 / (f * n)
    u = [amplitude * math.sin(2 * math.pi * (k % n) / n) for k in range(4 * n + 1)]
    X = 0j
    for k in range(4 * n):
        if k >= n:
            X += state[1] * np.exp(-2j * math.pi * (k % n) / n)
        if between == "sine":
            inp = Sine(amplitude, w, 2 * math.pi * (k % n) / n)
        else:
            inp = Line(u[k], 0.0 if between == "held" else (u[k + 1] - u[k]) / dt)
        state = segment(par, state, inp, dt)
    return X * 2j / (amplitude * 3 * n), state


STREAM_KINDS = [(carry, between) for carry in ("rest", "carried") for between in ("held", "linear", "sine")]


def sweep(par, amplitude, frequencies, carry, between):
    state, out = (0.0, 0.0), []
    for f in frequencies:
        G, state = stream(par, amplitude, f, between, (0.0, 0.0) if carry == "rest" else state)
        out.append(G)
    return out


def crossing(par, amplitude, low, high):
    return brentq(lambda f: degrees(settled(par, amplitude, f)) + 90, low, high, xtol=1e-6)


def make_response():
    rows, error = [], 0.0
    for par, amplitude in RESPONSES:
        for f in FREQUENCIES:
            G, e, periods, share = settled(par, amplitude, f, True)
            error = max(error, e)
            rows.append((*par, amplitude, f, degrees(G), abs(G), 20 * math.log10(abs(G)), share, periods))
    f9, f90 = crossing(PAPER, 9.0, 12, 18), crossing(PAPER, 90.0, 4, 10)
    write("response.csv", [
        "Settled response of the actuator to a continuous sine, started from rest: fundamental of the spool by a Fourier "
        "integral over one period.",
        "input=sine start=rest; periods: how many until the state repeats to 1e-13 of the amplitude, three times running",
        f"paper_parameters_f_minus_90_at_amplitude_9={f9:.6g} paper_parameters_f_minus_90_at_amplitude_90={f90:.6g}",
        error_text(error, "of the complex gain, between Gauss quadrature over the closed form and DOP853; DOP853 also "
                   "returns to the state it started from"),
    ], ["K", "T", "S", "amplitude [V]", "frequency [Hz]", "phase [deg]", "gain", "gain [dB]", "saturated_share", "periods"],
        rows)


def make_stream():
    rows, error = [], 0.0
    for par, amplitude in RESPONSES:
        columns = [sweep(par, amplitude, FREQUENCIES, carry, between) for carry, between in STREAM_KINDS]
        for i, f in enumerate(FREQUENCIES):
            row = [*par, amplitude, f]
            for (carry, between), column in zip(STREAM_KINDS, columns):
                row += [degrees(column[i]), abs(column[i])]
                if carry == "rest" and amplitude == 9.0 and i % 2 == 1:
                    other, _ = stream(par, amplitude, f, between, (0.0, 0.0), dop_segment)
                    error = max(error, abs(other / column[i] - 1))
            rows.append(row)
    at = RESPONSES.index((PAPER, 9.0)), FREQUENCIES.index(14.5)
    row = rows[at[0] * len(FREQUENCIES) + at[1]]
    finer = degrees(sweep(PAPER, 9.0, [float(k) for k in range(1, 15)] + [14.5], "carried", "sine")[-1])
    write("response_stream.csv", [
        "The paper's sine stream: 40 samples a period, 4 periods a frequency, the first discarded, fundamental of samples "
        "40..159 (each the state at its time) against the commanded sine.",
        "rest: every frequency from z = x = 0. carried: the state is carried from the frequency in the row before, the "
        "first from rest; the sine starts at phase 0 each time. held, linear, sine: the command between samples.",
        f"at 14.5 Hz, amplitude 9, paper's parameters: phase_rest_sine={row[9]:.6g} phase_rest_linear={row[7]:.6g} "
        f"phase_rest_held={row[5]:.6g} phase_carried_sine={row[15]:.6g} "
        f"phase_carried_sine_on_grid_1_2_3_to_14_then_14.5={finer:.6g}",
        error_text(error, "of the complex gain, between the closed form by regions and DOP853 (from rest, amplitude 9, "
                   "every other frequency)"),
    ], ["K", "T", "S", "amplitude [V]", "frequency [Hz]"] + [
        f"{what}_{carry}_{between}{unit}" for carry, between in STREAM_KINDS
        for what, unit in (("phase", " [deg]"), ("gain", ""))], rows)


if __name__ == "__main__":
    make_orifice()
    make_valve()
    make_kinks()
    make_actuator()
    make_position()
    make_response()
    make_stream()
    total = sum(f.stat().st_size for f in HERE.iterdir() if f.is_file())
    print(f"{total} bytes")
    assert total < 400_000
