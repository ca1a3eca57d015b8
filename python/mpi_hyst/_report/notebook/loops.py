"""Tunings and runs."""

from __future__ import annotations

import mpi_hyst as mh
from mpi_hyst._report.notebook.box import Box
from mpi_hyst._report.page import Table
from mpi_hyst._report.realtime import facts, times
from mpi_hyst._text import digits, span


def tuning(made: mh.control.Tuning) -> Box:
    """Return the box of a tuning."""
    rows = [
        ("structure", made.structure),
        ("kp", digits(made.kp)),
        ("ki", f"{digits(made.ki)} per second"),
        *(("filter", repr(one)) for one in made.filters),
        ("sampling interval", f"{digits(made.dt)} s"),
        ("disturbances are reduced up to", f"{digits(made.rejection_bandwidth)} Hz"),
        ("noise bandwidth", f"{digits(made.noise_bandwidth)} Hz"),
        (
            "peak sensitivity",
            f"{made.peak_sensitivity:.3f}, {made.peak_sensitivity_limit:g} allowed",
        ),
    ]
    header = ["slope of the hysteresis", "gain margin", "phase margin (°)", "crossover (Hz)"]
    lines = [
        [
            f"{name}, {digits(one.slope)}",
            *(f"{digits(one.gain_margin, 3)}", f"{one.phase_margin:.1f}"),
            digits(one.crossover),
            f"{one.peak_sensitivity:.3f}",
        ]
        for name, one in (("least", made.at_min_slope), ("greatest", made.at_max_slope))
    ]
    table = Table("Margins", [*header, "peak sensitivity"], lines)
    note = f"{made.explanation} Gains are in drive over position, in the units of the stage."
    return Box("Tuned feedback", rows, tables=[table], note=note)


def run(made: mh.plant.Run) -> Box:
    """Return the box of a closed loop."""
    header = ["error", "samples", "max", "rms", "measured max", "measured rms"]
    lines = [_errors("whole run", made.metrics)]
    if made.settled is not None:
        lines.append(_errors("after the first period", made.settled))
    metrics = made.metrics
    rows = [
        ("samples", str(len(made))),
        ("rms error of the position", digits(metrics.position_rmse, 3)),
        ("largest error of the position", digits(metrics.max_position_error, 3)),
        ("range of the reference", digits(metrics.range)),
        ("drive", span(metrics.drive_low, metrics.drive_high, "")),
        ("samples at a limit", str(metrics.saturated_count)),
        ("samples without a reading", str(metrics.missing_count)),
    ]
    drawn = (made.drive, made.position)
    note = "Drive and position are in the units of the plant."
    return Box("Closed loop", rows, tables=[Table("Errors", header, lines)], loop=drawn, note=note)


def _errors(name: str, metrics: mh.plant.Metrics) -> list[str]:
    values = (metrics.max_position_error, metrics.position_rmse, metrics.max_error, metrics.rmse)
    return [name, str(metrics.samples), *(digits(value, 3) for value in values)]


def realtime(made: mh.realtime.LoopReport) -> Box:
    """Return the box of a loop in real time."""
    rows = [*facts(made), *(("warning", one) for one in made.warnings)]
    return Box("Loop in real time", rows, tables=[Table("Times", *times(made))])
