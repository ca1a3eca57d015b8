"""`simulate` with plants of the user: anything with read() and write(drive)."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest

DT = 1e-4
LIMITS = (-560.0, 560.0)
ACTUATOR = mh.paper.table_1_recovered()
STAGE = mh.plant.SecondOrder(400.0, 0.95)
REFERENCE = mh.signals.sine(3.3, 20.0, seconds=0.1)


def controller(**options: Any) -> mh.control.HybridController:
    kp, ki = mh.paper.gains("A1")
    given = {"kp": kp, "ki": ki, "dt": DT, "limits": LIMITS, **options}
    return mh.control.HybridController(ACTUATOR.inverse(given["limits"]), **given)


def quantised() -> mh.plant.Plant:
    return mh.plant.Plant(
        ACTUATOR, dynamics=STAGE, noise=0.016, limits=LIMITS, dac_bits=14, adc_bits=18,
        adc_range=(-4.0, 4.0), dt=DT, seed=5,
    )  # fmt: skip


class Bench:
    """One of our plants as hardware: two methods, and what else it is told to show."""

    def __init__(self, plant: mh.plant.Plant, *shown: str) -> None:
        self.plant, self.shown = plant, shown

    def read(self) -> float:
        return self.plant.read()

    def write(self, drive: float) -> None:
        self.plant.write(drive)

    def __getattr__(self, name: str) -> Any:
        if name in ("plant", "shown") or name not in self.shown:
            raise AttributeError(name)
        return getattr(self.plant, name)


ALL = ("position", "drive", "limits", "dt")


class Integral:
    """A controller of the user."""

    def __init__(self) -> None:
        self.sum = 0.0

    def step(self, reference: float, measurement: float, /) -> float:
        self.sum += 0.02 * (reference - measurement)
        return 150.0 * self.sum


def surroundings(name: str) -> tuple[Any, dict[str, Any]]:
    """A controller, and what is around it."""
    target = mh.control.invert_dynamics(
        mh.trajectories.Sine(3.3, 20.0), DT, dynamics=STAGE, seconds=0.1
    )
    if name == "object":
        return Integral(), {}
    if name == "preview":
        return controller(preview=mh.control.preview(STAGE, DT, ahead=4), slew=2e5), {}
    around: dict[str, Any] = {
        "target": target,
        "observer": mh.control.Observer(ACTUATOR, dynamics=STAGE, noise=0.016, drift=0.5, dt=DT),
        "repetitive": mh.control.RepetitiveControl(
            500, kp=60.0, ki=6e3, slope=5e-3, dynamics=STAGE, dt=DT, bandwidth=150.0
        ),
        "identifier": mh.RecursiveIdentifier(ACTUATOR, dynamics=STAGE, dt=DT),
        "model_update_interval": 300,
    }
    return controller(), around


def shown(run: mh.plant.Run) -> list[list[float]]:
    return [a.tolist() for a in (run.reference, run.measured, run.position, run.drive)]


@pytest.mark.parametrize("name", ["object", "preview", "everything"])
def test_a_plant_of_ours_behind_two_methods_gives_the_same_bits(name: str) -> None:
    (one, around), (other, beside) = surroundings(name), surroundings(name)
    plant, bench = quantised(), Bench(quantised(), *ALL)
    run = mh.plant.simulate(one, plant, REFERENCE, period=500, **around)
    again = mh.plant.simulate(other, bench, REFERENCE, period=500, **beside)
    assert shown(again) == shown(run)
    assert (repr(again.metrics), again.limits) == (repr(run.metrics), run.limits)
    assert bench.plant.state == plant.state
    if name != "object":
        assert other.state == one.state
    for key in ("observer", "repetitive", "identifier"):
        assert key not in around or beside[key].state == around[key].state


def test_what_an_object_does_not_show_is_what_was_read_and_written() -> None:
    bench, one = Bench(quantised()), controller(limits=(-400.0, 400.0))
    run = mh.plant.simulate(one, bench, REFERENCE)
    twin, plant, drives, measured = controller(limits=(-400.0, 400.0)), quantised(), [], []
    for r in REFERENCE:
        measured.append(plant.read())
        drives.append(twin.step(r, measured[-1]))
        plant.write(drives[-1])
    assert run.drive.tolist() == drives
    assert run.measured.tolist() == run.position.tolist() == measured
    assert run.limits == (-400.0, 400.0)
    assert mh.plant.simulate(Integral(), bench, REFERENCE).limits is None


def test_our_plant_has_the_methods_of_hardware() -> None:
    one, other = quantised(), quantised()
    for drive in (300.0, math.nan, 900.0):
        other.write(drive)
        assert one.step(drive) == other.read() == other.measured
    assert one.state == other.state


class BoucWen:
    """y' = w (d u + h - y), h' = u' (a - (b sign(u' h) + c) |h|), by Euler's method."""

    def __init__(self) -> None:
        self.u = self.h = self.position = 0.0

    def read(self) -> float:
        return self.position

    def write(self, drive: float) -> None:
        pole = 1.0 - math.exp(-2.0 * math.pi * 400.0 * DT)
        move = (drive - self.u) / 20
        for _ in range(20):
            self.h += move * (
                2e-3 - (4e-3 * math.copysign(1.0, move * self.h) + 1e-3) * abs(self.h)
            )
        self.u = drive
        self.position += pole * (5e-3 * drive + self.h - self.position)


