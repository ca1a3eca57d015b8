"""The fast steering mirror benchmark, beside the published figures: `make bench-benchmarks`.

Three piezo drives, three displacements, 6.4 kHz. Its files are not part of this repository:
`--training FILES --test FILES` takes them by path. A file holds arrays `u` and `y` (.npz, or .mat
with scipy) of shape (samples, 3) or (samples, 3, realisations), or it is a .csv of six columns,
drives first. The first 100 samples of every realisation are dropped; the figure is the rms error
over the standard deviation, of each position, realisation and period, and their plain mean.

Without files a mirror is simulated by equations of this file that know nothing of the package:
each drive goes through plays and creeping lags, the sums move three resonances that are coupled,
and noise is added. WHAT IS PRINTED THEN IS NO RESULT ON THE BENCHMARK.

The model is chosen by `mh.identify_axes(u, y, dt=dt, skip=100)` on training realisations alone; the
test realisations are simulated once, by the model that was chosen.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

RATE, DROPPED, CHANNELS = 6400.0, 100, 3

# Method, mean of rms error over standard deviation, in %.
PUBLISHED = (("linear", 13.8), ("neural NL-LFR, 63 minutes on a GPU", 5.13))


def read(path: Path) -> list[tuple[Array, Array]]:
    """Return the realisations of a file: drives and positions, rows of samples."""
    if path.suffix == ".csv":
        table = np.loadtxt(path, delimiter=",", skiprows=1)
        return [(table[:, :CHANNELS], table[:, CHANNELS : 2 * CHANNELS])]
    if path.suffix == ".mat":
        from scipy.io import loadmat

        arrays: Any = loadmat(path)
    else:
        arrays = np.load(path)
    u, y = (np.asarray(arrays[name], dtype=float) for name in ("u", "y"))
    u, y = (np.atleast_3d(signal).reshape(*signal.shape[:2], -1) for signal in (u, y))
    return [(u[:, :, i].copy(), y[:, :, i].copy()) for i in range(u.shape[2])]


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


def error(model: mh.MultiAxisStage, records: list[tuple[Array, Array]]) -> float:
    """Return the plain mean of rms error over standard deviation, in %."""
    ratios = []
    for u, y in records:
        missed = (y - model.forward().run(u))[DROPPED:]
        ratios.append(np.sqrt((missed**2).mean(axis=0)) / y[DROPPED:].std(axis=0))
    return 100.0 * float(np.mean(ratios))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--training", nargs="+", type=Path, default=[], help="files to fit")
    parser.add_argument("--test", nargs="+", type=Path, default=[], help="files to judge, once")
    parser.add_argument("--order", type=int, help="the number of states; by default found")
    parser.add_argument("--samples", type=int, default=4096, help="of a simulated realisation")
    arguments = parser.parse_args()
    if bool(arguments.training) != bool(arguments.test):
        parser.error("--training and --test: expected both or none of them")
    if arguments.training:
        training, test = (
            [record for path in paths for record in read(path)]
            for paths in (arguments.training, arguments.test)
        )
    else:
        sys.stdout.write("NO FILES: A SIMULATED MIRROR, NO RESULT ON THE BENCHMARK (see --help)\n")
        rng = np.random.default_rng(1)
        drives = [multisine(arguments.samples, rng) for _ in range(5)]
        training = [(u, mirror(u, rng)) for u in drives[:4]]
        test = [(u, mirror(u, rng)) for u in drives[4:]]
    u, y = [list(signals) for signals in zip(*training, strict=True)]
    wall, start = time.perf_counter(), time.process_time()
    order: Any = "auto" if arguments.order is None else arguments.order
    found = mh.identify_axes(u, y, dt=1.0 / RATE, order=order, skip=DROPPED)
    seconds, wall = time.process_time() - start, time.perf_counter() - wall
    forward, drive = found.model.forward(), test[0][0]
    forward.run(drive)
    start = time.process_time()
    forward.run(np.tile(drive, (20, 1)))
    step = (time.process_time() - start) / (20 * len(drive))
    ratio = error(found.model, test)
    rows = [(f"this package, {found.hysteresis} {found.place}", ratio)]
    rows += PUBLISHED if arguments.training else ()
    lines = [
        found.summary(),
        f"\nTest realisations: {len(test)}; mean of rms error over standard deviation, %",
        *(f"  {name:<40} {percent:6.2f}" for name, percent in rows),
        f"Fit: {seconds:.0f} s of processor time, {wall:.0f} s by the clock",
        f"Step: {1e9 * step:.0f} ns",
    ]
    sys.stdout.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
