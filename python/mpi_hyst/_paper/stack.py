"""The measured stack of the demo: models are fitted to one record and judged by another."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Literal

import numpy as np

import mpi_hyst as mh
from mpi_hyst._paper.demo import Error, Progress
from mpi_hyst._types import Samples

NOISE = (0.065, 0.072)  # um rms at rest, from the provenance of the records

Watch = Callable[[str, str], AbstractContextManager[Progress | None]]


@dataclass(frozen=True)
class Prediction:
    """A model's errors on the record that it was fitted to, and on the other one."""

    name: str
    fitted: Error
    unseen: Error
    output: Samples
    """What the model says of the other record, with the offset that suits that record best."""


@dataclass(frozen=True)
class MeasuredStack:
    """The records, the recommended model, and what every model says of the unseen record."""

    fitted: mh.datasets.Record
    unseen: mh.datasets.Record
    found: mh.results.Identification
    line: Prediction
    conventional: Prediction
    modified: Prediction

    @property
    def predictions(self) -> tuple[Prediction, Prediction, Prediction]:
        """Every model, the simplest first."""
        return self.line, self.conventional, self.modified


def compute(watch: Watch) -> MeasuredStack:
    """Fit all models to the decaying loops and predict the major loops.

    `watch` takes the name of a fit and a unit; its context gives the progress function.
    """
    fitted = mh.datasets.piezo_stack("decaying_loops")
    unseen = mh.datasets.piezo_stack("major_loops")

    def fit(model: Literal["modified", "conventional"]) -> mh.results.Identification:
        with watch(f"measured stack, {model} model", "µm") as progress:
            return mh.identify(
                *(fitted.u, fitted.y),
                dt=fitted.dt,
                skip=fitted.skip,
                model=model,
                operators=20,
                progress=progress,
            )

    def predicted(name: str, found: mh.results.Identification) -> Prediction:
        return _judged(
            name,
            *(fitted, found.residuals(fitted.u, fitted.y, record=0)),
            *(unseen, found.residuals(unseen.u, unseen.y, skip=unseen.skip)),
        )

    found = fit("modified")
    return MeasuredStack(
        *(fitted, unseen, found),
        _straight_line(fitted, unseen),
        predicted("conventional model (plays)", fit("conventional")),
        predicted("modified model (coupled plays)", found),
    )


def _straight_line(fitted: mh.datasets.Record, unseen: mh.datasets.Record) -> Prediction:
    moved = slice(fitted.skip, None)
    line = np.polynomial.Polynomial.fit(fitted.u[moved], fitted.y[moved], 1)
    residuals = [record.y - line(record.u) for record in (fitted, unseen)]
    # As for the models: the zero of the sensor is arbitrary in every record.
    residuals[1] -= residuals[1][unseen.skip :].mean()
    return _judged("constant gain (no model)", fitted, residuals[0], unseen, residuals[1])


def _judged(
    name: str,
    fitted: mh.datasets.Record,
    of_fitted: Samples,
    unseen: mh.datasets.Record,
    of_unseen: Samples,
) -> Prediction:
    def error(residuals: Samples, record: mh.datasets.Record) -> Error:
        return Error.of(residuals[record.skip :], record.y[record.skip :])

    return Prediction(
        name, error(of_fitted, fitted), error(of_unseen, unseen), unseen.y - of_unseen
    )