def test_hysteresis_of_another_kind_behind_a_lag_is_followed() -> None:
    limits, reference = (-500.0, 500.0), mh.signals.sine(1.5, 10.0, seconds=0.3)
    line = mh.PrandtlIshlinskii([5e-3], [0.0]).inverse(limits)
    largest = {}
    for kp, ki in ((0.0, 0.0), (20.0, 1e5)):
        hybrid = mh.control.HybridController(line, kp=kp, ki=ki, dt=DT, limits=limits)
        plant = BoucWen()
        run = mh.plant.simulate(hybrid, plant, reference, period=1000)
        assert run.settled is not None
        largest[kp] = run.settled.max_position_error
    assert largest[0.0] > 0.25  # um: hysteresis
    assert largest[20.0] < 0.06


# ---- hardware that fails


class Broken(Bench):
    """Fails to write once, at a sample."""

    def __init__(self, plant: mh.plant.Plant, at: int) -> None:
        super().__init__(plant, *ALL)
        self.at, self.written = at, 0

    def write(self, drive: float) -> None:
        if self.written == self.at:
            self.at = -1
            raise OSError(5, "the amplifier is gone")
        self.written += 1
        super().write(drive)


@pytest.mark.parametrize("at", [0, 100])
@pytest.mark.parametrize("ahead", [False, True])
def test_a_write_that_fails_leaves_the_controller_where_the_amplifier_is(
    at: int, ahead: bool
) -> None:
    options = {"preview": mh.control.preview(STAGE, DT, ahead=4)} if ahead else {}
    hybrid, bench = controller(**options), Broken(quantised(), at)
    identifier, twin = (mh.RecursiveIdentifier(ACTUATOR, dynamics=STAGE, dt=DT) for _ in range(2))
    with pytest.raises(OSError, match="the amplifier is gone"):
        mh.plant.simulate(hybrid, bench, REFERENCE, identifier=identifier)
    # by hand, one sample less
    other, plant = controller(**options), quantised()
    filling = len(options["preview"].coefficients) - 1 if ahead else 0
    for k in range(at):
        measured = plant.read()
        drive = other.step(REFERENCE[max(0, k - filling)], measured)
        twin.update(drive, measured)
        plant.write(drive)
    assert hybrid.state == other.state
    assert identifier.state == twin.state
    assert bench.plant.state == plant.state


def test_what_the_object_raises_passes_through() -> None:
    class ToldError(Exception):
        pass

    told = ToldError("by read")

    class Raises(Bench):
        def read(self) -> float:
            raise told

    with pytest.raises(ToldError) as caught:
        mh.plant.simulate(controller(), Raises(quantised()), REFERENCE)
    assert caught.value is told


# ---- missing measurements


class Blinking(Bench):
    """Shows nothing at some samples."""

    def __init__(self, plant: mh.plant.Plant, blind: dict[int, float]) -> None:
        super().__init__(plant, *ALL)
        self.blind, self.k = blind, -1

    def read(self) -> float:
        self.k += 1
        return self.blind.get(self.k, self.plant.read())


def test_readings_of_nan_are_missing_measurements() -> None:
    blind = dict.fromkeys((3, *range(50, 80)), math.nan) | {600: math.inf}
    hybrid, bench = controller(), Blinking(quantised(), blind)
    run = mh.plant.simulate(hybrid, bench, REFERENCE, period=500)
    assert hybrid.missing_count == len(blind)
    missing = np.isin(np.arange(REFERENCE.size), list(blind))
    assert np.array_equal(np.isnan(run.measured), missing)
    assert np.isfinite(run.drive).all() and np.isfinite(run.position).all()
    error = (run.reference - run.measured)[~missing]
    assert run.metrics.max_error == np.abs(error).max()
    assert run.metrics.rmse == pytest.approx(math.sqrt(np.mean(error**2)), rel=1e-12)
    assert run.metrics.samples == REFERENCE.size
    assert run.settled is not None
    assert (run.metrics.missing_count, run.settled.missing_count) == (len(blind), 1)
    assert f"{len(blind)} without a reading" in repr(run.metrics)
    again = copy.deepcopy(run)
    assert repr(again.metrics) == repr(run.metrics)
    assert np.array_equal(again.measured, run.measured, equal_nan=True)


def test_errors_of_nothing_are_nan() -> None:
    class Blind:
        def read(self) -> float:
            return math.nan

        def write(self, drive: float) -> None:
            pass

    run = mh.plant.simulate(controller(), Blind(), REFERENCE)
    metrics = run.metrics
    assert metrics.missing_count == len(run) and metrics.hysteresis_percent is None
    assert all(map(math.isnan, (metrics.max_error, metrics.rmse, metrics.max_position_error)))


