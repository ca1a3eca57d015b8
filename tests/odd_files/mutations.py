"""Good files of one record in many notations, and what happens to files: a generator of both.

A mutated file gives the numbers of the record, or it is refused, or what was assumed is doubtful.
`judged` says which of these came true; anything else is wrong.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import mpi_hyst as mh
import numpy as np
from mpi_hyst._cli.identify_records import Files, _assumed
from mpi_hyst._cli.inputs import fitted_interval
from mpi_hyst._cli.look import read as look_at
from mpi_hyst._cli.terminal import CommandError

ROWS, DT = 66, 0.01
_PHASE = np.concatenate(
    [np.linspace(0, 1, 17), np.linspace(1, 0.2, 17)[1:], np.linspace(0.2, 1, 18)[1:]]
)
U = np.round(120.0 * np.concatenate([_PHASE, np.linspace(1, 0, 17)[1:]]), 3)
Y = np.round(
    mh.PrandtlIshlinskii([0.15, 0.03, 0.02], [0.0, 10.0, 25.0]).forward().run(U) + 0.0017, 6
)
T = np.round(DT * np.arange(ROWS), 6)

# Of each unit in a second, a volt and a micrometre.
SCALES = {
    "s": 1.0,
    "ms": 1e3,
    "us": 1e6,
    "V": 1.0,
    "mV": 1e3,
    "kV": 1e-3,
    "um": 1.0,
    "nm": 1e3,
    "mm": 1e-3,
}
NAMES = (
    ("Time", "Drive", "Gauge"),
    ("t", "voltage", "position"),
    ("Zeit", "Spannung", "Weg"),
    ("Temps", "Tension", "Deplacement"),
    ("time", "cmd", "sensor"),
    ("Elapsed time", "AO0", "Displacement"),
)  # fmt: skip
_WORDS: dict[str, str] = {
    "s": "seconds",
    "ms": "milliseconds",
    "V": "volts",
    "nm": "nanometers",
    "um": "microns",
}
# How a name says its unit.
NOTATIONS: tuple[Callable[[str, str], str], ...] = (
    lambda name, unit: f"{name}_{unit}",
    lambda name, unit: f"{name} ({unit})",
    lambda name, unit: f"{name} [{unit}]",
    lambda name, unit: f"{name}/{unit}" if len(unit) > 1 else f"{name} / {unit}",
    lambda name, unit: f"{name} / {unit}",
    lambda name, unit: f"{name} in {unit}",
    lambda name, unit: f"{name} {unit}",
    lambda name, unit: f"{name}, {unit}",
    lambda name, unit: f"{name} ({_WORDS.get(unit, unit)})",
    lambda name, unit: f"{name}({unit})",
    lambda name, unit: f"{name}-{unit}",
)  # fmt: skip


@dataclass
class Text:
    """A file as rows of cells, and how they are written."""

    names: list[str]
    units: list[str]
    rows: list[list[str]]
    separator: str
    comma: bool
    notation: int | None
    """How names say units; None where a row of units does, or nothing."""
    unit_row: bool
    preamble: list[str] = field(default_factory=list)
    comment_header: bool = False
    quotes: bool = False
    trailing: str = ""
    end: str = "\n"
    has_header: bool = True
    lines: list[str] = field(default_factory=list)
    """The lines, once they are written."""

    def written(self) -> list[str]:
        """Return the lines."""
        names = list(self.names)
        if self.notation is not None:
            names = [
                NOTATIONS[self.notation](*pair) for pair in zip(names, self.units, strict=True)
            ]
        quote = '"' if self.quotes else ""
        part = self.separator if self.separator != " " else "  "
        head = [part.join(f"{quote}{one}{quote}" for one in names) + self.trailing]
        if self.unit_row:
            head.append(part.join(self.units) + self.trailing)
        body = [self.separator.join(row) + self.trailing for row in self.rows]
        if self.comma:
            body = [line.replace(".", ",") for line in body]
        if self.comment_header:
            head = [f"# {head[0]}", *head[1:]]
        return [*self.preamble, *(head if self.has_header else []), *body]

    @property
    def first(self) -> int:
        """The line of the first row."""
        return len(self.preamble) + self.has_header * (1 + self.unit_row)


def good(draw: random.Random) -> Text:
    """Return a file that is right, in one of the usual notations."""
    separator = draw.choice([",", ",", ";", ";", "\t", "\t", " ", "|"])
    comma = separator != "," and draw.random() < 0.3
    units = [draw.choice(["s", "s", "ms"]), draw.choice(["V", "V", "V", "mV", "kV"])]
    units.append(draw.choice(["um", "um", "nm", "nm", "mm"]))
    digits = draw.choice(["{:.9f}", "{!r}", "{:.9g}"])
    values = np.column_stack(
        [column * SCALES[unit] for column, unit in zip((T, U, Y), units, strict=True)]
    )
    values = np.round(values, 9)
    order = [0, 1, 2]
    if draw.random() < 0.2:
        order = draw.choice([[0, 2, 1], [1, 2, 0], [2, 1, 0]])
    rows = [[digits.format(float(row[place])) for place in order] for row in values]
    names = list(draw.choice(NAMES))
    how = draw.random()
    notation = draw.randrange(len(NOTATIONS)) if how < 0.65 else None
    unit_row = notation is None
    text = Text(
        [names[place] for place in order],
        [units[place] for place in order],
        rows,
        separator,
        comma,
        notation,
        unit_row,
    )
    if separator == "," and notation == 7:
        text.quotes = True
    if separator == " " and (unit_row or notation in (5, 6, 7)):
        text.notation, text.unit_row = 0, False
    if separator == " ":
        text.comment_header = draw.random() < 0.5
    if draw.random() < 0.25:
        kinds = ["Rig,3", "Operator: AB", "Serial 1234", "", "Date;22.11.2026", "Gain\t20"]
        text.preamble = draw.sample(kinds, draw.randrange(1, 4))
        text.comment_header = False
    if separator in ",;\t" and draw.random() < 0.15:
        text.trailing = separator
    text.quotes = text.quotes or (separator in ",;" and draw.random() < 0.1)
    text.end = draw.choice(["\n", "\n", "\r\n"])
    return text


# What happens to files. Each takes the lines with the first row, and changes them in place.


def _row(draw: random.Random, text: Text) -> int:
    return draw.randrange(text.first, len(text.lines))


def drop_cell(draw: random.Random, text: Text) -> None:
    """A cell of a row is lost, with its separator."""
    at = _row(draw, text)
    cells = text.lines[at].split(text.separator)
    del cells[draw.randrange(len(cells))]
    text.lines[at] = text.separator.join(cells)


def drop_name(draw: random.Random, text: Text) -> None:
    """A name of the header is lost."""
    if text.has_header:
        at = len(text.preamble)
        cells = text.lines[at].split(text.separator)
        del cells[draw.randrange(len(cells))]
        text.lines[at] = text.separator.join(cells)


def add_name(draw: random.Random, text: Text) -> None:
    """The header has a name too many."""
    if text.has_header:
        at = len(text.preamble)
        text.lines[at] += f"{text.separator}{draw.choice(['Comment', 'Start', 'Aux'])}"


def move_header(draw: random.Random, text: Text) -> None:
    """The header comes later, or at the end."""
    if text.has_header:
        line = text.lines.pop(len(text.preamble))
        place = draw.choice([text.first, text.first + 1, len(text.lines)])
        text.lines.insert(min(place, len(text.lines)), line)


def other_separator(draw: random.Random, text: Text) -> None:
    """One row has another separator."""
    at = _row(draw, text)
    text.lines[at] = text.lines[at].replace(text.separator, draw.choice([",", ";", "\t", " "]))


def comma_for_separator(draw: random.Random, text: Text) -> None:
    """A program of another country writes decimal commas everywhere, whatever parts cells."""
    del draw
    text.lines[text.first :] = [line.replace(".", ",") for line in text.lines[text.first :]]


def comma_in_a_row(draw: random.Random, text: Text) -> None:
    """One row has the other decimal mark."""
    at = _row(draw, text)
    before, after = (".,", ",.") if text.separator != "," else (".", ",")
    text.lines[at] = text.lines[at].translate(str.maketrans(before, after))


def quotation_mark(draw: random.Random, text: Text) -> None:
    """A quotation mark comes in, anywhere."""
    at = draw.randrange(len(text.lines))
    place = draw.randrange(len(text.lines[at]) + 1)
    text.lines[at] = f'{text.lines[at][:place]}"{text.lines[at][place:]}'


def lines_above(draw: random.Random, text: Text) -> None:
    """A preamble."""
    more = draw.sample(["Rig,3", "Scope X200", "Model: a, b", "", "Points,66", "Gain;1,5", "7"], 2)
    text.lines[:0] = more
    text.preamble[:0] = more


def blank_lines(draw: random.Random, text: Text) -> None:
    """Blank lines, and remarks between rows."""
    text.lines.insert(_row(draw, text), draw.choice(["", "   ", "# paused", "// paused"]))


def comment_out(draw: random.Random, text: Text) -> None:
    """A row is behind the mark of a comment."""
    at = _row(draw, text)
    text.lines[at] = draw.choice(["#", "# ", "//", "% "]) + text.lines[at]


def word_for_number(draw: random.Random, text: Text) -> None:
    """A cell is no number."""
    at = _row(draw, text)
    cells = text.lines[at].split(text.separator)
    words = ["#N/A", "#DIV/0!", "NaN", "", "-", "OVLD", "1,234,567", "1e400", "--", "#REF!"]
    cells[draw.randrange(len(cells))] = draw.choice(words)
    text.lines[at] = text.separator.join(cells)


def cut_end(draw: random.Random, text: Text) -> None:
    """The file ends anywhere."""
    whole = "\n".join(text.lines)
    keep = draw.randrange(len("\n".join(text.lines[: text.first])) + 1, len(whole))
    text.lines = whole[:keep].split("\n")
    text.end += "cut"


def nul_bytes(draw: random.Random, text: Text) -> None:
    """The end of the file was never written."""
    text.lines.append("\0" * draw.randrange(1, 5000))


def drop_rows(draw: random.Random, text: Text) -> None:
    """Rows are lost."""
    at = _row(draw, text)
    del text.lines[at : at + draw.randrange(1, 5)]


def double_row(draw: random.Random, text: Text) -> None:
    """A row comes twice."""
    at = _row(draw, text)
    text.lines.insert(at, text.lines[at])


def swap_rows(draw: random.Random, text: Text) -> None:
    """Two rows change places."""
    at = draw.randrange(text.first, len(text.lines) - 1)
    text.lines[at], text.lines[at + 1] = text.lines[at + 1], text.lines[at]


def spaces(draw: random.Random, text: Text) -> None:
    """Spaces behind or before separators."""
    if text.separator in ",;":
        wide = draw.choice([f"{text.separator} ", f" {text.separator}", f" {text.separator} "])
        text.lines[:] = [line.replace(text.separator, wide) for line in text.lines]


def empty_column(draw: random.Random, text: Text) -> None:
    """An empty column, with a name or without."""
    if text.separator != " " and text.has_header:
        name = draw.choice(["", "Comment", "Remark"])
        head = len(text.preamble)
        for at, line in enumerate(text.lines):
            if at >= head:
                text.lines[at] = line + text.separator + (name if at == head else "")


def odd_unit(draw: random.Random, text: Text) -> None:
    """The header says its units in a way that nobody foresaw."""
    if text.has_header and text.notation is not None and not text.unit_row:
        how = draw.choice(
            ["{0}{1}", "{1}_{0}", "{0}.{1}", "{0} <{1}>", "{0}: {1}", "{1} {0}", "{0}{{{1}}}"]
        )
        quote = '"' if text.quotes else ""
        names = [how.format(*pair) for pair in zip(text.names, text.units, strict=True)]
        part = text.separator if text.separator != " " else "  "
        line = part.join(f"{quote}{one}{quote}" for one in names)
        text.lines[len(text.preamble)] = f"# {line}" if text.comment_header else line


def number_names(draw: random.Random, text: Text) -> None:
    """A table without names, written with an index as header."""
    del draw
    if text.has_header and all(unit in ("s", "V", "um") for unit in text.units):
        text.lines[len(text.preamble) : text.first] = [text.separator.join("012")]


def clock_without_unit(draw: random.Random, text: Text) -> None:
    """A file that is as it was written loses the unit of its time, which is a long one."""
    place = next((at for at, unit in enumerate(text.units) if unit in ("s", "ms")), None)
    if place is None or text.lines != text.written() or not text.has_header:
        return
    begins, day = draw.choice([(46348.5, 1.0), (739943.25, 1.0), (0.0, 1.0), (0.0, 24.0)])
    for row, time in zip(text.rows, T, strict=True):
        row[place] = repr(float(begins + time * day / 86400.0))
    before, name = text.written()[len(text.preamble)], text.names[place]
    text.lines = text.written()
    if text.notation is not None:
        called = NOTATIONS[text.notation](name, text.units[place])
        text.lines[len(text.preamble)] = before.replace(called, name)
        text.notation = None
    else:
        text.units[place] = "-"
        text.lines = text.written()


def settings_in_rows(draw: random.Random, text: Text) -> None:
    """A row of constants, above the header or below it, as wide as the rows or not."""
    count = draw.choice([3, 3, 3, 2, 4, 5])
    cells = [draw.choice(["136", "0.01", "5", "7.5", "100", "3"]) for _ in range(count)]
    if text.comma:
        cells = [cell.replace(".", ",") for cell in cells]
    place = draw.choice([len(text.preamble), text.first])
    text.lines.insert(place, text.separator.join(cells))


def thousands(draw: random.Random, text: Text) -> None:
    """A program parts thousands, in a file that is as it was written."""
    del draw
    units = [unit in ("mV", "nm") for unit in text.units]
    parted = any(set(",'") & set(cell) for row in text.rows for cell in row)
    if text.lines != text.written() or text.separator == "," or parted or not any(units):
        return
    whole = {at: all(float(row[at]).is_integer() for row in text.rows) for at in range(3)}
    for row in text.rows:
        for place, is_large in enumerate(units):
            if is_large:
                value = float(row[place])
                row[place] = f"{value:,.0f}" if whole[place] else f"{value:,.3f}"
    if text.comma:
        # `written` makes commas of the points that are left.
        text.rows = [[cell.replace(",", "'") for cell in row] for row in text.rows]
    text.lines = text.written()


def time_begins_anew(draw: random.Random, text: Text) -> None:
    """The first rows are those of another record: the last ones of this."""
    count = draw.randrange(1, 5)
    text.lines[text.first : text.first] = text.lines[-count:]


MUTATIONS = (
    drop_cell, drop_name, add_name, move_header, other_separator, comma_for_separator,
    comma_in_a_row, quotation_mark, lines_above, blank_lines, comment_out, word_for_number, cut_end,
    nul_bytes, drop_rows, double_row, swap_rows, spaces, empty_column, odd_unit, number_names,
    clock_without_unit, settings_in_rows, thousands, time_begins_anew,
)  # fmt: skip


def mutated(seed: int) -> tuple[bytes, str]:
    """Return a file, and what happened to it."""
    draw = random.Random(seed)
    text = good(draw)
    text.lines = text.written()
    happened: list[str] = []
    for _ in range(draw.choice([0, 1, 1, 1, 1, 2, 2])):
        one = draw.choice(MUTATIONS)
        # With a name lost and another one there it is the header of another file.
        if one in (drop_name, add_name) and {"drop_name", "add_name"} & set(happened):
            continue
        if len(text.lines) - text.first > 20 and "\0" not in text.lines[-1]:
            one(draw, text)
            happened.append(one.__name__)
    end = text.end.removesuffix("cut")
    last = "" if text.end.endswith("cut") or draw.random() < 0.2 else end
    content = end.join(text.lines) + last
    code = draw.choice(["utf-8", "utf-8", "utf-8", "utf-8-sig", "utf-16"])
    return content.encode(code), ", ".join(happened) or "nothing"


def judged(path: Path) -> str:
    """Read a file as `look` proposes and `identify` does: right, refused, doubtful, or wrong.

    The units are those that `identify` would give the stage.
    """
    try:
        guesses = look_at(path, None).guesses
        if "drive" not in guesses:
            return "refused"
        drive, position = guesses["drive"].column, guesses["position"].column
        clock = guesses["time"].column if "time" in guesses else None
        record = mh.io.read(path, [drive, position], time=clock)
        fitted_interval(record)
    except (mh.io.ReadError, CommandError):
        return "refused"
    files = Files((path,), drive, position)
    if any(one.level == "doubtful" for one in _assumed(record, files, {})):
        return "doubtful"
    u = record[drive] / SCALES.get(record.quantity(drive).suffix or "V", np.nan)
    y = record[position] / SCALES.get(record.quantity(position).suffix or "um", np.nan)
    places = np.arange(u.size)
    if record.seconds is not None:
        places = np.round(record.seconds / DT).astype(int)
        if not np.allclose(record.seconds, DT * places, rtol=0.0, atol=1e-6):
            return f"wrong times: {record.seconds[:3]}"
    if u.size > ROWS or places.min() < 0 or places.max() >= ROWS:
        return f"wrong rows: {u.size}, {places[:3]}"
    for name, got, expected in (("drive", u, U[places]), ("position", y, Y[places])):
        bad = np.flatnonzero(~(np.abs(got - expected) <= 1e-5 * np.ptp(expected) + 1e-6))
        if bad.size:
            return f"wrong {name}: {got[bad[0]]!r} for {expected[bad[0]]!r} in row {bad[0]}"
    return "right"
