"""The linear part of a stage in python-control and scipy.signal, and the margins of a loop.

Hysteresis is no linear system. What feedback meets is one: amplifier and modes behind the slope of
the hysteresis, which lies in `stage.slope_range`, with the dead time of the stage.
"""

from __future__ import annotations

from typing import Any

import control
import mpi_hyst as mh
import numpy as np
from support_stage import stage


def loop(one: mh.Stage, integral: float) -> Any:
    """Return the open loop of an integral gain (V/um/s) at the steepest slope of the hysteresis."""
    slope = one.slope_range[1]
    late, early = control.pade(one.dead_time, 3) if one.dead_time > 0.0 else ([1.0], [1.0])
    integrator = control.tf([integral], [1.0, 0.0])
    return slope * integrator * control.tf(late, early) * one.to_control()


def margins(one: mh.Stage, integral: float) -> tuple[float, float]:
    """Return the gain margin, and the phase margin in degrees."""
    gain, phase, *_ = control.margin(loop(one, integral))
    return float(gain), float(phase)


def resonance(one: mh.Stage) -> tuple[float, float]:
    """Return frequency in Hz and damping ratio of the slowest mode, by scipy."""
    # Its own `poles` take the way over a transfer function, which is badly conditioned.
    slowest = min(np.linalg.eigvals(one.to_scipy().A), key=abs)
    return float(abs(slowest) / (2.0 * np.pi)), float(-slowest.real / abs(slowest))


if __name__ == "__main__":
    light = stage().replace(dynamics=mh.plant.SecondOrder(150.0, 0.05), dead_time=1e-4)
    print("gain and phase margin:", margins(light, integral=1.0))
    print("frequency and damping:", resonance(light))
