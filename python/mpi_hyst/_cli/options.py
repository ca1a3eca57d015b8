"""Options that several commands share, and the kinds of values that options take."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeVar

import click

from mpi_hyst._quantity import SECONDS

Function = TypeVar("Function", bound=Callable[..., object])

FILE = click.Path(path_type=Path)


def options(*decorators: Callable[[Function], Function]) -> Callable[[Function], Function]:
    """Add options to a command in the order in which its help shows them."""

    def decorate(function: Function) -> Function:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def numbers(names: str) -> dict[str, Any]:
    """Make an option of numbers with commas between them: one for each name, or any with `...`."""
    count = None if names.endswith("...") else len(names.split(","))

    def convert(
        context: click.Context, option: click.Parameter, value: str | None
    ) -> tuple[float, ...] | None:
        if value is None:
            return None
        try:
            found = tuple(float(part) for part in value.split(","))
        except ValueError:
            found = ()
        if not found or len(found) != (count or len(found)):
            message = f"expected {names}, {count or 'any'} numbers, got {value!r}"
            raise click.BadParameter(message, context, option)
        return found

    return {"metavar": names, "callback": convert}


def limits(default: str = "") -> Callable[[Function], Function]:
    """Return the option for the limits of the drive; it is required without a default."""
    shown = f"  [default: {default}]" if default else ""
    return click.option(
        "--limits",
        required=not default,
        **numbers("LOW,HIGH"),
        help=f"Lower and upper limit of the drive, for example -500,500.{shown}",
    )


def slew(default: str) -> Callable[[Function], Function]:
    """Return the option for the slew rate of the drive."""
    return click.option(
        "--slew",
        type=float,
        metavar="V/s",
        help=f"How fast the drive may change.  [default: {default}]",
    )


def _time_column(
    context: click.Context, option: click.Parameter, value: str | None
) -> str | Literal[False] | None:
    """Read the name of a column; none stands for no column."""
    del context, option
    return False if value == "none" else value


def time_column(function: Function) -> Function:
    """Add the option that names the time column."""
    return click.option(
        "--time",
        metavar="NAME|none",
        callback=_time_column,
        help="Time column, by name or number; none uses none.  [default: time_s, time, a name "
        "with a unit such as t_ms, or t, if present]",
    )(function)


def time_unit(function: Function) -> Function:
    """Add the option that says the unit of the time column."""
    return click.option(
        "--time-unit",
        type=click.Choice(tuple(SECONDS)),
        help="Unit of the time column.  [default: that in its name or in the file, else s]",
    )(function)


def reference(what: str) -> Callable[[Function], Function]:
    """Return the options that say where in its file a reference is, and how it is sampled."""
    return options(
        click.option("--column", help=f"Column of the {what}.  [default: the only numeric one]"),
        time_column,
        time_unit,
        click.option(
            "--rate",
            type=float,
            metavar="HZ",
            help="Sampling rate, for a file without a time column.",
        ),
    )


def lead_in(what: str) -> Callable[[Function], Function]:
    """Return the option for the time that the way from rest takes."""
    return click.option(
        "--lead-in",
        type=float,
        metavar="SECONDS",
        help=f"Time to move smoothly from rest to the beginning of the {what}.",
    )


def report(function: Function) -> Function:
    """Add the option that asks for a report."""
    return click.option("--report", "report_path", type=FILE, help="Report to write (HTML).")(
        function
    )


def stage(function: Function) -> Function:
    """Add the options that replace parts of the stage, or add them to a hysteresis model."""
    return options(
        click.option(
            "--dynamics",
            **numbers("FREQUENCY,DAMPING"),
            help="Natural frequency (Hz) and damping ratio of the stage, for example 400,0.95.",
        ),
        click.option(
            "--amplifier-bandwidth",
            type=float,
            metavar="HZ",
            help="Bandwidth (-3 dB) of a first-order amplifier.",
        ),
        click.option(
            "--dead-time",
            type=float,
            metavar="SECONDS",
            help="Dead time of the stage, without the hold of the converter.",
        ),
        slew("that of the stage"),
    )(function)


def directory(default: str, holds: str) -> Callable[[Function], Function]:
    """Return the option of a command that fills a directory."""
    return click.option(
        "--out",
        "directory",
        type=FILE,
        default=default,
        show_default=True,
        help=f"Directory for {holds}.",
    )
