"""How long `identify` takes for one record, with its defaults: `make bench-identify`."""

from __future__ import annotations

import argparse
import time
from statistics import median
from typing import Any

import mpi_hyst as mh
import numpy as np
from law_stages import NOISE
from other_physics import STAGES
from records import RATE, Array, drive, heading, position, tell

WAYS: dict[str, dict[str, Any]] = {
    "hysteresis alone": {},
    "with dt, so that dynamics and creep are looked for": {"dt": 1.0 / RATE},
}

# Stages whose experiment is fitted, and what models of this package are to them.
EXPERIMENTS = {"two modes": "which fits", "normal Preisach": "which nothing fits"}


def seconds(times: int, u: Array, y: Array, **options: Any) -> float:
    """How long an identification takes: the median of so many."""
    took = []
    for _ in range(times):
        start = time.perf_counter()
        mh.identify(u, y, **options)
        took.append(time.perf_counter() - start)
    return median(took)


def experiment(name: str, rate: float) -> tuple[Array, Array]:
    """The experiment of a stage at this rate, and what it measures: nearly two minutes."""
    (stage,) = (one for one in STAGES if one.name == name)
    full = stage.high - stage.low
    (one,) = mh.signals.experiment(
        stage.low,
        stage.high,
        slew=10.0 * full,
        rate=rate,
        frequencies=(1.0, 5.0),
        cycles=5,
        rest=20.0,
        joined=True,
    )
    u = np.asarray(one.drive)
    clean = stage.position(u, 1.0 / rate)
    noise = np.random.default_rng(1).normal(0.0, NOISE * np.ptp(clean), clean.size)
    return u, clean + noise


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, nargs="*", default=[12_000, 1_000_000])
    parser.add_argument(
        "--rates", type=float, nargs="*", default=[900.0, 3200.0], help="of experiments, in Hz"
    )
    parser.add_argument("--operators", type=int, default=20)
    parser.add_argument("--times", type=int, default=3, help="how often; the median is told")
    asked = parser.parse_args()
    tell(heading())
    for samples in asked.samples:
        u = drive(samples)
        y = position(u, asked.operators, np.random.default_rng(1))
        for way, more in WAYS.items():
            took = seconds(asked.times, u, y, operators=asked.operators, **more)
            tell(f"{samples} samples, {asked.operators} operators, {way}: {took:.2f} s")
    for rate in asked.rates:
        for name, way in EXPERIMENTS.items():
            u, y = experiment(name, rate)
            took = seconds(asked.times, u, y, dt=1.0 / rate)
            tell(f"{u.size} samples of an experiment, {name}, {way}: {took:.2f} s")


if __name__ == "__main__":
    main()
