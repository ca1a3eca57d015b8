"""A table in HTML with a verdict and a drawing: without scripts, readable on light and dark."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape

import numpy as np

import mpi_hyst as mh
from mpi_hyst._report.page import Table
from mpi_hyst._text import printable
from mpi_hyst._types import Samples

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


def findings_of(findings: Iterable[mh.results.Finding]) -> list[tuple[str, str]]:
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
