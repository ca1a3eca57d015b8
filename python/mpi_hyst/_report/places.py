"""A stage identified from places, for the terminal and as a page: images before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from mpi_hyst._core import PlacesIdentification
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

    found: PlacesIdentification
    drives: Sequence[str]
    corrected: Corrected | None = None


def facts(result: Places) -> list[tuple[str, str]]:
    """Return what was found as names and values."""
    found = result.found
    low_high = found.position_range
    said = [
        ("drives", ", ".join(result.drives)),
        ("pairs", _pairs(found)),
        ("lengths", f"{len(found.length_errors)}{_left_out(found.wrong_lengths)}"),
        ("model", repr(found.model) + _further(found)),
        ("dead time", f"{digits(found.dead_time)} ± {digits(found.dead_time_std)} s"),
        ("creep", "none" if found.creep is None else repr(found.creep)),
        ("drift", _drift(result)),
        ("temperature", "none given" if found.temperature is None else _temperature(found)),
        ("range", f"{digits(low_high[0])} to {digits(low_high[1])}"),
        ("mismatch", f"{digits(found.mismatch)} {_of_what(found)}"),
    ]
    if result.corrected is not None:
        before, after = differences(result.corrected)
        said.append(("trace and retrace differ", f"{digits(before)} before, {digits(after)} after"))
    return said


def _further(found: PlacesIdentification) -> str:
    """Name what stands beside the plays, and in front of them."""
    duhem = "" if found.duhem is None else f", Duhem operator of {len(found.duhem.knots)} knots"
    return duhem + ("" if found.input_map is None else ", input map")


def _pairs(found: PlacesIdentification) -> str:
    count = len(found.mismatches)
    if not count:
        return "none"
    silent = len(found.uninformative_pairs)
    return f"{count}{_left_out(found.wrong_pairs)}, {silent} say nothing"


def _of_what(found: PlacesIdentification) -> str:
    """Return what is missed by the mismatch."""
    return "between the instants of a pair" if len(found.mismatches) else "of a length, rms"


def _left_out(wrong: Sequence[int]) -> str:
    return f", {len(wrong)} left out as wrong" if wrong else ""


def _drift(result: Places) -> str:
    """Return how far what is seen drifts in each drive."""
    if not result.found.has_drift:
        return "none"
    far = (np.ptp(result.found.drift(number)) for number in range(len(result.drives)))
    return ", ".join(digits(float(one)) for one in far)


def _temperature(found: PlacesIdentification) -> str:
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
    told, wrong, one, all_of_them = (
        (found.mismatches, found.wrong_pairs, "pair", "pairs")
        if len(found.mismatches)
        else (found.length_errors, found.wrong_lengths, "length", "lengths")
    )
    share = f"{100.0 * found.mismatch / (high - low):.2g} %"
    cards = [
        Card(share, f"mismatch of a {one}", "of the range"),
        Card(str(len(told)), all_of_them, f"{len(wrong)} left out"),
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
