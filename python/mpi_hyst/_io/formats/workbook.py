"""Workbooks of spreadsheets (.xlsx), by python-calamine.

A sheet is read as a text with tabs between its cells, so all that holds for texts holds for it: the
line of a message is the row of the sheet.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from datetime import date, datetime, time, timedelta
from pathlib import Path
from typing import Any
from zipfile import ZipFile

from mpi_hyst._io.formats.text import TextTable
from mpi_hyst._io.record import Assumption, ReadError
from mpi_hyst._io.source import reader, whole
from mpi_hyst._io.table import Table


def is_workbook(path: Path) -> bool:
    """Whether an archive is a workbook and none of arrays."""
    try:
        with ZipFile(path) as archive:
            return "[Content_Types].xml" in archive.namelist()
    except Exception:  # zipfile raises what it happens to meet in a broken file
        return False


def read_workbook(path: Path) -> Table:
    """Open a workbook: the first sheet with columns of numbers."""
    calamine = reader(str(path), "python_calamine", "xlsx")
    with whole(path, "workbook"):
        book = calamine.CalamineWorkbook.from_path(str(path))
        sheets = {
            name: book.get_sheet_by_name(name).to_python(skip_empty_area=False)
            for name in book.sheet_names
        }
    tables: dict[str, TextTable] = {}
    for name, rows in sheets.items():
        if any(any(cell != "" for cell in row) for row in rows):
            tables[name] = TextTable(path, _Sheet(rows))
    with_numbers = [name for name, table in tables.items() if len(table.numeric) > 1]
    with_numbers = with_numbers or [name for name, table in tables.items() if table.numeric]
    formulas, why = _formulas_without_values(path), ""
    if formulas:
        what = f"{formulas} cells hold formulas and not their values"
        why = f"{what}: open the workbook in a spreadsheet and save it, or save the sheet as CSV"
    if not with_numbers:
        reason = f"; {why}" if why else ""
        raise ReadError(f"{path}: no sheet with columns of numbers: {', '.join(sheets)}{reason}")
    first, *others = with_numbers
    table = tables[first]
    table.format = f"workbook, sheet {first}"
    if why:
        table.assumed.insert(0, Assumption("table", why, "doubtful"))
    if others:
        said = (
            f"sheet {first} is read, {', '.join(others)} not: move a sheet to the front to read it"
        )
        table.assumed.insert(0, Assumption("bytes", said, "assumed"))
    return table


# A cell with a formula behind which no value stands, as programs write it that do not calculate.
_FORMULA = re.compile(
    rb'<c\b(?![^>]*t="str")[^>]*>\s*'
    rb"<f\b[^>]*?(?:/>|>[^<]*</f>)\s*(?:<v\s*/>|<v>\s*</v>)?\s*</c>"
)


def _formulas_without_values(path: Path) -> int:
    """Return how many cells of all sheets hold a formula that was never calculated."""
    with whole(path, "workbook"), ZipFile(path) as archive:
        names = [one for one in archive.namelist() if one.startswith("xl/worksheets/sheet")]
        return sum(len(_FORMULA.findall(archive.read(one))) for one in names)


class _Sheet:
    """The rows of a sheet as lines of text."""

    encoding = "utf-8"
    last_is_open = False

    def __init__(self, rows: Sequence[Sequence[Any]]) -> None:
        self._lines = iter(["\t".join(map(_text, row)) for row in rows])

    def __iter__(self) -> Iterator[str]:
        return self

    def __next__(self) -> str:
        return next(self._lines)

    def block(self, least: int) -> bytes:
        """Nothing: there are no bytes."""
        del least
        return b""

    def skip(self, size: int, lines: int) -> None:
        """Nothing to skip."""

    def not_text(self) -> ReadError:
        """Return nothing: a sheet is always text."""
        raise AssertionError


def _text(cell: object) -> str:
    if isinstance(cell, bool):
        return str(cell)
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 1e15:
        return str(int(cell))
    if isinstance(cell, timedelta):
        return f"{cell.total_seconds()!r} s"
    if isinstance(cell, datetime | time | date):
        return cell.isoformat()
    return " ".join(str(cell).split())
