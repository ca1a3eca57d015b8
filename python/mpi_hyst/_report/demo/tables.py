"""The tables of the demo, for the terminal and for the report."""

from __future__ import annotations

from mpi_hyst._paper.demo import Demo, Error
from mpi_hyst._paper.stack import MeasuredStack
from mpi_hyst._text import digits


def stack_errors(stack: MeasuredStack) -> tuple[list[str], list[list[str]]]:
    """Return the errors of all models of the measured stack as a table."""
    header = ["record", "model", "max (µm)", "rms (µm)", "max (%)", "rms (%)", "base (µm)"]
    rows = []
    for what, name in (("fitted", stack.fitted.name), ("not fitted", stack.unseen.name)):
        for one in stack.predictions:
            error = one.fitted if what == "fitted" else one.unseen
            micrometres = (f"{value:.3f}" for value in (error.max, error.rms))
            percent = (f"{100 * value / error.base:.2f}" for value in (error.max, error.rms))
            cells = [*micrometres, *percent, digits(error.base)]
            rows.append([f"{name}, {what}", one.name, *cells])
    return header, rows


def model_errors(demo: Demo) -> tuple[list[str], list[list[str]]]:
    """Return the errors of both models as a table."""
    header = ["compared with", "model", "max (nm)", "rms (nm)", "max (%)", "rms (%)", "base (µm)"]
    rows = []
    learned, unseen = demo.records
    for against, record, wanted in (
        ("identification, measured", learned, learned.measured),
        ("validation, measured", unseen, unseen.measured),
        ("validation, true position", unseen, unseen.position),
    ):
        for name, found in (("conventional", demo.conventional), ("modified", demo.modified)):
            error = Error.of(wanted - demo.modelled(found, record), wanted)
            rows.append([against, name, *_cells(error)])
    return header, rows


def tracking_errors(demo: Demo) -> tuple[list[str], list[list[str]]]:
    """Return the errors of all schemes as a table."""
    header = ["drive from", "max (nm)", "rms (nm)", "max (%)", "rms (%)", "base (µm)"]
    return header, [[scheme.name, *_cells(scheme.error)] for scheme in demo.schemes]


def _cells(error: Error) -> list[str]:
    """Format with unit nm and % of the base."""
    of_base = (f"{100 * value / error.base:.3f}" for value in (error.max, error.rms))
    return [_nanometres(error.max), _nanometres(error.rms), *of_base, digits(error.base)]


def _nanometres(micrometres: float) -> str:
    value = 1e3 * micrometres
    return f"{value:.2f}" if value >= 0.005 else f"{value:.0e}"
