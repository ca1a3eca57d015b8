"""What `mh.identify` leaves by default on stages of other physics than its own model.

`make bench-foreign`. The stages are those of `other_physics.py`.

A stage is identified from one record of two kinds. `triangles` are three full ones at 1 Hz.
`several` is what `mh.signals.experiment` makes: a small chirp, loops of several sizes at two rates,
and rests. Noise is 0.05 % of the range. Then five drives are predicted that were not recorded, in
the range and at the speeds of the record: two sums of sines, two kinds of triangles, and steps.

`error` is the median of five rms errors of the true positions, each about its mean, as a share of
the range. `baseline` is the least of five simple models that were fitted to the same record.
`cover` is the share of noisy positions in the band of 95 %, which is moved by the mean of what is
missed, as a record has an offset of its own. `claimed` is the rms error that its
width stands for were it normal, over the true one, noise included. The last column names what was
found beside plays, and the codes of red findings.
"""

from __future__ import annotations

import argparse
import math
import time
from collections.abc import Callable
from typing import Any, NamedTuple

import law_stages
import mpi_hyst as mh
import numpy as np
from law_stages import DT, NOISE, way
from other_physics import STAGES, Stage, play_outputs
from records import Array, heading, tell
from scipy.optimize import nnls
from scipy.signal import lfilter

KINDS = ("triangles", "several")


class Recorded(NamedTuple):
    """A drive, and the usual and the largest speed of its large loops in V/s."""

    drive: Array
    usual: float
    fastest: float


def recorded(stage: Stage, kind: str) -> Recorded:
    full = stage.high - stage.low
    if kind == "triangles":
        return Recorded(way([0.0, *[stage.high, stage.low] * 3, 0.0], 2.0 * full), full, 2.0 * full)
    (one,) = mh.signals.experiment(
        stage.low,
        stage.high,
        slew=10.0 * full,
        rate=1.0 / DT,
        frequencies=(1.0, 5.0),
        cycles=3,
        rest=1.0,
        joined=True,
    )
    return Recorded(np.asarray(one.drive), 2.0 * full, 10.0 * full)


def sines(stage: Stage, largest: float, speed: float, rng: np.random.Generator) -> Array:
    """Three sines for eight seconds, slowed down until none of their moves is faster."""
    parts = rng.dirichlet([3.0, 3.0, 3.0])
    rates, phases = np.array([1.0, 1.7, 2.9]) * rng.uniform(0.9, 1.1, 3), rng.uniform(0.0, 6.28, 3)
    t = np.arange(round(8.0 / DT)) * DT
    half = 0.5 * (stage.high - stage.low) * largest
    rates *= speed / (half * parts @ rates)
    wave = 0.5 * (stage.high + stage.low) + half * np.sin(t[:, None] * rates + phases) @ parts
    return np.concatenate([way([0.0, float(wave[0])], speed), wave])


def unseen(stage: Stage, record: Recorded, rng: np.random.Generator) -> list[Array]:
    """Five drives in the range and at the speeds of a record, from rest at 0."""
    low, full = stage.low, stage.high - stage.low
    wide = [low + full * rng.uniform(a, a + 0.3) for a in (0.7, 0.0) * 8]
    small = [0.0]
    for _ in range(4):
        center, half = low + full * rng.uniform(0.25, 0.75), full * rng.uniform(0.05, 0.25)
        small += [center + half, center - half] * 2
    steps = [way([0.0, 0.0], record.fastest)]
    for level in rng.uniform(low, stage.high, 12):
        steps.append(way([float(steps[-1][-1]), float(level)], record.fastest))
        steps.append(np.full(round(rng.uniform(0.2, 1.0) / DT), level))
    return [
        sines(stage, 0.95, 0.9 * record.fastest, rng),
        sines(stage, 0.7, record.usual, rng),
        way([0.0, *wide], 0.8 * record.fastest),
        way(small, record.usual),
        np.concatenate(steps),
    ]


Model = Callable[[Array], Array]


def least_squares(columns: Array, y: Array) -> Array:
    return np.asarray(np.linalg.lstsq(columns, y, rcond=None)[0])


def straight_line(u: Array, y: Array) -> Model:
    line = np.polyfit(u, y, 1)
    return lambda other: np.asarray(np.polyval(line, other), dtype=float)


