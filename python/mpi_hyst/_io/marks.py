"""The marks in numbers: which one is the decimal mark, and which one parts thousands.

A mark is proved to be the decimal one by a number that is written as no thousands are: 0.5, 12.25.
Where nothing proves it and numbers below 1000 stand without it in the same column, 1.277 may be
1277 as well: then it is no decimal mark, and such a number is refused until somebody says which.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from mpi_hyst._io.cells import PARTED, is_like_a_number, is_number
from mpi_hyst._io.record import Assumption, Level

THOUSANDS = (".", ",", "'", " ")
"""What may part thousands."""
_BESIDE = {".": ",", ",": "."}
_SPACES = " \u00a0\u202f\u2009"
_PAIRS = re.compile(r"[+-]?\d+"), re.compile(r"\d+([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Marks:
    """The decimal mark, empty where no number has one, and what is uncertain about it."""

    decimal: str
    said: str = ""
    """Which numbers are refused, and why."""
    refused: str = ""
    """Why no number can be read, in the words of one cell."""
    cell: str = ""
    doubt: str = ""
    """Which numbers are read, though their mark may part thousands."""

    def told(self) -> list[Assumption]:
        """Return what is uncertain, as what was assumed."""
        levels: tuple[tuple[str, Level], ...] = ((self.said, "assumed"), (self.doubt, "doubtful"))
        return [Assumption("dialect", text, level) for text, level in levels if text]


def marks_of(columns: Sequence[Sequence[str]], thousands: str | None) -> Marks:
    """Tell the marks by the cells of all columns; `thousands` is what a user says of them."""
    cells = [cell for column in columns for cell in column if "," in cell or "." in cell]
    if thousands:
        return Marks(_BESIDE.get(thousands) or _counted(cells))
    proved = {mark: any(_proves(cell, mark) for cell in cells) for mark in ".,"}
    if proved["."] != proved[","]:
        mark = "." if proved["."] else ","
        doubt = _doubt_of_a_column(columns, mark) if thousands is None else ""
        return Marks(mark, doubt=doubt)
    if thousands is not None or proved["."]:
        return Marks(_counted(cells))
    for mark in ".,":
        for column in columns:
            if found := _are_thousands(column, mark):
                said = f"{found[0]!r} {found[1]} may be {found[0].replace(mark, '')}"
                option = f"--thousands {mark!r} if {mark} parts thousands, else --thousands none"
                return Marks(_BESIDE[mark], f"{said}: not read; {option}")
    both = [next((cell for cell in cells if mark in cell), "") for mark in ".,"]
    if all(both):
        said = f"{both[0]!r} and {both[1]!r}: one of both marks parts thousands"
        return Marks(".", "", f"{said}; --thousands '.' or --thousands ',' says which", both[0])
    mark = _counted(cells)
    cell = next((one for one in cells if mark and PARTED[mark].fullmatch(one)), "")
    said = f"{cell!r} may be {cell.replace(mark, '')}: a decimal mark is taken, as in all cells"
    option = f"--thousands none if it is one, --thousands {mark!r} if not"
    return Marks(mark, doubt=f"{said}; {option}" if cell else "")


def _doubt_of_a_column(columns: Sequence[Sequence[str]], mark: str) -> str:
    """Say which column may have parted thousands where other columns prove the decimal mark.

    Who writes zeros behind a decimal mark, as in 7,500, writes 0,000 and not 0 beside it.
    """
    for column in columns:
        found = _are_thousands(column, mark)
        if found and any(mark in cell and cell.endswith("0") for cell in column):
            said = f"{found[0]!r} {found[1]} may be {found[0].replace(mark, '')}: a decimal mark"
            return f"{said} is taken, as in other columns; --thousands none if it is one"
    return ""


def _counted(cells: Sequence[str]) -> str:
    """Return the mark with which more cells are numbers."""
    found = {mark: sum(is_number(cell, mark) for cell in cells) for mark in ".,"}
    if found[","] > found["."]:
        return ","
    return "." if cells else ""


def _proves(cell: str, mark: str) -> bool:
    """Whether a number could not be written like this if the mark parted thousands."""
    if _BESIDE[mark] in cell:
        # 1.277,50: the last one is the decimal mark.
        return is_like_a_number(cell) and cell.rfind(mark) > cell.rfind(_BESIDE[mark])
    return mark in cell and is_number(cell, mark) and not PARTED[mark].fullmatch(cell)


def _are_thousands(column: Sequence[str], mark: str) -> tuple[str, str] | None:
    """Return a number of a column whose mark may part thousands, and what speaks for that."""
    marked = [cell for cell in column if mark in cell]
    if not marked or not all(PARTED[mark].fullmatch(cell) for cell in marked):
        return None
    twice = next((cell for cell in marked if cell.count(mark) > 1), None)
    if twice is not None:
        return twice, "with two marks"
    others = [cell for cell in column if cell and mark not in cell]
    whole = [cell for cell in others if cell.lstrip("+-").isdigit()]
    # Numbers above 1000 without a mark would have one.
    if not whole or any(abs(int(cell)) >= 1000 for cell in whole):
        return None
    return marked[0], f"beside {max(whole, key=len)!r}"


def unparted(cell: str, thousands: str | None) -> str:
    """Return a number without what parts its thousands; another cell as it is."""
    if not thousands:
        return cell
    mark = f"[{_SPACES}]" if thousands == " " else re.escape(thousands)
    decimal = _BESIDE.get(thousands)
    behind = re.escape(decimal) if decimal else "[.,]"
    if not re.fullmatch(rf"[+-]?\d{{1,3}}({mark}\d{{3}})+({behind}\d*)?([eE][+-]?\d+)?", cell):
        return cell
    return re.sub(mark, "", cell)


def why_pairs(
    rows: Sequence[Sequence[str]], misfit: tuple[int, int] | None, has_header: bool
) -> str:
    """Return why numbers are refused that look parted at a decimal comma; empty if they do not.

    With twice as many cells as names they are, and without a header where whole numbers of constant
    width follow whole numbers. `misfit` is a line that looks like a header, and its names.
    """
    width = len(rows[0])
    reason = "decimal commas between commas? separate the cells by semicolons"
    names = misfit[1] if misfit is not None else 0
    place = ""
    if misfit is not None:
        header = f"as in the header, line {misfit[0] + 1}, got {width}"
        place = f"expected {names} cells {header}: "
    cells = [[cell for cell in row if cell] for row in rows]
    whole = all(_PAIRS[0].fullmatch(c) or _PAIRS[1].fullmatch(c) for row in cells for c in row)
    if names and width == 2 * names:
        return f"{place}twice as many cells as names: {reason}"
    if names and width > names and whole:
        return f"{place}more cells than names, and whole numbers only: {reason}"
    if width % 2 or not whole or len(rows) < 3 or has_header:
        return ""
    for index in range(1, width, 2):
        second = [row[index] for row in rows]
        lengths = {len(re.split("[eE]", cell)[0]) for cell in second}
        plain = all(_PAIRS[1].fullmatch(cell) for cell in second)
        leads = any(len(cell) > 1 and cell[0] == "0" for cell in second)
        varied = len(set(second)) > 2
        if not plain or len(lengths) > 1 or not (leads or (lengths == {1} and varied)):
            return ""
    return f"{place}every second cell is a whole number of constant width: {reason}"
