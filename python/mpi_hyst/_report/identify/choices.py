"""The choices of cross-validation, with the errors of all candidates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mpi_hyst as mh
from mpi_hyst._text import digits

ERROR = (
    "error: the geometric mean of the rms errors on the folds, so that no fold outweighs the others"
)
"""What stands in the tables."""


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
        """Every candidate with its typical error on the folds that were held out."""
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
    terms = [_terms(creep, shift) for creep, shift, _ in found.terms_validation]
    kept = _terms(len(found.creep_std), _shift(found))
    made = [
        _choice(
            *("terms", terms, [(None, error) for _, _, error in found.terms_validation], kept),
            *(kept, simplest),
        ),
        _choice("weights", laws, found.weights_validation, law, f"{law} weights", simplest),
        _choice("operators", counts, found.cross_validation, count, f"{count} operators", simplest),
        _choice(
            *("smoothness", smoothness, found.smoothness_validation, value),
            *(f"smoothness {value}", "the candidate that predicts held-out folds best"),
        ),
    ]
    return [choice for choice in made if choice.candidates]


def _terms(creep: int, shift: str) -> str:
    """Return the name of a choice of terms."""
    creeps = ["no creep", "slow creep", "slow and fast creep"][min(creep, 2)]
    return f"{creeps}, " + ("no loop shift" if shift == "none" else f"loop shift {shift}")


def _shift(found: mh.results.Identification) -> str:
    """Return the loop shift in the words of the candidates."""
    if found.loop_shift is None:
        return "none"
    both = "c_1 and c_2" if len(found.loop_shift_std) > 1 else "c_1"
    return f"{both}, {found.loop_shift.time_constant:g} s"


def _choice(
    header: str,
    candidates: list[str],
    pairs: Sequence[tuple[object, float]],
    chosen: str,
    name: str,
    rule: str,
) -> Choice:
    errors = [error for _, error in pairs]
    sentence = f"{name} chosen by cross-validation: {rule}"
    return Choice(header, sentence, candidates, errors, chosen)