def branches(u: Array, y: Array) -> Model:
    """A quintic for rising and one for falling drives; at rest the last one goes on."""
    middle, half = 0.5 * (u.max() + u.min()), 0.5 * np.ptp(u)

    def columns(drive: Array) -> Array:
        moves = np.sign(np.diff(drive, prepend=drive[0]))
        last = np.maximum.accumulate(np.where(moves != 0.0, np.arange(drive.size), 0))
        rising = (moves[last] >= 0.0)[:, None]
        powers = np.vander((drive - middle) / half, 6)
        return np.hstack([powers * rising, powers * ~rising])

    found = least_squares(columns(u), y)
    return lambda other: columns(other) @ found


def weights_and_offset(outputs: Array, y: Array) -> tuple[Array, float]:
    """Weights of 0 or more, and an offset of any sign, by the smaller problem of the same sum."""
    q, r = np.linalg.qr(outputs - outputs.mean(0))
    weights, _ = nnls(r, q.T @ (y - y.mean()))
    return weights, float(y.mean() - outputs.mean(0) @ weights)


def twenty(u: Array) -> Array:
    return 0.5 * np.ptp(u) * np.arange(20) / 20.0


def plays(u: Array, y: Array) -> Model:
    r = twenty(u)
    weights, offset = weights_and_offset(play_outputs(u, r), y)
    return lambda other: play_outputs(other, r) @ weights + offset


def plays_and_cubic(u: Array, y: Array) -> Model:
    """Plays, and a cubic of their sum: each in turn for the other, and the best of all turns."""
    r = twenty(u)
    outputs, left = play_outputs(u, r), math.inf
    wanted = y
    for _ in range(8):
        weights, offset = weights_and_offset(outputs, wanted)
        x = outputs @ weights + offset
        cubic = np.polyfit(x, y, 3)
        error = float(np.std(np.polyval(cubic, x) - y))
        if error < left:
            left, best = error, (weights, offset, cubic)
        grid = np.linspace(x.min() - 0.1 * np.ptp(x), x.max() + 0.1 * np.ptp(x), 2000)
        wanted = np.interp(y, np.maximum.accumulate(np.polyval(cubic, grid)), grid)
    w, b, c = best
    return lambda other: np.asarray(np.polyval(c, play_outputs(other, r) @ w + b), dtype=float)


def arx(u: Array, y: Array) -> Model:
    """Of order 2, fitted by the next sample, and run on the drive alone from rest."""
    y0 = y[: round(0.02 / DT)].mean()
    v, x = u - u[0], y - y0
    columns = np.column_stack([x[1:-1], x[:-2], v[2:], v[1:-1], v[:-2]])
    a1, a2, b0, b1, b2 = least_squares(columns, x[2:])
    return lambda other: np.asarray(lfilter([b0, b1, b2], [1.0, -a1, -a2], other - u[0])) + y0


BASELINES: dict[str, Callable[[Array, Array], Model]] = {
    "line": straight_line,
    "quintics": branches,
    "plays": plays,
    "plays + cubic": plays_and_cubic,
    "ARX": arx,
}


def off(predicted: Array, true: Array) -> float:
    """The rms error about its mean, without bound where a model runs away."""
    error = float(np.std(predicted - true))
    return error if math.isfinite(error) else math.inf


class Judged(NamedTuple):
    """How a fit did: errors in % of the range, times in seconds."""

    error: float
    baseline: float
    by: str
    verdict: str
    cover: float
    claimed: float
    seconds: float
    terms: str


def terms_of(found: mh.results.Identification) -> str:
    """What is there beside plays, and the codes of red findings."""
    names = {
        "creep": found.creep,
        "map in front": found.input_map,
        "map behind": found.output_map,
        "duhem": found.duhem,
        "relaxing plays": found.relaxing_plays,
        "loop shift": found.loop_shift,
        "slow gain": found.slow_gain,
        "amplifier": found.amplifier_bandwidth,
        "lag" if isinstance(found.dynamics, mh.plant.FirstOrder) else "modes": found.dynamics,
    }
    told = [name for name, term in names.items() if term is not None]
    if found.ratios != (1.0, 1.0, 1.0):
        told.append("coupled")
    red = [one.code for one in found.warnings if one.severity == "red"]
    return ", ".join(told) + ("; red: " + ", ".join(red) if red else "")


