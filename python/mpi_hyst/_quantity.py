"""The quantity in a column of a record: its name and its unit.

The unit is in the name of the column, as in `drive_v` or `Time (us)`, or was given beside it: in a
row below the header, or as an attribute of the column.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "d": 86400.0}
TIME_NAMES = ("time", "t", "x_value", "timestamp", "elapsed time", "zeit", "temps", "tiempo",
              "datetime", "date time", "date/time", "time stamp")  # fmt: skip

_UNITS = {
    unit.lower(): unit
    for unit in (
        *("V", "mV", "kV", "A", "mA", "C", "nC", "uC"),
        *("m", "mm", "um", "nm", "pm", "rad", "mrad", "urad", "deg", "N", "mN", "mT", "uT"),
        *SECONDS,
    )
}
_WORDS = {
    **dict.fromkeys(("volt", "volts", "voltage"), "V"),
    **dict.fromkeys(("micron", "microns", "micrometer", "micrometre"), "um"),
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sekunden"), "s"),
    **{"msec": "ms", "usec": "us", "microseconds": "us", "milliseconds": "ms", "minutes": "min"},
}
_MICRO = ("um", "us", "urad", "uC", "uT")
# A column `position_min` holds a minimum and `gain_h` no hours: so only behind a name of time.
_ONLY_OF_TIME = ("ns", "min", "h", "d")
_BEHIND = re.compile(r"(?P<name>.*?\S)[\s_]*(\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)|\s/\s*(?P<c>\S+))")
# `I/mA` and `Weg/µm` are quantities over units; `scope/A` may be a path.
_OVER = re.compile(r"(?P<name>[^/]*[^/\s])/(?P<unit>[^/\s]+)")
_SYMBOL = re.compile(r"[^\W\d_](_\w+|\d+)?")


def known_unit(text: str) -> str:
    """Return a unit in ASCII as column names end with it, or nothing: `[µm]` and `um` are um."""
    bare = _bare(text)
    return _UNITS.get(bare, _WORDS.get(bare, ""))


def _bare(unit: str) -> str:
    return unit.strip().strip("[]()").strip().replace("µ", "u").replace("μ", "u").lower()


def _over(column: str) -> tuple[str, str] | None:
    """Return name and unit of a quantity over its unit: `I/mA`, `Zeit/s`."""
    found = _OVER.fullmatch(column)
    if found is None:
        return None
    name, unit = found["name"], _UNITS.get(_bare(found["unit"]), "")
    is_told = len(unit) > 1 or _SYMBOL.fullmatch(name) is not None
    if name.lower() in TIME_NAMES or (is_told and unit not in _ONLY_OF_TIME):
        return (name, unit) if unit else None
    return None


def with_unit(name: str, unit: str) -> str:
    """Return the name of a column that says its unit: position_um. An unknown one is left out."""
    known = known_unit(unit)
    return f"{name}_{known.lower()}" if known else name


def drive_with_unit(unit: str) -> str:
    """Return the name of the column of a drive: `drive` for V, as in any name without a unit."""
    return "drive" if known_unit(unit) == "V" else with_unit("drive", unit)


@dataclass(frozen=True)
class Quantity:
    """A quantity by the name of its column: `displacement_um` is a displacement in µm.

    `given` is the unit that the file states beside the name; it goes before that in the name.
    """

    column: str
    given: str = ""

    @property
    def suffix(self) -> str:
        """The unit as column names end with it, in ASCII: um. Empty if there is none."""
        return known_unit(self.given) or self._parts[1]

    @property
    def unit(self) -> str:
        """The unit as text shows it: µm."""
        return f"µ{self.suffix[1:]}" if self.suffix in _MICRO else self.suffix

    @property
    def name(self) -> str:
        """The name without the unit."""
        return self._parts[0].replace("_", " ")

    @property
    def label(self) -> str:
        """The name with its unit, for an axis: displacement (µm)."""
        return f"{self.name} ({self.unit})" if self.suffix else self.column

    @property
    def in_parentheses(self) -> str:
        """The unit for the end of a label or of a column header: a space and (µm), or nothing."""
        return f" ({self.unit})" if self.unit else ""

    @property
    def is_time(self) -> bool:
        """Whether the name says that this is the time: time, `t_ms`, `Time (us)`, but not `t`."""
        name = self._parts[0].strip().lower()
        return name in TIME_NAMES and (self.suffix in SECONDS or (name != "t" and not self.suffix))

    @property
    def _parts(self) -> tuple[str, str]:
        """The name without the unit, and the unit that it ends with."""
        found = _BEHIND.fullmatch(self.column.strip())
        if found is not None and (unit := known_unit(found["a"] or found["b"] or found["c"] or "")):
            return found["name"], unit
        if (over := _over(self.column.strip())) is not None:
            return over
        name, _, last = self.column.rpartition("_")
        unit = _UNITS.get(last.lower(), "") if name else ""
        if unit in _ONLY_OF_TIME and name.lower() not in TIME_NAMES:
            unit = ""
        return (name, unit) if unit else (self.column, "")


@dataclass(frozen=True)
class Stated(Quantity):
    """A quantity whose unit a user states: any text, or nothing."""

    @property
    def suffix(self) -> str:
        """The unit in ASCII where it is a known one, else as it was stated."""
        return known_unit(self.given) or self.given.strip()
