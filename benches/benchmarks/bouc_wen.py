"""The public Bouc-Wen benchmark, beside the published figures: `make bench-benchmarks`.

The plant is simulated from the equations of J.-P. Noel and M. Schoukens, "Hysteretic benchmark with
a dynamic nonlinearity" (Workshop on Nonlinear System Identification Benchmarks, Brussels, 2016), by
an integrator of this file that knows nothing of the package: m y'' + c y' + k y + z = u,
z' = alpha y' - beta (gamma |y'| z + delta y' |z|), steps of 1/15000 s, records at 750 Hz.
So these are no official records. `--official FOLDER` judges the same models on the official files
(uval_multisine.mat, yval_multisine.mat, uval_sinesweep.mat, yval_sinesweep.mat), in this folder or
below it: hand over the unpacked archive as it is.

A training record is a random-phase multisine of 5-150 Hz, 50 N rms, 8192 samples, five periods,
with white noise of 8e-6 m. Tests have no noise: another multisine, and a sweep of 20-50 Hz, 40 N,
from rest, 10 Hz a minute. Identification is `mh.identify_oscillator(u, y, dt=dt)` with no option;
its seconds are those of the processor, on one core.

Then the true plant is driven, open loop, by the inverse of the identified model for a motion of
5-150 Hz that it has not seen, at 15 kHz, and by the inverse of the best linear oscillator.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

M, C, K = 2.0, 10.0, 5e4
ALPHA, BETA, GAMMA, DELTA = 5e4, 1e3, 0.8, -1.1
RATE, FINE, SAMPLES = 750, 20, 8192
BAND = (5.0, 150.0)
NOISE, PERIODS = 8e-6, 5

# Method, rms error in m over the official multisine test.
KOOPMAN = "Iacob et al., Learning Koopman models from data under general noise conditions, Table 1"
NOEL = "Noel et al., A nonlinear state-space approach to hysteresis identification, 1610.09138"
SCHOUKENS = "Schoukens, Improved initialization of state-space artificial neural networks, 2021"
PUBLISHED = (
    ("linear, in Koopman form", 1.60e-4, KOOPMAN),
    ("state-space network", 2.65e-5, KOOPMAN),
    ("Koopman, input affine", 1.43e-5, KOOPMAN),
    ("polynomial state space", 1.34e-5, KOOPMAN),
    ("PNLSS, 217 parameters", 1.21e-5, NOEL),
    ("gR-SS-NN, best black box", 7.53e-6, SCHOUKENS),
)


def smooth(drive: Array) -> Array:
    """Return the drive at beginning, middle and end of steps, from what it is on half steps."""
    return np.stack([drive[:-2:2], drive[1:-1:2], drive[2::2]], axis=1)


def held(drive: Array) -> Array:
    """Return the same of a drive that is constant in every step."""
    return np.repeat(drive[:, None], 3, axis=1)


def simulate(drive: Array, state: Sequence[float] = (0.0, 0.0, 0.0)) -> tuple[Array, list[float]]:
    """Take Runge-Kutta steps of 1/15000 s: the position at every step, and the last state."""
    h = 1.0 / (RATE * FINE)
    found = np.empty(len(drive))
    y, v, z = state

    def rates(y: float, v: float, z: float, u: float) -> tuple[float, float]:
        force = (u - C * v - K * y - z) / M
        return force, ALPHA * v - BETA * (GAMMA * abs(v) * z + DELTA * v * abs(z))

    for i, (u0, u1, u2) in enumerate(drive.tolist()):
        found[i] = y
        a1, z1 = rates(y, v, z, u0)
        v2 = v + 0.5 * h * a1
        a2, z2 = rates(y + 0.5 * h * v, v2, z + 0.5 * h * z1, u1)
        v3 = v + 0.5 * h * a2
        a3, z3 = rates(y + 0.5 * h * v2, v3, z + 0.5 * h * z2, u1)
        v4 = v + h * a3
        a4, z4 = rates(y + h * v3, v4, z + h * z3, u2)
        y += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4)
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)
        z += h / 6.0 * (z1 + 2.0 * z2 + 2.0 * z3 + z4)
    return found, [y, v, z]


def multisine(rng: np.random.Generator, rms: float) -> Array:
    """Draw a period of random phases on the half steps of the integration."""
    spectrum = np.zeros(SAMPLES * FINE + 1, complex)
    lines = np.arange(np.ceil(BAND[0] * SAMPLES / RATE), BAND[1] * SAMPLES // RATE + 1, dtype=int)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size))
    u: Array = np.fft.irfft(spectrum)
    u *= rms / u.std()
    return u


def periodic(drive: Array) -> tuple[Array, Array]:
    """Simulate a steady period of drive and position at 750 Hz, after one to settle."""
    closed = smooth(np.append(drive, drive[0]))
    _, settled = simulate(closed)
    position, _ = simulate(closed, settled)
    return drive[:: 2 * FINE], position[::FINE]


def sweep(seconds: float = 180.0) -> tuple[Array, Array]:
    """Simulate a sweep from 20 to 50 Hz from rest."""
    t = np.arange(int(seconds * RATE) * 2 * FINE + 1) / (2.0 * RATE * FINE)
    drive = 40.0 * np.sin(2.0 * np.pi * (20.0 * t + 15.0 * t**2 / seconds))
    position, _ = simulate(smooth(drive))
    return drive[: -1 : 2 * FINE], position[::FINE]


def tell(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def error(
    found: mh.results.OscillatorIdentification, u: Array, y: Array, settle: int | None
) -> float:
    model = found.model
    got = model.response(u, dt=1.0 / RATE, hold="band_limited", settle=settle)
    return rms(got + found.output_offset - y)


def wanted(rng: np.random.Generator) -> tuple[Array, float]:
    """Draw two seconds of a motion of 5-150 Hz, begun softly, at 15 kHz."""
    dt = 1.0 / (RATE * FINE)
    t = dt * np.arange(int(2.0 / dt))
    frequencies = np.arange(BAND[0], BAND[1] + 1.0, 2.5)
    phases = 2.0 * np.pi * rng.random(frequencies.size)
    # Amplitudes as a flat force on the mass gives above the resonance, level below it.
    amplitudes = 1.0 / (1.0 + (frequencies / 35.0) ** 2)
    y = np.cos(2.0 * np.pi * frequencies * t[:, None] + phases) @ amplitudes
    y *= 6.6e-4 / y.std() * (1.0 - np.exp(-((t / 0.1) ** 4)))
    return y, dt


def tracking(model: mh.plant.HystereticOscillator, y: Array, dt: float) -> float:
    """Return the rms error of the true plant under the inverse's drive, over that of the motion."""
    position, _ = simulate(held(model.inverse(y, dt=dt)))
    return rms(position - y) / rms(y)


