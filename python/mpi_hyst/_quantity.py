"""What the column of a record holds: its name and its unit."""

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


@dataclass(frozen=True)
class Quantity:
    """What a column holds, told by its name: `displacement_um` is displacement in um."""

    column: str

    @property
    def unit(self) -> str:
        """The unit that ends the name after an underscore, or nothing."""
        name, _, suffix = self.column.rpartition("_")
        return _UNITS.get(suffix.lower(), "") if name else ""

    @property
    def name(self) -> str:
        """The name without its unit."""
        name = self.column.rpartition("_")[0] if self.unit else self.column
        return name.replace("_", " ")

    @property
    def label(self) -> str:
        """For an axis: displacement (µm)."""
        return f"{self.name} ({self.shown_unit})" if self.unit else self.column

    @property
    def shown_unit(self) -> str:
        """The unit with the micro sign: um becomes µm."""
        return f"µ{self.unit[1:]}" if self.unit in ("um", "us", "urad", "uC") else self.unit
