"""Random controllers, each with its plain Python twin, and what may happen to them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mpi_hyst as mh
import numpy as np
import reference
from hypothesis import strategies as st
from support import BAD

R = [0.0, 60.0, 150.0, 300.0]
WEIGHTS = ([4.3e-3, 6e-4, 5e-4, 4e-4], [5.0e-3, 2e-4, 9e-4, 0.0])
RATIOS = {"ra": 0.95, "rb": 0.30, "rc": 0.35}


def actuator(which: int = 0) -> mh.ModifiedPrandtlIshlinskii:
    """One of two actuators of the same operators, volts in and um out."""
    return mh.ModifiedPrandtlIshlinskii.from_ratios(WEIGHTS[which], R, **RATIOS)


def feedforward(source: str | None, limits: tuple[float, float]) -> Any:
    """What mh.control.HybridController takes."""
    if source == "exact":
        return actuator().inverse(limits)
    return actuator().parametric_inverse().forward() if source == "parametric" else source


def twin_feedforward(source: str | None, limits: tuple[float, float]) -> Any:
    """The same from the twins."""
    if source == "exact":
        return actuator().inverse(limits).step  # itself compared with its twin in test_laws.py
    if source != "parametric":
        return source
    bank = actuator().parametric_inverse()
    return reference.ModifiedPrandtlIshlinskii(
        list(bank.weights), list(bank.r), list(bank.ra), list(bank.rb), list(bank.rc)
    ).step


@dataclass(frozen=True)
class Drawn:
    """The arguments of a controller."""

    source: str | None
    window: tuple[list[float], int, bool] | None
    """Coefficients, how many samples references come early, whether they are smoothed besides."""
    keywords: dict[str, Any]

    def controller(self, **others: Any) -> mh.control.HybridController:
        keywords = {**self.keywords, **others}
        keywords["filters"] = [mh.control.Biquad(*section) for section in keywords["filters"]]
        preview = None
        if self.window is not None:
            coefficients, ahead, smooth = self.window
            preview = mh.control.Preview(coefficients, ahead, DT)
            preview = preview.smoothed(SMOOTHING) if smooth else preview
        source = feedforward(self.source, keywords["limits"])
        return mh.control.HybridController(source, preview=preview, **keywords)

    def twin(self) -> reference.Controller:
        source = twin_feedforward(self.source, self.keywords["limits"])
        slew = self.keywords["slew"]
        keywords = {**self.keywords, "slew": math.inf if slew is None else slew}
        window, kernel = None, [1.0]
        if self.window is not None:
            coefficients, ahead, smooth = self.window
            window, kernel = (coefficients, ahead), KERNEL if smooth else kernel
        return reference.Controller(source, window=window, kernel=kernel, **keywords)


def numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False)


DT = 1e-4
SMOOTHING = 9e-4  # s: three means over three samples
KERNEL = (np.array([1.0, 3.0, 6.0, 7.0, 6.0, 3.0, 1.0]) / 27.0).tolist()
GAINS = st.just(0.0) | numbers(1e-3, 100.0)
INTEGRAL_GAINS = st.just(0.0) | numbers(10.0, 1e6)
"""Of the same size in one sample as the others."""
TRACKING = st.tuples(st.just("back_calculation"), st.none() | numbers(1e-5, 1.0))
ANTI_WINDUPS = st.tuples(st.just("conditional"), st.none()) | TRACKING


@st.composite
def sections(draw: st.DrawFn) -> reference.control.Section:
    """A section of poles at a radius and an angle, which may ring for many samples."""
    b = draw(st.tuples(numbers(-2.0, 2.0), numbers(-2.0, 2.0), numbers(-2.0, 2.0)))
    radius, angle = draw(numbers(0.0, 0.99)), draw(numbers(0.0, 3.1))
    return b, (-2.0 * radius * math.cos(angle), radius * radius)


FILTERS = st.lists(sections(), max_size=3)


@st.composite
def setups(draw: st.DrawFn, laws: tuple[str, ...] = ("positional", "incremental")) -> Drawn:
    """Any feed-forward, preview, limits and law."""
    window = None
    if draw(st.booleans()):
        coefficients = draw(st.lists(numbers(-3.0, 3.0), min_size=1, max_size=5))
        window = (coefficients, draw(st.integers(0, len(coefficients) - 1)), draw(st.booleans()))
    law = draw(st.sampled_from(laws))
    anti_windup, tracking_time = draw(ANTI_WINDUPS)
    filters, negative = draw(FILTERS), draw(st.booleans())
    keywords = {
        # Behind filters it may be negative: active damping.
        "kp": draw(GAINS) * (-1.0 if filters and negative else 1.0),
        "filters": filters,
        "ki": draw(INTEGRAL_GAINS),
        "dt": DT,
        "limits": draw(st.sampled_from([(-500.0, 500.0), (-20.0, 150.0), (30.0, 100.0)])),
        "slew": draw(st.none() | numbers(1e3, 1e6)),
        "law": law,
        "anti_windup": anti_windup,
        "tracking_time": tracking_time,
        "bumpless_time": draw(st.just(0.0) | numbers(1e-4, 0.1)),
        "max_missing": draw(st.integers(0, 3)),
    }
    source = draw(st.sampled_from([None, "given", "exact", "parametric"]))
    return Drawn(source, window, keywords)


Call = tuple[tuple[float, float, float | None], dict[str, Any]]

GOOD = numbers(-4.0, 4.0)
WILD = st.one_of(GOOD, GOOD, GOOD, numbers(-1e3, 1e3), numbers(-1e9, 1e9), st.sampled_from(BAD))


def calls(number: st.SearchStrategy[float] = WILD) -> st.SearchStrategy[Call]:
    """The arguments of a step."""
    volts = st.none() | numbers(-600.0, 600.0) | number
    keywords = st.fixed_dictionaries({"target": st.none() | number})
    return st.tuples(st.tuples(number, number, volts), keywords)


MODES = st.sampled_from(["run", "feedforward", "hold"])
GAIN_PAIRS = st.tuples(GAINS, INTEGRAL_GAINS)


def events(upheavals: bool = False) -> st.SearchStrategy[tuple[str, Any]]:
    """Samples and changes of mode; with upheavals all that users can do to a controller."""
    step = st.tuples(st.just("step"), calls(GOOD) | calls(GOOD) | calls())
    mode = st.tuples(st.just("mode"), MODES)
    plan = st.tuples(st.just("plan"), st.tuples(calls(), st.booleans()))
    back = st.sampled_from([("hold", False), ("mode", "run")])
    common = [*[step] * 8, plan, mode, back, back]
    if not upheavals:
        return st.one_of(common)
    return st.one_of(
        *common,
        st.tuples(st.just("set_gains"), GAIN_PAIRS),
        st.tuples(st.just("set_filters"), FILTERS),
        st.tuples(st.just("set_model"), st.integers(0, 1)),
        st.tuples(st.just("set_feedforward"), st.sampled_from([None, "given", "exact"])),
        st.tuples(st.just("reset"), st.none() | numbers(-20.0, 150.0)),
        st.sampled_from([("save", None), ("restore", None)]),
    )


def happen(
    controller: mh.control.HybridController, event: tuple[str, Any], saved: list[Any]
) -> bool:
    """Let it happen. True if the amplifier is where the controller has just been told it is."""
    name, value = event
    if name == "step":
        controller.step(*value[0], **value[1])
    elif name == "plan":
        (arguments, keywords), commit = value
        controller.plan(*arguments, **keywords)
        assert not commit or controller.commit()
    elif name in ("mode", "hold"):
        setattr(controller, name, value)
    elif name == "set_gains":
        controller.set_gains(*value)
    elif name == "save":
        saved.append(controller.state)
    else:
        return _upheave(controller, name, value, saved)
    return False


def _upheave(
    controller: mh.control.HybridController, name: str, value: Any, saved: list[dict[str, Any]]
) -> bool:
    if name == "set_feedforward":
        controller.set_feedforward(feedforward(value, controller.limits))
        return False
    try:
        if name == "set_filters":
            controller.set_filters([mh.control.Biquad(*section) for section in value])
        elif name == "set_model":
            controller.set_model(actuator(value))
        elif name == "reset":
            controller.reset(value)
        elif saved:
            controller.state = saved[-1]
    except (
        ValueError
    ):  # no model, another one, a drive outside the limits, a state of another source, kp < 0
        return False
    return (name == "restore" and bool(saved)) or (name == "reset" and value is not None)
