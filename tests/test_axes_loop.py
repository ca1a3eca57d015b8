"""`simulate` for several axes, and what does not fit."""

from __future__ import annotations

import math
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from axes import CROSSTALK, DT, LAG, LIMITS, MODELS, controllers, made, plants, raster
from support import Array

# ---- the loop


class Bench:
    """A plant of several axes as hardware."""

    def __init__(self, plant: mh.plant.MultiAxisPlant) -> None:
        self.plant, self.fails, self.blind = plant, -1, -1
        self.k = -1

    def read(self) -> Array:
        self.k += 1
        shown = self.plant.read()
        if self.k == self.blind:
            shown[1] = math.nan
        return shown

    def write(self, drives: Array) -> None:
        if self.k == self.fails:
            raise OSError(5, "gone")
        self.plant.write(drives)

    def __getattr__(self, name: str) -> Any:
        if name not in ("position", "drive", "limits", "dt"):
            raise AttributeError(name)
        return getattr(self.plant, name)


def same(one: list[mh.plant.Run], other: list[mh.plant.Run]) -> None:
    assert len(one) == len(other)
    for a, b in zip(one, other, strict=True):
        for name in ("reference", "measured", "position", "drive"):
            assert np.array_equal(getattr(a, name), getattr(b, name))
        assert (a.limits, repr(a.metrics)) == (b.limits, repr(b.metrics))


@pytest.mark.parametrize("ahead", [0, 4])
def test_the_loop_is_what_steps_make_also_behind_two_methods(ahead: int) -> None:
    options = {"preview": mh.control.preview(LAG, DT, ahead=ahead)} if ahead else {}
    filling = len(options["preview"].coefficients) - 1 if ahead else 0
    reference = raster(0.05)[::-1].copy()

    def both() -> tuple[mh.control.MultiAxisController, mh.plant.MultiAxisPlant]:
        axes = mh.control.MultiAxisController(controllers(2, **options), np.linalg.inv(CROSSTALK))
        return axes, mh.plant.MultiAxisPlant(plants(2, 0.016), CROSSTALK)

    axes, stage = both()
    runs = mh.plant.simulate(axes, stage, reference, period=250)
    by_hand, plant = both()
    rows = np.r_[
        np.repeat(reference[:1], filling, axis=0),
        reference,
        np.repeat(reference[-1:], ahead, axis=0),
    ]
    drives, seen = [], []
    for row in rows:
        seen.append(plant.read())
        drives.append(by_hand.step(row, seen[-1]))
        plant.write(drives[-1])
    for i, run in enumerate(runs):
        assert run.drive.tolist() == [u[i] for u in drives[filling + ahead :]]
        assert run.measured.tolist() == [y[i] for y in seen[filling + ahead :]]
        assert run.reference.tolist() == reference[:, i].tolist()
        assert (run.period, run.limits) == (250, LIMITS)
    assert by_hand.state == axes.state and plant.state == stage.state
    axes, stage = both()
    same(mh.plant.simulate(axes, Bench(stage), reference, period=250), runs)
    assert by_hand.state == axes.state


def test_hardware_that_fails_leaves_all_controllers_before_that_sample() -> None:
    axes, other = made(), made()
    bench, plant = (
        Bench(mh.plant.MultiAxisPlant(plants(2), CROSSTALK)),
        mh.plant.MultiAxisPlant(plants(2), CROSSTALK),
    )
    bench.fails = 100
    with pytest.raises(OSError, match="gone"):
        mh.plant.simulate(axes, bench, raster())
    mh.plant.simulate(other, plant, raster()[:100])
    assert axes.state == other.state
    assert bench.plant.state == plant.state


def test_a_missing_reading_of_one_axis_is_nan_there() -> None:
    axes, bench = made(), Bench(mh.plant.MultiAxisPlant(plants(2), CROSSTALK))
    bench.blind = 10
    runs = mh.plant.simulate(axes, bench, raster(0.05))
    assert [run.metrics.missing_count for run in runs] == [0, 1]
    assert np.flatnonzero(np.isnan(runs[1].measured)).tolist() == [10]
    assert axes.missing_count.tolist() == [1, 1]


class Law:
    """A controller of several axes of the user."""

    def __init__(self) -> None:
        self.sum = np.zeros(2)

    def step(self, references: Array, measurements: Array, /) -> Array:
        self.sum += 5.0 * (references - measurements)
        return self.sum


def test_a_controller_of_the_user_gets_and_gives_arrays() -> None:
    one, other = Law(), Law()
    stage, bench = (mh.plant.MultiAxisPlant(plants(2), CROSSTALK) for _ in range(2))
    runs = mh.plant.simulate(one, stage, raster(0.05))
    again = mh.plant.simulate(other, Bench(bench), raster(0.05))
    same(again, runs)
    assert runs[0].metrics.max_position_error < 2.5


def test_targets_of_all_axes_lead_the_feed_forward() -> None:
    reference = raster(0.1)
    target = np.roll(reference, -3, axis=0)
    target[-3:] = reference[-1]
    errors: list[float] = []
    around: list[dict[str, Any]] = [{}, {"target": target}]
    for keywords in around:
        stage = mh.plant.MultiAxisPlant(plants(2), CROSSTALK)
        x, _ = mh.plant.simulate(made(), stage, reference, period=500, **keywords)
        assert x.settled is not None
        errors.append(x.settled.max_position_error)
    assert errors[1] < 0.8 * errors[0]


