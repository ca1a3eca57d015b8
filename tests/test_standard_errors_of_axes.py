"""Standard errors of hysteresis inside and of several axes: what noise makes of the estimates."""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import Array

DT = 1e-3
SEEDS = 8
# The thresholds that the identification puts over drives of at most 1.
THRESHOLDS = np.arange(1, 9) / 9.0
WEIGHTS = 0.6 * np.exp(-np.arange(8) / 4.0)


def coloured(noise: Array) -> Array:
    """Return noise of the same size whose samples go together for 15 of them."""
    mean = np.ones(15) / np.sqrt(15.0)
    return np.apply_along_axis(lambda one: np.convolve(one, mean, "same"), 0, noise)


def measured(y: Array, share: float, seed: int, is_coloured: bool) -> Array:
    noise = np.random.default_rng(seed).standard_normal((y.shape[0] + 40, *y.shape[1:]))
    noise = (coloured(noise) if is_coloured else noise)[20:-20]
    return np.asarray(y + share * y.std(axis=0) * noise)


def spread(estimates: list[Array], claimed: list[Array]) -> Array:
    """Return the standard errors that are claimed over how far the estimates scatter."""
    return np.asarray(np.median(claimed, axis=0) / np.std(estimates, axis=0, ddof=1))


# ---- one mode, hysteresis inside


@pytest.mark.parametrize("is_coloured", [False, True])
def test_parameters_of_an_oscillator_scatter_as_they_say(is_coloured: bool) -> None:
    plant = mh.plant.HystereticOscillator(
        0.5, 5.0, 2.5e4, mh.Duhem.from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)
    )
    t = DT * np.arange(1500)
    u = 60.0 * np.sin(2.0 * np.pi * (5.0 + 95.0 / 3.0 * t) * t) * np.minimum(t / 0.1, 1.0)
    y = plant.response(u, dt=DT)
    distances = []
    for seed in range(SEEDS):
        noisy = measured(y, 2e-3, seed, is_coloured)
        found = mh.identify_oscillator(u, noisy, dt=DT, hold="zero", knots=3)
        model, z = found.model, np.asarray(found.model.hysteresis.knots)
        pairs: list[Any] = [
            (model.gain - 0.5, found.gain_std),
            (model.damping - 5.0, found.damping_std),
            (model.stiffness - 2.5e4, found.stiffness_std),
            (found.output_offset, found.output_offset_std),
            (model.hysteresis.rising - (2.5e4 - 800.0 * z + 1100.0 * abs(z)), found.rising_std),
            (model.hysteresis.falling - (2.5e4 + 800.0 * z + 1100.0 * abs(z)), found.falling_std),
        ]
        distances.append(np.concatenate([np.atleast_1d(missed / std) for missed, std in pairs]))
        stds = np.concatenate([np.atleast_1d(std) for _, std in pairs])
        assert (stds == found.standard_errors[[0, 1, 2, -1, *range(3, 9)]]).all()
    # The rms distance from the truth in standard errors, of each parameter and of all.
    rms = np.sqrt(np.mean(np.square(distances), axis=0))
    assert 0.6 < np.sqrt(np.mean(rms**2)) < 1.6, rms


# ---- several axes


def drives(seed: int) -> Array:
    noise = np.random.default_rng(seed).standard_normal((1200, 2))
    u = np.apply_along_axis(lambda one: np.convolve(one, np.ones(8), "same"), 0, noise)
    return np.asarray(u / abs(u).max(axis=0))


def plant_of_plays() -> mh.MultiAxisStage:
    radius, turn = 0.9, 0.7
    s, c = radius * np.sin(turn), radius * np.cos(turn)
    return mh.MultiAxisStage(
        [[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 0.6]],
        [[0.3, 0.05], [0.2, 0.0], [0.0, 0.3]],
        [[1.0, 0.2, 0.1], [-0.1, 0.0, 1.0]],
        np.zeros((2, 2)),
        bw=[[0.15, 0.0], [0.1, 0.0], [0.0, 0.2]],
        cq=np.zeros((2, 3)),
        dq=np.eye(2),
        operators=[(THRESHOLDS, WEIGHTS)] * 2,
        dt=DT,
    )


def moved(stage: mh.MultiAxisStage, deviations: Array) -> Array:
    """Return by how much a constant w of each operator moves the positions."""
    a, bw, c = (np.asarray(matrix) for matrix in (stage.a, stage.bw, stage.c))
    gains = c @ np.linalg.solve(np.eye(len(a)) - a, bw) / deviations[:, None]
    return np.asarray(np.linalg.norm(gains, axis=0))


