"""How long `identify` takes for one record, with its defaults: `make bench-identify`."""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
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

# A stage whose experiment is fitted, and what a model of this package is to it.
EXPERIMENTS = {
    "mode": "which fits",
    "normal Preisach": "which nothing fits",
}


def seconds(fit: Callable[[], object]) -> float:
    """How long one identification takes."""
    start = time.perf_counter()
    fit()
    return time.perf_counter() - start


def experiment(name: str, rate: float) -> tuple[Array, Array]:
    """The experiment of a stage at this rate, and what it measures: 2.1 minutes."""
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
        "--rates", type=float, nargs="*", default=[500.0], help="of the experiments, in Hz"
    )
    parser.add_argument("--operators", type=int, default=20)
    parser.add_argument("--times", type=int, default=3, help="how often; the median is told")
    asked = parser.parse_args()
    tell(heading())
    for samples in asked.samples:
        u = drive(samples)
        y = position(u, asked.operators, np.random.default_rng(1))
        for way, more in WAYS.items():
            options = {"operators": asked.operators, **more}
            took = median(seconds(lambda: mh.identify(u, y, **options)) for _ in range(asked.times))  # noqa: B023
            tell(f"{samples} samples, {asked.operators} operators, {way}: {took:.2f} s")
    for rate in asked.rates:
        for name, way in EXPERIMENTS.items():
            u, y = experiment(name, rate)
            took = median(
                seconds(lambda: mh.identify(u, y, dt=1.0 / rate)) for _ in range(asked.times)
            )  # noqa: B023
            tell(f"{u.size} samples of an experiment, {name}, {way}: {took:.2f} s")


if __name__ == "__main__":
    main()
