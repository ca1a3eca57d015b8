"""Stages of other physics than the model of the package, each by its own equations in numpy.

Twelve are those of `tests/law_stages.py`; the model of the package has some of these, such as plays
with a lag. Of those that are simulated here it has the late plays, Kuhnen's creep, the polymer, the
two modes and the bent creep, with time constants and thresholds of its own choice. All begin at
rest at a drive of 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import law_stages
import numpy as np
from law_stages import activated_cells
from records import Array
from scipy.signal import lfilter

FINE = 0.25  # V: the largest step of an equation of rates


class Stage(NamedTuple):
    """A stage over a range of drives, and its positions at drives every so many seconds."""

    name: str
    low: float
    high: float
    position: Callable[[Array, float], Array]


def fine_steps(u: Array) -> Iterator[tuple[float, float, int]]:
    """The drive before a step, a step, and how many of them lead to each sample."""
    last = float(u[0])
    for now in u.tolist():
        count = max(1, math.ceil(abs(now - last) / FINE))
        yield last, (now - last) / count, count
        last = now


def lag(x: Array, dt: float, tau: float) -> Array:
    """Behind a lag of first order, at rest at its first value, with each sample held."""
    keep = math.exp(-dt / tau)
    y, _ = lfilter([0.0, 1.0 - keep], [1.0, -keep], x, zi=[x[0]])
    return np.asarray(y)


def mode(x: Array, dt: float, frequency: float, damping: float) -> Array:
    """Behind a mode with a static gain of 1, with each sample held."""
    w = 2.0 * math.pi * frequency
    wd, decay = w * math.sqrt(1.0 - damping**2), math.exp(-damping * w * dt)
    c, s = decay * math.cos(wd * dt), decay * math.sin(wd * dt)
    first, out, p, v = c + damping * w / wd * s, np.empty(x.size), float(x[0]), 0.0
    for k, now in enumerate(x.tolist()):
        out[k] = p
        off = p - now
        p = now + first * off + s / wd * v
        v = -w * w * s / wd * off + (c - damping * w / wd * s) * v
    return out


def play_outputs(u: Array, thresholds: Array) -> Array:
    """Plays that are virgin at the first drive, one a column."""
    z, out = np.full(thresholds.size, u[0]), np.empty((u.size, thresholds.size))
    for k, now in enumerate(u.tolist()):
        z = np.maximum(now - thresholds, np.minimum(now + thresholds, z))
        out[k] = z
    return out


def ordinary_plays(u: Array) -> Array:
    r = np.linspace(0.0, 40.0, 33)
    return np.asarray(play_outputs(u, r) @ np.r_[0.6, 0.025 * np.exp(-r[1:] / 20.0)])


def jiles_atherton(u: Array, _: float) -> Array:
    """Irreversible and reversible magnetisation under a field that is the drive."""
    a, k, alpha, c = 18.0, 10.0, 4.0, 0.15
    irreversible = m = 0.0
    out = np.empty(u.size)
    for n, (h, step, count) in enumerate(fine_steps(u)):
        for part in range(count):
            e = (h + (part + 0.5) * step + alpha * m) / a
            anhysteretic = 1.0 / math.tanh(e) - 1.0 / e if abs(e) > 1e-3 else e / 3.0
            off, way = anhysteretic - irreversible, math.copysign(1.0, step)
            if off * way > 0.0:
                irreversible += step * off / (way * k - alpha * off)
            m = c * anhysteretic + (1.0 - c) * irreversible
        out[n] = 60.0 * m + 0.2 * (h + count * step)
    return out


def cells(u: Array, up: Array, down: Array, first: Array) -> Array:
    """The mean of relays that switch up and down at these drives."""
    state, out = first, np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        state = np.where(now >= up, 1.0, np.where(now <= down, -1.0, state))
        out[k] = state.mean()
    return out


def normal_preisach(u: Array, _: float) -> Array:
    """Centres and widths are normal, and the cells begin without a mean."""
    rng = np.random.default_rng(1)
    middle, half = rng.normal(0.0, 22.0, 2000), np.abs(rng.normal(12.0, 7.0, 2000))
    share = cells(u, middle + half, middle - half, np.sign(-middle))
    return 0.4 * u + 25.0 * share


def skewed_preisach(u: Array, _: float) -> Array:
    """Both thresholds have wide densities of their own, and the cells begin down."""
    rng = np.random.default_rng(2)
    one, other = 12.0 + 10.0 * rng.standard_t(2.0, (2, 2000)) * [[1.0], [1.6]] - [[0.0], [30.0]]
    up, down = np.maximum(one, other), np.minimum(one, other)
    return 0.3 * u + 30.0 * cells(u, up, down, np.where(u[0] >= up, 1.0, -1.0))


def miller(u: Array, _: float) -> Array:
    """Polarisation that nears the branches of saturation, and strain of first and second order."""
    coercive, remanent = 14.0, 0.7
    width = 2.0 * coercive / math.log((1.0 + remanent) / (1.0 - remanent))
    p, out = 0.0, np.empty(u.size)
    for n, (e, step, count) in enumerate(fine_steps(u)):
        way = math.copysign(1.0, step)
        for part in range(count):
            branch = way * math.tanh((way * (e + (part + 0.5) * step) - coercive) / width)
            left = max(0.0, way * (p - branch)) / max(1e-9, 1.0 - way * p)
            share = 1.0 - math.tanh(math.sqrt(left))
            p += step * share * (1.0 - branch**2) / width
        out[n] = 0.4 * (e + count * step) + 22.0 * p + 3.0 * p**2
    return out


def slack(u: Array, dt: float) -> Array:
    """A drive with backlash whose flanks give way as a cube, behind a belt with a short lag."""
    gap = 5.0
    z = play_outputs(u, np.array([gap]))[:, 0]
    return lag(z + 0.5 * gap * ((u - z) / gap) ** 3, dt, 4e-3)


def thresholds_of_speed(u: Array, dt: float) -> Array:
    """Thresholds grow with the logarithm of the speed of the drive: Al Janaideh's plays."""
    speed = lag(np.abs(np.diff(u, prepend=u[0])) / dt, dt, 5e-3)
    r = np.arange(16) * 2.2
    weights, z, out = 0.06 * np.exp(-r / 18.0), np.full(r.size, u[0]), np.empty(u.size)
    for k, (now, wider) in enumerate(zip(u.tolist(), 1.5 * np.log1p(0.02 * speed), strict=True)):
        z = np.maximum(now - r - wider, np.minimum(now + r + wider, z))
        out[k] = 0.5 * now + weights @ z
    return out


