"""What identification found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

import mpi_hyst as mh
from mpi_hyst._quantity import Stated
from mpi_hyst._report.identify.records import Records, Task
from mpi_hyst._report.identify.summary import parameters, title, with_error
from mpi_hyst._report.model_table import model_table
from mpi_hyst._report.notebook.box import Box, findings_of
from mpi_hyst._report.notebook.models import loop
from mpi_hyst._report.page import Table
from mpi_hyst._text import digits
from mpi_hyst._types import Samples

_NOTE = "Values ± one standard error. Drive and position are in the units of the records."
_SHOWN = 40  # rows of a table


def identification(found: mh.results.Identification) -> Box:
    """Return the box of an identification."""
    task = Task(Records([], [], ends=False), Stated("drive"), Stated("position"))
    rows = [*_errors("fit", found.fit)]
    if found.validation is not None:
        rows += _errors("validation", found.validation)
    rows += [("noise of the sensor", f"{digits(found.noise, 3)} rms"), *parameters(task, found)]
    stds = [found.weights_std.tolist(), found.weights_negative_std.tolist()]
    table = model_table(found.model, "", "", stds)
    named = f"Identification: {title(found, len(found.records))}"
    findings = findings_of(found.warnings)
    return Box(named, rows, found.verdict, findings, [table], loop(found), _NOTE)


def dynamics(found: mh.results.DynamicsIdentification) -> Box:
    """Return the box of an identification of the linear part."""
    rows = [*_errors("fit", found.fit)]
    if found.dynamics is not None:
        frequency = with_error(found.dynamics.frequency, found.frequency_std, "Hz")
        second = isinstance(found.dynamics, mh.plant.SecondOrder)
        rows.append(("natural frequency" if second else "bandwidth", frequency))
        if isinstance(found.dynamics, mh.plant.SecondOrder):
            rows.append(("damping ratio", with_error(found.dynamics.damping, found.damping_std)))
    dead_time = with_error(1e3 * found.dead_time, 1e3 * found.dead_time_std, "ms", scale=np.inf)
    lag = with_error(1e3 * found.lag, 1e3 * found.lag_std, "ms", scale=np.inf)
    rows += [("dead time", dead_time), ("lag of slow motion", lag)]
    rows += [("gain", digits(found.gain)), ("noise of the sensor", f"{digits(found.noise, 3)} rms")]
    findings = findings_of(found.warnings)
    return Box("Identification of dynamics", rows, found.verdict, findings, note=_NOTE)


def many(found: mh.results.ManyIdentifications) -> Box:
    """Return the box of many actuators."""
    verdicts = Counter(found.verdicts)
    told = ", ".join(f"{verdicts[level]} {level}" for level in ("green", "amber", "red"))
    rows = [("actuators", str(len(found))), ("verdicts", told)]
    rows += [("operators", str(found.operators)), ("weights", found.weights_law)]
    for name, values in (("rms error", found.rmse), ("largest error", found.max_errors)):
        rows.append((name, _spread(values)))
    codes = Counter(code for one in found.findings for code, _, _ in one)
    rows += [(f"finding {code}", f"at {count}") for code, count in codes.most_common(_SHOWN)]
    failed = list(found.errors.items())
    tables = []
    if failed:
        lines = [[str(actuator), reason] for actuator, reason in failed[:_SHOWN]]
        caption = f"{len(failed)} not fitted"
        note = f"The first {_SHOWN}." if len(failed) > _SHOWN else ""
        tables.append(Table(caption, ["actuator", "reason"], lines, note))
    return Box("Identification of many actuators", rows, tables=tables)


def comparison(found: mh.results.Comparison) -> Box:
    """Return the box of a comparison of models."""
    header = ["model", "weights", "unknowns", "rms fitted", "rms held out", "worst stretch"]
    lines = [
        [
            *(one.model, one.weights_law, str(one.unknowns), digits(one.fit.rmse, 3)),
            *(digits(one.held_out, 3), digits(one.worst_stretch, 3)),
        ]
        for one in found.rows
    ]
    rows = [("the simplest that predicts as well as the best", found.simplest)]
    rows += [(f"not tried: {name}", reason) for name, reason in found.omitted.items()]
    return Box("Comparison of models", rows, tables=[Table("Errors", header, lines)])


def _errors(name: str, quality: mh.results.Quality) -> list[tuple[str, str]]:
    rms = f"{digits(quality.rmse, 3)} ({quality.rmse_percent:.3f} % of the range)"
    largest = f"{digits(quality.max_error, 3)} ({quality.max_error_percent:.3f} % of the range)"
    return [(f"rms error, {name}", rms), (f"largest error, {name}", largest)]


def _spread(values: Samples | Sequence[float]) -> str:
    """Return the median and the extremes of what is known."""
    known = np.asarray(values)[np.isfinite(values)]
    if known.size == 0:
        return "not known"
    low, middle, high = (float(one) for one in (known.min(), np.median(known), known.max()))
    return f"{digits(low, 3)} to {digits(high, 3)}, median {digits(middle, 3)}"
