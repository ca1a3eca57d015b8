"""The choices of cross-validation, with the errors of all candidates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mpi_hyst as mh
from mpi_hyst._text import digits


@dataclass(frozen=True)
class Choice:
    """One option that cross-validation chose."""

    header: str
    sentence: str
    """The choice and its rule."""
    candidates: list[str]
    errors: list[float]
    chosen: str

    @property
    def rows(self) -> list[list[str]]:
        """Every candidate with its rms error on the folds that were held out."""
        errors = map(digits, self.errors)
        return [[name, error] for name, error in zip(self.candidates, errors, strict=True)]

    @property
    def best(self) -> list[int]:
        """The index of the chosen row."""
        return [self.candidates.index(self.chosen)] if self.chosen in self.candidates else []


def choices(found: mh.results.Identification) -> list[Choice]:
    """Return the choices in the order in which they were made."""
    simplest = "the simplest candidate whose prediction of held-out folds is as good as the best"
    laws = [str(law) for law, _ in found.weights_validation]
    counts = [str(count) for count, _ in found.cross_validation]
    smoothness = [f"{value:g}" for value, _ in found.smoothness_validation]
    law, count, value = found.weights_law, str(found.model.operators), f"{found.smoothness:g}"
    made = [
        _choice("weights", laws, found.weights_validation, law, f"{law} weights", simplest),
        _choice("operators", counts, found.cross_validation, count, f"{count} operators", simplest),
        _choice(
            *("smoothness", smoothness, found.smoothness_validation, value),
            *(f"smoothness {value}", "the candidate that predicts held-out folds best"),
        ),
    ]
    return [choice for choice in made if choice.candidates]


def _choice(
    header: str,
    candidates: list[str],
    pairs: Sequence[tuple[object, float]],
    chosen: str,
    name: str,
    rule: str,
) -> Choice:
    errors = [rmse for _, rmse in pairs]
    sentence = f"{name} chosen by cross-validation: {rule}"
    return Choice(header, sentence, candidates, errors, chosen)
