"""A deformable mirror of HCIPy whose actuators have hysteresis, and commands that cancel it.

`HystereticMirror` moves the actuators of the mirror as the volts and their history say. `flatten`
gets the volts for wanted strokes from the exact inverse.
"""

from __future__ import annotations

from typing import Any

import hcipy
import mpi_hyst as mh
import numpy as np

LIMITS = (-500.0, 500.0)  # V
STROKE = 1e-6  # HCIPy counts in metres, the models here in um


class HystereticMirror:
    """A mirror of HCIPy behind volts: `mirror` is it, with its true shape."""

    def __init__(self, mirror: hcipy.DeformableMirror, actuators: mh.ActuatorArray) -> None:
        """Put all actuators at rest."""
        self.mirror = mirror
        self._moves = actuators.forward()
        self._wanted = actuators.inverse(limits=LIMITS)

    def drive(self, volts: Any) -> None:
        """Put out volts; the surface follows with hysteresis."""
        self.mirror.actuators = STROKE * self._moves.step(volts)

    def command(self, strokes: Any) -> Any:
        """Move every actuator by a stroke in metres from rest, and return the volts."""
        volts = self._wanted.step(np.asarray(strokes) / STROKE)
        self.drive(volts)
        return volts


def mirror(across: int = 8) -> HystereticMirror:
    """Return a square mirror with Gaussian influence functions and unequal actuators."""
    grid = hcipy.make_pupil_grid(64, 1.0)
    shapes = hcipy.make_gaussian_influence_functions(grid, across, 1.0 / across)
    gains = np.random.default_rng(3).uniform(0.9, 1.1, across**2)
    one = mh.paper.table_1_recovered()
    models = [
        mh.ModifiedPrandtlIshlinskii.from_ratios(
            gain * one.weights, one.r, ra=0.95, rb=0.3, rc=0.35
        )
        for gain in gains
    ]
    return HystereticMirror(hcipy.DeformableMirror(shapes), mh.ActuatorArray(models))


if __name__ == "__main__":
    device = mirror()
    print(device.command(np.full(64, 1e-6)).std(), device.mirror.surface.max())
