"""A TANGO device: the axes of a scanner as attributes `x` and `y`, in um.

Writing an attribute moves the axis. The memory is in a file, so the server may be started anew.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from support_stage import scanner
from tango import AttrWriteType, DevState
from tango.server import Device, attribute, device_property

AXIS = {"dtype": float, "access": AttrWriteType.READ_WRITE, "unit": "um", "format": "%.6f"}


class PiezoScanner(Device):
    """Positions in, drives out; derive from it and replace `put_out`."""

    x, y = attribute(**AXIS), attribute(**AXIS)
    memory = device_property(dtype=str, default_value="scanner.json", doc="what is remembered")

    def init_device(self) -> None:
        """Go on from the file, if there is one."""
        super().init_device()
        self._scanner = scanner()
        if Path(self.memory).exists():
            self._scanner.load(self.memory)
        self.set_state(DevState.ON)

    def put_out(self, drives: Mapping[str, Any]) -> None:
        """Give the drives of all axes to the hardware, one for each `dt`."""

    def move(self, name: str, position: float) -> None:
        """Move smoothly; what is out of reach fails, and nothing has moved then."""
        self._scanner.run({name: [position, position]}, lead_in=0.1, write=self.put_out)
        self._scanner.save(self.memory)

    def read_x(self) -> float:
        """Return where the axis x is at rest."""
        return self._scanner.positions["x"]

    def write_x(self, position: float) -> None:
        """Move the axis x."""
        self.move("x", position)

    def read_y(self) -> float:
        """Return where the axis y is at rest."""
        return self._scanner.positions["y"]

    def write_y(self, position: float) -> None:
        """Move the axis y."""
        self.move("y", position)


if __name__ == "__main__":
    PiezoScanner.run_server()
