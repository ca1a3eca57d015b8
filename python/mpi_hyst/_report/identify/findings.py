"""What is wrong with records, for the terminal and for the report."""

from __future__ import annotations

from collections.abc import Sequence

import mpi_hyst as mh
from mpi_hyst._report.page import Section, Table
from mpi_hyst._text import digits

_LOOKED_FOR = (
    "Looked for: too few samples, thresholds that the input never reaches, missing minor loops, "
    "operators that the data cannot tell apart, a residual that follows speed or time, outliers, "
    "clipped signals. What each number is says help(mpi_hyst.diagnose)."
)


def text(findings: Sequence[mh.results.Finding], records: Sequence[str]) -> str:
    """Return one line for each finding, by name, or that there is none."""
    if not findings:
        return "warnings: none"
    lines = [
        f"  {found.code}: {_place(found, records)}{found.message}"
        f" (value {digits(found.value, 3)}, limit {digits(found.limit, 3)})"
        for found in findings
    ]
    return "\n".join(["warnings", *lines])


def section(findings: Sequence[mh.results.Finding], records: Sequence[str]) -> Section:
    """Return the section of the report."""
    if not findings:
        return Section("warnings", "Warnings", ["Nothing was found.", _LOOKED_FOR])
    table = Table(
        "What may be wrong",
        ["name", "record", "value", "limit"],
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
    sentences = [f"{found.code}: {_place(found, records)}{found.message}." for found in findings]
    return Section("warnings", "Warnings", [*sentences, _LOOKED_FOR], [table])


def _place(found: mh.results.Finding, records: Sequence[str]) -> str:
    return "" if found.record is None else f"{records[found.record]}: "