def linear_of(u: Array, y: Array) -> mh.plant.HystereticOscillator:
    """Fit a linear oscillator to the lines of the band, by least squares."""
    lines = np.arange(np.ceil(BAND[0] * SAMPLES / RATE), BAND[1] * SAMPLES // RATE + 1, dtype=int)
    s = 2j * np.pi * lines * RATE / SAMPLES
    spectra = [np.fft.rfft(x)[lines] for x in (u, y)]
    columns = np.stack([spectra[0], -s * spectra[1], -spectra[1]], axis=1)
    sides = [np.concatenate([part.real, part.imag]) for part in (columns, s**2 * spectra[1])]
    (b, c, k), *_ = np.linalg.lstsq(sides[0], sides[1], rcond=None)
    flat = mh.Duhem([-1.0, 1.0], [1e-6, 1e-6], [1e-6, 1e-6])
    return mh.plant.HystereticOscillator(float(b), max(float(c), 0.0), float(k), flat)


def official(folder: Path) -> list[tuple[str, Array, Array, int | None]]:
    """Read the official test records: the multisine is steady, the sweep begins at rest."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    if not folder.is_dir():
        raise ValueError(f"{folder}: expected a folder with the official test files, got none")

    def signal(name: str) -> Array:
        paths = sorted(folder.rglob(f"{name}.mat"))
        if len(paths) != 1:
            got = ", ".join(map(str, paths)) or "none"
            raise ValueError(f"{folder}: expected one file {name}.mat in or below it, got {got}")
        (path,) = paths
        try:
            arrays = loadmat(path)
        except (ValueError, TypeError, NotImplementedError, MatReadError) as failure:
            expected = "expected a MATLAB file of version 7 or earlier"
            raise ValueError(f"{path}: {expected}, got: {failure}") from failure
        if name not in arrays:
            named = ", ".join(sorted(key for key in arrays if not key.startswith("__")))
            raise ValueError(f"{path}: expected an array {name}, got {named}")
        values: Array = np.ravel(arrays[name]).astype(float)
        return values

    tests = []
    for name, key, settle in (
        ("official multisine", "multisine", 1),
        ("official sweep", "sinesweep", None),
    ):
        u, y = signal(f"uval_{key}"), signal(f"yval_{key}")
        if u.size != y.size:
            expected = f"as many numbers in uval_{key}.mat as in yval_{key}.mat"
            raise ValueError(f"{folder}: expected {expected}, got {u.size} and {y.size}")
        for file, values in (("uval", u), ("yval", y)):
            if not np.isfinite(values).all():
                got = f"{values[~np.isfinite(values)][0]}"
                raise ValueError(f"{folder}/{file}_{key}.mat: expected finite numbers, got {got}")
        tests.append((name, u, y, settle))
    return tests


def run(
    seed: int, swept: tuple[Array, Array], tests: Sequence[tuple[str, Array, Array, int | None]]
) -> None:
    rng = np.random.default_rng(seed)
    u, y = periodic(multisine(rng, 50.0))
    record = np.tile(y, PERIODS) + NOISE * rng.standard_normal(PERIODS * SAMPLES)
    start = time.process_time()
    found = mh.identify_oscillator(np.tile(u, PERIODS), record, dt=1.0 / RATE)
    seconds = time.process_time() - start
    other = periodic(multisine(rng, 50.0))
    motion, dt = wanted(rng)
    linear = linear_of(u, y)
    knots = len(found.model.hysteresis.knots)
    tell(
        f"{seed:>4}  {knots:>5}  {found.standard_errors.size:>10}  {seconds:>7.1f}"
        f"  {error(found, *other, 1):>9.2e}  {error(found, *swept, None):>9.2e}"
        f"  {tracking(found.model, motion, dt):>8.3%}  {tracking(linear, motion, dt):>8.1%}",
    )
    for name, test_u, test_y, settle in tests:
        tell(f"      {name}: {error(found, test_u, test_y, settle):.2e} m")


def seed_of(text: str) -> int:
    """Return a seed of random numbers."""
    number = int(text)
    if number < 0:
        raise argparse.ArgumentTypeError(f"expected an integer of at least 0, got {text}")
    return number


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("--seeds", type=seed_of, nargs="+", default=[1, 2, 3, 4])
    parser.add_argument("--official", type=Path, help="folder of the official test files")
    options = parser.parse_args()
    try:
        tests = official(options.official) if options.official else []
    except (OSError, ValueError) as failure:
        parser.error(str(failure))
    judged = "judged on the official tests too" if tests else "no official records"
    tell(f"Bouc-Wen benchmark, simulated from its equations ({judged}).\n")
    tell("Published, rms error over the official multisine test:")
    for name, value, source in PUBLISHED:
        tell(f"  {name:<26} {value:.2e} m   {source}")
    tell("\nHere, rms errors in m over tests without noise, and of tracking an unseen motion:")
    tell("seed  knots  parameters  seconds  multisine      sweep   inverse   linear inverse")
    swept = sweep()
    for seed in options.seeds:
        run(seed, swept, tests)


if __name__ == "__main__":
    main()
