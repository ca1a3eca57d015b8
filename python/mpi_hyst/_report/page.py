"""Reports: sections with text, figures and tables in one self-contained HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from typing import TypeAlias

from mpi_hyst._text import NOT_DETERMINED, printable_lines

_NUMBERS = {"nan", "inf", "bound", NOT_DETERMINED}  # what stands in columns of numbers


@dataclass(frozen=True)
class Figure:
    """An image as a data URI, with alternative text and a caption."""

    image: str
    alternative: str
    caption: str
    kind: str = "figure"


@dataclass(frozen=True)
class Table:
    """Cells as text. The first column names the rows; `best` rows are highlighted."""

    caption: str
    header: Sequence[str]
    rows: Sequence[Sequence[str]]
    note: str = ""
    best: Sequence[int] = ()
    kind: str = "table"

    @property
    def words(self) -> list[int]:
        """Which columns hold words, to the left, and not numbers, to the right."""
        columns = enumerate(zip(*self.rows, strict=True))
        return [index for index, cells in columns if 2 * sum(map(_is_word, cells)) > len(cells)]


@dataclass(frozen=True)
class Pairs:
    """Names and values."""

    caption: str
    rows: Sequence[tuple[str, str]]
    kind: str = "pairs"


@dataclass(frozen=True)
class Lines:
    """Lines of a terminal."""

    text: str
    kind: str = "lines"


def _is_word(cell: str) -> bool:
    return cell[:1].isalpha() and cell not in _NUMBERS


Block: TypeAlias = Figure | Table | Pairs | Lines


@dataclass(frozen=True)
class Section:
    """A heading, sentences, and figures and tables."""

    name: str
    title: str
    text: Sequence[str] = ()
    blocks: Sequence[Block] = ()


@dataclass(frozen=True)
class Card:
    """A main result with its meaning and its base."""

    value: str
    what: str
    base: str = ""


@dataclass(frozen=True)
class Verdict:
    """Green, amber or red, what that means, and one line for each reason."""

    level: str
    meaning: str
    reasons: Sequence[str] = ()


@dataclass(frozen=True)
class Report:
    """The content of a report."""

    title: str
    subtitle: str
    cards: Sequence[Card]
    sections: Sequence[Section]
    footer: str = field(default="")
    verdict: Verdict | None = None
    provenance: Sequence[tuple[str, str]] = ()
    """How the page was made, as `provenance.rows` has it."""


def render(report: Report) -> str:
    """Return the HTML text."""
    import jinja2

    source = files("mpi_hyst._report").joinpath("page.html.j2").read_text("utf-8")
    environment = jinja2.Environment(
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_finalize,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.from_string(source).render(report=report)


def _finalize(value: object) -> object:
    """Escape characters in names of files and columns that a page cannot contain."""
    return printable_lines(value) if isinstance(value, str) else value
