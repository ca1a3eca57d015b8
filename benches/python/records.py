"""Records of simulated actuators, and how work on them is timed."""

from __future__ import annotations

import os
import platform
import sys
import time
from collections.abc import Callable
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


def heading() -> str:
    """The machine, how busy it is, and the date."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else float("nan")
    now = datetime.now(timezone.utc).date()
    return f"{processor()}, {os.cpu_count()} processors, load {load:.1f}, {now}"
