"""A default that a signature shows is the one that takes effect."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import pytest
from mpi_hyst import _core

# Every parameter that sets a field of an options struct of Rust, which has the default: as shown?
COMPARED: dict[str, bool] = dict(vars(_core)["_defaults"]())


def test_defaults_of_options_are_those_of_their_crates() -> None:
    assert [name for name, is_same in COMPARED.items() if not is_same] == []


def test_all_gathered_options_are_compared() -> None:
    functions = {name.rpartition(".")[0] for name in COMPARED}
    assert functions >= {
        *(
            "identify",
            "compare",
            "identify_many",
            "identify_dynamics",
            "identify_oscillator",
            "identify_axes",
            "experiment",
            "run",
            "tune",
        ),
        *("HybridController.new", "ActuatorArray.controller", "RecursiveIdentifier.new"),
        *("IterativeLearning.new", "Stage.iterative_learning", "RepetitiveControl.new"),
        *("MultiAxisStage.controller", "Raster.new"),
    }
    fit = {name.removeprefix("identify.") for name in COMPARED if name.startswith("identify.")}
    shown = {
        name
        for name, parameter in inspect.signature(mh.identify).parameters.items()
        if parameter.default is not parameter.empty
    }
    # What is not an option of the fit, or becomes one together with another parameter.
    of_the_call = {"y", "dt", "times", "skip", "validate", "progress", "keep_partial"}
    assert shown - fit == of_the_call | {"operators", "thresholds"}


@pytest.mark.parametrize(
    ("method", "function"),
    [
        (mh.Stage.plot, mh.plot.loops),
        (mh.Forward.plot, mh.plot.memory),
        (mh.plant.Run.plot, mh.plot.run),
        (mh.plant.Run.report, mh.reports.run),
        (mh.results.Identification.report, mh.reports.identification),
    ],
)
def test_methods_that_show_have_the_defaults_of_what_they_call(
    method: Callable[..., Any], function: Callable[..., Any]
) -> None:
    own, called = (inspect.signature(one).parameters for one in (method, function))
    kept = {name: parameter.default for name, parameter in own.items() if name != "self"}
    assert kept and kept == {name: called[name].default for name in kept}


def test_a_controller_of_several_axes_has_the_defaults_of_one_axis() -> None:
    shown = inspect.signature(mh.MultiAxisStage.controller).parameters
    of_one_axis = inspect.signature(mh.control.HybridController).parameters
    for name in ("slew", "bumpless_time", "max_missing"):
        assert shown[name].default == of_one_axis[name].default, name


def test_an_array_is_demagnetized_as_one_actuator() -> None:
    shown = inspect.signature(mh.ActuatorArray.demagnetize).parameters
    of_one = inspect.signature(mh.signals.demagnetize).parameters
    for name in ("rate", "cycles", "shape"):
        assert shown[name].default == of_one[name].default, name
