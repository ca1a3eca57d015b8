"""The options of `mpi-hyst identify` as a value, and their checks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.outputs import check_outputs
from mpi_hyst._quantity import Quantity
from mpi_hyst._report.identify.records import Records, Task

Kind = Literal["modified", "conventional"]
Weights = Literal["auto", "free", "quadratic", "split"]
Smoothness = float | Literal["auto"]
Operators = int | Literal["auto"]
Dynamics = Literal["auto", 1, 2]
Creep = int | Literal["auto"]


@dataclass(frozen=True)
class Request:
    """The options, by their names. Those not given are None, empty or the default."""

    data: tuple[Path, ...]
    input_column: str
    output_column: str
    stage_path: Path | None = None
    report_path: Path | None = None
    skip: tuple[str, ...] = ()
    rows: tuple[int, ...] = ()
    time: str | None = None
    rate: float | None = None
    validate: tuple[Path, ...] = ()
    validate_skip: tuple[str, ...] = ()
    validate_from: tuple[str, ...] = ()
    model: Kind = "modified"
    operators: Operators = 20
    weights: Weights = "auto"
    smoothness: Smoothness = 0.0
    thresholds: Literal["uniform", "quantiles"] = "uniform"
    ratios: tuple[float, float, float] | None = None
    input_offset: float | None = None
    dead_time: float | None = None
    dynamics: Dynamics | None = None
    creep: Creep | None = None
    keep_partial: bool = False

    @property
    def input(self) -> Quantity:
        """The drive."""
        return Quantity(self.input_column)

    @property
    def output(self) -> Quantity:
        """The displacement."""
        return Quantity(self.output_column)

    def task(self, records: Records) -> Task:
        """Return what the reports need to know about the request."""
        options = {
            "ratios": self.ratios,
            "input offset": self.input_offset,
            "dead time": self.dead_time,
        }
        given = [name for name, value in options.items() if value is not None]
        return Task(records, self.input, self.output, given)

    def check(self) -> None:
        """Refuse options that contradict each other, and outputs that cannot be written."""
        check_outputs([self.stage_path, self.report_path], [*self.data, *self.validate])
        if self.input_column == self.output_column:
            raise CommandError(f"--input and --output: both are column {self.input_column!r}")
        if self.model == "conventional" and self.ratios is not None:
            raise CommandError("--ratios: the conventional model has no ratios")
        if self.model == "conventional" and self.weights == "split":
            raise CommandError("--weights: the conventional model has no split weights")
        if self.validate and self.validate_from:
            raise CommandError("--validate and --validate-from: give one of both")
        if self.validate_skip and not self.validate:
            raise CommandError("--validate-skip: no --validate file is given")
