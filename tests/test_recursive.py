"""Recursive identification: least squares that follow, bounded, always with an inverse."""

from __future__ import annotations

import json
import math
import pickle
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from support import (
    BAD,
    Array,
    bits,
)

ACTUATOR = mh.paper.table_1_recovered()
GIVEN = mh.paper.table_1()


def swings(samples: int = 6000) -> Array:
    """Over the whole range, decaying and growing."""
    k = np.arange(samples)
    swing: Array = 500.0 * np.sin(0.02 * k) * (0.55 + 0.45 * np.cos(7.1e-4 * k))
    return swing


def measured(u: Array, noise: float = 0.016, offset: float = 0.7) -> Array:
    y: Array = ACTUATOR.forward().run(u) + offset
    return y + noise * np.random.default_rng(1).standard_normal(u.size)


def updated(identifier: mh.RecursiveIdentifier, u: Array, y: Array) -> Array:
    return np.array([identifier.update(a, b) for a, b in zip(u, y, strict=True)])


def regressor(made: mh.ModifiedPrandtlIshlinskii, u: Array) -> Array:
    """One column for each operator, by the operators themselves."""
    rows = zip(made.r, made.ra, made.rb, made.rc, strict=True)
    return np.column_stack([mh.CoupledPlay(*row).run(u) for row in rows])


@pytest.mark.parametrize("held", [None, 0.7])
def test_without_forgetting_it_is_least_squares(held: float | None) -> None:
    u = swings()
    y = measured(u, noise=0.002)  # with more, some weights of the batch are negative
    offset: Any = "fit" if held is None else held
    identifier = mh.RecursiveIdentifier(GIVEN, forgetting=1.0, output_offset=offset)
    updated(identifier, u, y)
    z = regressor(GIVEN, u)
    if held is None:
        # the last column as large as the others, for the condition of the problem
        weights = np.linalg.lstsq(np.column_stack([z, np.full(u.size, 500.0)]), y, rcond=None)[0]
        expected, expected_offset = weights[:-1], 500.0 * weights[-1]
    else:
        expected, expected_offset = np.linalg.lstsq(z, y - held, rcond=None)[0], held
    assert (expected > 0.0).all()  # so the projection changes nothing
    # weights are 3e-4 to 4e-3 um/V; the given ones count as 1e-12 of a sample
    np.testing.assert_allclose(identifier.model.weights, expected, rtol=0, atol=1e-12)
    assert identifier.model.output_offset == pytest.approx(expected_offset, abs=1e-10)
    assert identifier.frozen is None
    np.testing.assert_array_equal(identifier.model.r, GIVEN.r)  # type: ignore[union-attr]


def test_the_covariance_is_the_inverse_of_the_information() -> None:
    u = swings()
    identifier = mh.RecursiveIdentifier(GIVEN)
    updated(identifier, u, measured(u))
    z = np.column_stack([regressor(GIVEN, u), np.ones(u.size)])
    expected = np.linalg.inv(z.T @ z)
    # the inverse loses the condition of z'z, 1e9 or so
    np.testing.assert_allclose(
        identifier.covariance, expected, rtol=1e-5, atol=1e-6 * abs(expected[0, 0])
    )


def test_it_follows_a_change_with_forgetting_only() -> None:
    u = swings(20_000)
    changed = mh.ModifiedPrandtlIshlinskii(
        1.2 * ACTUATOR.weights, *thresholds(ACTUATOR), output_offset=0.1
    )
    y = np.where(np.arange(u.size) < 5000, ACTUATOR.forward().run(u), changed.forward().run(u))
    follows, averages = (
        mh.RecursiveIdentifier(GIVEN, forgetting=0.999),
        mh.RecursiveIdentifier(GIVEN),
    )
    updated(follows, u, y)
    updated(averages, u, y)
    assert (
        abs(follows.model.weights - changed.weights).max() < 1e-8
    )  # 15 memory lengths: e^-15 is left
    assert abs(averages.model.weights - changed.weights).max() > 1e-5


