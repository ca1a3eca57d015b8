"""Numbers, tables and names as text."""

from __future__ import annotations

import math
import unicodedata
from collections.abc import Collection, Sequence

_NOISE = 1e-12
"""A number is rounding if it is such a part of those from which it was computed."""


def printable(text: str) -> str:
    """Escape characters that control a terminal or that a page cannot contain.

    They are those of Unicode that are no letters, marks, digits, signs or spaces: control, formats
    that nobody sees (marks of direction, joiners, the soft hyphen), breaks of lines, surrogates,
    which stand for bytes of a name that are not UTF-8, and what has no meaning.
    """
    if text.isprintable():
        return text
    return "".join(ascii(one)[1:-1] if _is_unprintable(one) else one for one in text)


def _is_unprintable(one: str) -> bool:
    category = unicodedata.category(one)
    return category[0] == "C" or category in ("Zl", "Zp")


def printable_lines(text: str) -> str:
    """Escape the same characters, but keep line breaks."""
    return "\n".join(map(printable, text.split("\n")))


def digits(value: float, count: int = 4) -> str:
    """Format with `count` significant digits, without an exponent for usual magnitudes."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    exponent = math.floor(math.log10(abs(value)))
    if -5 <= exponent < 7:
        return f"{value:.{max(0, count - 1 - exponent)}f}"
    return f"{value:.{count - 1}e}"


NOT_DETERMINED = "not determined"


def determined(
    value: float, std: float, *, scale: float | None = None, bounds: Collection[float] = (0.0,)
) -> bool:
    """Return whether an estimate means something: its standard error is at most its scale.

    The scale is its value by default. At a bound there is no standard error, and none is needed.
    """
    if math.isnan(std):
        return any(math.isclose(value, bound, abs_tol=1e-9) for bound in bounds)
    return std <= (abs(value) if scale is None else scale)


def in_unit(value: float, unit: str, count: int = 4) -> str:
    """Format a number with its unit, if it has one."""
    return f"{digits(value, count)} {unit}".rstrip()


def without_noise(value: float, scale: float) -> float:
    """Return 0 for a number that is rounding beside the scale: for texts, not for files."""
    return 0.0 if abs(value) <= _NOISE * scale else value


def span(low: float, high: float, unit: str) -> str:
    """Format a range; an end that is rounding beside the other one is 0."""
    scale = max(abs(low), abs(high))
    low, high = without_noise(low, scale), without_noise(high, scale)
    return f"{digits(low)} to {in_unit(high, unit)}"


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Align a table: the first column to the left, the others to the right."""
    lines = [list(header), *(list(row) for row in rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    return "\n".join(
        "  "
        + "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def text_pairs(pairs: Sequence[tuple[str, str]]) -> str:
    """Align names and values, one pair per line."""
    width = max(len(name) for name, _ in pairs)
    return "\n".join(f"  {name.ljust(width)}  {value}" for name, value in pairs)
