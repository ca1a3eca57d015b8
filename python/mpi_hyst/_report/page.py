"""Reports: each is a template that extends `page.html.j2`, filled with numbers, tables and figures.

The text of a page, its sections and their order are in its template; `blocks.html.j2` has what
sections are made of. A page is one file of HTML that needs nothing else. It says how it was made:
version, date, command, and hashes of what went in.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from mpi_hyst._core import Finding, Stage
from mpi_hyst._files import sha256
from mpi_hyst._report import canvas
from mpi_hyst._text import NOT_DETERMINED, digits, in_unit, printable_lines

if TYPE_CHECKING:
    import jinja2

_NUMBERS = {"nan", "inf", "bound", NOT_DETERMINED}  # what stands in columns of numbers

_EPOCH = "SOURCE_DATE_EPOCH"  # of reproducible builds: seconds that stand for now

Provenance: TypeAlias = Sequence[tuple[str, str]]
"""How a page was made, as names and values."""
Rows: TypeAlias = tuple[Sequence[str], Sequence[Sequence[str]]]
"""The header and the rows of a table."""


@dataclass(frozen=True)
class Table:
    """Cells as text, where the table brings its caption along."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""

    def __iter__(self) -> Iterator[Any]:
        """Return header and rows: a template takes them together."""
        return iter((self.header, self.rows))


@dataclass(frozen=True)
class Card:
    """A main result with its meaning and its base."""

    value: str
    what: str
    base: str = ""


MEANINGS = {
    "green": "Nothing was found that makes the result doubtful.",
    "amber": "Some numbers are doubtful, or another record would make the result better.",
    "red": "The result is not that of the stage. Do not use it before the red findings are gone.",
}
"""What a verdict means."""


def verdict_lines(verdict: str, findings: Iterable[Finding]) -> list[str]:
    """Return a verdict and its findings as the terminal shows them."""
    said = [f"- {one.code}: {one.message}; {one.hint}" for one in findings]
    return [f"verdict: {verdict}. {MEANINGS[verdict]}", *said]


def findings_table(findings: Iterable[Finding]) -> Rows:
    """Return findings as a table."""
    rows = [[one.code, one.severity, one.message, one.hint] for one in findings]
    return (["finding", "severity", "what", "what to try"], rows)


@dataclass(frozen=True)
class Verdict:
    """Green, amber or red, what that means, and one line for each reason."""

    level: str
    meaning: str
    reasons: Sequence[str] = ()


def render(
    template: str,
    *,
    cards: Sequence[Card],
    verdict: Verdict | None = None,
    provenance: Provenance = (),
    **values: Any,
) -> str:
    """Return the HTML text."""
    frame = {"cards": cards, "verdict": verdict, "provenance": provenance, "contents": []}
    return environment().get_template(template).render(**frame, **values)


def environment() -> jinja2.Environment:
    """Return what reads the templates. Everything that they show is escaped."""
    import jinja2

    made = jinja2.Environment(
        loader=jinja2.FunctionLoader(_source),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_finalize,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters |= {
        "columns_of_words": columns_of_words,
        "data_uri": canvas.data_uri,
        "digits": digits,
        "in_unit": in_unit,
    }
    return made


def _source(name: str) -> str:
    return files("mpi_hyst._report").joinpath(name).read_text("utf-8")


def _finalize(value: object) -> object:
    """Escape characters in names of files and columns that a page cannot contain."""
    is_markup = hasattr(value, "__html__")
    return printable_lines(value) if isinstance(value, str) and not is_markup else value


def columns_of_words(rows: Sequence[Sequence[str]]) -> list[int]:
    """Return which columns hold words, to the left, and not numbers, to the right."""
    columns = enumerate(zip(*rows, strict=True))
    return [index for index, cells in columns if 2 * sum(map(_is_word, cells)) > len(cells)]


def _is_word(cell: str) -> bool:
    return cell[:1].isalpha() and cell not in _NUMBERS


def made_with(
    made_by: str | None,
    data: Iterable[tuple[str, str | None]] = (),
    stage: tuple[str, str | None] | None = None,
) -> Provenance:
    """Return names and values. `data` are names with their SHA-256, as far as it is known.

    `made_by` is the command, or the call in Python; None if neither is known.
    """
    # Slow to import, and needed by pages alone.
    from importlib.metadata import version

    made = [("made with", f"mpi_hyst {version('mpi_hyst')}"), ("date", _date())]
    made += [] if made_by is None else [("made by", made_by)]
    # Parts of one file have one source.
    made += [("data", _hashed(*one)) for one in dict.fromkeys(data)]
    return [*made, *([] if stage is None else [("stage", _hashed(*stage))])]


def hashed_file(path: Path) -> tuple[str, str | None]:
    """Return the name of a file with its SHA-256; a pipe cannot be read again and has none."""
    return str(path), sha256(path)


def hashed_stage(stage: Stage) -> tuple[str, str]:
    """Return the hash of a stage that is in no file."""
    return "Stage.to_bytes()", hashlib.sha256(stage.to_bytes()).hexdigest()


def hashed_arrays(name: str, arrays: Sequence[object]) -> tuple[str, str]:
    """Return the hash of samples that are in no file: of their float64, one array after another."""
    digest = hashlib.sha256()
    for values in arrays:
        digest.update(np.ascontiguousarray(values, dtype="<f8").tobytes())
    return name, digest.hexdigest()


def _hashed(name: str, sha256: str | None) -> str:
    return name if sha256 is None else f"{name}, SHA-256 {sha256}"


def _date() -> str:
    from datetime import datetime, timezone

    given = os.environ.get(_EPOCH)
    moment = datetime.now(timezone.utc).astimezone()
    if given is not None:
        moment = datetime.fromtimestamp(int(given), timezone.utc)
    return moment.isoformat(sep=" ", timespec="seconds")
