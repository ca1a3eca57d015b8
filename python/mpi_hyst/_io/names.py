"""What names of columns and their units look like, in cells and in a line of text."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence

from mpi_hyst._io.cells import MISSING, is_like_a_number, is_stamp, split
from mpi_hyst._quantity import Quantity, is_like_a_unit, known_unit

_UNIT_WORDS = {"", "-", "--", "raw", "bit", "k", "sequence"}
# What parts a key from its value parts a name from its unit, too: `Model: a`, `Time: ms`.
_KEY = re.compile(r"[^:=]*[:=](?P<value>[^:=]*)")
_PARTS_ALONE = (";", ",", "|", "/", ":", "=")
# A word that only says what follows: `columns: time, drive, gauge`.
_SAYS_NAMES = re.compile(
    r"(columns?|fields?|names?|header|channels?|spalten?|colonnes?|columnas?)\s*[:=]\s*",
    re.IGNORECASE,
)


def are_units(cells: Sequence[str], *, one_is_known: bool = True) -> bool:
    """Whether a row below the header holds units: s, V, [µm]."""
    known = [known_unit(cell) != "" for cell in cells]
    other = [
        cell.lower() in _UNIT_WORDS
        or is_like_a_unit(cell)
        or (cell[0] in "[(" and cell[-1] in "])")
        for cell, is_known in zip(cells, known, strict=True)
        if not is_known
    ]
    return all(other) and (any(known) if one_is_known else any(cells))


def unnamed(index: int, names: Sequence[str]) -> str:
    """Return what a column without a name is called: by its number, if no other one is."""
    return f"column {index}" if str(index) in names else str(index)


def is_prose(text: str) -> bool:
    """Whether a line is a remark: a sentence, a setting, a date."""
    return bool(re.search(r"[:=]|\w[.!?]$", text)) or is_stamp(text)


def trimmed(cells: Sequence[str]) -> list[str]:
    """Return cells without the empty ones behind them."""
    count = max((index + 1 for index, cell in enumerate(cells) if cell), default=0)
    return list(cells[:count])


def without_numbers(names: list[str]) -> list[str] | None:
    """Return names, or None if one is a number in any notation, or most are empty."""
    numbers = any(is_like_a_number(name) or is_stamp(name) for name in names)
    filled = [name for name in names if name.lower() not in MISSING]
    return None if numbers or 2 * len(filled) < len(names) else names


def names_in(text: str, delimiter: str, width: int, full: int) -> list[str] | None:
    """Return the names in a text, parted by whatever makes as many as there are columns.

    `full` is the number of cells of most rows, of which those beyond the width are empty.
    """
    bare = _SAYS_NAMES.sub("", text, count=1) if _SAYS_NAMES.match(text) else text
    ways: list[Callable[[str], list[str]]] = [
        lambda line: split(line, delimiter),
        *(lambda line, mark=mark: split(line, mark) for mark in "\t;,|"),
        _wide_gaps,
        _behind_units,
        _with_units,
    ]
    # What parts the rows parts their names too, if it is there.
    parted = delimiter != " " and delimiter in bare
    for way in ways[:1] if parted else ways:
        names = [name.strip(' "') for name in trimmed(way(bare))]
        if not are_names(names):
            continue
        if len(names) == full and len(names) > width:
            return without_numbers(names)
        if len(names) == width and without_numbers(names) is not None:
            commas = [name.rstrip(",;") for name in names]
            return commas if all(commas) else names
    return None


def are_names(names: Sequence[str]) -> bool:
    """Whether none is a separator, and the first one is no key of a setting: `Model: a, b`."""
    if any(name in _PARTS_ALONE for name in names):
        return False
    told = _KEY.fullmatch(names[0]) if names else None
    if told is None or is_like_a_unit(told["value"]):
        return True
    return any(_KEY.fullmatch(name) or Quantity(name).suffix for name in names[1:])


def _wide_gaps(text: str) -> list[str]:
    return re.split(r"\s{2,}|\t", text.strip())


def _behind_units(text: str) -> list[str]:
    """Part names with single spaces behind each unit in brackets: `Time (ms) Drive (V)`."""
    parts = [part.strip(" ,;") for part in re.split(r"(?<=[\])])[\s,;]+", text.strip())]
    return parts if all(part.endswith((")", "]")) for part in parts) else []


def _with_units(text: str) -> list[str]:
    """Join words and units that follow each other: `time ms drive V`."""
    words = text.replace(",", " ").split()
    units = words[1::2]
    if len(words) % 2 or not all(known_unit(unit) for unit in units):
        return []
    return [f"{name} ({unit})" for name, unit in zip(words[::2], units, strict=True)]
