"""Hysteresis inside dynamics of one and of two modes, on plants written without the package."""

from __future__ import annotations

import mpi_hyst as mh
import numpy as np
import numpy.typing as npt
import pytest

Array = npt.NDArray[np.float64]

DT = 1.0 / 750.0


def multisine(seed: int, rms: float) -> Array:
    """Random phases from 5 to 150 Hz, in N."""
    samples = 2048
    frequency = np.fft.rfftfreq(samples, DT)
    phases = np.random.default_rng(seed).uniform(0.0, 2.0 * np.pi, frequency.size)
    band = (frequency >= 5.0) & (frequency <= 150.0)
    u = np.fft.irfft(np.where(band, np.exp(1j * phases), 0.0), samples)
    return np.asarray(rms * u / u.std())


def chain(drive: Array, modes: int) -> Array:
    """The first mass of a chain on a Bouc-Wen spring: Runge-Kutta steps, ten in a sample."""
    mass = np.array([2.0, 1.0][:modes])
    coupling = 6e4 * np.array([[1.0, -1.0], [-1.0, 1.0]]) if modes == 2 else np.zeros((1, 1))
    stiffness = coupling + np.diag([5e4, 0.0][:modes])
    damping = 3.0 * np.diag(mass) + 5e-5 * stiffness
    first = np.eye(modes)[0]

    def rates(state: Array, force: float) -> Array:
        x, v, z = state[:modes], state[modes:-1], state[-1]
        a = ((force - z) * first - stiffness @ x - damping @ v) / mass
        rate = 5e4 * v[0] - 800.0 * abs(v[0]) * z + 1100.0 * v[0] * abs(z)
        return np.concatenate([v, a, [rate]])

    h, state, positions = DT / 10.0, np.zeros(2 * modes + 1), np.empty(drive.size)
    for k, force in enumerate(drive):
        positions[k] = state[0]
        for _ in range(10):
            k1 = rates(state, force)
            k2 = rates(state + 0.5 * h * k1, force)
            k3 = rates(state + 0.5 * h * k2, force)
            k4 = rates(state + h * k3, force)
            state = state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return positions


@pytest.mark.parametrize("modes", [1, 2])
def test_a_restoring_force_with_hysteresis_is_found(modes: int) -> None:
    u = [multisine(seed, 50.0) for seed in (1, 2)]
    clean = [chain(one, modes) for one in u]
    rng = np.random.default_rng(4)
    y = [one + 1e-3 * one.std() * rng.standard_normal(one.size) for one in clean]
    columns = ([one[:, None] for one in signals] for signals in (u, y))
    found = mh.identify_axes(*columns, dt=DT)
    assert (found.hysteresis, found.place) == ("duhem", "inside")
    assert found.linear_errors[0] > 0.15 * found.deviations[0]
    for rms in (50.0, 35.0):
        drive = multisine(3, rms)
        test = chain(drive, modes)
        error = found.model.forward().run(drive[:, None])[:, 0] - test
        assert np.sqrt((error**2).mean()) < 0.02 * test.std(), rms


def test_a_sample_that_is_no_number_is_named_by_its_row() -> None:
    u, y = np.ones((200, 2)), np.ones((200, 2))
    y[150, 1] = np.nan
    with pytest.raises(ValueError, match=r"y\[150\]: expected a finite number .*, got NaN"):
        mh.identify_axes(u, y, dt=DT)
