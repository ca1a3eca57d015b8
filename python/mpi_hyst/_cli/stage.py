"""The stage of a command: a stage or model file, with the options that change it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import mpi_hyst as mh
from mpi_hyst._cli.options import flags, numbers, option, slew
from mpi_hyst._cli.terminal import CommandError, note, parameter, with_options
from mpi_hyst._core import load_from
from mpi_hyst._quantity import Quantity, stated_unit
from mpi_hyst._types import Model


@dataclass(frozen=True)
class StageOptions:
    """What replaces parts of the stage, or is added to a hysteresis model."""

    dynamics: tuple[float, float] | None = option(
        **numbers("FREQUENCY,DAMPING"),
        help="Natural frequency (Hz) and damping ratio of the stage, for example 400,0.95.",
    )
    amplifier_bandwidth: float | None = option(
        metavar="HZ", help="Bandwidth (-3 dB) of a first-order amplifier."
    )
    dead_time: float | None = option(
        metavar="SECONDS", help="Dead time of the stage, without the hold of the converter."
    )
    slew: float | None = slew("that of the stage")

    def changes(self) -> dict[str, Any]:
        """Return what replaces parts of the stage."""
        given = {name: value for name, value in vars(self).items() if value is not None}
        if self.dynamics is not None:
            given["dynamics"] = mh.plant.SecondOrder(*self.dynamics)
        return given


_NAMES = {
    **flags(StageOptions),
    **dict.fromkeys(("frequency", "damping"), "--dynamics"),
    **{"noise": "--noise", "limits": "--limits"},
}


def load(path: Path, data: bytes | None = None) -> mh.Stage | Model:
    """Read a stage or a hysteresis model, or take what was read; an error names the file."""
    try:
        return mh.load(path) if data is None else load_from(path, data)
    except (ValueError, TypeError) as error:
        message = str(error)
        raise CommandError(message if str(path) in message else f"{path}: {message}") from error


@contextmanager
def refusing(path: Path, names: Mapping[str, str] = MappingProxyType({})) -> Iterator[None]:
    """Name options and files, as `names` has them, where the library refuses its arguments."""
    try:
        yield
    except mh.NotInvertibleError as error:
        raise CommandError(f"{path}: {error}") from error
    except CommandError:
        raise
    except (ValueError, TypeError) as error:
        raise CommandError(name_options(error, names)) from error


def load_stage(path: Path, options: StageOptions, data: bytes | None = None) -> mh.Stage:
    """Read a stage, or make one around a hysteresis model; options replace parts of it."""
    loaded = load(path, data)
    with refusing(path):
        changes = options.changes()
        if isinstance(loaded, mh.Stage):
            return loaded.replace(**changes) if changes else loaded
        return mh.Stage(loaded, **changes)


def say_red(path: Path, stage: mh.Stage) -> None:
    """Say that a stage should not be used, where its identification found so."""
    for one in (stage.identified or {}).get("warnings", []):
        if one["severity"] == "red":
            note(f"{path}: do not use it yet: {one['message']}")


def say_steady(path: Path, stage: mh.Stage, otherwise: str = "") -> None:
    """Say at which temperature a stage is taken to stay that follows one."""
    term = stage.temperature
    if term is not None:
        steady = f"taken to stay at {term.reference:g}"
        note(f"{path}: follows a temperature, which is {steady}{otherwise}")


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
    slow = (stage.creep, stage.loop_shift, stage.relaxing_plays, stage.slow_gain)
    parts = (stage.dynamics, stage.amplifier_bandwidth, *slow)
    return all(part is None for part in parts) and stage.dead_time == 0.0


def name_options(said: Exception | str, others: Mapping[str, str] = MappingProxyType({})) -> str:
    """Return an error or a warning of the library with options and files in place of arguments."""
    return with_options(str(said), parameter(said), {**_NAMES, **others})
