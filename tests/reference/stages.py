"""A stage in plain Python.

Dead time, hysteresis, loop shift, plays that relax, slow gain, creep and one mode.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Sequence

from .loop_shift import LoopShift
from .models import Model
from .plants import second_order
from .relaxing_plays import RelaxingPlays
from .slow_gain import SlowGain


class ReferenceStage:
    """Rows of a record: the position y(k) is read when the drive u(k) is put out."""

    def __init__(
        self,
        hysteresis: Model,
        frequency: float,
        damping: float,
        *,
        creep: Iterable[tuple[float, float]],
        delay: int,
        dt: float,
        loop_shift: LoopShift | None = None,
        relaxing: RelaxingPlays | None = None,
        slow_gain: SlowGain | None = None,
    ) -> None:
        """Creep as pairs of amplitude and time constant in seconds; the delay in samples."""
        self.hysteresis = hysteresis
        self.loop_shift = loop_shift
        self.relaxing = relaxing
        self.slow_gain = slow_gain
        self.mode = second_order(frequency, damping, dt)
        self.creep = [(amplitude, math.exp(-dt / tau)) for amplitude, tau in creep]
        self.lags = [0.0] * len(self.creep)
        self.waiting = deque([0.0] * delay)
        self.position = 0.0

    def step(self, drive: float) -> float:
        crept = sum(
            amplitude * lag for (amplitude, _), lag in zip(self.creep, self.lags, strict=True)
        )
        row = self.position + crept
        self.waiting.append(drive)
        late = self.waiting.popleft()
        displacement = self.hysteresis.step(late)
        if self.loop_shift is not None:
            displacement += self.loop_shift.step(late)
        if self.relaxing is not None:
            displacement = self.relaxing.step(late, displacement)
        if self.slow_gain is not None:
            displacement = self.slow_gain.step(late, displacement)
        for j, (_, decay) in enumerate(self.creep):
            self.lags[j] = decay * self.lags[j] + (1.0 - decay) * displacement
        self.position = self.mode.step(displacement)
        return row

    def run(self, drives: Sequence[float]) -> list[float]:
        return [self.step(drive) for drive in drives]