def thresholds(made: mh.ModifiedPrandtlIshlinskii) -> list[Array]:
    return [made.r, made.ra, made.rb, made.rc]


def test_a_conventional_model_stays_one() -> None:
    actuator = mh.PrandtlIshlinskii([2.0, 0.5, 0.25], [0.0, 1.0, 2.0], input_offset=0.5)
    identifier = mh.RecursiveIdentifier(
        mh.PrandtlIshlinskii([1.0] * 3, [0.0, 1.0, 2.0], input_offset=0.5)
    )
    u = 5.0 * np.sin(0.1 * np.arange(1000.0))
    updated(identifier, u, actuator.forward().run(u))
    assert isinstance(identifier.model, mh.PrandtlIshlinskii)
    np.testing.assert_allclose(identifier.model.weights, actuator.weights, rtol=0, atol=1e-9)
    assert identifier.model.input_offset == 0.5


def test_the_error_is_that_of_the_model_before() -> None:
    u = swings(300)
    y = measured(u, noise=0.3)
    identifier = mh.RecursiveIdentifier(GIVEN, forgetting=0.99)
    forward = GIVEN.forward()
    for a, b in zip(u, y, strict=True):
        forward.set_model(identifier.model)
        expected = b - forward.step(a)
        assert identifier.update(a, b) == pytest.approx(expected, abs=1e-13)


@given(
    st.lists(st.tuples(st.floats(-600, 600), st.floats(-5, 5)), max_size=60),
    st.sampled_from([1.0, 0.99, 0.6]),
)
def test_the_model_is_invertible_at_every_sample(
    samples: list[tuple[float, float]], forgetting: float
) -> None:
    identifier = mh.RecursiveIdentifier(ACTUATOR, forgetting=forgetting)
    for u, y in samples:
        identifier.update(u, y)
        assert (identifier.model.weights >= 0.0).all()
        assert identifier.model.weights[0] >= 0.999e-6 * ACTUATOR.weights[0]
        identifier.model.inverse()


def test_split_models_are_followed() -> None:
    truth = mh.ModifiedPrandtlIshlinskii(
        ACTUATOR.weights,
        *thresholds(ACTUATOR),
        weights_negative=ACTUATOR.weights * np.r_[1.0, np.linspace(0.5, 1.5, 19)],
    )
    given = mh.ModifiedPrandtlIshlinskii(
        GIVEN.weights,
        *thresholds(GIVEN),
        weights_negative=GIVEN.weights * np.r_[1.0, np.full(19, 0.9)],
    )
    identifier = mh.RecursiveIdentifier(given)
    assert identifier.covariance.shape == (40, 40)  # 20 + 19 weights and the offset
    u = swings(20_000)
    updated(identifier, u, truth.forward().run(u))
    # 1e-12 of prior information, and the rounding of 20 000 updates
    found = identifier.model
    assert isinstance(found, mh.ModifiedPrandtlIshlinskii)
    np.testing.assert_allclose(found.weights, truth.weights, atol=1e-9)
    np.testing.assert_allclose(found.weights_negative, truth.weights_negative, atol=1e-9)


def test_dynamics_between_hysteresis_and_measurement_cost_no_accuracy() -> None:
    stage = mh.plant.SecondOrder(400.0, 0.95)
    u = swings(20_000)
    y = stage.response(ACTUATOR.forward().run(u), dt=1e-4)
    identifier = mh.RecursiveIdentifier(GIVEN, dynamics=stage, dt=1e-4)
    updated(identifier, u, y)
    np.testing.assert_allclose(identifier.model.weights, ACTUATOR.weights, atol=1e-9)
    other = pickle.loads(pickle.dumps(identifier))
    assert other.state == identifier.state
    with pytest.raises(TypeError, match="dt: expected the sampling interval in seconds beside dyn"):
        mh.RecursiveIdentifier(GIVEN, dynamics=stage)
    with pytest.raises(
        TypeError, match=r"dynamics: expected FirstOrder, SecondOrder, Antiresonance, .*, got 400"
    ):
        mh.RecursiveIdentifier(GIVEN, dynamics=400, dt=1e-4)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="dt: expected a finite number above 0"):
        mh.RecursiveIdentifier(GIVEN, dynamics=stage, dt=0.0)


