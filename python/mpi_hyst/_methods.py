"""Methods of compiled classes that show them: `_repr_html_`, `plot` and `report`.

They are set on the classes when the package is imported, as text and figures are made in Python.
What they need is imported when they are called.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from importlib import import_module
from typing import Any

import mpi_hyst._core as _core
from mpi_hyst import plot, reports

_BOXES = {
    "PrandtlIshlinskii": "model",
    "ModifiedPrandtlIshlinskii": "model",
    "Stage": "stage",
    "Identification": "identification",
    "DynamicsIdentification": "dynamics",
    "ManyIdentifications": "many",
    "Comparison": "comparison",
    "Tuning": "tuning",
    "Run": "run",
    "LoopReport": "realtime",
}
_PLOTS: dict[str, Callable[..., Any]] = {
    **dict.fromkeys(("PrandtlIshlinskii", "ModifiedPrandtlIshlinskii", "Stage"), plot.loops),
    "Identification": plot.loops,
    "Tuning": plot.tuning,
    "Run": plot.run,
    "LoopReport": plot.realtime,
    **dict.fromkeys(("Forward", "Inverse", "StageInverse"), plot.memory),
}
_REPORTS: dict[str, Callable[..., Any]] = {
    "Identification": reports.identification,
    "Run": reports.run,
}


def attach() -> None:
    """Set the methods on the classes."""
    for name, box in _BOXES.items():
        _set(name, "_repr_html_", _html(box))
    for name, function in _PLOTS.items():
        said = f"Draw it with `mpi_hyst.plot.{function.__name__}`, which has the arguments."
        _set(name, "plot", _method(function, said))
    for name, function in _REPORTS.items():
        said = (
            f"Write a report as one HTML file: `mpi_hyst.reports.{function.__name__}`, which has "
            "the arguments."
        )
        _set(name, "report", _method(function, said))


def _set(owner: str, name: str, function: Callable[..., Any]) -> None:
    function.__name__, function.__qualname__ = name, f"{owner}.{name}"
    setattr(getattr(_core, owner), name, function)


def _html(name: str) -> Callable[[Any], str]:
    """Return a method that shows an object in a notebook."""

    def show(self: Any) -> str:
        html: str = getattr(import_module("mpi_hyst._report.notebook"), name)(self).html()
        return html

    return show


def _method(function: Callable[..., Any], said: str) -> Callable[..., Any]:
    """Return a function as a method: its first argument is the object."""

    def call(self: Any, /, *others: Any, **options: Any) -> Any:
        return function(self, *others, **options)

    signature = inspect.signature(function)
    _, *others = signature.parameters.values()
    own = inspect.Parameter("self", inspect.Parameter.POSITIONAL_OR_KEYWORD)
    # `inspect` and help() read it; the type of a function does not have it.
    call.__signature__ = signature.replace(parameters=[own, *others])  # type: ignore[attr-defined]
    call.__doc__ = said
    return call
