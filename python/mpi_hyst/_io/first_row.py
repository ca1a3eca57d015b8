"""What speaks against the first row of a table: it may be names, or a setting of an instrument."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise

from mpi_hyst._io.cells import MISSING, is_like_a_number, number
from mpi_hyst._io.clocks import even_step

# As pandas writes the number of a column, that of a whole or of a real index.
COUNT = re.compile(r"(0|[1-9]\d*)(\.0)?")
_LARGEST = 1000  # number of a column
_FEWEST = 3  # rows that tell how a column goes on
_NEAR = 20  # of them
_MOST = 0.7  # of the rows that are written otherwise: %g writes whole numbers short
_JUMP = 3.0  # largest steps


def is_word(cell: str) -> bool:
    """Whether a cell holds a word, and neither a number nor what stands for a missing one."""
    told = re.search(r"[^\W\d_]{2}", cell) is not None and not cell.startswith("#")
    return told and not is_like_a_number(cell) and cell.lower() not in MISSING


def may_be_names(first: Sequence[str], below: Sequence[Sequence[str]], decimal: str) -> bool:
    """Whether a first row of small whole numbers is hardly one of the rows below.

    They differ from each other as names do, and do not go on as the rows do: a clock in them
    leaps, or all of them are written otherwise, or one is far from the next.
    """
    if len(below) < _FEWEST or not first:
        return False
    if not any(row[0] for row in [first, *below]):
        first, below = first[1:], [row[1:] for row in below]
    begins = 1 if first and not first[0] else 0
    digits = first[begins:]
    if not digits or not all(map(COUNT.fullmatch, digits)):
        return False
    counts = [float(cell) for cell in digits]
    if len(set(counts)) < len(counts) or max(counts) >= _LARGEST:
        return False
    if begins:
        return True
    leaps = False
    for value, column in zip(counts, _columns(below, len(first), decimal), strict=True):
        known = [one for one in column[:_NEAR] if one is not None]
        if len(known) < _FEWEST:
            continue
        if even_step(known):
            # A clock tells it alone.
            return not even_step([value, *known])
        leaps = leaps or abs(known[0] - value) > _JUMP * _largest_step(known) > 0.0
    # One number alone may be a whole one among others.
    return leaps or (len(first) > 1 and _written(first, below, decimal))


def may_be_settings(first: Sequence[str], below: Sequence[Sequence[str]], decimal: str) -> bool:
    """Whether a first row of whole numbers below names is hardly one of the rows below.

    All of them are far from the next ones, and written otherwise. Zeros are where a record begins.
    """
    if (
        len(below) < _FEWEST
        or not all(map(COUNT.fullmatch, first))
        or not _written(first, below, decimal)
    ):
        return False
    leaps = []
    for cell, column in zip(first, _columns(below, len(first), decimal), strict=True):
        known = [one for one in column[:_NEAR] if one is not None]
        far = len(known) >= _FEWEST and abs(known[0] - float(cell)) > _JUMP * _largest_step(known)
        leaps.append(far)
    return all(leaps) and any(float(cell) for cell in first)


def _written(first: Sequence[str], below: Sequence[Sequence[str]], decimal: str) -> bool:
    """Whether a row of whole numbers stands above rows that have decimals."""
    return all(
        decimal not in cell and sum(decimal in row[index] for row in below) > _MOST * len(below)
        for index, cell in enumerate(first)
    )


def goes_on(first: Sequence[str], below: Sequence[Sequence[str]], decimal: str) -> bool:
    """Whether a first row of consecutive whole numbers is one of the rows below.

    A row that is written otherwise, or that is far from the next ones, is none of them. As names
    such a row is sure enough to be taken for them, so it must say less than one of any numbers.
    """
    written = [
        decimal not in first[index] and all(decimal in row[index] for row in below)
        for index in range(len(first))
    ]
    if all(written):
        return False
    for cell, column in zip(first, _columns(below, len(first), decimal), strict=True):
        known = [value for value in column if value is not None]
        if len(known) < _FEWEST:
            continue
        if even_step(known[:_NEAR]):
            # A clock tells it alone.
            return even_step([float(cell), *known[:_NEAR]]) > 0.0
        if abs(float(cell) - known[0]) > _JUMP * _largest_step(known):
            return False
    return len(first) == 1


def _largest_step(values: Sequence[float]) -> float:
    return max(abs(b - a) for a, b in pairwise(values))


def _columns(rows: Sequence[Sequence[str]], count: int, decimal: str) -> list[list[float | None]]:
    """Return the numbers of the first columns of rows."""
    return [[number(row[index], decimal) for row in rows] for index in range(count)]
