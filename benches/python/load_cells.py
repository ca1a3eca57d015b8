"""What a calibration leaves of the error of load cells that are no model of the package.

`make bench-load-cells`. Cells are simulated by equations of this file: Bouc-Wen elements, elements
that stick and slip, and relays. Each has 0.3 % of hysteresis and more, creep, 10 K of drift that
comes late, and noise. Each was loaded before in four ways, of which the calibration knows nothing,
and is calibrated by known loads up and down as in `examples/load_cell.py`. Then other loads are
weighed, after the same history and at other temperatures.

A figure is the rms error of these loads, some seconds after each was put on, as a share of what a
straight line through the known loads leaves. `virgin` is the same where the calibration is told
that nothing lay on the cell before, which is wrong here. The middle line of the last cell bends.
With `--steady` the temperature does not change, and no term of it is fitted.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import NamedTuple

import load_cell
import mpi_hyst as mh
import numpy as np
from records import Array, heading, tell

DT, HOLD = load_cell.DT, 60  # s, samples at each load
FULL = 100.0  # kg
KNOWN = np.r_[0:101:10, 90:-1:-10, 0:61:20, 40:-1:-20, 0, 0, 80, 30, 100, 50, 0, 0].astype(float)
BEFORE = ([100.0], [60.0], [100.0, 0.0, 100.0], [80.0, 20.0, 50.0])
MOMENTS = 50  # steps in which a load is put on


def bouc_wen(loads: Array) -> Array:
    """The part of each load that hysteresis takes: two Bouc-Wen elements."""
    slips, shares = np.array([12.0, 40.0]), np.array([0.0055, 0.0030])
    z, last, taken = np.zeros(2), 0.0, []
    for load in loads:
        step = (load - last) / MOMENTS
        for _ in range(MOMENTS if step else 0):
            z += step * (1.0 - (0.5 + 0.5 * np.sign(z * step)) * np.minimum(1.0, np.abs(z) / slips))
        last = load
        taken.append(shares @ z)
    return np.array(taken)


def slipping(loads: Array) -> Array:
    """Four elements that stick and slip."""
    slips, stretched, last, taken = np.array([3.0, 8.0, 20.0, 45.0]), np.zeros(4), 0.0, []
    for load in loads:
        stretched = np.clip(stretched + (load - last), -slips, slips)
        last = load
        taken.append(0.002 * stretched.sum())
    return np.array(taken)


def relays(loads: Array, middles: Array, share: float) -> Array:
    """Relays about these loads, more of them narrow than wide."""
    half = np.random.default_rng(0).exponential(12.0, middles.size)
    up, taken = np.zeros(middles.size, dtype=bool), []
    for load in loads:
        up = np.where(load >= middles + half, True, np.where(load <= middles - half, False, up))
        taken.append(-share * np.ptp(middles) * up.mean())
    return np.array(taken)


def even(loads: Array) -> Array:
    """Relays that lie as densely everywhere, far beyond the loads too."""
    return relays(loads, np.linspace(-FULL, 2.0 * FULL, 600), 0.012)


def bent(loads: Array) -> Array:
    """Relays that are densest at half the load: so the middle line bends."""
    return relays(loads, FULL * (0.5 + np.arcsin(np.linspace(-1.0, 1.0, 400)) / np.pi), 0.012)


# Name, hysteresis, amplitudes and time constants of creep, mV/kg, mV/K, time constant of heat.
Cell = tuple[str, Callable[[Array], Array], list[float], list[float], float, float, float]
CELLS: tuple[Cell, ...] = (
    ("Bouc-Wen", bouc_wen, [0.0010, 0.0012], [25.0, 240.0], 1.98, 0.05, 300.0),
    ("stick and slip", slipping, [0.0007] * 3, [8.0, 40.0, 200.0], 1.50, -0.04, 200.0),
    ("relays", even, [0.0015, 0.0008], [15.0, 120.0], 2.00, 0.05, 250.0),
    ("relays, bent", bent, [0.0015, 0.0008], [15.0, 120.0], 2.00, 0.05, 250.0),
)


def late(values: Array, tau: float, start: float) -> Array:
    """What follows with a time constant."""
    out, state = [], start
    for value in values:
        state += (value - state) * DT / tau
        out.append(state)
    return np.array(out)


def readings(cell: Cell, loads: Array, temperature: Array, rng: np.random.Generator) -> Array:
    _, hysteresis, amplitudes, taus, gain, sensitivity, lag = cell
    creep = sum(c * late(loads, tau, 0.0) for c, tau in zip(amplitudes, taus, strict=True))
    warmth = sensitivity * (late(temperature, lag, temperature[0]) - 23.0)
    noise = rng.normal(0.0, 0.003, loads.size)
    return np.asarray(gain * (loads - hysteresis(loads) + creep) + warmth + noise)


def heat(samples: int, rng: np.random.Generator) -> Array:
    """10 K of drift, up and down within the hour, and a window that is opened."""
    time = np.arange(samples) / samples
    waves = np.sin(2 * np.pi * (1.7 * time + rng.random())) + 0.4 * np.sin(2 * np.pi * 5.3 * time)
    waves[time > 0.6] -= 0.8
    return np.asarray(18.0 + 10.0 * (waves - waves.min()) / np.ptp(waves))


class Judged(NamedTuple):
    """The rms error of a straight line in kg, the shares that are left of it, and the findings."""

    line: float
    calibrated: float
    virgin: float
    told: list[str]


def judged(cell: Cell, before: list[float], seed: int, *, steady: bool) -> Judged:
    """Calibrate a cell, then weigh loads that were not calibrated."""
    warmth_of = (lambda samples, _: np.full(samples, 23.0)) if steady else heat
    rng = np.random.default_rng(seed)
    history = np.repeat([0.0, *before, 0.0], HOLD)
    whole = np.concatenate([history, np.repeat(KNOWN, HOLD)])
    warmth = warmth_of(whole.size, rng)
    part = slice(history.size, None)
    loads, temperature, reading = (
        one[part] for one in (whole, warmth, readings(cell, whole, warmth, rng))
    )
    held = np.arange(HOLD - 1, loads.size, HOLD)
    line = np.polyfit(reading[held], loads[held], 1)

    drawn = rng.uniform(0.0, FULL, 24)
    others = np.concatenate([history, np.repeat([*drawn, 0.0, 0.0, 0.0, 0.0], HOLD)])
    warmth = warmth_of(others.size, rng)
    weighed = readings(cell, others, warmth, rng)
    read = np.arange(others.size) % HOLD >= load_cell.SOON
    read &= np.arange(others.size) >= history.size

    def rms(error: Array) -> float:
        return float(np.sqrt(np.mean(error[read] ** 2)))

    def share(found: mh.results.PlacesIdentification) -> float:
        corrected = weighed - (reading[0] - found.drift(0)[0])
        if found.temperature is not None:
            corrected = corrected - found.temperature.response(warmth, DT)
        return rms(found.stage.inverse(DT).run(corrected) - others) / plain

    plain = rms(np.polyval(line, weighed) - others)
    unknown, virgin = (
        load_cell.calibrate(loads, HOLD, None if steady else temperature, reading, rested=rested)
        for rested in (False, True)
    )
    return Judged(plain, share(unknown), share(virgin), [one.code for one in unknown.warnings])


def summary(left: list[list[float]]) -> str:
    columns = zip(("calibrated", "virgin"), np.array(left).T, strict=True)
    return "; ".join(
        f"{name} {column.min():.2f} to {column.max():.2f}, mean {column.mean():.2f}"
        for name, column in columns
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seeds", type=int, nargs="+", default=range(1, 7), help="of heat and loads"
    )
    parser.add_argument("--steady", action="store_true", help="a temperature that does not change")
    asked = parser.parse_args()
    tell(heading())
    tell("cell            loaded before  seed  straight line  calibrated  virgin  findings")
    of_cells = []
    for cell in CELLS:
        left = []
        for before in BEFORE:
            for seed in asked.seeds:
                one = judged(cell, before, seed, steady=asked.steady)
                left.append([one.calibrated, one.virgin])
                loads = ", ".join(f"{load:g}" for load in before)
                numbers = f"{one.line:10.3f} kg  {one.calibrated:10.2f}  {one.virgin:6.2f}"
                tell(f"{cell[0]:<14}  {loads:<13}  {seed:>4}  {numbers}  {', '.join(one.told)}")
        of_cells.append(left)
        tell(f"  {summary(left)}")
    tell(f"all: {summary([one for left in of_cells for one in left])}")


if __name__ == "__main__":
    main()