def late_plays(u: Array, dt: float) -> Array:
    """Every play is seen behind a lag of its own, the wide ones last."""
    r = np.linspace(2.0, 34.0, 17)
    z = play_outputs(u, r)
    late = [lag(z[:, i], dt, tau) for i, tau in enumerate(np.geomspace(4e-3, 2.0, r.size))]
    return np.asarray(0.6 * u + 0.025 * np.sum(late, axis=0))


def maxwell_slip(u: Array, dt: float) -> Array:
    """Springs that slip at a force, each in series with a dashpot, held against a stiff stack."""
    slip = np.array([1.5, 4.0, 9.0, 18.0, 34.0])
    keep = np.exp(-dt / np.array([0.05, 0.2, 0.8, 4.0, 60.0]))
    force, last, out = np.zeros(slip.size), float(u[0]), np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        force = np.clip(keep * force + (now - last), -slip, slip)
        last = now
        out[k] = 0.8 * now - 0.09 * force.sum()
    return out


def creeping_plays(u: Array, dt: float) -> Array:
    """Kuhnen's operators: plays that creep to their bounds, each with three time constants."""
    r, taus = np.meshgrid([0.0, 6.0, 14.0, 26.0], [0.02, 0.2, 2.0])
    share, s, out = -np.expm1(-dt / taus), np.full(r.shape, u[0]), np.empty(u.size)
    weights = 0.012 * np.exp(-r / 25.0)
    for k, now in enumerate(u.tolist()):
        out[k] = (weights * s).sum()
        s = s + share * (np.maximum(now - r, np.minimum(now + r, s)) - s)
    return ordinary_plays(u) + out


def bouc_wen_behind_sigmoid(u: Array, _: float) -> Array:
    z, out = 0.0, np.empty(u.size)
    for n, (v, step, count) in enumerate(fine_steps(u)):
        for _part in range(count):
            turn = 0.7 * math.copysign(1.0, step * z) + 0.3
            z += step * (1.0 - turn * abs(z / 16.0) ** 1.5)
        out[n] = 55.0 * math.tanh((v + count * step - 0.4 * z) / 50.0)
    return out


def heated(u: Array, dt: float) -> Array:
    """A shape-memory wire: power heats in two times, and the temperature has plays and a limit."""
    power = u**2 / 100.0
    temperature = 0.85 * lag(power, dt, 0.03) + 0.15 * lag(power, dt, 0.5)
    r = np.linspace(0.0, 14.0, 15)
    bent = 80.0 * np.tanh(play_outputs(temperature, r) / 80.0)
    return np.asarray(bent @ np.r_[0.3, np.full(14, 0.04)])


def electrostatic(u: Array, dt: float) -> Array:
    """A plate that is drawn by u^2 over the square of its gap, with a mode and slow charging."""
    w, damping, gap, parts = 2.0 * math.pi * 60.0, 0.1, 200.0, 20
    h, p, v, out = dt / parts, 0.0, 0.0, np.empty(u.size)
    for k, now in enumerate((u - 0.03 * lag(u, dt, 0.8)).tolist()):
        out[k] = p
        for _ in range(parts):
            drawn = 2.5e-3 * now * now / (1.0 - p / gap) ** 2
            v += h * (w * w * (drawn - p) - 2.0 * damping * w * v)
            p += h * v
    return out


