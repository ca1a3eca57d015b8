"""An axis of a scanner as a device of ophyd-async, which plans of bluesky move.

What the plan reads is the position at rest. A position out of reach fails the plan, and nothing
has moved then.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any

import bluesky.plans as bp
import mpi_hyst as mh
from bluesky import RunEngine
from ophyd_async.core import (
    AsyncStatus,
    StandardReadable,
    StandardReadableFormat,
    init_devices,
    soft_signal_r_and_setter,
)
from support_stage import scanner


class PiezoAxis(StandardReadable):
    """One axis; `write` puts out the drives of all axes, one for each `scanner.dt`."""

    def __init__(
        self,
        one: mh.scan.Scanner,
        axis: str,
        write: Callable[[Mapping[str, Any]], object],
        name: str = "",
    ) -> None:
        """Name an axis of a scanner."""
        self._scanner, self._axis, self._write = one, axis, write
        with self.add_children_as_readables(StandardReadableFormat.HINTED_SIGNAL):
            self.position, self._show = soft_signal_r_and_setter(
                float, one.positions[axis], units="um", precision=6
            )
        super().__init__(name=name)

    @AsyncStatus.wrap
    async def set(self, value: float) -> None:
        """Move smoothly to a position in um."""
        positions = {self._axis: [value, value]}
        await asyncio.to_thread(self._scanner.run, positions, lead_in=0.1, write=self._write)
        self._show(self._scanner.positions[self._axis])


if __name__ == "__main__":
    engine = RunEngine()
    with init_devices():
        x = PiezoAxis(scanner(), "x", lambda drives: print(len(drives["x"]), "drives"))
    engine(bp.scan([], x, 20.0, 40.0, 5), lambda name, document: print(name, document.get("data")))
