"""The quantity in a column of a record: its name and its unit, from the name of the column."""

from __future__ import annotations

from dataclasses import dataclass

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
_UNITS = {
    unit.lower(): unit
    for unit in (
        *("V", "mV", "kV", "A", "mA", "C", "nC", "uC"),
        *("m", "mm", "um", "nm", "pm", "rad", "mrad", "urad", "deg", "N", "mN"),
        *SECONDS,
    )
}
_MICRO = ("um", "us", "urad", "uC")


@dataclass(frozen=True)
class Quantity:
    """A quantity by the name of its column: `displacement_um` is a displacement in µm."""

    column: str

    @property
    def suffix(self) -> str:
        """The unit as column names end with it, in ASCII: um. Empty if there is none."""
        name, _, last = self.column.rpartition("_")
        return _UNITS.get(last.lower(), "") if name else ""

    @property
    def unit(self) -> str:
        """The unit as text shows it: µm."""
        return f"µ{self.suffix[1:]}" if self.suffix in _MICRO else self.suffix

    @property
    def name(self) -> str:
        """The name without the unit."""
        name = self.column.rpartition("_")[0] if self.suffix else self.column
        return name.replace("_", " ")

    @property
    def label(self) -> str:
        """The name with its unit, for an axis: displacement (µm)."""
        return f"{self.name} ({self.unit})" if self.suffix else self.column

    @property
    def in_parentheses(self) -> str:
        """The unit for the end of a label or of a column header: a space and (µm), or nothing."""
        return f" ({self.unit})" if self.unit else ""
