"""The linear part of a stage as the options describe it, and options in place of arguments."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError

_OPTIONS = {
    "frequency": "--dynamics",
    "damping": "--dynamics",
    "dynamics": "--dynamics",
    "amplifier_bandwidth": "--amplifier-bandwidth",
    "dead_time": "--dead-time",
}


@dataclass(frozen=True)
class StageOptions:
    """Dynamics, amplifier and dead time, each None where it was not given."""

    dynamics: tuple[float, float] | None = None
    amplifier_bandwidth: float | None = None
    dead_time: float | None = None

    @classmethod
    def split(cls, given: Mapping[str, Any]) -> tuple[StageOptions, dict[str, Any]]:
        """Take these options out of those of a command; return the others too."""
        names = [field.name for field in fields(cls)]
        others = {name: value for name, value in given.items() if name not in names}
        return cls(**{name: given[name] for name in names}), others

    @property
    def given(self) -> bool:
        """Whether there is anything beside the hysteresis."""
        return (self.dynamics, self.amplifier_bandwidth, self.dead_time) != (None, None, None)

    def dead_time_samples(self, dt: float) -> float:
        """Return the dead time in samples."""
        return dead_time_samples(self.dead_time or 0.0, dt)

    def arguments(self) -> dict[str, Any]:
        """Return the arguments by which the library takes this."""
        return {
            "dynamics": None if self.dynamics is None else mh.plant.SecondOrder(*self.dynamics),
            "amplifier_bandwidth": self.amplifier_bandwidth,
            "dead_time": self.dead_time or 0.0,
        }


def dead_time_samples(seconds: float, dt: float) -> float:
    """Convert a dead time, which must be a finite number of seconds, not below zero."""
    if not (math.isfinite(seconds) and seconds >= 0.0):
        raise CommandError(f"--dead-time: expected a finite number >= 0, got {seconds!r}")
    return seconds / dt


def name_options(message: str, others: Mapping[str, str]) -> str:
    """Name options and files in a message of the library, which names arguments."""
    name, colon, rest = message.partition(":")
    return {**_OPTIONS, **others}.get(name, name) + colon + rest
