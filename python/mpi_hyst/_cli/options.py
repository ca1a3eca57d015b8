"""The options of a command are the fields of its request: name, type, flags and help stand there.

`command` tells click of them, and hands the command a request. Options that several commands share
are fields that a function makes (`limits`), or a class of their own, which a request has as a field
(`group`). An option that the library takes under the same name says to which calls it is `passed`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, fields
from pathlib import Path
from types import NoneType, UnionType
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

import click

from mpi_hyst._io.marks import THOUSANDS
from mpi_hyst._io.source import TextOptions
from mpi_hyst._quantity import SECONDS

Request = TypeVar("Request")

FILE = click.Path(path_type=Path)


def option(*flags: str, passed: tuple[str, ...] = (), **how: Any) -> Any:
    """Make a field an option: `--its-name`, unless other flags are given.

    `how` is what click takes, but for what the type of the field says already.
    """
    default = how.get("default", () if how.get("multiple") else None)
    shown = {} if default is None or "is_flag" in how else {"show_default": True}
    return field(default=default, metadata={"click": (flags, shown | how), "passed": passed})


def flag(*flags: str, **how: Any) -> Any:
    """Make a field an option without a value."""
    return option(*flags, is_flag=True, default=False, **how)


def argument(metavar: str | None = None, **how: Any) -> Any:
    """Make a field an argument."""
    return field(default=None, metadata={"click": (None, {"metavar": metavar, **how})})


def group(kind: type, **words: str) -> Any:
    """Make a class of options a part of a request; `words` stand in their help."""
    return field(default_factory=kind, metadata={"group": kind, "words": words})


def command(
    request: type[Request], short_help: str | None = None
) -> Callable[[Callable[[Request], object]], click.Command]:
    """Make a function of a request a command."""

    def decorate(function: Callable[[Request], object]) -> click.Command:
        def call(**given: Any) -> object:
            return function(_made(request, given))

        return click.Command(
            function.__name__,
            callback=call,
            params=_parameters(request, {}),
            help=function.__doc__,
            short_help=short_help,
        )

    return decorate


def passed(request: object, call: str) -> dict[str, Any]:
    """Return what goes to a call of the library; what was not given is not in it."""
    names = [one.name for one in _own(type(request)) if call in one.metadata.get("passed", ())]
    given = {name: getattr(request, name) for name in names}
    return {name: value for name, value in given.items() if value is not None}


def asked(request: object, call: str) -> dict[str, Any]:
    """Return the same as the call takes it: `none` is None."""
    given = passed(request, call).items()
    return {name: None if value == "none" else value for name, value in given}


def flags(request: type) -> dict[str, str]:
    """Return the flag of every option by the name of its field."""
    found: dict[str, str] = {}
    for one in _own(request):
        if "group" in one.metadata:
            found |= flags(one.metadata["group"])
        elif one.metadata["click"][0] is not None:
            found[one.name] = _flags(one)[0]
    return found


def _own(request: type) -> tuple[Any, ...]:
    """Return the fields that stand for options."""
    return tuple(one for one in fields(request) if one.metadata)


def _flags(one: Any) -> tuple[str, ...]:
    given: tuple[str, ...] = one.metadata["click"][0]
    return given or (f"--{one.name.replace('_', '-')}",)


def _made(request: type[Request], given: dict[str, Any]) -> Request:
    parts = {one.name: one.metadata.get("group") for one in _own(request)}
    return request(
        **{
            name: given[name] if kind is None else _made(kind, given)
            for name, kind in parts.items()
        }
    )


def _parameters(request: type, words: dict[str, str]) -> list[click.Parameter]:
    found: list[click.Parameter] = []
    kinds = get_type_hints(request)
    for one in _own(request):
        if "group" in one.metadata:
            found += _parameters(one.metadata["group"], one.metadata["words"])
            continue
        given, how = one.metadata["click"]
        how = _of_type(kinds[one.name]) | how
        if given is None:
            found.append(click.Argument([one.name], **how))
        else:
            how["help"] = how["help"].format(**words) if words else how["help"]
            found.append(click.Option([*_flags(one), one.name], **how))
    return found


def _of_type(kind: Any) -> dict[str, Any]:
    """Return what the type of a field tells click."""
    if get_origin(kind) in (Union, UnionType):
        several = [one for one in get_args(kind) if one is not NoneType]
        return _of_type(several[0]) if len(several) == 1 else {}
    if get_origin(kind) is Literal:
        return {"type": click.Choice(get_args(kind))}
    return {"type": FILE if kind is Path else kind} if kind in (Path, int, float) else {}


def numbers(names: str, *words: str) -> dict[str, Any]:
    """Make an option of numbers with commas between them: one for each name, or any with `...`.

    One of the words may stand in their place.
    """
    count = None if names.endswith("...") else len(names.split(","))

    def convert(
        context: click.Context, option: click.Parameter, value: str | None
    ) -> tuple[float, ...] | str | None:
        if value is None or value in words:
            return value
        try:
            found = tuple(float(part) for part in value.split(","))
        except ValueError:
            found = ()
        if not found or len(found) != (count or len(found)):
            expected = ", ".join([f"{names}, {count or 'any'} numbers", *words])
            message = f"expected {expected}, got {value!r}"
            raise click.BadParameter(message, context, option)
        return found

    return {"metavar": "|".join((names, *words)), "callback": convert}


def word_or(words: tuple[str, ...], number: str, read: Callable[[str], float]) -> dict[str, Any]:
    """Make an option of one of these words, or of a number."""

    def convert(
        context: click.Context, option: click.Parameter, value: str | None
    ) -> float | str | None:
        if value is None or value in words:
            return value
        try:
            return read(value)
        except ValueError:
            message = f"expected {', '.join(words)} or {number}, got {value!r}"
            raise click.BadParameter(message, context, option) from None

    return {"callback": convert}


def limits(default: str = "", **how: Any) -> Any:
    """Make a field the limits of the drive; they are required without a default."""
    shown = f"  [default: {default}]" if default else ""
    said = f"Lower and upper limit of the drive, for example -500,500.{shown}"
    return option(required=not default, **numbers("LOW,HIGH"), help=said, **how)


def slew(default: str, **how: Any) -> Any:
    """Make a field the slew rate of the drive."""
    said = f"How fast the drive may change.  [default: {default}]"
    return option(metavar="V/s", help=said, **how)


def whole(text: str) -> int:
    """Read a whole number from 1 on; how large it may be is said by the library."""
    number = int(text) if text.isascii() and text.isdigit() and len(text) < 19 else 0
    if number < 1:
        raise ValueError(text)
    return number


def smoothness(**how: Any) -> Any:
    """Make a field the smoothness of the weights."""
    return option(
        metavar="NUMBER|auto",
        default="auto",
        **word_or(("auto",), "a number >= 0", float),
        help="Penalty on second differences of the weights. auto: by cross-validation.",
        **how,
    )


def thresholds(**how: Any) -> Any:
    """Make a field the law of the thresholds."""
    return option(
        default="uniform",
        help="Thresholds at equal distances, at quantiles of the reversals of the drive, or "
        "growing by a constant factor from a hundredth of the range on: more operators "
        "for small loops.",
        **how,
    )


def ratios(**how: Any) -> Any:
    """Make a field the ratios of the thresholds."""
    return option(**numbers("RA,RB,RC", "fit"), **how)


def input_offset(**how: Any) -> Any:
    """Make a field the drive at which the model rests."""
    return option(help="Drive at which the model rests.  [default: fitted]", **how)


def dead_time(**how: Any) -> Any:
    """Make a field the dead time."""
    return option(
        metavar="SECONDS",
        help="Time that the position is behind hysteresis and dynamics.  [default: fitted]",
        **how,
    )


def creep(**how: Any) -> Any:
    """Make a field the creep."""
    return option(
        metavar="TERMS|log|auto|none",
        **word_or(("auto", "none", "log"), "a whole number from 1 on", whole),
        help="Creep: log-type, or so many terms a decade apart. auto: none, log-type, or an "
        "amplitude for every decade, as the records tell it.  [default: auto]",
        **how,
    )


def _time_column(
    context: click.Context, option: click.Parameter, value: str | None
) -> str | Literal[False] | None:
    """Read the name of a column; none stands for no column."""
    del context, option
    return False if value == "none" else value


def time_column() -> Any:
    """Make a field the name of the time column."""
    return option(
        metavar="NAME|none",
        callback=_time_column,
        help="Time column, by name or number; none uses none.  [default: time_s, time, a name "
        "with a unit such as t_ms, or t, if present]",
    )


def time_unit() -> Any:
    """Make a field the unit of the time column."""
    return option(
        type=click.Choice(tuple(SECONDS)),
        help="Unit of the time column.  [default: that in its name or in the file, else s]",
    )


def _thousands(context: click.Context, option: click.Parameter, value: str | None) -> str | None:
    """Read what parts thousands; none stands for nothing."""
    del context, option
    return "" if value == "none" else value


@dataclass(frozen=True)
class OfText:
    """What is said of texts that they do not say themselves."""

    skip_lines: int = option(
        type=click.IntRange(min=0),
        default=0,
        metavar="LINES",
        help="Lines at the top of a text to leave out.",
    )
    thousands: str | None = option(
        type=click.Choice((*THOUSANDS, "none")),
        callback=_thousands,
        help="What parts thousands in a text.  [default: nothing; refused where 1.277 may be 1277]",
    )

    @property
    def options(self) -> TextOptions:
        """The same for the reader."""
        return TextOptions(self.skip_lines, self.thousands)


@dataclass(frozen=True)
class Sampled:
    """Where in its file a trajectory is, and how it is sampled."""

    column: str | None = option(help="Column of the {what}.  [default: the only numeric one]")
    unit: str | None = option(
        metavar="UNIT",
        help="Unit of the {what}; nothing is converted.  [default: that in the name of its column "
        "or in the file, else that of the stage]",
    )
    time: str | Literal[False] | None = time_column()
    time_unit: str | None = time_unit()
    rate: float | None = option(
        metavar="HZ", help="Sampling rate, for a file without a time column."
    )
    text: OfText = group(OfText)


def lead_in(what: str, **how: Any) -> Any:
    """Make a field the time that the way from rest takes."""
    return option(
        metavar="SECONDS",
        help=f"Time to move smoothly from rest to the beginning of the {what}.",
        **how,
    )


def report() -> Any:
    """Make a field the place of a report."""
    return option("--report", help="Report to write (HTML).")


def directory(default: str, holds: str) -> Any:
    """Make a field the directory that a command fills."""
    return option("--out", type=FILE, default=default, help=f"Directory for {holds}.")
