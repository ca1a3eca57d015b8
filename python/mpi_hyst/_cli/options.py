"""Options that several commands share, and the values that options take."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

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
    """Make an option of several numbers with commas between them."""
    count = len(names.split(","))

    def convert(
        context: click.Context, option: click.Parameter, value: str | None
    ) -> tuple[float, ...] | None:
        if value is None:
            return None
        try:
            found = tuple(float(part) for part in value.split(","))
        except ValueError:
            found = ()
        if len(found) != count:
            message = f"expected {names}, {count} numbers, got {value!r}"
            raise click.BadParameter(message, context, option)
        return found

    return {"metavar": names, "callback": convert}


def directory(default: str, holds: str) -> Callable[[Function], Function]:
    """Return the option of a command that fills a directory."""
    return click.option(
        "--out",
        "directory",
        type=FILE,
        default=Path(default),
        show_default=True,
        help=f"Directory for {holds}.",
    )
