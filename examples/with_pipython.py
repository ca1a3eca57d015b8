"""A scan as the waveform of a PI controller, by PIPython.

The axis is driven in open loop, so the points of the wave table are the drives of this package.
"""

from __future__ import annotations

from typing import Any

import mpi_hyst as mh
from pipython import GCSDevice, pitools
from support_stage import DT, scanner

BUNCH = 100
"""So many points go with one command: see the manual of the controller."""


def load_waveform(device: GCSDevice, drives: Any, table: int = 1, generator: int = 1) -> None:
    """Write drives to a wave table and connect a wave generator to it."""
    pitools.writewavepoints(device, table, [float(one) for one in drives], bunchsize=BUNCH)
    device.WSL(generator, table)
    device.WGC(generator, 1)  # once


def start(device: GCSDevice, generator: int = 1) -> None:
    """Let the wave generator run."""
    device.WGO(generator, 1)


if __name__ == "__main__":
    one = scanner()
    line = 20.0 + mh.signals.triangle(10.0, 2.0, seconds=1.0, rate=1.0 / DT)
    with GCSDevice("E-727") as controller:
        controller.ConnectUSB(serialnum="0112345678")
        load_waveform(controller, one.run({"x": line}, lead_in=0.1)["x"])
        start(controller)
