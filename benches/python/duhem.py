"""`run` and `step` of `mh.Duhem` with nine knots, nanoseconds a sample: the least and the median.

The knots cover what each signal passes, as in `cargo bench`.
"""

from __future__ import annotations

import sys
import time

import mpi_hyst as mh
import numpy as np

REPEATS, SAMPLES = 60, 100_000


def operator(reach: float) -> mh.Duhem:
    """Return nine knots, f+ falling and f- rising over them."""
    knots = np.linspace(-reach, reach, 9)
    return mh.Duhem(knots, np.linspace(1.4, 0.6, 9), np.linspace(0.6, 1.4, 9))


def main() -> None:
    """Print a line for each signal."""
    t = np.arange(SAMPLES) / 10e3
    rng = np.random.default_rng(1)
    signals = {
        "1 Hz sine": 100.0 * np.sin(2.0 * np.pi * t),
        "50 Hz sine + 0.1 V noise": 100.0 * np.sin(100.0 * np.pi * t)
        + rng.normal(0.0, 0.1, SAMPLES),
        "white noise, full range": rng.uniform(-100.0, 100.0, SAMPLES),
    }
    for name, drive in signals.items():
        stream, out, times = operator(100.0), np.empty(SAMPLES), []
        for _ in range(REPEATS):
            start = time.perf_counter()
            stream.run(drive, out=out)
            times.append(1e9 * (time.perf_counter() - start) / SAMPLES)
        least, median = min(times), float(np.median(times))
        sys.stdout.write(f"{name:<26} run {least:6.1f} ns, median {median:6.1f} ns\n")


if __name__ == "__main__":
    main()