def power_law_creep(u: Array, dt: float) -> Array:
    """A move of plays goes on as t^0.25, behind a mode."""
    x = ordinary_plays(u)
    going_on = 0.05 * (np.arange(u.size) * dt) ** 0.25
    size = 2 * u.size
    moves = np.fft.rfft(np.diff(x, prepend=x[0]), size)
    crept = np.fft.irfft(moves * np.fft.rfft(going_on, size), size)[: u.size]
    return mode(x + crept, dt, 50.0, 0.04)


def lugre(u: Array, dt: float) -> Array:
    """A flexure without mass, with the bristles of LuGre that slip at a force."""
    parts, slip, z, x = 20, 7.0, 0.0, 0.0
    h, out = dt / parts, np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        for _ in range(parts):
            v = (now - x - 0.9 * z) / 0.06
            z += h * (v - abs(v) * z / slip)
            x += h * v
        out[k] = x
    return out


def dahl(u: Array, _: float) -> Array:
    """Dahl's friction of an exponent of 1.7, and a stiffness that differs to both sides."""
    z, out = 0.0, np.empty(u.size)
    for n, (v, step, count) in enumerate(fine_steps(u)):
        for _part in range(count):
            z += step * max(0.0, 1.0 - math.copysign(1.0, step) * z / 9.0) ** 1.7
        end = v + count * step
        out[n] = end - 0.35 * z + 7.5e-4 * end * abs(end)
    return out


def magnetostrictive(u: Array, dt: float) -> Array:
    """The square of a magnetisation that passes zero within the range, behind a lag."""
    r = np.linspace(0.0, 30.0, 25)
    field = play_outputs(u - 20.0, r) @ np.exp(-r / 12.0) / 8.0
    return lag(60.0 * np.tanh(field / 40.0) ** 2, dt, 3e-3)


def polymer(u: Array, dt: float) -> Array:
    """The square of the voltage, behind three springs with dashpots."""
    s = u**2 / 100.0
    return 0.7 * s + 0.2 * lag(s, dt, 0.05) + 0.15 * lag(s, dt, 0.6) + 0.1 * lag(s, dt, 6.0)


def generalised_plays(u: Array, _: float) -> Array:
    """Plays with envelopes of their own for rising and for falling drives."""
    r = np.linspace(0.0, 1.2, 16)
    up, down = 1.2 * np.tanh((u - 8.0) / 45.0) + 0.1, 1.1 * np.tanh((u + 6.0) / 60.0)
    z, out = np.zeros(r.size), np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        z = np.maximum(up[k] - 0.4 * r, np.minimum(down[k] + 0.4 * r, z))
        out[k] = 5.0 * (z * np.exp(-r)).sum() + 0.1 * now
    return out


def krasnoselskii(u: Array, _: float) -> Array:
    """Cells of Krasnosel'skii and Pokrovskii: relays with ridges in place of jumps."""
    rng = np.random.default_rng(5)
    low, width, ridge = rng.uniform(-45.0, 40.0, 300), rng.exponential(14.0, 300), 6.0
    z, out = np.full(300, -1.0), np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        risen = np.clip((now - low - width) / ridge, -1.0, 1.0)
        z = np.maximum(risen, np.minimum(np.clip((now - low) / ridge, -1.0, 1.0), z))
        out[k] = 40.0 * z.mean() + 0.3 * now
    return out


def leaky(u: Array, dt: float) -> Array:
    """Charge that leaks off within 25 s."""
    x = ordinary_plays(u)
    return x - 0.9 * lag(x - x[0], dt, 25.0)


def self_heating(u: Array, dt: float) -> Array:
    """The square of the current warms the stack within 8 s."""
    current = np.diff(u, prepend=u[0]) / dt
    return ordinary_plays(u) + 0.15 * lag(current**2 / 2e4, dt, 8.0)


def two_modes(u: Array, dt: float) -> Array:
    x = ordinary_plays(u)
    return 0.8 * mode(x, dt, 42.0, 0.02) + 0.2 * mode(x, dt, 95.0, 0.015)


def muscle(u: Array, dt: float) -> Array:
    """A fluid muscle: pressure comes late, its skin slips, and the force falls as it shortens."""
    pressure = lag(u, dt, 0.02)
    slip = np.array([2.0, 5.0, 10.0, 20.0])
    force, last, out = np.zeros(slip.size), float(pressure[0]), np.empty(u.size)
    for k, now in enumerate(pressure.tolist()):
        force = np.clip(force + (now - last), -slip, slip)
        last = now
        out[k] = 70.0 * -math.expm1(-max(now - 0.12 * force.sum() + 5.0, 0.0) / 55.0)
    return out


