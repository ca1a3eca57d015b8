"""A stage of pymmcore-plus: Micro-Manager moves it like any other, in um and without hysteresis.

`UniMMCore` loads devices that are written in Python beside those of Micro-Manager.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
from pymmcore_plus.experimental.unicore import StageDevice, UniMMCore
from support_stage import DT, stage


class PiezoStage(StageDevice):
    """The axis z of a scanner; `write` puts out its drives, one for each `scanner.dt`."""

    def __init__(self, one: mh.scan.Scanner, write: Callable[[Any], object]) -> None:
        """Drive the axis z of a scanner."""
        super().__init__()
        self._scanner, self._write, self._origin = one, write, 0.0

    def set_position_um(self, val: float) -> None:
        """Move smoothly, within limits and slew; out of reach is a ValueError."""
        wanted = val + self._origin
        self._scanner.run({"z": [wanted, wanted]}, lead_in=0.1, write=self._write)

    def get_position_um(self) -> float:
        """Return where the stage is."""
        return self._scanner.positions["z"] - self._origin

    def home(self) -> None:
        """Move to the position at rest."""
        self.set_position_um(-self._origin)

    def set_origin(self) -> None:
        """Call this place 0 um."""
        self._origin = self._scanner.positions["z"]

    def stop(self) -> None:
        """Do nothing: every motion has ended when it returns."""


def core(one: mh.scan.Scanner, write: Callable[[Any], object]) -> UniMMCore:
    """Return a core with this stage as its focus drive."""
    made = UniMMCore()
    made.loadPyDevice("Piezo", PiezoStage(one, write))
    made.initializeDevice("Piezo")
    made.setFocusDevice("Piezo")
    return made


if __name__ == "__main__":
    focus = core(
        mh.scan.Scanner({"z": stage()}, DT), lambda drives: print(len(drives["z"]), "drives")
    )
    focus.setPosition(25.0)
    print(focus.getPosition())
