"""The stage of a command: a stage or model file, with the options that change it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import Any

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError, note, parameter, with_options
from mpi_hyst._core import load_from
from mpi_hyst._quantity import Quantity, stated_unit
from mpi_hyst._types import Model

_OPTIONS = {
    "frequency": "--dynamics",
    "damping": "--dynamics",
    "dynamics": "--dynamics",
    "amplifier_bandwidth": "--amplifier-bandwidth",
    "dead_time": "--dead-time",
    "noise": "--noise",
    "limits": "--limits",
    "slew": "--slew",
}


@dataclass(frozen=True)
class StageOptions:
    """What replaces parts of the stage, each None where it was not given."""

    dynamics: tuple[float, float] | None = None
    amplifier_bandwidth: float | None = None
    dead_time: float | None = None
    slew: float | None = None

    @classmethod
    def split(cls, given: Mapping[str, Any]) -> tuple[StageOptions, dict[str, Any]]:
        """Take these options out of those of a command; return the others too."""
        names = [field.name for field in fields(cls)]
        others = {name: value for name, value in given.items() if name not in names}
        return cls(**{name: given[name] for name in names}), others

    def changes(self) -> dict[str, Any]:
        """Return what replaces parts of the stage."""
        options: dict[str, Any] = {
            "dynamics": None if self.dynamics is None else mh.plant.SecondOrder(*self.dynamics),
            "amplifier_bandwidth": self.amplifier_bandwidth,
            "dead_time": self.dead_time,
            "slew": self.slew,
        }
        return {name: value for name, value in options.items() if value is not None}


def load(path: Path, data: bytes | None = None) -> mh.Stage | Model:
    """Read a stage or a hysteresis model, or take what was read; an error names the file."""
    try:
        return mh.load(path) if data is None else load_from(path, data)
    except (ValueError, TypeError) as error:
        message = str(error)
        raise CommandError(message if str(path) in message else f"{path}: {message}") from error


def load_stage(path: Path, options: StageOptions, data: bytes | None = None) -> mh.Stage:
    """Read a stage, or make one around a hysteresis model; options replace parts of it."""
    loaded = load(path, data)
    try:
        changes = options.changes()
        if isinstance(loaded, mh.Stage):
            return loaded.replace(**changes) if changes else loaded
        return mh.Stage(loaded, **changes)
    except mh.NotInvertibleError as error:
        raise CommandError(f"{path}: {error}") from error
    except (ValueError, TypeError) as error:
        raise CommandError(name_options(error)) from error


def say_red(path: Path, stage: mh.Stage) -> None:
    """Say that a stage should not be used, where its identification found so."""
    for one in (stage.identified or {}).get("warnings", []):
        if one["severity"] == "red":
            note(f"{path}: do not use it yet: {one['message']}")


def check_unit(file: str, quantity: Quantity, stage: mh.Stage) -> None:
    """Refuse a reference that states another unit than the stage."""
    got, expected = quantity.suffix, stated_unit(stage.units[1])
    if got and expected and got != expected:
        raise CommandError(
            f"{file}: {quantity.column}: expected {expected}, as the stage has, got {got}"
        )


def of_stage(quantity: Quantity, stage: mh.Stage) -> Quantity:
    """Return a reference in the unit of the stage, where it has none of its own."""
    return quantity if quantity.suffix else Quantity(quantity.column, stage.units[1])


def why_narrowed(stage: mh.Stage) -> str:
    """Say why a stage uses fewer drives than its limits allow, and what changes that, if it does.

    Those are the drives that were identified.
    """
    if not stage.is_narrowed:
        return ""
    if stage.limits is None:
        return "the records reach no further; --limits goes beyond"
    least, most = stage.limits
    span = f"{least:g} to {most:g} {stage.units[0]}".rstrip()
    return f"the records do not reach the limits {span}; --limits {least:g},{most:g} goes there"


def is_static(stage: mh.Stage) -> bool:
    """Return whether the position depends on the drives alone, not on their times."""
    parts = (stage.dynamics, stage.amplifier_bandwidth, stage.creep, stage.loop_shift)
    return all(part is None for part in parts) and stage.dead_time == 0.0


def name_options(said: Exception | str, others: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return an error or a warning of the library with options and files in place of arguments."""
    return with_options(str(said), parameter(said), {**_OPTIONS, **others})
