"""How long `identify_many` takes, and how near it comes to single fits: `make bench-many`.

The actuators differ in ratios, weights, gain, both offsets, dead time and noise. The drive is a
decaying sine. Where every actuator has its own drive, amplitude and offset of the sine differ too.
"""

from __future__ import annotations

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

RATE = 10_000.0  # Hz
LOWEST, HIGHEST = 5.0, 115.0  # V


def drive(samples: int, share: float = 1.0) -> Array:
    """A sine of 12 periods that decays to a fifth."""
    part = np.arange(samples) / samples
    swing = 0.5 * (HIGHEST - LOWEST) * share
    middle = 0.5 * (HIGHEST + LOWEST)
    return middle + swing * (1.0 - 0.8 * part) * np.sin(24.0 * np.pi * part)


def position(u: Array, operators: int, random: np.random.Generator) -> Array:
    """One actuator of its own kind, in um, with noise of 0.1 % of its range."""
    gain, ra = 0.01 * random.uniform(0.5, 1.5), random.uniform(0.7, 1.3)
    input_offset = random.uniform(0.0, 20.0)
    fall = 1.0 - 0.5 * np.arange(operators) / operators
    weights = gain * 0.1 * random.uniform(0.0, 1.0, operators) * fall
    weights[0] = gain
    model = mh.ModifiedPrandtlIshlinskii.from_ratios(
        weights,
        (HIGHEST - input_offset) * np.arange(operators) / operators,
        ra=ra,
        rb=ra * random.uniform(0.2, 0.8),
        rc=random.uniform(0.2, 0.8),
        input_offset=input_offset,
        output_offset=random.uniform(-1.0, 1.0),
    )
    clean, sample = model.forward().run(u), np.arange(u.size)
    late = np.interp(sample - random.uniform(0.0, 3.0), sample, clean)
    measured: Array = late + 1e-3 * np.ptp(clean) * random.normal(size=u.size)
    return measured


def tell(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def timed(work: Callable[[], Any]) -> tuple[str, Any]:
    """What came of it, and how long it took: by the clock, and of all processors together."""
    start, worked = time.perf_counter(), time.process_time()
    result = work()
    spent, worked = time.perf_counter() - start, time.process_time() - worked
    return f"{spent:.1f} s, {worked:.1f} s of processors", result


def processor() -> str:
    """The name of the processor where the system tells it."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
        return next(line.split(":")[1].strip() for line in lines if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor() or platform.machine()


def compared(found: mh.results.ManyIdentifications, singles: list[Any]) -> str:
    """The squared errors beside those of single fits."""
    single = np.array([one.fit.rmse for one in singles])
    excess = (found.rmse[: single.size] / single) ** 2 - 1.0
    both = (
        f"by more than {limit:g} {np.mean(excess > limit):.1%} worse, "
        f"{np.mean(excess < -limit):.1%} better"
        for limit in LIMITS
    )
    return f"{'; '.join(both)}; worst {excess.max():.2g}, best {excess.min():.2g}"


LIMITS = (1e-6, 1e-4, 1e-3, 1e-2)
"""By how much a sum of squares may exceed that of the single fit, as a share."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    for name, default in (("actuators", 4096), ("samples", 5000), ("operators", 16)):
        parser.add_argument(f"--{name}", type=int, default=default)
    parser.add_argument("--threads", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--singles", type=int, default=64, help="how many are fitted singly too")
    parser.add_argument("--weights", default="free")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    now = datetime.now(timezone.utc).date()
    tell(f"{processor()}, {os.cpu_count()} processors, load {load:.1f}, {now}")
    random = np.random.default_rng(asked.seed)
    options: dict[str, Any] = {
        **{"dt": 1.0 / RATE, "operators": asked.operators},
        **{"weights": asked.weights, "smoothness": 0.0},
    }
    u, singly = drive(asked.samples), min(asked.singles, asked.actuators)
    Y = np.column_stack([position(u, asked.operators, random) for _ in range(asked.actuators)])
    shape = f"{asked.samples} samples, {asked.operators} operators, {asked.threads} threads"

    def single(pair: tuple[Array, Array]) -> mh.results.Identification:
        alone: dict[str, Any] = {"dynamics": None, "creep": None, "loop_shift": None}
        alone |= {"input_map": None, "output_map": None}
        return mh.identify(pair[0], pair[1], **alone, **options)

    def in_parallel(pairs: list[tuple[Array, Array]]) -> list[mh.results.Identification]:
        with ThreadPoolExecutor(asked.threads) as pool:
            return list(pool.map(single, pairs))

    spent, found = timed(lambda: mh.identify_many(u, Y, threads=asked.threads, **options))
    tell(f"one drive: {asked.actuators} actuators, {shape}: {spent}")
    tell(f"  {found}")
    alone, fits = timed(lambda: in_parallel([(u, y.copy()) for y in Y.T[:singly]]))
    tell(f"  {singly} single fits in parallel: {alone}")
    tell(f"  sum of squares beside the single fit: {compared(found, fits)}")

    drives = np.column_stack(
        [drive(asked.samples, random.uniform(0.8, 1.0)) for _ in range(singly)]
    )
    own = np.column_stack([position(one.copy(), asked.operators, random) for one in drives.T])
    spent, found = timed(lambda: mh.identify_many(drives, own, threads=asked.threads, **options))
    tell(f"own drives: {singly} actuators, {shape}: {spent}")
    pairs = [(one.copy(), y.copy()) for one, y in zip(drives.T, own.T, strict=True)]
    alone, fits = timed(lambda: in_parallel(pairs))
    tell(f"  {singly} single fits in parallel: {alone}")
    same = all(fit.model == found[m] for m, fit in enumerate(fits))
    tell(f"  the models are {'the same' if same else 'others'}")


if __name__ == "__main__":
    main()
