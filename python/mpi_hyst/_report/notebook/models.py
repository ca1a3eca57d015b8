"""Models and stages."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import mpi_hyst as mh
from mpi_hyst._quantity import Stated
from mpi_hyst._report.model_table import model_table
from mpi_hyst._report.notebook.box import Box
from mpi_hyst._report.page import Table
from mpi_hyst._report.shown import Shown, default_drive, run
from mpi_hyst._report.stage import linear_parts
from mpi_hyst._text import digits, in_unit
from mpi_hyst._types import Model, Samples

_HASH = 12  # digits of a SHA-256 that tell records apart


def model(shown: Model) -> Box:
    """Return the box of a model. It has no units of its own."""
    rows = [*_hysteresis(shown), *_offsets(shown)]
    table = model_table(shown, "", "")
    note = "In the units of drive and position, which a model does not know."
    return Box(_name(shown), rows, tables=[table], loop=loop(shown), note=note)


def stage(shown: mh.Stage) -> Box:
    """Return the box of a stage."""
    drive, position = Stated("drive", shown.units[0]), Stated("position", shown.units[1])
    of_slope = f"{position.unit}/{drive.unit}" if drive.unit and position.unit else ""
    rows = _limits(shown, drive.unit, position.unit)
    rows += [("hysteresis", f"{_name(shown.hysteresis)}, {shown.hysteresis.operators} operators")]
    rows += _hysteresis(shown.hysteresis, of_slope)[1:]
    rows += [("other parts", part) for part in linear_parts(shown)]
    maps = (("input map", shown.input_map), ("output map", shown.output_map))
    rows += [(name, f"{len(points[0])} points") for name, points in maps if points is not None]
    if shown.noise is not None:
        rows.append(("noise of the sensor", f"{in_unit(shown.noise, position.unit)} rms"))
    findings: list[tuple[str, str]] = []
    verdict = None
    if shown.identified is not None:
        told = shown.identified
        rows += _identified(told, position.unit)
        severities = [one["severity"] for one in told["warnings"]]
        verdict = "red" if "red" in severities else "amber" if severities else "green"
        findings = [
            (one["severity"], f"{one['code']}: {one['message']}") for one in told["warnings"]
        ]
        findings.sort(key=lambda one: one[0] != "red")
    title = f"Stage, {drive.unit or 'drive'} to {position.unit or 'position'}"
    std = _standard_errors(shown)
    tables = [model_table(shown.hysteresis, of_slope, drive.unit, _of_weights(shown, std))]
    if others := [[name, digits(one, 2)] for name, one in std.items() if "[" not in name]:
        note = "One standard error, in the unit of the parameter; of times in seconds."
        tables.append(Table("Standard errors", ["parameter", "std"], others, note))
    return Box(title, rows, verdict, findings, tables, loop(shown))


def _standard_errors(shown: mh.Stage) -> dict[str, float]:
    """Return the standard errors by the names of the parameters that were estimated."""
    told = shown.identified or {"parameters": [], "covariance": []}
    variances: Sequence[float] | Samples = (
        np.diag(np.asarray(told["covariance"])) if told["covariance"] else []
    )
    return {
        name: math.sqrt(max(float(variance), 0.0))
        for name, variance in zip(told["parameters"], variances, strict=True)
    }


def _of_weights(shown: mh.Stage, std: dict[str, float]) -> list[list[float]]:
    """Return the standard errors of the weights; what was not estimated lies at a bound."""
    families = ("weights", "weights_negative") if shown.hysteresis.split else ("weights",)
    count = shown.hysteresis.operators
    if not std:
        return []
    return [[std.get(f"{name}[{i}]", math.nan) for i in range(count)] for name in families]


def loop(shown: Shown) -> tuple[Samples, Samples] | None:
    """Return decaying loops, minus nothing: what a drawing of the hysteresis shows."""
    if isinstance(shown, mh.results.Identification):
        shown = shown.model
    drive = default_drive(shown)
    position = run(shown, drive, None)
    return (drive, position) if np.isfinite(position).all() else None


def _name(shown: Model) -> str:
    modified = isinstance(shown, mh.ModifiedPrandtlIshlinskii)
    return f"{'modified' if modified else 'conventional'} Prandtl-Ishlinskii model"


def _hysteresis(shown: Model, of_slope: str = "") -> list[tuple[str, str]]:
    low, high = shown.slope_range
    because = shown.not_invertible_because
    return [
        ("operators", str(shown.operators)),
        ("slope", f"{digits(low)} to {in_unit(high, of_slope)}"),
        ("exact inverse", "yes" if because is None else f"no: {because}"),
    ]


def _offsets(shown: Model) -> list[tuple[str, str]]:
    return [
        ("input offset", digits(shown.input_offset)),
        ("output offset", digits(shown.output_offset)),
    ]


def _limits(shown: mh.Stage, drive: str, position: str) -> list[tuple[str, str]]:
    rows = []
    for name, ends, unit in (
        ("limits of the drive", shown.limits, drive),
        ("drive by default", shown.drive_range, drive),
        ("position within", shown.position_range, position),
    ):
        if ends is not None:
            rows.append((name, f"{digits(ends[0])} to {in_unit(ends[1], unit)}"))
    if shown.slew is not None:
        rows.append(("slew rate", in_unit(shown.slew, f"{drive}/s" if drive else "per second")))
    return rows


def _identified(told: dict[str, object], unit: str) -> list[tuple[str, str]]:
    rows = []
    for name, key in (("rms error of the fit", "rmse"), ("largest error of the fit", "max_error")):
        value = told.get(key)
        if isinstance(value, float):
            rows.append((name, in_unit(value, unit, 3)))
    records = told.get("records")
    for record in records if isinstance(records, list) else []:
        name, sha256 = record.get("name", ""), record.get("sha256")
        known = f", SHA-256 {sha256[:_HASH]}…" if sha256 else ""
        rows.append(("record", f"{name}{known}"))
    return rows
