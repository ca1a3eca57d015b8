"""A stage in words."""

from __future__ import annotations

import mpi_hyst as mh
from mpi_hyst._text import digits


def linear_parts(stage: mh.Stage) -> list[str]:
    """Describe everything of a stage but its hysteresis and its noise."""
    parts = []
    if stage.amplifier_bandwidth is not None:
        parts.append(f"amplifier bandwidth {stage.amplifier_bandwidth:g} Hz")
    parts += map(_section, _sections(stage))
    if stage.loop_shift is not None:
        parts.append(_loop_shift(stage.loop_shift, stage.units[1]))
    if stage.creep is not None:
        parts.append(f"creep of {len(stage.creep.amplitudes)} terms")
    if stage.dead_time:
        parts.append(f"dead time {digits(1e3 * stage.dead_time)} ms")
    return parts


def _loop_shift(shift: mh.plant.LoopShift, unit: str) -> str:
    square, product = map(digits, shift.amplitudes)
    tau = digits(shift.time_constant)
    return f"loop shift {square} and {product} {unit}, time constant {tau} s"


def _sections(stage: mh.Stage) -> list[object]:
    if stage.dynamics is None:
        return []
    return list(stage.dynamics) if isinstance(stage.dynamics, tuple) else [stage.dynamics]


def _section(section: object) -> str:
    if isinstance(section, mh.plant.SecondOrder):
        frequency, damping = digits(section.frequency), digits(section.damping)
        return f"natural frequency {frequency} Hz, damping ratio {damping}"
    if isinstance(section, mh.plant.FirstOrder):
        return f"first-order lag of {digits(section.frequency)} Hz"
    if isinstance(section, mh.plant.Modes):
        modes = zip(section.modes, section.gains, strict=True)
        return "; ".join(f"{_section(mode)}, static gain {digits(float(g))}" for mode, g in modes)
    return repr(section)
