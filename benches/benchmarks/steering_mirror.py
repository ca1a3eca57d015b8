"""The fine steering mirror benchmark, beside the published figures: `make bench-benchmarks`.

The mirror of CubeSpec: three piezo drives, three displacements, 6.4 kHz. It is described in
M. Floren et al., "Data-driven state-space identification and nonlinearity assessment of the
CubeSpec Fine Steering Mirror", ISMA-USD 2024, pages 2042-2052.
Its files are not part of this repository:
`--official FOLDER` takes the folder of u_100mV_train.npy, y_100mV_train.npy, ..._test.npy and those
of 200 and 300 mV, as merijnfloren/fsm-benchmark-data has them: arrays of shape (samples of a
period, 3, realisations, periods). The periods of a realisation follow each other in one record.
`--training FILES --test FILES` takes other files: arrays `u` and `y` (.npz, or .mat with scipy) of
shape (samples, 3) or (samples, 3, realisations), or a .csv of six columns, drives first. The first
100 samples of every period are dropped; the figure is the rms error over the standard deviation, of
each position, realisation and period, and their plain mean.

Without files a mirror is simulated by equations of this file that know nothing of the package:
each drive goes through plays, the sums move three resonances that are coupled, and noise is added.
WHAT IS PRINTED THEN IS NO RESULT ON THE BENCHMARK.

The model is chosen by `mh.identify_axes(u, y, dt=dt, skip=100)` on training realisations alone; the
test realisations are simulated once, by the model that was chosen.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

RATE, DROPPED, CHANNELS = 6400.0, 100, 3

# Method, mean of rms error over standard deviation, in %. The source has figures for 100, 200 and
# 300 mV of one model (analyze_models.ipynb), of which these are plain means: 18.61, 6.61, 16.28
# (linear, 28 states) and 6.37, 4.84, 4.19 (NL-LFR; 3788 s on an NVIDIA T600 Laptop GPU).
SOURCE = "M. Floren, baseline models of the benchmark, v2026.04.15, doi:10.5281/zenodo.19591136"
PUBLISHED = (("linear", 13.8), ("neural NL-LFR, 63 minutes on a GPU", 5.13))


class Record(NamedTuple):
    """Drives and positions, rows of samples, of periods that follow each other."""

    u: Array
    y: Array
    periods: int = 1


def loaded(path: Path, load: Callable[[Path], Any]) -> Any:
    """Return what a library makes of a file, or name the file that it cannot read."""
    try:
        return load(path)
    except OSError:
        raise
    # Libraries raise what they like on bytes that are no such file.
    except Exception as failure:
        kind = f"expected a file {path.suffix} as its name says"
        raise ValueError(f"{path}: {kind}, got: {failure}") from failure


def read(path: Path) -> list[Record]:
    """Return the realisations of a file."""
    if path.suffix == ".csv":
        table = loaded(path, partial(np.loadtxt, delimiter=",", skiprows=1, ndmin=2))
        if table.shape[1] != 2 * CHANNELS:
            raise ValueError(f"{path}: expected {2 * CHANNELS} columns, got {table.shape[1]}")
        return realisations(path, table[:, :CHANNELS], table[:, CHANNELS:])
    if path.suffix == ".mat":
        from scipy.io import loadmat

        arrays = loaded(path, loadmat)
    elif path.suffix == ".npz":
        arrays = loaded(path, np.load)
    else:
        raise ValueError(f"{path}: expected a file .npz, .mat or .csv, got {path.suffix!r}")
    missing = {"u", "y"} - set(arrays)
    if missing:
        named = sorted(name for name in arrays if not name.startswith("__"))
        raise ValueError(f"{path}: expected arrays u and y, got {', '.join(named)}")
    return realisations(path, arrays["u"], arrays["y"])


def official(folder: Path, part: str) -> list[Record]:
    """Return all realisations of the official files of a part: train or test."""
    paths = sorted(folder.rglob(f"u_*_{part}.npy"))
    if not paths:
        raise ValueError(f"{folder}: expected files u_*_{part}.npy in or below it, got none")
    records = []
    for path in paths:
        other = path.with_name(f"y{path.name[1:]}")
        if not other.exists():
            raise ValueError(f"{other}: expected the positions to {path.name}, got no such file")
        records += realisations(path, loaded(path, np.load), loaded(other, np.load))
    return records


def realisations(path: Path, u: Any, y: Any) -> list[Record]:
    """Take arrays apart: samples, channels, realisations if there are any, and their periods."""
    u, y = loaded(path, lambda _: [np.asarray(signal, dtype=float) for signal in (u, y)])
    if u.shape != y.shape or u.ndim not in (2, 3, 4) or u.shape[1] != CHANNELS:
        expected = f"u and y of one shape (samples, {CHANNELS}, realisations, periods)"
        raise ValueError(
            f"{path}: expected {expected}, the last two or the last if there are any, "
            f"got {u.shape} and {y.shape}"
        )
    if not (np.isfinite(u).all() and np.isfinite(y).all() and len(u) > DROPPED):
        raise ValueError(f"{path}: expected finite numbers, and more than {DROPPED} samples")
    u, y = (signal.reshape(*signal.shape, *[1] * (4 - signal.ndim)) for signal in (u, y))
    if np.ptp(u, axis=3).max() > 1e-9 * np.ptp(u):
        raise ValueError(f"{path}: expected periods of the same drives along the last axis")
    one = [signal.transpose(2, 3, 0, 1).reshape(u.shape[2], -1, CHANNELS) for signal in (u, y)]
    return [Record(drives, seen, u.shape[3]) for drives, seen in zip(*one, strict=True)]


def multisine(samples: int, rng: np.random.Generator) -> Array:
    """Return drives of random phases up to 1 kHz, 1 V rms, that begin softly."""
    spectrum = np.zeros((samples // 2 + 1, CHANNELS), dtype=complex)
    lines = np.arange(1, int(1000.0 / RATE * samples))
    phases = rng.uniform(0.0, 2.0 * np.pi, (lines.size, CHANNELS))
    spectrum[lines] = np.exp(1j * phases) / np.sqrt(
        1.0 + (lines[:, None] * RATE / samples / 200.0) ** 2
    )
    u = np.fft.irfft(spectrum, samples, axis=0)
    soft = np.minimum(np.arange(samples) / DROPPED, 1.0)[:, None]
    return np.asarray(soft * u / u.std(axis=0))


def mirror(u: Array, rng: np.random.Generator) -> Array:
    """Return the positions of the simulated mirror, by ten steps in a sample, with noise."""
    coupling = np.array([[1.0, -0.5, -0.5], [0.0, 0.9, -0.9], [0.4, 0.4, 0.4]])
    frequency, damping = (
        2.0 * np.pi * np.array([700.0, 850.0, 1300.0]),
        np.array([0.03, 0.04, 0.05]),
    )
    mixed = np.array([[1.0, 0.05, 0.02], [-0.04, 1.0, 0.03], [0.02, -0.03, 1.0]])
    thresholds, parts = np.array([0.15, 0.4, 0.8, 1.4, 2.2]), 10
    weights, h = np.array([0.12, 0.1, 0.09, 0.08, 0.07]), 1.0 / (RATE * parts)
    plays, y, v = np.zeros((CHANNELS, thresholds.size)), np.zeros(CHANNELS), np.zeros(CHANNELS)
    found = np.empty_like(u)
    for k, row in enumerate(u):
        found[k] = mixed @ y
        drive = row[:, None]
        plays = np.maximum(drive - thresholds, np.minimum(drive + thresholds, plays))
        force = coupling @ (row + plays @ weights)
        for _ in range(parts):
            v = v + h * (frequency**2 * (force - y) - 2.0 * damping * frequency * v)
            y = y + h * v
    noise = 2e-3 * found.std(axis=0) * rng.standard_normal(found.shape)
    return np.asarray(found + noise)


def simulated(samples: int) -> tuple[list[Record], list[Record]]:
    """Return four training realisations of the simulated mirror, and one to test."""
    sys.stdout.write("NO FILES: A SIMULATED MIRROR, NO RESULT ON THE BENCHMARK (see --help)\n")
    rng = np.random.default_rng(1)
    drives = [multisine(samples, rng) for _ in range(5)]
    records = [Record(u, mirror(u, rng)) for u in drives]
    return records[:4], records[4:]


def error(model: mh.MultiAxisStage, records: list[Record]) -> float:
    """Return the plain mean of rms error over standard deviation, in %."""
    ratios = []
    for u, y, periods in records:
        positions, missed = (
            signal.reshape(periods, -1, CHANNELS)[:, DROPPED:]
            for signal in (y, y - model.forward().run(u))
        )
        ratios.append(np.sqrt((missed**2).mean(axis=1)) / positions.std(axis=1))
    return 100.0 * float(np.mean(np.concatenate(ratios)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--official", type=Path, help="folder of the official files")
    parser.add_argument("--training", nargs="+", type=Path, default=[], help="files to fit")
    parser.add_argument("--test", nargs="+", type=Path, default=[], help="files to judge, once")
    parser.add_argument("--order", type=int, help="the number of states; by default found")
    parser.add_argument("--samples", type=int, default=4096, help="of a simulated realisation")
    arguments = parser.parse_args()
    if bool(arguments.training) != bool(arguments.test):
        parser.error("--training and --test: expected both or none of them")
    if arguments.official and arguments.training:
        parser.error("--official: expected no --training and --test beside it")
    measured = True
    try:
        if arguments.official:
            training, test = (official(arguments.official, part) for part in ("train", "test"))
        elif arguments.training:
            training, test = (
                [record for path in paths for record in read(path)]
                for paths in (arguments.training, arguments.test)
            )
        else:
            training, test, measured = *simulated(arguments.samples), False
        u, y = [record.u for record in training], [record.y for record in training]
        wall, start = time.perf_counter(), time.process_time()
        order: Any = "auto" if arguments.order is None else arguments.order
        found = mh.identify_axes(u, y, dt=1.0 / RATE, order=order, skip=DROPPED)
    except (OSError, ValueError) as failure:
        parser.error(str(failure))
    seconds, wall = time.process_time() - start, time.perf_counter() - wall
    forward, drive = found.model.forward(), test[0].u
    forward.run(drive)
    start = time.process_time()
    forward.run(np.tile(drive, (20, 1)))
    step = (time.process_time() - start) / (20 * len(drive))
    ratio = error(found.model, test)
    rows = [(f"this package, {found.hysteresis} {found.place}", ratio)]
    rows += PUBLISHED if measured else ()
    lines = [
        found.summary(),
        f"\nTest realisations: {len(test)}; mean of rms error over standard deviation, %",
        *(f"  {name:<40} {percent:6.2f}" for name, percent in rows),
        *([f"  Published: {SOURCE}"] if measured else []),
        f"Fit: {seconds:.0f} s of processor time, {wall:.0f} s by the clock",
        f"Step: {1e9 * step:.0f} ns",
    ]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
