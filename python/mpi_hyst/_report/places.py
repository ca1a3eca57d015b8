"""A stage identified from places, for the terminal and as a page: images before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

import mpi_hyst as mh
from mpi_hyst._report import canvas
from mpi_hyst._report.page import (
    MEANINGS,
    Card,
    Provenance,
    Verdict,
    findings_table,
    render,
    verdict_lines,
)
from mpi_hyst._text import digits, text_pairs
from mpi_hyst._types import Matrix, Samples

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class ScanImages:
    """Trace and retrace, each row in the order of time."""

    trace: Matrix
    retrace: Matrix


@dataclass(frozen=True)
class Corrected:
    """The images of a scan as they were, and on an even grid."""

    before: ScanImages
    trace: Matrix
    retrace: Matrix
    grid: Samples


@dataclass(frozen=True)
class Places:
    """What was found, from which drives, with the images of the last scan if there are any."""

    found: mh.results.PlacesIdentification
    drives: Sequence[str]
    corrected: Corrected | None = None


def facts(result: Places) -> list[tuple[str, str]]:
    """Return what was found as names and values."""
    found = result.found
    pairs, low_high = len(found.mismatches), found.position_range
    said = [
        ("drives", ", ".join(result.drives)),
        (
            "pairs",
            f"{pairs}{_left_out(found.wrong_pairs)}, {len(found.uninformative_pairs)} say nothing",
        ),
        ("lengths", f"{len(found.length_errors)}{_left_out(found.wrong_lengths)}"),
        ("model", repr(found.model)),
        ("dead time", f"{digits(found.dead_time)} ± {digits(found.dead_time_std)} s"),
        ("creep", "none" if found.creep is None else repr(found.creep)),
        ("drift", _drift(result)),
        ("temperature", "none given" if found.temperature is None else _temperature(found)),
        ("range", f"{digits(low_high[0])} to {digits(low_high[1])}"),
        ("mismatch", f"{digits(found.mismatch)} between the instants of a pair"),
    ]
    if result.corrected is not None:
        before, after = differences(result.corrected)
        said.append(("trace and retrace differ", f"{digits(before)} before, {digits(after)} after"))
    return said


def _left_out(wrong: Sequence[int]) -> str:
    return f", {len(wrong)} left out as wrong" if wrong else ""


def _drift(result: Places) -> str:
    """Return how far what is seen drifts in each drive."""
    if not result.found.has_drift:
        return "none"
    far = (np.ptp(result.found.drift(number)) for number in range(len(result.drives)))
    return ", ".join(digits(float(one)) for one in far)


def _temperature(found: mh.results.PlacesIdentification) -> str:
    term, (of_sensitivity, of_lag) = found.temperature, found.temperature_std
    assert term is not None
    return (
        f"{digits(term.sensitivity)} ± {digits(of_sensitivity)} per K, "
        f"{digits(term.time_constant)} ± {digits(of_lag)} s later"
    )


def differences(corrected: Corrected) -> tuple[float, float]:
    """Return the rms of trace less retrace, each line about its mean, before and after."""

    def differ(one: Matrix, other: Matrix) -> float:
        apart = one - other
        return float(np.nanstd(apart - np.nanmean(apart, axis=1, keepdims=True)))

    before = corrected.before
    return (
        differ(before.trace, before.retrace[:, ::-1]),
        differ(corrected.trace, corrected.retrace),
    )


def summary(result: Places) -> str:
    """Return what the terminal shows."""
    found = result.found
    return "\n".join([text_pairs(facts(result)), *verdict_lines(found.verdict, found.warnings)])


def report(result: Places, provenance: Provenance = ()) -> str:
    """Return the HTML text."""
    found = result.found
    low, high = found.position_range
    cards = [
        Card(
            f"{100.0 * found.mismatch / (high - low):.2g} %", "mismatch of a pair", "of the range"
        ),
        Card(str(len(found.mismatches)), "pairs", f"{len(found.wrong_pairs)} left out"),
        Card(digits(high - low), "range", "unit of the lengths"),
    ]
    reasons = [one.message for one in found.warnings]
    return render(
        "places.html.j2",
        cards=cards,
        verdict=Verdict(found.verdict, MEANINGS[found.verdict], reasons),
        provenance=provenance,
        result=result,
        facts=facts(result),
        findings=findings_table(found.warnings),
        images=None if result.corrected is None else images_figure(result.corrected),
    )


def images_figure(corrected: Corrected) -> Figure:
    """Draw trace, and trace less retrace, as they were and on an even grid."""
    figure = canvas.new_figure(6.4)
    before = corrected.before
    rows = (
        ("trace", before.trace, corrected.trace),
        (
            "trace less retrace",
            before.trace - before.retrace[:, ::-1],
            corrected.trace - corrected.retrace,
        ),
    )
    for panels, (name, *images) in zip(figure.subplots(2, 2), rows, strict=True):
        levels = [one - np.nanmean(one, axis=1, keepdims=True) for one in images]
        # Grey means the same before and after.
        most = max(float(np.nanmax(np.abs(level))) for level in levels)
        for axes, level, what in zip(panels, levels, ("", ", corrected"), strict=True):
            canvas.dress(axes, f"{name}{what}", "pixel", "line").grid(visible=False)
            shown = {"cmap": "gray", "vmin": -most, "vmax": most}
            axes.imshow(level, aspect="auto", interpolation="nearest", **shown)
    return figure
