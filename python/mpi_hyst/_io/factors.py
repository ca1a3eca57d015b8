"""Factors and offsets that stand beside arrays, as settings or attributes of a file.

Nobody knows whether the numbers have them already. So none is applied, and each is told.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mpi_hyst._io.record import Assumption
from mpi_hyst._quantity import SECONDS, Quantity, known_unit, words_of

_WORD = re.compile(
    r"(scale|scaling|gain|factor|faktor|facteur|multiplier|sensitivity|cal|calib|calibration"
    r"|conversion|slope|attenuation|amplification|(?P<sum>offset|zero))s?",
    re.IGNORECASE,
)
# What readers of other projects apply themselves, and what is of the clock.
_APPLIED = re.compile(r"(scale_factor|add_offset|NI_.*|wf_.*)")
_COUNTED = ("count", "counts", "lsb", "bit", "bits", "digit", "digits", "step", "steps")
# The number that a text begins with: none that goes on as a date.
_LEADING = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?(?![\d.-])")
# Of the clock, as a setting beside arrays.
_OF_CLOCK = ("dt", "fs", "sample rate", "sampling rate", "sample time", "sampling frequency")
_MOST = 16  # values of a setting
_LONGEST = 40  # characters of one that is a text


@dataclass(frozen=True)
class Setting:
    """What a file says beside its columns: a name, and a number, a few of them or a text."""

    name: str
    value: Any
    column: str = ""
    """The column whose attribute it is; empty where it stands by itself."""


def settings_of(attributes: Mapping[str, Any], column: str = "") -> list[Setting]:
    """Return attributes as settings, without those that a reader applies."""
    return [
        Setting(str(name), value, column)
        for name, value in attributes.items()
        if not _APPLIED.fullmatch(str(name))
    ]


def factors_told(settings: Iterable[Setting], places: Mapping[str, int]) -> Iterator[Assumption]:
    """Say which settings are factors or offsets, and of which columns, by their places."""
    for one in settings:
        words = words_of(one.name.replace("/", " per "))
        if " ".join(words).lower() in _OF_CLOCK and (value := _shown(one.value, np.nan)):
            what = f"{one.name} {value} is not used; --rate says how fast a record is"
            yield Assumption("roles", what)
        found = [told for word in words if (told := _WORD.fullmatch(word)) is not None]
        if not found and not _is_per(words):
            continue
        is_sum = any(told["sum"] for told in found)
        value = _shown(one.value, 0.0 if is_sum else 1.0)
        if value:
            index = places.get(one.column or _about(words, places))
            at = f"attribute of {one.column}: " if one.column else ""
            what = f"{at}{one.name} {value} is not applied; mend the numbers, or say their unit"
            yield Assumption("units", what, "doubtful", index)


def _is_per(words: Sequence[str]) -> bool:
    """Whether words are a unit per another one, as in `um_per_volt`; rates are none."""
    low = [word.lower() for word in words]
    if "per" not in low[1:-1]:
        return False
    at = low.index("per", 1)
    unit, of = known_unit(words[at - 1]), known_unit(words[at + 1])
    return unit != "" and of not in SECONDS and (of != "" or low[at + 1] in _COUNTED)


def _about(words: Sequence[str], names: Iterable[str]) -> str:
    """Return the one column whose name is in that of a factor: `gauge_um` of `gauge_scale`."""
    low = [word.lower() for word in words]
    leaves = {name: Quantity(re.split(r"[./]", name)[-1]).name.strip().lower() for name in names}
    found = [name for name, leaf in leaves.items() if leaf in low]
    return found[0] if len(found) == 1 else ""


def _shown(value: Any, neutral: float) -> str:
    """Return a setting as text; nothing if it changes nothing, or is no number."""
    if isinstance(value, bytes):
        value = value.decode("utf-8", "replace")
    array = np.asarray(value)
    if array.dtype.kind in "fiu" and 0 < array.size <= _MOST:
        values = array.reshape(-1).astype(np.float64).tolist()
        changes = any(one != neutral for one in values)
        return ", ".join(f"{one:g}" for one in values) if changes else ""
    texts = array.reshape(-1).tolist() if array.dtype.kind in "USO" else []
    text = str(texts[0]).strip() if len(texts) == 1 else ""
    found = _LEADING.match(text)
    return "" if found is None or (found[0] == text and float(text) == neutral) else text[:_LONGEST]
