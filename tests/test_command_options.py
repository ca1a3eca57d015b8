"""An option is declared once: as a field of a request, which says also where it goes."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal

import mpi_hyst as mh
import pytest
from click.testing import CliRunner
from mpi_hyst._cli import axes, excite, identify, places, precompensate, realtime
from mpi_hyst._cli.options import argument, command, flag, flags, group, numbers, option, passed

CALLS: dict[str, Callable[..., Any]] = {
    "identify": mh.identify,
    "compare": mh.compare,
    "identify_axes": mh.identify_axes,
    "identify_places": mh.identify_places,
    "stage": mh.Stage,
    "precompensate": mh.Stage.precompensate,
    "run": mh.realtime.run,
    "experiment": mh.signals.experiment,
    "demagnetize": mh.signals.demagnetize,
}


ROOMS = [axes, excite, identify, places, precompensate, realtime]
# What a command calls the default of the library.
CALLED = {"fit": "fitted", None: "none", ("thresholds", None): "uniform"}
# The places command says what the library makes of None; realtime does not run for ever.
OWN = {("operators", "identify_places"), ("seconds", "run")}


@pytest.mark.parametrize("room", ROOMS)
def test_what_is_passed_is_an_argument_of_the_library(room: Any) -> None:
    pairs = [
        (one.name, call) for one in fields(room.Request) for call in one.metadata.get("passed", ())
    ]
    assert pairs
    for name, call in pairs:
        assert name in inspect.signature(CALLS[call]).parameters


def as_said(name: str, default: Any) -> set[str]:
    """Return how a command may call a default of the library."""
    if isinstance(default, tuple):
        return {",".join(f"{one:g}" for one in default)}
    if isinstance(default, float | int):
        return {f"{default:g}"}
    return {str(default), CALLED.get((name, default), CALLED.get(default, ""))}


@pytest.mark.parametrize("room", ROOMS)
def test_a_command_says_the_default_of_the_library(room: Any) -> None:
    compared = 0
    for one in fields(room.Request):
        if not one.metadata.get("passed"):
            continue
        told = re.search(r"\[default: (\S+)\]", one.metadata["click"][1].get("help", ""))
        own = one.default if one.default not in (None, (), False) else None
        for call in one.metadata["passed"]:
            if (told is None and own is None) or (one.name, call) in OWN:
                continue
            said = told[1] if told else f"{own:g}" if isinstance(own, float) else str(own)
            default = inspect.signature(CALLS[call]).parameters[one.name].default
            assert said in as_said(one.name, default), one.name
            compared += 1
    assert compared > 0 or room is precompensate


@dataclass(frozen=True)
class Shared:
    rate: float | None = option(metavar="HZ", help="Rate of the {what}.")


@dataclass(frozen=True)
class Request:
    data: Path = argument("FILE")  # noqa: RUF009
    shared: Shared = group(Shared, what="record")  # noqa: RUF009
    kind: Literal["slow", "fast"] = option(passed=("fit",), default="slow", help="Kind.")
    ends: tuple[float, float] | None = option("-e", passed=("fit",), **numbers("A,B"), help="Ends.")
    again: bool = flag(help="Again.")


def test_a_command_gets_what_its_fields_say() -> None:
    got: list[Request] = []

    @command(Request, short_help="Try.")
    def attempt(request: Request) -> None:
        """Try it."""
        got.append(request)

    assert attempt.name == "attempt" and attempt.help == "Try it."
    said = CliRunner().invoke(attempt, ["a.csv", "--rate", "5", "-e", "1,2", "--again"])
    assert said.exit_code == 0, said.output
    assert got == [Request(Path("a.csv"), Shared(5.0), "slow", (1.0, 2.0), True)]
    assert passed(got[0], "fit") == {"kind": "slow", "ends": (1.0, 2.0)}
    assert flags(Request) == {"rate": "--rate", "kind": "--kind", "ends": "-e", "again": "--again"}
    shown = CliRunner().invoke(attempt, ["--help"]).output
    assert "Rate of the record." in shown and "[slow|fast]" in shown and "[default: slow]" in shown
    assert CliRunner().invoke(attempt, ["a.csv", "--kind", "none"]).exit_code == 2
    CliRunner().invoke(attempt, ["a.csv"])
    assert passed(got[1], "fit") == {"kind": "slow"} and got[1].shared.rate is None