def test_weights_that_would_be_negative_are_the_nearest_that_are_not() -> None:
    u = swings(3000)
    actuator = mh.ModifiedPrandtlIshlinskii(
        [4e-3, 3e-4, -2e-4, 3e-4, -1e-4],
        *(100.0 * f * np.arange(5.0) for f in (1.0, 0.95, 0.30, 0.35)),
    )
    start = mh.ModifiedPrandtlIshlinskii(abs(actuator.weights), *thresholds(actuator))
    identifier = mh.RecursiveIdentifier(start, output_offset=0.0)
    y = actuator.forward().run(u)
    updated(identifier, u, y)
    found, z = identifier.model.weights, regressor(actuator, u)
    gradient = z.T @ (z @ found - y) / (np.linalg.norm(z, axis=0) * np.linalg.norm(y))
    # Karush, Kuhn, Tucker: zero where the weight is free, upwards where it is held at zero
    assert (found == 0.0).any()
    assert abs(gradient[found > 0.0]).max() < 1e-9
    assert gradient[found == 0.0].min() > -1e-9


def test_it_freezes_at_standstill_and_wakes() -> None:
    u = swings()
    identifier = mh.RecursiveIdentifier(GIVEN, forgetting=0.999)
    updated(identifier, u, measured(u))
    updated(identifier, np.full(2000, u[-1]), np.full(2000, 1.0))
    assert identifier.frozen == "poor_excitation"
    frozen = identifier.model
    updated(identifier, np.full(2000, u[-1]), np.full(2000, 50.0))
    assert identifier.model == frozen and identifier.frozen == "poor_excitation"
    identifier.update(u[-1] - 100.0, 1.0)
    assert identifier.frozen is None and identifier.model != frozen


def test_forgetting_brings_back_a_bounded_covariance() -> None:
    identifier = mh.RecursiveIdentifier(
        GIVEN, forgetting=0.99, covariance=100.0, covariance_limit=100.0
    )
    u = (
        200.0
        + 8.0 * np.sin(0.3 * np.arange(50_000.0))
        + np.random.default_rng(2).standard_normal(50_000)
    )
    updated(identifier, u, 0.01 * u)
    unit = np.append(np.full(20, 512.0), 1.0)
    eigenvalues = np.linalg.eigvalsh(identifier.covariance * np.outer(unit, unit))
    assert eigenvalues.min() > 0.0 and eigenvalues.max() <= 100.0 / 0.99**21
    assert eigenvalues.max() > 90.0


@pytest.mark.parametrize("bad", BAD)
def test_bad_samples_hold_the_model_and_are_counted(bad: float) -> None:
    identifier = mh.RecursiveIdentifier(GIVEN)
    u = swings(100)
    last = updated(identifier, u, measured(u))[-1]
    held = identifier.model
    assert identifier.update(bad, 1.0) == identifier.update(10.0, bad) == last
    assert (
        identifier.model == held and identifier.rejected == 2 and identifier.frozen == "not_finite"
    )
    identifier.reset()
    assert identifier.rejected == 0 and identifier.frozen is None and identifier.model == GIVEN


