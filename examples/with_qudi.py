"""A scanner as qudi and its like have one: go somewhere, scan a line, ask where it is.

A hardware module of qudi derives from this class and from the interface of its version; what it
writes to is the analog output of the set-up. The memory is saved after every motion, so the module
may be reloaded, or the computer started again, in between.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import mpi_hyst as mh
import numpy as np
from support_stage import scanner

Write = Callable[[Mapping[str, Any]], object]


class PiezoScanner:
    """Positions in, voltages out through `write`, and a file for what must not be forgotten."""

    def __init__(self, one: mh.scan.Scanner, write: Write, memory: Path) -> None:
        """Go on from the file, if there is one."""
        self._scanner, self._write, self._memory = one, write, memory
        if memory.exists():
            one.load(memory)

    def get_position(self) -> dict[str, float]:
        """Return where the axes are, in um."""
        return self._scanner.positions

    def move_absolute(self, position: Mapping[str, float], seconds: float = 0.1) -> None:
        """Move some axes smoothly to a position."""
        self._drive({axis: [where, where] for axis, where in position.items()}, seconds)

    def scan_line(self, start: Mapping[str, float], end: Mapping[str, float], pixels: int) -> None:
        """Move along a straight line, a sample for each pixel."""
        self._drive({axis: np.linspace(start[axis], end[axis], pixels) for axis in start}, 0.1)

    def _drive(self, positions: Mapping[str, Any], lead_in: float) -> None:
        self._scanner.run(positions, lead_in=lead_in, write=self._write)
        self._scanner.save(self._memory)


if __name__ == "__main__":
    device = PiezoScanner(scanner(), lambda drives: print(len(drives["x"])), Path("memory.json"))
    device.move_absolute({"x": 20.0, "y": 30.0})
    device.scan_line({"x": 20.0}, {"x": 40.0}, pixels=500)
    print(device.get_position())
