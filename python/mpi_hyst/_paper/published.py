"""The published numbers, caveats about them, and their comparison with ours."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

PAPER = (
    "G. Wang, G. Chen, H. Zhou, F. Bai, Modeling and Tracking Control for Piezoelectric Actuator "
    "Based on a New Asymmetric Hysteresis Model, IEEE/CAA J. Autom. Sinica 4(4), 782-791, 2017"
)

UNPUBLISHED_DATA = (
    "The printed 5.31 % of the conventional model depends on measured data that are not published. "
    "On the actuator described by the tables, the best conventional fit has a smaller error."
)
BASES = (
    "The bases of the printed percentages differ or are not given. Here every percentage names its "
    "base. The printed average hysteresis of the sines has neither base nor definition, so it is "
    "not compared."
)
NO_PROOF = (
    "A1 and P3 are simulated plants. With the published law they give the published maximum "
    "errors, and so do other plants. The agreement does not prove that the actuator of the paper "
    "was like them. A1: natural frequency 400 Hz, damping ratio 0.95, 16.0 nm rms of sensor noise. "
    "P3: 2000 Hz, 0.03, 16.4 nm, and an amplifier of 279 Hz bandwidth."
)
CAVEATS = (UNPUBLISHED_DATA, BASES, NO_PROOF)

WALK_OUTPUT = (0.0, 10.0, -12.0, 5.0, 5.0, 15.0, -7.0, -7.0)  # V, Fig. 5
MODIFIED_MAX, MODIFIED_MSE = 1.02, 0.002  # %, um^2: Fig. 8
CONVENTIONAL_MAX, CONVENTIONAL_MSE = 5.31, 0.014  # %, um^2: Fig. 9 and 10
TRIANGLE_CONVENTIONAL, TRIANGLE_MODIFIED = (0.10, 0.11), (0.06, 0.07)  # um: Fig. 12, 13
HYSTERESIS_CONVENTIONAL, HYSTERESIS_MODIFIED = 1.8, 1.0  # %: Fig. 12, 13
SINES = {5.0: 0.098, 10.0: 0.159, 15.0: 0.224, 20.0: 0.293}  # Hz, um: Fig. 14 to 17
AVERAGE_HYSTERESIS = {5.0: 0.9, 10.0: 1.0, 15.0: 1.2, 20.0: 1.3}  # Hz, %: the same


@dataclass(frozen=True)
class Comparison:
    """A published number, or the two published for both directions, and ours."""

    figure: str
    what: str
    unit: str
    published: tuple[float, float] | None
    ours: float
    plant: str = ""
    note: str = ""

    @property
    def deviation_percent(self) -> float | None:
        """The deviation from the nearest published number in % of it; zero between two."""
        if self.published is None:
            return None
        low, high = self.published
        nearest = min(max(self.ours, low), high)
        return 0.0 if self.ours == nearest else 100.0 * (self.ours - nearest) / abs(nearest)

    @property
    def published_text(self) -> str:
        """The published number or numbers as text."""
        if self.published is None:
            return "-"
        return " to ".join(f"{value:g}" for value in dict.fromkeys(self.published))

    @property
    def deviation_text(self) -> str:
        """The deviation in % with its sign, as text."""
        deviation = self.deviation_percent
        if self.published is None or deviation is None:
            return "-"
        if self.published == (self.ours, self.ours):
            return "none"
        return "within" if deviation == 0.0 else f"{deviation:+.1f} %"

    def as_json(self) -> dict[str, Any]:
        """Return the entry of results.json."""
        return {
            "figure": self.figure,
            "what": self.what,
            "unit": self.unit,
            "plant": self.plant or None,
            "published": None if self.published is None else list(self.published),
            "ours": self.ours,
            "deviation_percent": self.deviation_percent,
            "note": self.note or None,
        }


def single(value: float) -> tuple[float, float]:
    """Return one published number as a range."""
    return (value, value)
