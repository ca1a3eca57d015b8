"""Verdict and warnings about records and fit, for the terminal and for the report."""

from __future__ import annotations

import math
from collections.abc import Sequence

import mpi_hyst as mh
from mpi_hyst._report.identify.records import Records
from mpi_hyst._report.page import Section, Table, Verdict
from mpi_hyst._text import NOT_DETERMINED, digits

_MEANING = {
    "green": "Nothing was found that makes the result doubtful.",
    "amber": "Some numbers are doubtful, or another record would make the result better.",
    "red": "The result is not that of the stage. Do not use it before the red findings are gone.",
}

_CHECKS = (
    "Checked: sign and direction of the loops, times of the samples, size of the residuals and "
    "what they follow (input, rate, amplitude, time), start-up, outliers, clipped signals, number "
    "of samples, missing and repeated loops, thresholds that the input does not reach, operators "
    "that the data cannot distinguish, dead time, validation beyond the range. docs/findings.md "
    "explains each number."
)


def verdict(found: mh.results.Identification) -> str:
    """Return the verdict in one line, with the codes of what was found, the worst first."""
    codes = list(dict.fromkeys(finding.code for finding in _worst_first(found.warnings)))
    interrupted = ", but the search was interrupted" if found.partial else ""
    return f"verdict: {found.verdict}{interrupted}" + (f" ({', '.join(codes)})" if codes else "")


def banner(found: mh.results.Identification, records: Records) -> Verdict:
    """Return the verdict at the top of the report."""
    lines = [
        f"{finding.code}: {_place(finding, records)}{finding.message}. Try: {finding.hint}."
        for finding in _worst_first(found.warnings)
    ]
    interrupted = " The search was interrupted." if found.partial else ""
    return Verdict(found.verdict, f"{_MEANING[found.verdict]}{interrupted}", lines)


def text(findings: Sequence[mh.results.Finding], records: Records) -> str:
    """Return two lines for each warning, or one line if there is none."""
    if not findings:
        return "warnings: none"
    lines = [
        f"  {found.severity} {found.code}: {_place(found, records)}{found.message}"
        f" (value {_number(found.value)}, limit {_number(found.limit)})\n    try: {found.hint}"
        for found in _worst_first(findings)
    ]
    return "\n".join(["warnings", *lines])


def section(findings: Sequence[mh.results.Finding], records: Records) -> Section:
    """Return the section of the report."""
    if not findings:
        return Section("warnings", "Warnings", ["No warnings.", _CHECKS])
    table = Table(
        "Warnings",
        ["code", "record", "sample", "severity", "value", "limit"],
        [
            [
                found.code,
                "all" if found.record is None else records.names[found.record],
                "" if found.sample is None else str(found.sample),
                found.severity,
                _number(found.value),
                _number(found.limit),
            ]
            for found in _worst_first(findings)
        ],
        "The verdict at the top of the page says what each means and what to try.",
    )
    return Section("warnings", "Warnings", [_CHECKS], [table])


def _number(value: float) -> str:
    return digits(value, 3) if math.isfinite(value) else NOT_DETERMINED


def _worst_first(findings: Sequence[mh.results.Finding]) -> list[mh.results.Finding]:
    return sorted(findings, key=lambda found: found.severity != "red")


def _place(found: mh.results.Finding, records: Records) -> str:
    return "" if found.record is None else f"{records.names[found.record]}: "