def test_a_state_survives_pickle_and_json_bit_for_bit() -> None:
    u = swings(2000)
    y = measured(u, noise=0.5)
    identifier = mh.RecursiveIdentifier(
        GIVEN, forgetting=0.99, output_offset=0.25, covariance=1e6, covariance_limit=50.0
    )
    updated(identifier, u[:1000], y[:1000])
    identifier.update(math.nan, 0.0)
    others = [pickle.loads(pickle.dumps(identifier))]
    for kept in (
        pickle.loads(pickle.dumps(identifier.state)),
        json.loads(json.dumps(identifier.state)),
    ):
        other = mh.RecursiveIdentifier(
            GIVEN, forgetting=0.99, output_offset=0.25, covariance=1e6, covariance_limit=50.0
        )
        other.state = kept
        others.append(other)
    expected = updated(identifier, u[1000:], y[1000:])
    for other in others:
        assert other.rejected == 1
        assert bits(updated(other, u[1000:], y[1000:])) == bits(expected)
        assert other.state == identifier.state and other.model == identifier.model


def test_a_wrong_state_is_refused_and_changes_nothing() -> None:
    identifier = mh.RecursiveIdentifier(GIVEN)
    identifier.update(100.0, 0.4)
    good = identifier.state
    wrong: list[Any] = [{}, None, {**good, "extra": 1}, {**good, "turn": 21}, {**good, "turn": -1}]
    wrong += [{**good, "estimate": good["estimate"][1:]}, {**good, "outputs": [math.nan] * 20}]
    wrong += [{**good, "published": [-1.0] * 21}, {**good, "frozen": "cold"}]
    for state in wrong:
        with pytest.raises(ValueError, match=r"^state: expected "):
            identifier.state = state
        assert identifier.state == good


@pytest.mark.parametrize(
    ("options", "kind", "message"),
    [
        ({"forgetting": 1.1}, ValueError, r"forgetting: expected a number from 0.5 to 1, got 1.1"),
        (
            {"forgetting": math.nan},
            ValueError,
            r"forgetting: expected a number from 0.5 to 1, got NaN",
        ),
        (
            {"covariance": -1.0},
            ValueError,
            r"covariance: expected a number from 1e-30 to 1e30, got -1.0",
        ),
        ({"covariance_limit": 0.0}, ValueError, r"covariance_limit: expected .*, got 0.0"),
        (
            {"output_offset": math.inf},
            ValueError,
            r"output_offset: expected a finite number .*, got inf",
        ),
        (
            {"output_offset": "fix"},
            TypeError,
            r"output_offset: expected \"fit\" or a number, got 'fix'",
        ),
        ({"model": 3.0}, TypeError, r"model: expected a PrandtlIshlinskii or .*, got 3.0"),
        (
            {"model": mh.PrandtlIshlinskii([1.0], [2.0])},
            mh.NotInvertibleError,
            r"the model is not invertible: .*",
        ),
    ],
)
def test_wrong_arguments_are_named(
    options: dict[str, Any], kind: type[Exception], message: str
) -> None:
    with pytest.raises(kind, match=f"^{message}$"):
        mh.RecursiveIdentifier(**{"model": GIVEN, **options})
    with pytest.raises(TypeError):
        mh.RecursiveIdentifier(GIVEN).update("a", 1.0)  # type: ignore[arg-type]


def test_a_controller_gets_better_models_while_it_runs() -> None:
    weights = ACTUATOR.weights * np.where(np.arange(20) % 2 == 0, 1.25, 0.7)
    plant = mh.ModifiedPrandtlIshlinskii(
        weights, *thresholds(ACTUATOR), output_offset=0.2
    ).forward()
    inverse = ACTUATOR.inverse(limits=(-500.0, 500.0))
    identifier = mh.RecursiveIdentifier(ACTUATOR, forgetting=0.999)
    k = np.arange(15_000)
    targets = 2.5 * np.sin(0.01 * k) * (0.6 + 0.4 * np.cos(3.7e-4 * k))
    errors = np.empty(k.size)
    for i, target in enumerate(targets):
        drive = inverse.step(target)
        y = plant.step(drive)
        identifier.update(drive, y)
        errors[i] = y - target
        inverse.set_model(identifier.model)
        assert inverse.peek(math.nan) == drive
    assert abs(errors[:100]).max() > 0.1
    assert abs(errors[10_000:]).max() < 1e-6