def judged(number: int, kind: str, seed: int, setting: dict[str, Any]) -> Judged:
    """Identify one stage from one record, and predict other drives."""
    stage = STAGES[number]
    rng = np.random.default_rng([seed, number, KINDS.index(kind)])
    record = recorded(stage, kind)
    clean = stage.position(record.drive, DT)
    size = float(np.ptp(clean))
    y = clean + rng.normal(0.0, NOISE * size, clean.size)
    begun = time.perf_counter()
    found = mh.identify(record.drive, y, dt=DT, **setting)
    seconds = time.perf_counter() - begun
    simple = {name: fit(record.drive, y) for name, fit in BASELINES.items()}

    errors, covers, claims, of_simple = [], [], [], []
    for drive in unseen(stage, record, rng):
        true = stage.position(drive, DT)
        noisy = true + rng.normal(0.0, NOISE * size, true.size)
        said, low, high = (np.asarray(one) for one in found.predict(drive, dt=DT, interval=0.95))
        offset = np.mean(noisy - said)
        errors.append(off(said, true))
        covers.append(np.mean((low + offset <= noisy) & (noisy <= high + offset)))
        claims.append(math.sqrt(np.mean((high - low) ** 2)) / (2.0 * 1.96) / off(said, noisy))
        of_simple.append([off(model(drive), true) for model in simple.values()])
    medians = np.median(of_simple, axis=0)
    best = int(np.argmin(medians))
    return Judged(
        100.0 * float(np.median(errors)) / size,
        100.0 * float(medians[best]) / size,
        list(simple)[best],
        found.verdict,
        float(np.mean(covers)),
        float(np.median(claims)),
        seconds,
        terms_of(found),
    )


def summary(kind: str, rows: list[Judged]) -> str:
    errors = np.array([one.error for one in rows])
    over = errors / [one.baseline for one in rows]
    claims = np.array([one.claimed for one in rows])
    wrong = sum(one.verdict == "green" and one.error > 1.0 for one in rows)
    return (
        f"{kind}, {len(rows)} stages: error over baseline {np.exp(np.log(over).mean()):.2f}, "
        f"worse than it {np.sum(over > 1.0)}, with more than the noise "
        f"{np.sum((over > 1.0) & (errors > 100.0 * NOISE))}; "
        f"cover {np.mean([one.cover for one in rows]):.3f}, "
        f"claimed 0.5 to 1.5 {np.mean((claims >= 0.5) & (claims <= 1.5)):.2f}; "
        f"green with more than 1 % {wrong}; {np.median([one.seconds for one in rows]):.1f} s"
    )


def setting_of(text: str) -> tuple[str, Any]:
    """KEY=VALUE, the value None, a number or a word."""
    key, _, value = text.partition("=")
    if value.lower() == "none":
        return key, None
    try:
        return key, float(value) if "." in value or "e-" in value else int(value)
    except ValueError:
        return key, value


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stages", default="", help="parts of names, with commas: all by default")
    parser.add_argument("--records", choices=(*KINDS, "both"), default="both")
    parser.add_argument("--seed", type=int, default=0, help="of noise and unseen drives")
    parser.add_argument(
        "--fit",
        type=setting_of,
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="an argument of identify, such as relaxing_plays=none",
    )
    asked = parser.parse_args()
    parts = [part.strip() for part in asked.stages.split(",")]
    numbers = [k for k, one in enumerate(STAGES) if any(part in one.name for part in parts)]
    if not numbers:
        parser.error(f"--stages: expected parts of {[one.name for one in STAGES]}")
    tell(heading())
    tell(
        f"{'stage':<22}  {'record':<9}  error %  baseline %  {'by':<13}  verdict  cover  claimed"
        "  seconds  terms"
    )
    sums = []
    for kind in KINDS if asked.records == "both" else (asked.records,):
        rows = []
        for number in numbers:
            one = judged(number, kind, asked.seed, dict(asked.fit))
            rows.append(one)
            tell(
                f"{STAGES[number].name:<22}  {kind:<9}  {one.error:7.3f}  {one.baseline:10.3f}"
                f"  {one.by:<13}  {one.verdict:<7}  {one.cover:5.3f}  {one.claimed:7.2f}"
                f"  {one.seconds:7.1f}  {one.terms}"
            )
        sums.append(summary(kind, rows))
        own = [one for k, one in zip(numbers, rows, strict=True) if k >= len(law_stages.STAGES)]
        if 0 < len(own) < len(rows):
            sums.append(summary(f"{kind}, those of other_physics.py", own))
    for line in sums:
        tell(line)


if __name__ == "__main__":
    main()