@pytest.mark.parametrize("is_coloured", [False, True])
def test_modes_plays_and_offsets_of_axes_scatter_as_they_say(is_coloured: bool) -> None:
    u, true = [drives(seed) for seed in (1, 2, 3)], plant_of_plays()
    y = [true.forward().run(one) for one in u]
    estimates, claimed = [], []
    for seed in range(SEEDS):
        noisy = [measured(one, 3e-3, 10 * seed + i, is_coloured) for i, one in enumerate(y)]
        found = mh.identify_axes(
            u, noisy, dt=DT, order=3, hysteresis="plays", place="in_front", skip=20
        )
        gains = moved(found.model, found.deviations)
        operators: list[Any] = found.model.operators
        weights = [np.asarray(operator[1]) for operator in operators]
        assert [one.size for one in weights] == [one.size for one in found.operators_std] == [8, 8]
        # Of w and bw the records tell the product alone.
        estimates.append(
            np.concatenate(
                [
                    np.ravel(found.modes),
                    found.model.output_offset,
                    weights[0] * gains[0],
                    weights[1] * gains[1],
                ]
            )
        )
        stds = found.operators_std
        assert all((std > 0.0).all() and np.isfinite(std).all() for std in stds)
        claimed.append(
            np.concatenate(
                [
                    np.ravel(found.modes_std),
                    found.output_offset_std,
                    stds[0] * gains[0],
                    stds[1] * gains[1],
                ]
            )
        )
        assert "Mode: " in found.summary() and "Operator 1: threshold" in found.summary()
    ratio = spread(estimates, claimed)
    assert 0.5 < np.exp(np.mean(np.log(ratio))) < 1.5, ratio
    rate = -np.log(0.9)
    natural = np.hypot(rate, 0.7)
    truth = np.concatenate(
        [
            [natural / (2.0 * np.pi * DT), rate / natural, 0.0, 0.0],
            *(WEIGHTS * gain for gain in moved(true, found.deviations)),
        ]
    )
    distance = np.sqrt(np.mean(((np.asarray(estimates) - truth) / claimed) ** 2))
    assert 0.5 < distance < 1.5, distance


def slopes_of_truth(z: Array, rising: bool) -> Array:
    """Return f of the operators below between their knots, NaN beyond."""
    low, high = (1.5, 0.6) if rising else (0.6, 1.5)
    return np.asarray(np.interp(z, [-2.0, 0.0, 2.0], [low, 1.0, high], np.nan, np.nan))


def test_f_of_axes_scatters_as_it_says() -> None:
    plays = plant_of_plays()
    parts = {name: getattr(plays, name) for name in ("a", "b", "c", "d", "bw", "dq")}
    operators = [mh.Duhem([-2.0, 0.0, 2.0], [1.5, 1.0, 0.6], [0.6, 1.0, 1.5])] * 2
    cq = [[0.3, 0.0, 0.0], [0.0, 0.2, 0.2]]
    true = mh.MultiAxisStage(**parts, cq=cq, operators=operators, dt=DT)
    u = [3.0 * drives(seed) for seed in (1, 2, 3)]
    y = [true.forward().run(one) for one in u]
    of_drives = np.vstack([one[20:] for one in u]).std(axis=0)

    def seen(stage: mh.MultiAxisStage) -> Array:
        a, b, cq, dq = (np.asarray(one) for one in (stage.a, stage.b, stage.cq, stage.dq))
        gains = (dq + cq @ np.linalg.solve(np.eye(len(a)) - a, b)) * of_drives
        return np.asarray(np.linalg.norm(gains, axis=1))

    distances: list[float] = []
    for seed in range(4):
        noisy = [measured(one, 3e-3, 10 * seed + i, False) for i, one in enumerate(y)]
        found = mh.identify_axes(
            u, noisy, dt=DT, order=3, hysteresis="duhem", place="inside", skip=20
        )
        # The same w and q are larger or smaller numbers there.
        of_w = moved(found.model, found.deviations) / moved(true, found.deviations)
        of_q = seen(found.model) / seen(true)
        for i, operator in enumerate(found.model.operators):
            assert isinstance(operator, mh.Duhem)
            z = of_w[i] * np.asarray(operator.knots)
            truth = np.concatenate([slopes_of_truth(z, rising) for rising in (True, False)])
            f = np.concatenate([operator.rising, operator.falling])
            # None at the bound, infinite where z never was.
            std = found.operators_std[i]
            assert ((std > 0.0) | np.isnan(std)).all(), std
            distance = (f - truth / (of_w[i] * of_q[i])) / std
            distances += distance[np.isfinite(distance) & np.isfinite(std)].tolist()
    assert len(distances) > 30
    assert 0.5 < np.median(np.abs(distances)) / 0.674 < 1.6, distances


def test_a_linear_stage_has_modes_and_offsets_alone() -> None:
    u = [drives(seed) for seed in (1, 2)]
    stage = mh.MultiAxisStage(
        [[0.7, 0.5], [-0.5, 0.7]], [[0.3, 0.0], [0.0, 0.2]], np.eye(2), np.zeros((2, 2)),
        bw=np.zeros((2, 0)), cq=np.zeros((0, 2)), dq=np.zeros((0, 2)), operators=[], dt=DT,
    )  # fmt: skip
    y = [measured(stage.forward().run(one), 1e-2, i, False) for i, one in enumerate(u)]
    found = mh.identify_axes(u, y, dt=DT, order=2, hysteresis="none")
    ((frequency, damping),) = found.modes
    rate, turn = -np.log(np.hypot(0.7, 0.5)), np.arctan2(0.5, 0.7)
    natural = np.hypot(rate, turn)
    ((of_frequency, of_damping),) = found.modes_std
    assert abs(frequency - natural / (2.0 * np.pi * DT)) < 5.0 * of_frequency < 0.01 * frequency
    assert abs(damping - rate / natural) < 5.0 * of_damping < 0.05 * damping
    assert found.operators_std == []
    assert (abs(found.model.output_offset) < 5.0 * found.output_offset_std).all()
