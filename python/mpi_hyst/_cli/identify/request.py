"""The options of `mpi-hyst identify` as a value, and their checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

import mpi_hyst as mh
from mpi_hyst._cli.errors import CommandError
from mpi_hyst._cli.outputs import check_outputs
from mpi_hyst._cli.stage import name_options
from mpi_hyst._quantity import Quantity
from mpi_hyst._report.identify.records import Records, Task

Kind = Literal["modified", "conventional"]


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
    leave_out: tuple[tuple[int, int], ...] = ()
    mend: tuple[tuple[int, int], ...] = ()
    time: str | Literal[False] | None = None
    time_unit: str | None = None
    rate: float | None = None
    input_unit: str | None = None
    output_unit: str | None = None
    validate: tuple[Path, ...] = ()
    validate_skip: tuple[str, ...] = ()
    validate_from: tuple[str, ...] = ()
    limits: tuple[float, float] | None = None
    slew: float | None = None
    negate_output: bool = False
    compare: bool = False
    keep_partial: bool = False
    units: Mapping[str, str] = field(default_factory=dict)
    """The units of the columns that the first file states, known once it is read."""
    strict: bool = False
    fit: dict[str, Any] = field(default_factory=dict)
    """What goes to `mh.identify` under its own name; what was not given is not in it."""

    @classmethod
    def of(cls, given: Mapping[str, Any]) -> Request:
        """Take what the command line gives: what is no field goes to the fit."""
        own = {one.name for one in fields(cls)}
        fit = {
            name: value for name, value in given.items() if name not in own and value is not None
        }
        return cls(fit=fit, **{name: value for name, value in given.items() if name in own})

    @property
    def input(self) -> Quantity:
        """The drive."""
        return Quantity(self.input_column, self.units.get(self.input_column, ""))

    @property
    def output(self) -> Quantity:
        """The displacement."""
        return Quantity(self.output_column, self.units.get(self.output_column, ""))

    @property
    def model(self) -> Kind:
        """The kind of model."""
        return "conventional" if self.fit.get("model") == "conventional" else "modified"

    def bench(self) -> dict[str, Any]:
        """Return what the stage gets besides what is fitted."""
        given = {"limits": self.limits, "slew": self.slew}
        return {name: value for name, value in given.items() if value is not None}

    def task(self, records: Records) -> Task:
        """Return what the reports need to know about the request."""
        given = [name.replace("_", " ") for name in self.fit]
        return Task(records, self.input, self.output, given)

    def check(self) -> None:
        """Refuse options that contradict each other, and outputs that cannot be written."""
        check_outputs([self.stage_path, self.report_path], [*self.data, *self.validate])
        if self.input_column == self.output_column:
            raise CommandError(f"--input and --output: both are column {self.input_column!r}")
        if self.model == "conventional" and "ratios" in self.fit:
            raise CommandError("--ratios: the conventional model has no ratios")
        if self.model == "conventional" and self.fit.get("weights") == "split":
            raise CommandError("--weights: the conventional model has no split weights")
        if self.validate and self.validate_from:
            raise CommandError("--validate and --validate-from: give one of both")
        for option, stretches in (("--leave-out", self.leave_out), ("--mend", self.mend)):
            if stretches and len(self.data) > 1:
                raise CommandError(f"{option}: expected one file, got {len(self.data)}")
            if stretches and self.validate_from:
                raise CommandError(f"{option} and --validate-from: give one of both")
        if self.validate_skip and not self.validate:
            raise CommandError("--validate-skip: no --validate file is given")
        try:
            # The stage of a fit is made after the work; any hysteresis shows now what it refuses.
            mh.Stage(mh.PrandtlIshlinskii([1.0], [0.0]), **self.bench())
        except (ValueError, TypeError) as error:
            raise CommandError(name_options(error)) from error
