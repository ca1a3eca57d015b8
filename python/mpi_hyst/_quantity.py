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
        *("angstrom", "arcsec", "%", "ppm", "counts", "degC", "bar", "mbar"),
        *("V/m", "kV/m", "kV/mm", "A/m", "kA/m"),
        *SECONDS,
    )
} | {"å": "angstrom", "°c": "degC"}
# In small letters these would be units of another size.
_EXACT = {unit: unit for unit in ("MV/m", "MPa")}
# A unit that is stated like this is mega, not milli; `DRIVE_MV` is a name in capitals.
_MEGA = ("MV", "MA", "MN")
_WORDS = {
    **dict.fromkeys(("volt", "volts", "voltage"), "V"),
    **dict.fromkeys(("micron", "microns", "micrometer", "micrometre"), "um"),
    **dict.fromkeys(("sec", "secs", "second", "seconds", "sekunden"), "s"),
    **dict.fromkeys(("celsius", "deg c"), "degC"),
    **{"percent": "%", "count": "counts", "cts": "counts", "arcseconds": "arcsec"},
    **{"msec": "ms", "usec": "us", "microseconds": "us", "milliseconds": "ms", "minutes": "min"},
}
_MICRO = ("um", "us", "urad", "uC", "uT")
_SHOWN = {"degC": "°C", "angstrom": "Å", **{unit: f"µ{unit[1:]}" for unit in _MICRO}}
# A column `position_min` holds a minimum and `gain_h` no hours: so only behind a name of time.
_ONLY_OF_TIME = ("ns", "min", "h", "d")
_BEHIND = re.compile(r"(?P<name>.*?\S)[\s_]*(\[(?P<a>[^\]]*)\]|\((?P<b>[^)]*)\)|\s/\s*(?P<c>\S+))")
# `I/mA` and `Weg/µm` are quantities over units; `scope/A` may be a path.
_OVER = re.compile(r"(?P<name>[^/]*[^/\s])/(?P<unit>[^/\s]+)")
_SYMBOL = re.compile(r"[^\W\d_](_\w+|\d+)?")
# `encoder/counts` may be a path, too.
_ONLY_OF_SYMBOL = ("counts",)
# What stands in parentheses may be a remark: `pos (raw)`. So there a unit must look like one.
_ONE = (
    r"([pnuµμmckMG]?(m[23]?|g|s2?|A|V|K|N|J|W|T|Pa|Hz|bar|rad|eV|[oO]hm|Ω|Oe|ε|strain)|°F?|degF|psi"
    r"|rpm|dB|a\.?u\.?|arcmin|LSB|digits?|steps?|px|pixels?|turns?|1)(\^-?\d|-[12]|[²³])?"
)
_LIKE_A_UNIT = re.compile(rf"{_ONE}([/*·.]{_ONE})*")


def known_unit(text: str) -> str:
    """Return a unit in ASCII as column names end with it, or nothing: `[µm]` and `um` are um."""
    bare = _bare(text)
    if bare in _MEGA:
        return ""
    return _unit(bare) or _WORDS.get(bare.lower(), "")


def stated_unit(text: str) -> str:
    """Return a unit that is stated: a known one in ASCII, else its text.

    Numbers, as of a channel, and dashes are none.
    """
    bare = " ".join(text.strip().strip("[]()").replace("μ", "µ").split())
    return known_unit(text) or (bare if re.search(r"[^\W\d_]|[%‰°]", bare) else "")


def _bare(unit: str) -> str:
    return unit.strip().strip("[]()").strip().replace("µ", "u").replace("μ", "u")


def _unit(bare: str) -> str:
    return _EXACT.get(bare, _UNITS.get(bare.lower(), ""))


def is_like_a_unit(text: str) -> bool:
    """Whether a text is a known unit, or is written as units are: mW, 1/s, steps."""
    return known_unit(text) != "" or _LIKE_A_UNIT.fullmatch(text.strip()) is not None


def _behind(column: str) -> tuple[str, str] | None:
    """Return name and unit of a column that ends with it: `T [degC]`, `T (degC)`, `T / degC`."""
    found = _BEHIND.fullmatch(column)
    if found is None:
        return None
    other = found["b"] or found["c"] or ""
    unit = stated_unit(found["a"] or (other if is_like_a_unit(other) else ""))
    return (found["name"], unit) if unit else None


def _over(column: str) -> tuple[str, str] | None:
    """Return name and unit of a quantity over its unit: `I/mA`, `Zeit/s`."""
    found = _OVER.fullmatch(column)
    if found is None:
        return None
    name, bare = found["name"], _bare(found["unit"])
    unit = bare if bare in _MEGA else _unit(bare)
    is_told = len(unit) > 1 and unit not in _ONLY_OF_SYMBOL
    is_told = is_told or _SYMBOL.fullmatch(name) is not None
    if name.lower() in TIME_NAMES or (is_told and unit not in _ONLY_OF_TIME):
        return (name, unit) if unit else None
    return None


def with_unit(name: str, unit: str) -> str:
    """Return the name of a column that says its unit: position_um, or position [mV/m]."""
    stated = stated_unit(unit)
    if not stated:
        return name
    is_ending = known_unit(stated) and stated.isalnum()
    return f"{name}_{stated.lower()}" if is_ending else f"{name} [{stated}]"


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
        """The unit: um, in ASCII if it is known, else as it is stated. Empty if there is none."""
        return stated_unit(self.given) or self._parts[1]

    @property
    def time_unit(self) -> str:
        """The unit if it is one of time; empty if it is none."""
        return self.suffix if self.suffix in SECONDS else ""

    @property
    def unit(self) -> str:
        """The unit as text shows it: µm."""
        return _SHOWN.get(self.suffix, self.suffix)

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
        unit = known_unit(self.given) or self._parts[1]
        return name in TIME_NAMES and (unit in SECONDS or (name != "t" and not unit))

    @property
    def _parts(self) -> tuple[str, str]:
        """The name without the unit, and the unit that it ends with."""
        column = self.column.strip()
        if (behind := _behind(column)) is not None:
            return behind
        name, _, last = self.column.rpartition("_")
        unit = _unit(last) if name else ""
        is_time = name.lower() in TIME_NAMES
        # `x_bar` is a mean.
        if (unit in _ONLY_OF_TIME and not is_time) or (unit == "bar" and name in ("x", "y", "u")):
            unit = ""
        return (name, unit) if unit else _over(column) or (self.column, "")


@dataclass(frozen=True)
class Stated(Quantity):
    """A quantity whose unit a user states: any text, or nothing."""

    @property
    def suffix(self) -> str:
        """The unit in ASCII where it is a known one, else as it was stated."""
        return known_unit(self.given) or self.given.strip()