# ---- wrong input

Stage, Axes = mh.plant.MultiAxisPlant, mh.control.MultiAxisController
OBSERVER = mh.control.Observer(MODELS[0], dynamics=LAG, noise=0.016, drift=0.5, dt=DT)


def simulated(**changes: Any) -> Any:
    given: dict[str, Any] = {
        "controller": made(),
        "plant": Stage(plants(2), CROSSTALK),
        "reference": raster(0.01),
    }
    return lambda: mh.plant.simulate(**{**given, **changes})


NO_PLANT = type("NoPlant", (), {"read": lambda _: 0.0, "write": lambda _, __: None})()
THREE = type("Three", (), {"read": lambda _: [0.0] * 3, "write": lambda _, __: None})()


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda: Stage([], []), ValueError, "coupling: |plants: "),
        (lambda: Stage(3, []), TypeError, "plants: expected a list of Plant, got 3"),  # type: ignore[arg-type]
        (lambda: Stage([3], [[1.0]]), TypeError, r"plants\[0\]: expected a Plant, got 3"),  # type: ignore[list-item]
        (
            lambda: Stage(plants(2), np.eye(3)),
            ValueError,
            r"coupling: expected an array of shape \(2, 2\), got shape \(3, 3\)",
        ),
        (
            lambda: Stage(plants(2), [[1.0, 2.0], [2.0, 4.0]]),
            ValueError,
            "coupling: expected an invertible matrix .* at most 1e10, got inf",
        ),
        (
            lambda: Stage(plants(2), [[1.0, math.nan], [0.0, 1.0]]),
            ValueError,
            r"coupling\[1\]: expected a finite number",
        ),
        (
            lambda: Stage([*plants(1), *plants(1, dt=1e-3)], np.eye(2)),
            ValueError,
            r"plants\[1\]: expected 0.0001, the sampling interval of .*, got 0.001",
        ),
        (
            lambda: Stage(plants(2), np.eye(2)).step([1.0]),
            ValueError,
            "drives: expected 2 elements, got 1",
        ),
        (
            lambda: Stage(plants(2), np.eye(2)).run([[1.0]]),
            ValueError,
            r"drives: expected an array of shape \(samples, 2\), got shape \(1, 1\)",
        ),
        (lambda: Axes([]), ValueError, "controllers: expected at least one element"),
        (
            lambda: Axes([*controllers(1), *controllers(1, dt=1e-3)]),
            ValueError,
            r"controllers\[1\]: expected 0.0001, the sampling interval of the first one",
        ),
        (
            lambda: Axes(
                [*controllers(1), *controllers(1, preview=mh.control.Preview([0.5, 0.5], 1))]
            ),
            ValueError,
            r"controllers\[1\]: expected 0, the length of the preview of",
        ),
        (
            lambda: Axes(controllers(2), [[1.0, 1.0], [1.0, 1.0]]),
            ValueError,
            "decoupling: expected an invertible matrix",
        ),
        (
            lambda: made().step([1.0], [1.0, 2.0]),
            ValueError,
            r"references: expected an array of shape \(2,\), got shape \(1,\)",
        ),
        (
            lambda: made().step([1.0, 2.0], [1.0, 2.0], out=np.empty(3)),
            ValueError,
            "out: expected 2 elements, got 3",
        ),
        (
            lambda: made().run([[1.0, 2.0]], [[1.0, 2.0]] * 2),
            ValueError,
            "measurements: expected 1 rows",
        ),
        (
            simulated(reference=[0.0, 1.0]),
            ValueError,
            r"reference: expected an array of shape \(samples, 2\)",
        ),
        (
            simulated(reference=np.zeros((5, 3))),
            ValueError,
            r"reference: expected an array of shape \(samples, 2\), got shape \(5, 3\)",
        ),
        (
            simulated(period=100),
            ValueError,
            "period: expected a number from 0.0 to 99.0, got 100.0",
        ),
        (
            simulated(target=raster(0.02)),
            ValueError,
            "target: expected 100 samples as in the reference, got 200",
        ),
        (
            simulated(observer=OBSERVER),
            TypeError,
            "controller: expected a HybridController of one axis beside correction",
        ),
        (
            simulated(controller=controllers(1)[0]),
            TypeError,
            "controller: expected a MultiAxisController for a plant",
        ),
        (
            simulated(controller=Axes(controllers(3))),
            ValueError,
            "controller: expected one for 2 axes, as the plant has, got one for 3",
        ),
        (
            simulated(plant=Stage(plants(2, dt=1e-3), CROSSTALK)),
            ValueError,
            "controller: expected one made for the sampling interval of 0.001 s",
        ),
        (
            simulated(plant=Stage(plants(2, limits=(-9.0, 9.0)), CROSSTALK)),
            ValueError,
            "controller: expected limits within those of the plant",
        ),
        (
            simulated(plant=NO_PLANT),
            TypeError,
            "plant.read: expected 2 numbers at sample 0, got 0.0",
        ),
        (
            simulated(plant=THREE),
            TypeError,
            r"plant.read: expected 2 numbers at sample 0, got \[0.0, 0.0, 0.0\]",
        ),
        (
            simulated(plant=plants(1)[0]),
            TypeError,
            r"plant: expected a MultiAxisPlant, or an object with read\(\) and",
        ),
    ],
)
def test_what_does_not_fit_is_named(call: Any, error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=f"^({message})"):
        call()
