"""`mpi-hyst look`: a file in, what is in it and the next command out."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import click
import numpy as np

from mpi_hyst._cli.identify_records import is_missing, too_long
from mpi_hyst._cli.options import FILE, OfText, argument, command, group, option
from mpi_hyst._cli.outputs import Output, check_figure, check_outputs, write_outputs
from mpi_hyst._cli.terminal import CommandError, require_report_packages, say
from mpi_hyst._io.clock_doubts import clock_doubt
from mpi_hyst._io.clocks import LONGEST
from mpi_hyst._io.read import opened, take, unit_doubt
from mpi_hyst._io.record import ReadError
from mpi_hyst._io.roles import Guess, guess, time_index
from mpi_hyst._io.source import PLAIN, TextOptions
from mpi_hyst._io.table import Table, numeric
from mpi_hyst._quantity import SECONDS, Quantity
from mpi_hyst._report import canvas, traces
from mpi_hyst._text import digits, text_pairs, text_table
from mpi_hyst._types import Samples
from mpi_hyst.io import Columns

_MOST_PANELS = 6
_GAP = 1.5  # steps: a longer one lacks samples
_UNEVEN = 0.1  # of a step: identify refuses more
_SHOWN = 3  # gaps
_ROUNDING = 1e-4  # % of a step


@dataclass(frozen=True)
class Request:
    """The file, and what is drawn of it."""

    files: tuple[Path, ...] = argument("FILE", nargs=-1, required=True, type=FILE)
    plot_path: Path | None = option(
        "--plot",
        metavar="FILE|DIRECTORY",
        help="Figure of the record to write: .svg, .png or .pdf, or a directory for look.svg.",
    )
    rows: int | None = option(type=click.IntRange(min=1), help="Rows to read.  [default: all]")
    text: OfText = group(OfText)

    @property
    def data(self) -> Path:
        """The file; several are refused with the words that read them as one record."""
        if len(self.files) > 1:
            joined = "+".join(map(str, self.files))
            raise CommandError(
                f"expected one file, got {len(self.files)}; files of one record: {joined}"
            )
        return self.files[0]


@command(Request, short_help="Show what is in a file, and how to identify from it.")
def look(request: Request) -> None:
    """Show format, columns and sampling of a file, and guess drive, position and time.

    The last line is the command to run next. Formats: text (CSV and others), NumPy, MATLAB, HDF5,
    TDMS, LabVIEW measurements, workbooks (.xlsx).
    """
    say(run(request))


@dataclass(frozen=True)
class Sampling:
    """The steps of a time column, in its own unit and in seconds."""

    times: Samples
    quantity: Quantity

    @property
    def scale(self) -> float:
        """Seconds in the unit of the column; one without a unit is taken as seconds."""
        return SECONDS[self.quantity.time_unit or "s"]

    @property
    def steps(self) -> Samples:
        """The steps in seconds."""
        return np.diff(self.times) * self.scale

    @property
    def step(self) -> float:
        """The mean step in seconds."""
        return float(self.times[-1] - self.times[0]) * self.scale / (self.times.size - 1)

    @property
    def increases(self) -> bool:
        """Whether every time is later than the one before."""
        return bool((self.steps > 0.0).all())

    @property
    def gaps(self) -> list[int]:
        """The samples before which others are missing."""
        usual = float(np.median(self.steps))
        return [int(at) + 1 for at in np.flatnonzero(self.steps > _GAP * usual)]

    @property
    def uneven(self) -> bool:
        """Whether `identify` refuses the times, as the samples are not equally far apart."""
        even = self.times[0] * self.scale + self.step * np.arange(self.times.size)
        return bool(np.abs(self.times * self.scale - even).max() > _UNEVEN * self.step)

    @property
    def unit_is_doubtful(self) -> bool:
        """Whether the unit is not said, and the steps are too long for seconds."""
        return not self.quantity.time_unit and self.step >= LONGEST

    def facts(self) -> list[tuple[str, str]]:
        """Return what to know about the sampling, as names and values. Rows count from 0."""
        if not self.increases:
            at = int(np.flatnonzero(~(self.steps > 0.0))[0]) + 1
            return [("sampling", f"the time does not increase at row {at}")]
        usual = float(np.median(self.steps))
        whole = self.steps[self.steps <= _GAP * usual]
        jitter = float(whole.std())
        share = 100.0 * jitter / usual
        said = f"{digits(jitter, 2)} s rms, {digits(share, 2)} % of a step"
        pairs = [
            ("sampling", f"{digits(self.step)} s on average, {digits(1.0 / self.step)} Hz"),
            ("jitter", said if share > _ROUNDING else "none"),
            ("gaps", self._gaps(usual)),
        ]
        if self.quantity.time_unit not in ("", "s"):
            pairs.append(("time unit", f"{self.quantity.unit}, converted to seconds"))
        return pairs

    def _gaps(self, usual: float) -> str:
        gaps = self.gaps
        if not gaps:
            return "none"
        shown = [f"{digits(self.steps[at - 1], 3)} s before row {at}" for at in gaps[:_SHOWN]]
        more = f" and {len(gaps) - _SHOWN} more" if len(gaps) > _SHOWN else ""
        return f"{', '.join(shown)}{more}; the usual step is {digits(usual)} s"


@dataclass
class _Wrong:
    """The numbers of a column that are none: the rows without a reading, and the first others."""

    first: str
    missing: dict[int, str] = field(default_factory=dict)
    others: int = 0
    first_other: str = ""

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.missing) + self.others


@dataclass(frozen=True)
class Record:
    """What was read: all columns of numbers, NaN where a file has none."""

    columns: Columns
    filled: Mapping[str, Samples]
    """The columns with their holes filled in from both sides, for guesses and figures."""
    wrong: Mapping[str, _Wrong]
    other: Mapping[str, str]
    default_time: str | None
    """The column that `identify` takes as the time without being told."""

    guesses: Mapping[str, Guess]

    @property
    def sampling(self) -> Sampling | None:
        """The sampling by the guessed time column, if there is one and it has no holes."""
        clock = self.guesses.get("time")
        if clock is None or clock.column in self.wrong or self.columns.samples < 3:
            return None
        return Sampling(self.columns[clock.column], self.columns.quantity(clock.column))


def run(request: Request) -> str:
    """Read the file, draw what was asked for, and return the summary."""
    place = _place(request.plot_path)
    check_outputs([place], [request.data])
    if place is not None:
        require_report_packages("--plot")
    record = read(request.data, request.rows, request.text.options)
    lines = [_heading(request, record), _table(record), _guesses(record), _assumed(record)]
    lines.append(_next(request, record))
    if place is not None:
        content = _image(request, record, place.suffix.lower()[1:])
        write_outputs([Output.of(place, content)])
        lines.insert(-1, f"figure  {place}")
    return "\n\n".join(line for line in lines if line)


def read(path: Path, rows: int | None, options: TextOptions = PLAIN) -> Record:
    """Read every column of numbers; what is none is counted instead of refused."""
    wrong: dict[int, _Wrong] = {}

    def note(index: int, rows: int, place: str, what: str) -> None:
        told = f"{place}: {what}"
        entry = wrong.setdefault(index, _Wrong(told))
        if is_missing(what):
            entry.missing[rows] = told
        else:
            entry.first_other = entry.first_other or told
            entry.others += 1

    with opened(path, options) as table:
        names = [_unique(table, index) for index in numeric(table)]
        try:
            columns = take(table, lambda _: names, None, rows, note, ordered=False)
        except ReadError as error:
            before = f"; look at what is before it with --rows {error.rows}" if error.rows else ""
            raise CommandError(f"{error}{before}") from error
        clock = time_index(table, None)
        holes = {columns.key(index): entry for index, entry in wrong.items()}
        default = None if clock is None else columns.key(clock)
        other = table.other
    filled = {
        name: _filled(values)
        for name, values in columns.values.items()
        if 2 * np.isfinite(values).sum() > values.size
    }
    guesses = guess(filled, columns.units) if columns.samples > 2 else {}
    return Record(columns, filled, holes, other, default, guesses)


def _filled(values: Samples) -> Samples:
    known = np.isfinite(values)
    if known.all():
        return values
    places = np.arange(values.size)
    return np.interp(places, places[known], values[known])


def _unique(table: Table, index: int) -> str | int:
    name = table.names[index]
    return name if table.names.count(name) == 1 else index


def _place(plot: Path | None) -> Path | None:
    """Return the file of the figure: look.svg where a directory is given."""
    if plot is None:
        return None
    place = plot / "look.svg" if plot.is_dir() else plot
    check_figure(place)
    return place


def _heading(request: Request, record: Record) -> str:
    columns = record.columns
    limited = request.rows is not None and columns.samples == request.rows
    rows = f"{columns.samples} rows read" + (" (--rows; there may be more)" if limited else "")
    return f"{request.data}: {columns.format}\n{rows}; columns of numbers: {len(columns.values)}"


def _table(record: Record) -> str:
    rows = []
    for name, values in record.columns.values.items():
        known = values[np.isfinite(values)]
        ends = (
            [digits(float(one)) for one in (known.min(), known.max())] if known.size else ["", ""]
        )
        wrong = record.wrong.get(name)
        note = "" if wrong is None else f"{wrong.count} refused, {wrong.first}"
        # Of several columns of one name each is taken by its number.
        number = str(record.columns.names.index(name)) if name in record.columns.names else name
        shown = name if name in record.columns.names else record.columns.names[int(name)]
        unit = record.columns.quantity(name).unit or record.columns.units.get(name, "")
        rows.append([shown, number, unit, *ends, note])
    text = text_table(["column", "number", "unit", "minimum", "maximum", ""], rows)
    others = [f"{name} ({what})" for name, what in record.other.items()]
    return f"{text}\n  not read: {', '.join(others)}" if others else text


def _guesses(record: Record) -> str:
    pairs = [
        (role, record.guesses[role].text if role in record.guesses else "no column looks like it")
        for role in ("drive", "position", "time")
    ]
    sampling = record.sampling
    return text_pairs([*pairs, *([] if sampling is None else sampling.facts())])


def _assumed(record: Record) -> str:
    """Return what each stage of reading assumed, and of which units the guesses are taken to be."""
    pairs = [
        (one.stage, f"{'doubtful: ' if one.level == 'doubtful' else ''}{one.text}")
        for one in record.columns.assumed
        if one.stage not in ("units", "roles") or one.level != "said"
    ]
    clock = record.guesses.get("time")
    if clock is not None and not record.columns.quantity(clock.column).time_unit:
        one = clock_doubt(record.columns.quantity(clock.column), record.columns[clock.column])
        pairs.append(("units", f"{'doubtful: ' if one.level == 'doubtful' else ''}{one.text}"))
    for role, default, flag in _UNITS:
        if role in record.guesses:
            quantity = record.columns.quantity(record.guesses[role].column)
            doubt = unit_doubt(quantity, default, flag, "doubtful")
            if doubt is not None:
                level = "doubtful: " if doubt.level == "doubtful" else ""
                pairs = [pair for pair in pairs if repr(quantity.column) not in pair[1]]
                pairs.append(("units", f"{level}{doubt.text}"))
    return "\n".join(["assumed", text_pairs(pairs)]) if pairs else ""


_UNITS = (("drive", "V", "--input-unit"), ("position", "um", "--output-unit"))


def _next(request: Request, record: Record) -> str:
    """Return hints, and the command to run next."""
    if "drive" not in record.guesses:
        what = "identify needs a drive and a position: two columns of numbers that vary"
        return _trajectory(request, record) or f"no command to suggest: {what}"
    drive, position = (record.guesses[role].column for role in ("drive", "position"))
    words = ["mpi-hyst", "identify", _shown(request.data), "--input", drive, "--output", position]
    words += _time_option(record)
    words += [] if request.rows is None else ["--rows", str(request.rows)]
    words += _text_options(request)
    command = shlex.join([*words, "-o", "stage.json"])
    hints = [f"note: {hint}" for hint in _hints(record)]
    return "\n".join([*hints, "run next:", f"  {command}"])


def _trajectory(request: Request, record: Record) -> str:
    """Return what to run if the file may hold a trajectory; nothing if it may not."""
    if "trajectory" not in record.guesses:
        return ""
    column = record.guesses["trajectory"].column
    words = ["mpi-hyst", "precompensate", "stage.json", _shown(request.data), "--column", column]
    words += [*_time_option(record), *_text_options(request)]
    # Only a person knows the rate.
    sampling = record.sampling
    rate = " --rate HZ" if sampling is None or _useless_time(record) else ""
    notes = []
    if sampling is not None and sampling.increases and sampling.unit_is_doubtful:
        notes = [f"note: {_doubt(record, sampling)}"]
    hint = f"{column} alone may be a trajectory; with the stage that identify wrote, run next:"
    return "\n".join([*notes, hint, f"  {shlex.join([*words, '-o', 'drive.csv'])}{rate}"])


def _text_options(request: Request) -> list[str]:
    """Return what was said of the text, for the next command."""
    skipped, thousands = request.text.skip_lines, request.text.thousands
    words = ["--skip-lines", str(skipped)] if skipped else []
    return words if thousands is None else [*words, "--thousands", thousands or "none"]


def _doubt(record: Record, sampling: Sampling) -> str:
    return (
        f"{record.guesses['time'].column} has no unit and steps of {digits(sampling.step)}, "
        "hardly seconds: add --time-unit ms, or what it is; or --time none --rate HZ"
    )


def _shown(path: Path) -> str:
    """Return a file name that is not taken for an option."""
    return f"./{path}" if str(path).startswith("-") else str(path)


def _time_option(record: Record) -> list[str]:
    if _useless_time(record):
        return ["--time", "none"]
    sampling = record.sampling
    if sampling is None or not sampling.increases or sampling.unit_is_doubtful:
        return []
    name = record.guesses["time"].column
    return [] if name == record.default_time else ["--time", name]


def _useless_time(record: Record) -> str:
    """Return why the column that `identify` takes as the time tells none; nothing if it does.

    Where another column is the time, `identify` is told that. A time that goes back is one of two
    records: counting its rows would join them.
    """
    name, clock = record.default_time, record.guesses.get("time")
    if name is None or (clock is not None and clock.column != name):
        return ""
    if name in record.other:
        return f"holds {record.other[name]}"
    steps = np.diff(record.columns[name])
    stands = steps.size > 0 and steps.min() == 0.0
    return f"does not increase at row {steps.argmin() + 1}" if stands else ""


def _goes_back(record: Record) -> bool:
    """Whether the column that `identify` takes as the time does, though nothing else says time."""
    name = record.default_time
    if name is None or name in record.wrong or "time" in record.guesses:
        return False
    return bool((np.diff(record.columns[name]) < 0.0).any())


def _hints(record: Record) -> list[str]:
    hints = [_hint_about(record, name, wrong) for name, wrong in record.wrong.items()]
    sampling, useless = record.sampling, _useless_time(record)
    rate = "add --rate HZ to fit dead time, dynamics or creep"
    if useless:
        hints.append(f"{record.default_time} {useless}: --time none leaves it out; {rate}")
    elif _goes_back(record) or not (sampling is None or sampling.increases):
        hints.append("the time does not increase everywhere: cut the file there")
    elif sampling is None:
        # Of a time with cells that are refused it is said already what is wrong.
        hints += [] if record.default_time in record.wrong else [f"no time column: {rate}"]
    elif sampling.unit_is_doubtful:
        hints.append(_doubt(record, sampling))
    elif sampling.uneven:
        hints.append("the time steps are unequal: identify tells how far it matters")
    return hints


def _hint_about(record: Record, name: str, wrong: _Wrong) -> str:
    """Say what identify does about cells without a number."""
    count, first = wrong.count, wrong.first
    position = record.guesses.get("position")
    if position is not None and position.column == name and wrong.missing:
        gap = too_long(list(wrong.missing), record.columns.samples)
        if gap is not None:
            option = "" if gap.end is None else f" without --leave-out {gap.first}:{gap.end}"
            said = f"column {name}, {wrong.missing[gap.first]}, {gap.why}"
            return f"{said}; identify refuses this{option}"
        if not wrong.others:
            what = f"{_cells(count)} without a number, the first in {first}"
            return f"column {name} has {what}; identify puts straight lines there"
        # Of readings that are missing nothing has to be mended.
        count, first = wrong.others, wrong.first_other
    return f"column {name} has {_cells(count)} that identify refuses, the first in {first}"


def _cells(count: int) -> str:
    return "1 cell" if count == 1 else f"{count} cells"


def _image(request: Request, record: Record, kind: str) -> bytes:
    columns, sampling = record.columns, record.sampling
    if "drive" not in record.guesses:
        shown = list(record.filled.items())[:_MOST_PANELS]
        panels = {name: (columns.quantity(name), values) for name, values in shown}
        return canvas.image(traces.raw_columns(request.data.name, panels), kind)
    drive, position = (record.guesses[role].column for role in ("drive", "position"))
    seconds: Samples | None = None
    if sampling is not None and sampling.increases and not sampling.unit_is_doubtful:
        seconds = sampling.times * sampling.scale
    first = (columns.quantity(drive), record.filled[drive])
    second = (columns.quantity(position), record.filled[position])
    drawn = traces.raw_record(request.data.name, first, second, seconds)
    return canvas.image(drawn, kind)
