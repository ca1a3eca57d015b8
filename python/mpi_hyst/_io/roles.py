"""The stage of roles: which columns are the time, the drive and the position.

The time is told by names and units alone. `look` guesses the others by names, units and data.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from mpi_hyst._io.record import find
from mpi_hyst._io.table import Table
from mpi_hyst._quantity import SECONDS, Quantity, known_unit
from mpi_hyst._types import Samples

_WORDS = {
    "drive": {
        *("drive", "driver", "command", "cmd", "dac", "ao", "ao0", "ao1", "voltage", "volt", "v"),
        *("u", "input", "spannung", "tension", "piezo", "actuator", "excitation", "control", "amp"),
        *("stell", "commande", "tensione", "voltaje"),
    },
    "position": {
        *("position", "pos", "displacement", "disp", "sensor", "gauge", "strain", "sg", "y", "adc"),
        *("output", "interferometer", "capacitive", "cap", "weg", "auslenkung", "deplacement"),
        *("posizione", "posicion", "lvdt", "encoder", "measured", "stroke", "extension", "ai0"),
    },
    "time": {
        *("time", "t", "zeit", "temps", "tiempo", "tempo", "timestamp", "clock", "seconds", "sec"),
        *("s", "ms", "us", "elapsed"),
    },
}
_NOT = {"setpoint", "target", "reference", "ref", "sollwert", "index", "sample", "temp", "error"}
_UNITS = {
    "drive": ("V", "kV", "mV", "A", "mA", "MV/m", "kV/mm", "A/m", "kA/m"),
    "position": ("um", "nm", "mm", "m", "pm", "rad", "mrad", "urad", "deg", "arcsec", "angstrom"),
    "time": tuple(SECONDS),
}
_NAME, _UNIT, _TIMED, _LEADS = 2.0, 2.0, 2.0, 2.0
_MIN_LOOP = 1e-3  # of the area of the box around the loop; less may be noise
_EVEN = 0.2  # of a step
_POINTS = 200_000
_MOST = 12  # columns of which all pairs are compared


@dataclass(frozen=True)
class Guess:
    """A column and why it is taken for what it is."""

    column: str
    reasons: Sequence[str]

    @property
    def sureness(self) -> str:
        """How sure the guess is, in words."""
        return {0: "a mere guess", 1: "likely"}.get(len(self.reasons), "quite sure")

    @property
    def text(self) -> str:
        """The guess for a person."""
        why = ", ".join(self.reasons) or "nothing tells it from the others"
        return f"{self.column}  (guess, {self.sureness}: {why})"


TIME_COLUMNS = ("time_s", "time")
"""What the time column is called, first choice first; other names of time come after."""


def time_index(table: Table, time: str | int | None, chosen: Sequence[int] = ()) -> int | None:
    """Return the index of the time column that was asked for, or that is called so.

    In a source with groups it is that of the group of the chosen columns.
    """
    if time is not None:
        return find(table.source, table.names, time)
    group = _group(table, chosen)
    near = [index for index, name in enumerate(table.names) if group and _parent(name) == group]
    found = _clock_of(table, near, leaf=True)
    return _clock_of(table, range(len(table.names))) if found is None else found


def _group(table: Table, chosen: Sequence[int]) -> str:
    """Return the place that all chosen columns share; empty if they share none."""
    groups = {_parent(table.names[index]) for index in (chosen or table.numeric)}
    return groups.pop() if len(groups) == 1 else ""


def _parent(name: str) -> str:
    return re.split(r"[./][^./]*$", name)[0] if re.search(r"[./]", name) else ""


def _clock_of(table: Table, among: Sequence[int], *, leaf: bool = False) -> int | None:
    names = {index: table.names[index] for index in among}
    if leaf:
        names = {index: re.split(r"[./]", name)[-1] for index, name in names.items()}
    for wanted in TIME_COLUMNS:
        found = [index for index, name in names.items() if name == wanted]
        if found:
            return found[0] if leaf else find(table.source, table.names, wanted)
    quantities = {
        index: Quantity(name, table.units.get(index, "")) for index, name in names.items()
    }
    called = [index for index, one in quantities.items() if one.is_time]
    # Cells that are no numbers are refused by their place, and not passed over.
    named = sorted(called, key=lambda index: index not in table.numeric)
    # A bare t may be something else, so every name that says more goes first.
    bare = [i for i, name in names.items() if name == "t" and i in table.numeric]
    bare = [i for i in bare if not table.units.get(i)]
    timed = [
        index
        for index, one in quantities.items()
        if index in table.numeric
        and one.time_unit in ("s", "ms", "us", "ns")
        and (one.given or re.search(r"[\[({<]", one.column))
    ]
    only = timed if len(timed) == 1 else []
    return next(iter([*(i for i in named if i in table.numeric), *bare, *only, *named]), None)


def looks_like_a_time(column: Samples) -> str:
    """Say where a column that runs like a clock is none; empty if it runs like none, or is one.

    A bad stamp goes back, or every stamp stands for several rows.
    """
    if not np.isfinite(column).all():
        column = column[np.isfinite(column)]
    # A long column is looked at as a whole only where it may be a clock.
    if column.size <= _FEWEST or not bool((column[1:] <= column[:-1]).any()):
        return ""
    if column.size > _HEAD and _rises_rarely(column[:_HEAD]):
        return ""
    steps = np.diff(column)
    half = column.size // 2
    slope = float(np.median(column[half:] - column[: column.size - half])) / half
    rises = int((steps > 0.0).sum())
    if slope <= 0.0 or rises == 0:
        return ""
    each = steps.size / rises
    beside = column - slope * np.arange(column.size)
    bad = np.flatnonzero(np.abs(beside - np.median(beside)) > 1.5 * each * slope)
    if bad.size > max(1, _BAD * column.size):
        return ""
    if bad.size:
        return f"row {bad[0]} goes back"
    if each > 1.5 and bool((steps >= 0.0).all()):
        return f"about {each:.0f} rows share each stamp"
    return f"row {int(np.flatnonzero(steps <= 0.0)[0]) + 1} does not go on"


_FEWEST, _BAD = 10, 0.02  # steps, and the share of them that may go back


def _rises_rarely(column: Samples) -> bool:
    """Whether a column goes back so often that it is no clock."""
    return bool((column[1:] < column[:-1]).mean() > _OFTEN)


_HEAD, _OFTEN = 10_000, 0.2  # rows, and the share of them that go back


def guess(values: Mapping[str, Samples], units: Mapping[str, str]) -> dict[str, Guess]:
    """Return the guesses by "time", "drive" and "position", or by "trajectory" of one alone."""
    quantities = {name: Quantity(name, units.get(name, "")) for name in values}
    found = {}
    clock = _time(values, quantities)
    if clock is not None:
        found["time"] = clock
    left = {
        name: column
        for name, column in values.items()
        if (clock is None or name != clock.column) and np.ptp(column) > 0.0 and not _counts(column)
    }
    # A clock with a bad stamp is no position; where its unit or nothing else says so, it may be.
    left = {name: column for name, column in left.items() if not quantities[name].is_time}
    clocks = [name for name, column in left.items() if _runs_like_a_time(column, quantities[name])]
    if len(left) - len(clocks) >= 2:
        left = {name: column for name, column in left.items() if name not in clocks}
    pair = _pair(left, quantities)
    if pair is not None:
        found["drive"], found["position"] = pair
    elif len(left) == 1:
        (name,) = left
        why, score = _named("position", quantities[name])
        if score >= _named("drive", quantities[name])[1]:
            found["trajectory"] = Guess(name, why)
    return found


def _runs_like_a_time(column: Samples, quantity: Quantity) -> bool:
    return quantity.suffix in ("", *SECONDS) and looks_like_a_time(column) != ""


def _time(values: Mapping[str, Samples], quantities: Mapping[str, Quantity]) -> Guess | None:
    best, most = None, 0.0
    for name, column in values.items():
        reasons, score = _named("time", quantities[name])
        if column.size > 2 and bool((np.diff(column) > 0.0).all()):
            score += 0.5 * _TIMED
            if _equidistant(column):
                score += 0.5 * _TIMED
                reasons = [*reasons, "it grows in equal steps"]
                # A drive may be one slow ramp: a unit that no time has speaks against it.
                score -= 0.0 if quantities[name].suffix in ("", *SECONDS) else 2.0 * _UNIT
        else:
            score -= _TIMED
        if score > most and (reasons or score >= _TIMED):
            best, most = Guess(name, reasons), score
    return best


def _pair(
    values: Mapping[str, Samples], quantities: Mapping[str, Quantity]
) -> tuple[Guess, Guess] | None:
    """Return the drive and the position: the pair that names, units and the loop speak for."""
    best, most = None, -np.inf
    names = list(values)[:_MOST]
    for drive, position in permutations(names, 2):
        why_drive, score = _named("drive", quantities[drive])
        why_position, more = _named("position", quantities[position])
        lead = leads(values[drive], values[position])
        score += more
        if abs(lead) > _MIN_LOOP:
            score += _LEADS * float(np.sign(lead))
        if lead > _MIN_LOOP:
            why_drive = [*why_drive, f"it leads {position}"]
            why_position = [*why_position, f"it follows {drive} with hysteresis"]
        # A column is one of both, and what correlates with nothing is neither.
        score += abs(_correlation(values[drive], values[position]))
        if score > most:
            best, most = (Guess(drive, why_drive), Guess(position, why_position)), score
    return best


def leads(drive: Samples, position: Samples) -> float:
    """Return the area of the loop as a share of its box: above 0 if the second column lags."""
    every = slice(None, None, max(1, drive.size // _POINTS))
    u, y = _unit_box(drive[every]), _unit_box(position[every])
    # Of a lagging output the loop runs counter-clockwise; a falling one turns it round.
    area = 0.5 * float(np.sum(u[:-1] * np.diff(y) - y[:-1] * np.diff(u)))
    turns = max(1.0, 0.5 * float(np.abs(np.diff(u)).sum()))
    return area / turns * float(np.sign(_correlation(u, y)))


def _unit_box(column: Samples) -> Samples:
    centred = column - 0.5 * (column.min() + column.max())
    return np.asarray(centred / np.ptp(column), dtype=np.float64)


def _correlation(first: Samples, second: Samples) -> float:
    a, b = _unit_box(first), _unit_box(second)
    a, b = a - a.mean(), b - b.mean()
    return float(np.sum(a * b) / (np.sqrt(np.sum(a * a) * np.sum(b * b)) or 1.0))


def _named(role: str, quantity: Quantity) -> tuple[list[str], float]:
    """Return why name and unit speak for a role, and how much."""
    # `DriveVoltage` and `pos1` are words too.
    apart = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Za-z])(?=\d)", " ", quantity.name)
    words = [word for word in re.split(r"[^a-z]+", apart.lower()) if word]
    reasons, score = [], 0.0
    if set(words) & _NOT:
        score -= 2.0 * _NAME
    named = [word for word in words if word in _WORDS[role]]
    if named:
        reasons.append(f"its name has {named[0]!r}")
        score += _NAME
    if quantity.suffix in _UNITS[role]:
        reasons.append(f"its unit is {quantity.unit}")
        score += _UNIT
    elif known_unit(quantity.suffix):
        score -= 0.5 * _UNIT
    return reasons, score


def _equidistant(column: Samples) -> bool:
    steps = np.diff(column)
    usual = float(np.median(steps))
    # A gap does not make a clock something else.
    return bool(np.mean(np.abs(steps - usual) <= _EVEN * usual) > 0.9)


def _counts(column: Samples) -> bool:
    """Whether a column is a mere counter of samples."""
    return column.size > 2 and bool((np.diff(column) == 1.0).all())
