"""Warnings about records and fit, for the terminal and for the report."""

from __future__ import annotations

from collections.abc import Sequence

import mpi_hyst as mh
from mpi_hyst._report.page import Section, Table
from mpi_hyst._text import digits

_CHECKS = (
    "Checked: number of samples, thresholds that the input does not reach, missing minor loops, "
    "operators that the data cannot distinguish, residuals correlated with rate or time, outliers, "
    "clipped signals. help(mpi_hyst.diagnose) explains each number."
)


def text(findings: Sequence[mh.results.Finding], records: Sequence[str]) -> str:
    """Return two lines for each warning, or one line if there is none."""
    if not findings:
        return "warnings: none"
    lines = [
        f"  {found.code}: {_place(found, records)}{found.message}"
        f" (value {digits(found.value, 3)}, limit {digits(found.limit, 3)})\n    hint: {found.hint}"
        for found in findings
    ]
    return "\n".join(["warnings", *lines])


def section(findings: Sequence[mh.results.Finding], records: Sequence[str]) -> Section:
    """Return the section of the report."""
    if not findings:
        return Section("warnings", "Warnings", ["No warnings.", _CHECKS])
    table = Table(
        "Warnings",
        ["code", "record", "value", "limit"],
        [
            [
                found.code,
                "all" if found.record is None else records[found.record],
                digits(found.value, 3),
                digits(found.limit, 3),
            ]
            for found in findings
        ],
    )
    sentences = [
        f"{found.code}: {_place(found, records)}{found.message}. Hint: {found.hint}."
        for found in findings
    ]
    return Section("warnings", "Warnings", [*sentences, _CHECKS], [table])


def _place(found: mh.results.Finding, records: Sequence[str]) -> str:
    return "" if found.record is None else f"{records[found.record]}: "
