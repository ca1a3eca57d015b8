"""An option is declared once: as a field of a request, which says also where it goes."""

from __future__ import annotations

import inspect
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


@pytest.mark.parametrize("room", [axes, excite, identify, places, precompensate, realtime])
def test_what_is_passed_is_an_argument_of_the_library(room: Any) -> None:
    pairs = [
        (one.name, call) for one in fields(room.Request) for call in one.metadata.get("passed", ())
    ]
    assert pairs
    for name, call in pairs:
        assert name in inspect.signature(CALLS[call]).parameters


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