# ---- wrong objects


class Given:
    """What a plant gives and takes, one by one."""

    def __init__(self, **attributes: Any) -> None:
        self.read: Callable[[], Any] = lambda: 0.0
        self.write: Callable[[Any], Any] = lambda _: None
        for name, value in attributes.items():
            setattr(self, name, value)


class Wild:
    def step(self, reference: float, measurement: float, /) -> float:
        return math.nan * (reference - measurement)


@pytest.mark.parametrize(
    ("plant", "error", "message"),
    [
        (3, TypeError, r"plant: expected a Plant, or an object with read\(\) and .*, got 3"),
        (Given(read=1.0), TypeError, "plant: expected a Plant, or an object with"),
        (Given(write=None), TypeError, "plant: expected a Plant, or an object with"),
        (
            Given(read=lambda: "1.0"),
            TypeError,
            "plant.read: expected a number at sample 0, got '1.0'",
        ),
        (
            Given(read=lambda: None),
            TypeError,
            "plant.read: expected a number at sample 0, got None",
        ),
        (
            Given(position="here"),
            TypeError,
            "plant.position: expected a number at sample 0, got 'here'",
        ),
        (Given(drive=[1.0]), TypeError, r"plant.drive: expected a number at sample 0, got \[1.0\]"),
        (Given(limits=3.0), TypeError, r"plant.limits: expected two numbers \(low, high\) or None"),
        (
            Given(limits=(1.0, 0.0)),
            ValueError,
            r"plant.limits: expected \(low, high\) with low below",
        ),
        (
            Given(limits=(-9.0, 9.0)),
            ValueError,
            "controller: expected limits within those of the plant",
        ),
        (Given(dt=1e-3), ValueError, "controller: expected one made for the sampling interval"),
        (
            Given(dt=-1.0),
            TypeError,
            r"plant.dt: expected a number of seconds above 0, .*, got -1.0",
        ),
        (Given(dt="fast"), TypeError, "plant.dt: expected a number of seconds above 0, or None"),
    ],
)
def test_wrong_plants_are_named(plant: Any, error: type[Exception], message: str) -> None:
    hybrid = controller()
    before = hybrid.state
    with pytest.raises(error, match=f"^{message}") as caught:
        mh.plant.simulate(hybrid, plant, REFERENCE)
    if "drive" not in message.split(":")[0]:
        assert hybrid.state == before
    assert caught.value.parameter == message.split(":")[0].split(".")[0]  # type: ignore[attr-defined]


def test_a_bad_number_names_its_sample() -> None:
    readings = iter([0.0] * 7 + ["?"])
    with pytest.raises(TypeError, match=r"^plant.read: expected a number at sample 7, got '\?'"):
        mh.plant.simulate(controller(), Given(read=lambda: next(readings)), REFERENCE)
    ahead = controller(preview=mh.control.preview(STAGE, DT, ahead=4))
    with pytest.raises(TypeError, match=r"^plant.read: expected a number before sample 0, while"):
        mh.plant.simulate(ahead, Given(read=lambda: "?"), REFERENCE)


def test_only_finite_drives_are_written_to_objects() -> None:
    written: list[float] = []
    with pytest.raises(ValueError, match=r"^controller.step: expected a finite number at sample 0"):
        mh.plant.simulate(Wild(), Given(write=written.append), REFERENCE)
    assert written == []


def test_no_drive_beyond_stated_limits_is_written() -> None:
    class Wild:
        def step(self, reference: float, measurement: float) -> float:
            return 900.0 + 0.0 * (reference + measurement)

    bench = Bench(quantised(), "limits")
    before = bench.plant.drive
    with pytest.raises(ValueError, match=r"controller.step: expected a drive from -560.0 to 560.0"):
        mh.plant.simulate(Wild(), bench, REFERENCE)
    assert bench.plant.drive == before


def test_a_controller_has_taken_what_was_written_where_the_drive_cannot_be_read_back() -> None:
    class Deaf(Bench):
        @property
        def drive(self) -> float:
            return math.nan

    bench, hybrid = Deaf(quantised()), controller()
    with pytest.raises(ValueError, match=r"plant.drive: expected a finite number at sample 0"):
        mh.plant.simulate(hybrid, bench, 1.0 + REFERENCE)
    twin = controller()
    twin.step(1.0 + REFERENCE[0], quantised().measured)
    assert hybrid.drive == twin.drive


def test_methods_named_as_attributes_are_no_attributes() -> None:
    class Stage(Bench):
        def position(self) -> float:
            raise AssertionError

    run = mh.plant.simulate(controller(), Stage(quantised()), REFERENCE)
    assert np.array_equal(run.position, run.measured)


def test_a_plant_cannot_use_its_controller_meanwhile() -> None:
    hybrid = controller()
    with pytest.raises(RuntimeError, match="in use by a call"):
        mh.plant.simulate(hybrid, Given(read=lambda: hybrid.step(0.0, 0.0)), REFERENCE)
