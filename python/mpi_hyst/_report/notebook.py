"""What a notebook shows of an object: a small table in HTML with a verdict and a drawing.

It needs no scripts and nothing but numpy, and is readable on light and dark.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

from mpi_hyst._core import (
    Comparison,
    DynamicsIdentification,
    Finding,
    Identification,
    LoopReport,
    ManyIdentifications,
    Metrics,
    ModifiedPrandtlIshlinskii,
    Quality,
    Run,
    SecondOrder,
    Stage,
    Tuning,
)
from mpi_hyst._quantity import Stated
from mpi_hyst._report import models
from mpi_hyst._report.closed_loop import loop_facts, loop_times
from mpi_hyst._report.models import Shown, default_drive, linear_parts, model_table
from mpi_hyst._report.page import Table
from mpi_hyst._report.records import Records, Task
from mpi_hyst._report.summary import parameters, title, with_error
from mpi_hyst._text import digits, in_unit, printable, span
from mpi_hyst._types import Model, Samples

_LEVELS = {"green": "#2e9e63", "amber": "#d18a00", "red": "#d64545"}
# Half-transparent grey: visible on white and on black. Text has the colour of the notebook.
_LINE = "1px solid rgba(128,128,128,0.35)"
_CELL = f"padding:2px 10px 2px 0;border:0;border-bottom:{_LINE};background:transparent"
_WIDTH, _HEIGHT, _INSET = 240, 160, 8
_POINTS = 700
_FINDINGS = 20
_SHORT = 8  # rows of a table that is shown unfolded


@dataclass(frozen=True)
class Box:
    """What is shown of an object. Everything is text, and is escaped."""

    title: str
    rows: Sequence[tuple[str, str]]
    verdict: str | None = None
    findings: Sequence[tuple[str, str]] = ()
    """Severity and message of each."""
    tables: Sequence[Table] = ()
    """Folded away if they are long."""
    loop: tuple[Samples, Samples] | None = None
    """Drive and position of a small drawing."""
    note: str = ""

    def html(self) -> str:
        """Return the HTML text."""
        parts = [_verdict(self.verdict), _findings(self.findings)]
        body = _table([], self.rows) if self.rows else ""
        drawn = "" if self.loop is None else _drawing(*self.loop)
        across = "display:flex;flex-wrap:wrap;gap:16px;align-items:flex-start"
        parts.append(f'<div style="{across}"><div>{body}</div>{drawn}</div>')
        parts += map(_folded, self.tables)
        if self.note:
            parts.append(f'<div style="opacity:0.7;font-size:90%">{_text(self.note)}</div>')
        title = f'<div style="font-weight:600;margin-bottom:4px">{_text(self.title)}</div>'
        style = "font-size:13px;line-height:1.45;max-width:100%;overflow-x:auto"
        return f'<div style="{style}">{title}{"".join(parts)}</div>'


def findings_of(findings: Iterable[Finding]) -> list[tuple[str, str]]:
    """Return the findings, the worst first."""
    told = [(one.severity, f"{one.code}: {one.message}. Try: {one.hint}") for one in findings]
    return sorted(told, key=lambda one: one[0] != "red")


def _text(text: str) -> str:
    return escape(printable(text))


def _verdict(level: str | None) -> str:
    if level is None:
        return ""
    return (
        f'<div style="border-left:5px solid {_LEVELS[level]};padding-left:8px;margin:4px 0">'
        f"verdict: <b>{_text(level)}</b></div>"
    )


def _findings(findings: Sequence[tuple[str, str]]) -> str:
    if not findings:
        return ""
    lines = [
        f'<li><b style="color:{_LEVELS[level]}">{_text(level)}</b> {_text(message)}</li>'
        for level, message in findings[:_FINDINGS]
    ]
    if len(findings) > _FINDINGS:
        lines.append(f"<li>and {len(findings) - _FINDINGS} more</li>")
    return f'<ul style="margin:4px 0 8px;padding-left:18px">{"".join(lines)}</ul>'


def _table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    right = f"{_CELL};text-align:right"
    head = "".join(f'<th style="{right}">{_text(cell)}</th>' for cell in header)
    lines = []
    for first, *others in rows:
        # Names and values read to the left, columns of numbers to the right.
        align = "right" if header else "left;white-space:pre-wrap"
        cells = "".join(f'<td style="{_CELL};text-align:{align}">{_text(o)}</td>' for o in others)
        name = f'<td style="{_CELL};text-align:left;opacity:0.75">{_text(first)}</td>'
        lines.append(f"<tr>{name}{cells}</tr>")
    top = f"<thead><tr>{head}</tr></thead>" if header else ""
    style = "border-collapse:collapse;margin:0;color:inherit"
    return f'<table style="{style}">{top}<tbody>{"".join(lines)}</tbody></table>'


def _folded(table: Table) -> str:
    note = f"<div>{_text(table.note)}</div>" if table.note else ""
    summary = f'<summary style="cursor:pointer">{_text(table.caption)}</summary>'
    body = _table(table.header, table.rows)
    opened = ' open=""' if len(table.rows) <= _SHORT else ""
    return f"<details{opened}>{summary}{body}{note}</details>"


def _drawing(drive: Samples, position: Samples) -> str:
    """Draw position over drive as a line that fills its box."""
    known = np.isfinite(drive) & np.isfinite(position)
    x, y = drive[known], position[known]
    if x.size < 2:
        return ""
    every = slice(None, None, max(1, x.size // _POINTS))
    across = _INSET + _share(x[every]) * (_WIDTH - 2 * _INSET)
    down = _HEIGHT - _INSET - _share(y[every]) * (_HEIGHT - 2 * _INSET)
    points = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(across, down, strict=True))
    return (
        f'<svg width="{_WIDTH}" height="{_HEIGHT}" viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" '
        'aria-label="position over drive" style="border:1px solid rgba(128,128,128,0.35)">'
        f'<polyline points="{points}" fill="none" stroke="#2a8fc9" stroke-width="1.2"/></svg>'
    )


def _share(values: Samples) -> Samples:
    # Halved first: the difference of two huge numbers may be beyond what a float holds.
    low, high = 0.5 * float(values.min()), 0.5 * float(values.max())
    span = high - low
    if span <= 0.0:
        return np.full(values.shape, 0.5)
    return np.asarray((0.5 * values - low) / span, dtype=np.float64)


_HASH = 12  # digits of a SHA-256 that tell records apart


def model(shown: Model) -> Box:
    """Return the box of a model. It has no units of its own."""
    rows = [*_hysteresis(shown), *_offsets(shown)]
    table = model_table(shown, "", "")
    note = "In the units of drive and position, which a model does not know."
    return Box(_name(shown), rows, tables=[table], loop=loop(shown), note=note)


def stage(shown: Stage) -> Box:
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


def _standard_errors(shown: Stage) -> dict[str, float]:
    """Return the standard errors by the names of the parameters that were estimated."""
    told = shown.identified or {"parameters": [], "covariance": []}
    variances: Sequence[float] | Samples = (
        np.diag(np.asarray(told["covariance"])) if told["covariance"] else []
    )
    return {
        name: math.sqrt(max(float(variance), 0.0))
        for name, variance in zip(told["parameters"], variances, strict=True)
    }


def _of_weights(shown: Stage, std: dict[str, float]) -> list[list[float]]:
    """Return the standard errors of the weights; what was not estimated lies at a bound."""
    families = ("weights", "weights_negative") if shown.hysteresis.split else ("weights",)
    count = shown.hysteresis.operators
    if not std:
        return []
    return [[std.get(f"{name}[{i}]", math.nan) for i in range(count)] for name in families]


def loop(shown: Shown) -> tuple[Samples, Samples] | None:
    """Return decaying loops, minus nothing: what a drawing of the hysteresis shows."""
    if isinstance(shown, Identification):
        shown = shown.model
    drive = default_drive(shown)
    position = models.run(shown, drive, None)
    return (drive, position) if np.isfinite(position).all() else None


def _name(shown: Model) -> str:
    modified = isinstance(shown, ModifiedPrandtlIshlinskii)
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


def _limits(shown: Stage, drive: str, position: str) -> list[tuple[str, str]]:
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


_NOTE = "Values ± one standard error. Drive and position are in the units of the records."
_SHOWN = 40  # rows of a table


def identification(found: Identification) -> Box:
    """Return the box of an identification."""
    task = Task(Records([], [], ends=False), Stated("drive"), Stated("position"))
    rows = [*_quality("fit", found.fit)]
    if found.validation is not None:
        rows += _quality("validation", found.validation)
    rows += [("noise of the sensor", f"{digits(found.sensor_noise, 3)} rms")]
    rows += [("left by the fit", f"{digits(found.noise, 3)} rms"), *parameters(task, found)]
    stds = [found.weights_std.tolist(), found.weights_negative_std.tolist()]
    table = model_table(found.model, "", "", stds)
    named = f"Identification: {title(found, len(found.records))}"
    findings = findings_of(found.warnings)
    return Box(named, rows, found.verdict, findings, [table], loop(found), _NOTE)


def dynamics(found: DynamicsIdentification) -> Box:
    """Return the box of an identification of the linear part."""
    rows = [*_quality("fit", found.fit)]
    if found.dynamics is not None:
        frequency = with_error(found.dynamics.frequency, found.frequency_std, "Hz")
        second = isinstance(found.dynamics, SecondOrder)
        rows.append(("natural frequency" if second else "bandwidth", frequency))
        if isinstance(found.dynamics, SecondOrder):
            rows.append(("damping ratio", with_error(found.dynamics.damping, found.damping_std)))
    dead_time = with_error(1e3 * found.dead_time, 1e3 * found.dead_time_std, "ms", scale=np.inf)
    lag = with_error(1e3 * found.lag, 1e3 * found.lag_std, "ms", scale=np.inf)
    rows += [("dead time", dead_time), ("lag of slow motion", lag)]
    rows += [("gain", digits(found.gain)), ("noise of the sensor", f"{digits(found.noise, 3)} rms")]
    findings = findings_of(found.warnings)
    return Box("Identification of dynamics", rows, found.verdict, findings, note=_NOTE)


def many(found: ManyIdentifications) -> Box:
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


def comparison(found: Comparison) -> Box:
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


def _quality(name: str, quality: Quality) -> list[tuple[str, str]]:
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


def tuning(made: Tuning) -> Box:
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


def run(made: Run) -> Box:
    """Return the box of a closed loop."""
    header = ["error", "samples", "max", "rms", "measured max", "measured rms"]
    lines = [_metrics("whole run", made.metrics)]
    if made.settled is not None:
        lines.append(_metrics("after the first period", made.settled))
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


def _metrics(name: str, metrics: Metrics) -> list[str]:
    values = (metrics.max_position_error, metrics.position_rmse, metrics.max_error, metrics.rmse)
    return [name, str(metrics.samples), *(digits(value, 3) for value in values)]


def realtime(made: LoopReport) -> Box:
    """Return the box of a loop in real time."""
    rows = [*loop_facts(made), *(("warning", one) for one in made.warnings)]
    return Box("Loop in real time", rows, tables=[Table("Times", *loop_times(made))])


_BOXES: dict[str, Callable[..., Box]] = {
    "PrandtlIshlinskii": model,
    "ModifiedPrandtlIshlinskii": model,
    "Stage": stage,
    "Identification": identification,
    "DynamicsIdentification": dynamics,
    "ManyIdentifications": many,
    "Comparison": comparison,
    "Tuning": tuning,
    "Run": run,
    "LoopReport": realtime,
}


def html(shown: object) -> str:
    """Return what `_repr_html_` of an object of the compiled core returns."""
    return _BOXES[type(shown).__name__](shown).html()