def two_phases(u: Array, dt: float) -> Array:
    """A shape-memory alloy whose phase grows with its own rate on the way up and down."""
    warm = lag(u**2 / 100.0, dt, 0.08)
    share, last, out = 0.0, float(warm[0]), np.empty(u.size)
    for k, now in enumerate(warm.tolist()):
        step, last = now - last, now
        if step > 0.0:
            share += (1.0 - share) * -math.expm1(-step / 7.0 / (1.0 + math.exp((55.0 - now) / 7.0)))
        else:
            share *= math.exp(step / 7.0 / (1.0 + math.exp((now - 35.0) / 7.0)))
        out[k] = 40.0 * share + 0.1 * now
    return out


def sharp_preisach(u: Array, _: float) -> Array:
    """Cells that nearly all switch at one coercive drive."""
    rng = np.random.default_rng(9)
    half, middle = np.abs(rng.normal(15.0, 2.0, 1500)), rng.normal(0.0, 3.0, 1500)
    return 0.8 * u + 12.0 * cells(u, middle + half, middle - half, np.sign(-middle))


def limited(u: Array, dt: float) -> Array:
    """An amplifier that ends before the drive does, a lag, plays and a mode."""
    return mode(ordinary_plays(lag(np.clip(u, 3.0, 94.0), dt, 2e-3)), dt, 60.0, 0.05)


def eddy_currents(u: Array, dt: float) -> Array:
    """Flux that follows the field at a rate of its own, pinned by up to a force."""
    parts, pinned, flux = 8, 0.0, 0.0
    out = np.empty(u.size)
    for k, now in enumerate(u.tolist()):
        for _ in range(parts):
            step = (now - flux - pinned) * dt / parts / 4e-3
            pinned = min(8.0, max(-8.0, pinned + 0.5 * step))
            flux += step
        out[k] = flux + 5.0 * math.tanh(flux / 30.0)
    return out


def bent_creep(u: Array, dt: float) -> Array:
    """Plays that creep in two times, seen by a bent sensor."""
    x = ordinary_plays(u)
    x = x + 0.04 * lag(x, dt, 0.3) + 0.03 * lag(x, dt, 12.0)
    return np.asarray(x + 2e-3 * (x - 50.0) ** 2)


def of_tests(stage: law_stages.Stage) -> Stage:
    """A stage of the tests, which has their sampling interval."""
    return Stage(stage.name, stage.low, stage.high, lambda u, _: stage.position(u))


STAGES = (
    *map(of_tests, law_stages.STAGES),
    Stage("Jiles-Atherton", -50.0, 50.0, jiles_atherton),
    Stage("normal Preisach", -50.0, 50.0, normal_preisach),
    Stage("skewed Preisach", -50.0, 50.0, skewed_preisach),
    Stage("Miller ferroelectric", -50.0, 50.0, miller),
    Stage("slack drive", -50.0, 50.0, slack),
    Stage("thresholds of speed", -50.0, 50.0, thresholds_of_speed),
    Stage("late plays", 0.0, 100.0, late_plays),
    Stage("activated cells", -50.0, 50.0, activated_cells),
    Stage("Maxwell slip", -50.0, 50.0, maxwell_slip),
    Stage("Kuhnen creep", 0.0, 100.0, creeping_plays),
    Stage("Bouc-Wen in tanh", -50.0, 50.0, bouc_wen_behind_sigmoid),
    Stage("heated wire", 0.0, 100.0, heated),
    Stage("electrostatic", 0.0, 100.0, electrostatic),
    Stage("power-law creep", 0.0, 100.0, power_law_creep),
    Stage("LuGre", -50.0, 50.0, lugre),
    Stage("Dahl", -50.0, 50.0, dahl),
    Stage("magnetostrictive", 0.0, 100.0, magnetostrictive),
    Stage("polymer", 0.0, 100.0, polymer),
    Stage("generalised plays", -50.0, 50.0, generalised_plays),
    Stage("Krasnosel'skii", -50.0, 50.0, krasnoselskii),
    Stage("leaky", 0.0, 100.0, leaky),
    Stage("self-heating", 0.0, 100.0, self_heating),
    Stage("two modes", 0.0, 100.0, two_modes),
    Stage("fluid muscle", 0.0, 100.0, muscle),
    Stage("two phases", 0.0, 100.0, two_phases),
    Stage("sharp Preisach", -50.0, 50.0, sharp_preisach),
    Stage("limited", 0.0, 100.0, limited),
    Stage("eddy currents", -50.0, 50.0, eddy_currents),
    Stage("screw", 0.0, 100.0, lambda u, _: law_stages.screw(u)),
    Stage("bent creep", 0.0, 100.0, bent_creep),
)
