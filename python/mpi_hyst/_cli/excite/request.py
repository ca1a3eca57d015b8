"""The options of `mpi-hyst excite` as a value, and their checks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from mpi_hyst._cli.errors import CommandError, parameter, with_options
from mpi_hyst._quantity import Quantity
from mpi_hyst._text import printable

TIME = "time_s"
_SHARED = ("slew", "rate", "cycles", "shape", "center", "start")
_OF_EXPERIMENTS = (
    *("fast_rate", "frequencies", "rest"),
    *("fast_signal", "fast_amplitude", "fast_frequency"),
)
_NAMES = {name: f"--{name.replace('_', '-')}" for name in (*_SHARED, *_OF_EXPERIMENTS)}


@dataclass(frozen=True)
class Request:
    """The options, by their names. Those not given are None or the default."""

    limits: tuple[float, float]
    rate: float
    slew: float
    out: Path
    cycles: int = 20
    shape: Literal["triangle", "sine"] = "triangle"
    center: float | None = None
    start: float | None = None
    demagnetize: bool = False
    column: str = "voltage_v"
    report_path: Path | None = None
    fast_rate: float | None = None
    frequencies: tuple[float, float] | None = None
    rest: float | None = None
    fast_signal: Literal["chirp", "multisine"] | None = None
    fast_amplitude: float | None = None
    fast_frequency: float | None = None

    @property
    def quantity(self) -> Quantity:
        """The drive."""
        return Quantity(self.column)

    @property
    def single_file(self) -> bool:
        """Whether the drive goes to one file, instead of a directory."""
        return self.demagnetize or self.out.suffix.lower() == ".csv"

    def shared(self) -> dict[str, Any]:
        """Return the arguments that experiments and demagnetizing sequences share."""
        return self._given(_SHARED)

    def of_experiment(self) -> dict[str, Any]:
        """Return the arguments of an experiment."""
        return self._given((*_SHARED, *_OF_EXPERIMENTS))

    def _given(self, names: tuple[str, ...]) -> dict[str, Any]:
        values = {name: getattr(self, name) for name in names}
        return {name: value for name, value in values.items() if value is not None}

    def check(self) -> None:
        """Refuse names of columns that a CSV file cannot have, and options that contradict."""
        if self.column in ("", TIME):
            raise CommandError(f"--column: expected a name other than {TIME}, got {self.column!r}")
        if self.column != printable(self.column).strip():
            raise CommandError(f"--column: expected a printable name, got {self.column!r}")
        if self.demagnetize and (others := self._given(_OF_EXPERIMENTS)):
            raise CommandError(f"{_NAMES[next(iter(others))]}: not with --demagnetize")

    def explain(self, error: Exception) -> CommandError:
        """Return the error of the library with the option in front, or in place of the argument."""
        argument = parameter(error)
        message = with_options(str(error), argument, _NAMES)
        return CommandError(f"--limits: {message}" if argument in ("low", "high") else message)
