"""How long `identify` takes for one record, with its defaults: `make bench-identify`."""

from __future__ import annotations

import argparse
import time
from statistics import median
from typing import Any

import mpi_hyst as mh
import numpy as np
from records import RATE, Array, drive, heading, position, tell

WAYS: dict[str, dict[str, Any]] = {
    "hysteresis alone": {},
    "with dt, so that dynamics and creep are looked for": {"dt": 1.0 / RATE},
}


def seconds(u: Array, y: Array, options: dict[str, Any]) -> float:
    """How long one identification takes."""
    start = time.perf_counter()
    mh.identify(u, y, **options)
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--samples", type=int, nargs="+", default=[12_000, 1_000_000])
    parser.add_argument("--operators", type=int, default=20)
    parser.add_argument("--times", type=int, default=3, help="how often; the median is told")
    asked = parser.parse_args()
    tell(heading())
    for samples in asked.samples:
        u = drive(samples)
        y = position(u, asked.operators, np.random.default_rng(1))
        for way, more in WAYS.items():
            options = {"operators": asked.operators, **more}
            took = median(seconds(u, y, options) for _ in range(asked.times))
            tell(f"{samples} samples, {asked.operators} operators, {way}: {took:.2f} s")


if __name__ == "__main__":
    main()
