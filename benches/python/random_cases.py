"""What a fit promises, and whether it holds, on records of stages of other physics.

`make bench-random-cases`. A case is one of the stages of `other_physics.py` with a random record:
full triangles, strokes of random heights, a sum of sines or a decaying sine at a random speed, or
what `mh.signals.experiment` makes. Noise is 0.01 to 0.2 % of the range.
Then four drives and four motions are asked for that were not recorded, within the range and the
speeds of the record.

`error` is the largest rms error of the four drives about its mean, as a share of the range. A
`green` verdict with more than 1 % is a false promise. Before it is driven, each motion is promised
by `Stage.precompensate(return_error=True)` to miss by no more than a number, with 95 %: `kept` is
how many of the four are; the offset of a motion is taken off, as a sensor has one of its own.
`width` is that number over the largest error, the median of the four.
"""

from __future__ import annotations

import argparse
import math
import time
import warnings
from typing import NamedTuple

import mpi_hyst as mh
import numpy as np
from foreign_stages import Recorded, off, recorded, sines, terms_of, unseen
from law_stages import DT, decaying, way
from other_physics import STAGES, Stage
from records import Array, heading, tell

KINDS = ("triangles", "strokes", "sines", "decay", "several")
LIMIT = 0.01  # of the range: a green verdict with more is wrong


def at_random(stage: Stage, kind: str, rng: np.random.Generator) -> Recorded:
    """A record of a kind."""
    low, full = stage.low, stage.high - stage.low
    if kind == "several":
        return recorded(stage, kind)
    speed = full * float(np.exp(rng.uniform(np.log(0.5), np.log(10.0))))
    if kind == "triangles":
        drive = way([0.0, *[stage.high, stage.low] * int(rng.integers(2, 5)), 0.0], speed)
    elif kind == "strokes":
        ends = [low + full * rng.uniform(*part) for part in ((0.5, 1.0), (0.0, 0.5)) * 10]
        drive = way([0.0, stage.high, low, *ends, 0.0], speed)
    elif kind == "sines":
        drive = sines(stage, 1.0, speed, rng)
    else:
        rate, cycles = speed / (math.pi * full), rng.integers(4, 12)
        drive = decaying((low, stage.high), round(cycles / rate / DT), rate, speed)
    return Recorded(drive, 0.5 * speed, speed)


class Case(NamedTuple):
    """What a case promised, and what came of it."""

    error: float
    verdict: str
    promises: list[float]
    """For each motion: the promised over the largest error."""
    seconds: float
    terms: str


def promised(stage: Stage, found: mh.Stage, drive: Array) -> float | None:
    """The promised over the largest error of the motion that the model makes of a drive.

    None where the stage refuses the motion.
    """
    forward = found.forward(DT)
    forward.settle(drive[0])
    target = forward.run(drive)
    with warnings.catch_warnings():
        # A motion at an end of the range is held back by a little.
        warnings.simplefilter("ignore")
        try:
            driven, bounds = found.precompensate(target, DT, start=drive[0], return_error=True)
        except mh.StartError:
            return None
    miss = stage.position(np.asarray(driven), DT) - target
    return bounds.within / float(np.abs(miss - miss.mean()).max())


def case(number: int, kind: str, seed: int) -> Case:
    """Identify one stage from one record, and ask for other drives and motions."""
    stage = STAGES[number]
    rng = np.random.default_rng([seed, number, KINDS.index(kind)])
    record = at_random(stage, kind, rng)
    clean = stage.position(record.drive, DT)
    size = float(np.ptp(clean))
    noise = size * float(np.exp(rng.uniform(np.log(1e-4), np.log(2e-3))))
    y = clean + rng.normal(0.0, noise, clean.size)
    begun = time.perf_counter()
    found = mh.identify(record.drive, y, dt=DT)
    seconds = time.perf_counter() - begun

    seen = stage._replace(low=float(record.drive.min()), high=float(record.drive.max()))
    drives = unseen(seen, record, rng)[:4]
    errors = [off(found.predict(drive, dt=DT), stage.position(drive, DT)) for drive in drives]
    made = [promised(stage, found.stage, drive) for drive in drives]
    promises = [one for one in made if one is not None]
    return Case(max(errors) / size, found.verdict, promises, seconds, terms_of(found))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=250)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    tell(heading())
    tell(f"{'stage':<22}  {'record':<9}  error %  verdict  kept  width  seconds  terms")
    rows: list[Case] = []
    order = np.random.default_rng(asked.seed)
    for one in range(asked.cases):
        number, kind = int(order.integers(len(STAGES))), str(order.choice(KINDS))
        row = case(number, kind, asked.seed + one)
        rows.append(row)
        promises = np.array(row.promises)
        width = np.median(promises) if row.promises else math.nan
        tell(
            f"{STAGES[number].name:<22}  {kind:<9}  {100.0 * row.error:7.3f}  {row.verdict:<7}"
            f"  {np.sum(promises >= 1.0)}/{promises.size}  {width:6.2f}  {row.seconds:7.1f}"
            f"  {row.terms}"
        )
    green = [row for row in rows if row.verdict == "green"]
    wrong = sum(row.error > LIMIT for row in green)
    promises = np.concatenate([row.promises for row in rows])
    seconds = [row.seconds for row in rows]
    tell(
        f"{len(rows)} cases, {len(green)} green, of these {wrong} with more than {LIMIT:.0%}; "
        f"{promises.size} motions, {np.mean(promises >= 1.0):.3f} of which keep what was promised "
        f"with 95 %; promised over largest error, median {np.median(promises):.2f}; "
        f"median {np.median(seconds):.1f} s, longest {max(seconds):.1f} s"
    )


if __name__ == "__main__":
    main()
