"""The hybrid controller, equation (8) with errata 10 to 12, in plain Python.

One float at a time and as plain as it gets: the feed-forward is any function with a memory, the
incremental law adds increments to the last drive. Clarity before speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

Number = float | None
LARGEST = 1e100
MANY = 2**32 - 1


def is_good(x: float) -> bool:
    return math.isfinite(x) and abs(x) <= LARGEST


Section = tuple[tuple[float, float, float], tuple[float, float]]


class Filters:
    """Sections y = b0 u + b1 u(-1) + b2 u(-2) - a1 y(-1) - a2 y(-2), one behind the other."""

    def __init__(self, sections: Sequence[Section]) -> None:
        self.sections = sections
        self.past = [(0.0, 0.0, 0.0, 0.0) for _ in sections]

    def rest(self, x: float) -> float:
        """At rest at an input that was always the same."""
        for place, (b, a) in enumerate(self.sections):
            y = sum(b) / (1.0 + sum(a)) * x
            self.past[place] = (x, x, y, y)
            x = y
        return x

    def step(self, x: float) -> float:
        for place, (b, a) in enumerate(self.sections):
            u1, u2, y1, y2 = self.past[place]
            y = b[0] * x + b[1] * u1 + b[2] * u2 - a[0] * y1 - a[1] * y2
            self.past[place] = (x, u1, y, y1)
            x = y
        return x


class Controller:
    """u = H^-1[target] + kp e + ki dt sum of e + bumpless, e = F (reference - measurement).

    feedforward: target in, volts out, once per sample; None for 0 V; "given" if they come with
    every sample. Positions in um, drives in V, times in s, ki in V/um/s.
    """

    def __init__(
        self,
        feedforward: Callable[[float], float] | str | None,
        *,
        kp: float,
        ki: float,
        dt: float,
        limits: tuple[float, float],
        slew: float = math.inf,
        law: str = "positional",
        anti_windup: str = "conditional",
        tracking_time: float | None = None,
        bumpless_time: float = 0.005,
        max_missing: int = 10,
        measurement_range: tuple[float, float] = (-math.inf, math.inf),
        max_measurement_step: float = math.inf,
        window: tuple[Sequence[float], int] | None = None,
        kernel: Sequence[float] = (1.0,),
        filters: Sequence[Section] = (),
    ) -> None:
        """As mh.HybridController; what is not limited is infinite."""
        self.feedforward, self.kp, self.ki, self.dt = feedforward, kp, ki, dt
        self.limits, self.slew = limits, slew
        self.law, self.anti_windup = law, anti_windup
        integral_time = abs(kp) / ki if ki else 0.0
        self.share = min(1.0, dt / max(tracking_time or integral_time, dt)) if ki else 0.0
        self.bumpless_samples = int(bumpless_time / dt + 0.5)
        self.left = 0  # samples until the bumpless term is gone
        self.resting = MANY  # samples for which the integral rests; a start shortens it
        self.max_missing = max_missing
        coefficients, ahead = window or ([1.0], 0)
        self.window = np.convolve(coefficients, kernel).tolist()
        self.smooth = [0.0] * ahead + list(kernel)  # from the newest reference on
        self.measurement_range, self.max_measurement_step = measurement_range, max_measurement_step
        self.drive = min(max(0.0, limits[0]), limits[1])
        self.mode = "run"
        self.resumes = "run"
        self.ramp: tuple[float, float] | None = None  # of a stop: rate, rest drive
        self.integral = self.bumpless = 0.0
        self.proportional: Number = None  # of the last sample, if it had a measurement
        self.error = 0.0  # behind the filters
        self.filters = Filters(filters)
        self.volts = 0.0  # the last feed-forward
        self.started = False
        self.missing_in_a_row = 0
        self.last_measurement: Number = None
        self.references: list[float] = []  # since the window began to fill, newest first
        self.rejected_count = self.missing_count = self.implausible_count = 0
        self.saturated_count = self.slewing_count = 0

    def set_mode(self, mode: str) -> None:
        if mode == "hold":
            self.end_motion()
        else:
            self.resumes = mode
        self.mode = mode

    def stop(self, rate: float, rest_drive: float) -> None:
        self.end_motion()
        self.mode, self.ramp = "stop", (rate, rest_drive)

    def end_motion(self) -> None:
        self.started, self.references, self.resting = False, [], MANY
        self.last_measurement = None

    def set_gains(self, kp: float, ki: float) -> None:
        """For anti-windup without a share of the gains."""
        if self.proportional is not None:
            proportional = kp * self.error
            self.carry(self.proportional - proportional)
            self.proportional = proportional
        self.kp, self.ki = kp, ki

    def step(
        self, reference: float, measurement: float, given: Number = None, target: Number = None
    ) -> float:
        if self.mode == "stop":
            assert self.ramp is not None
            rate, rest = self.ramp
            self.limit(within(rest, self.drive, rate * self.dt))
            return self.drive
        if self.mode == "hold":
            return self.drive
        good = all(is_good(x) for x in (reference, given, target) if x is not None)
        if not good or (given is None and self.feedforward == "given"):
            self.rejected_count += 1
            self.started, self.references = False, []
            return self.drive
        reference, seen, filled = self.look(reference)
        filled = filled and target is None and given is None
        target = seen if target is None else target
        begins = self.proportional is None or self.last_measurement is None
        measured = self.is_usable(measurement)
        if measured:
            self.last_measurement, self.missing_in_a_row = measurement, 0
        else:
            self.missing_in_a_row += 1
            if self.mode == "run" and self.missing_in_a_row <= self.max_missing:
                self.started = False
                return self.drive
        volts = self.feedforward(target) if callable(self.feedforward) else 0.0
        volts = volts if given is None else given
        feedback = measured and self.mode == "run"
        if feedback:
            pass_on = self.filters.rest if begins else self.filters.step
            self.error = pass_on(reference - measurement)
        self.act(volts, self.error if feedback else None, filled)
        return self.drive

    def is_usable(self, measurement: float) -> bool:
        """Whether a measurement is finite and plausible; counts it if not."""
        if not is_good(measurement):
            self.missing_count += 1
            return False
        low, high = self.measurement_range
        plausible = low <= measurement <= high
        if self.last_measurement is not None and self.missing_in_a_row < max(1, self.max_missing):
            allowed = self.max_measurement_step * (self.missing_in_a_row + 1)
            plausible = plausible and abs(measurement - self.last_measurement) <= allowed
        self.implausible_count += not plausible
        return plausible

    def look(self, newest: float) -> tuple[float, float, bool]:
        """The reference of the feedback, the target, and whether the window is just full."""
        size = len(self.window)
        self.references = [newest, *self.references][: size + 1]
        come, first = len(self.references), self.references[-1]
        seen = [first] * size if come < size else self.references[:size]
        target = sum(c * r for c, r in zip(self.window, seen, strict=True))
        past = self.references + [first] * size
        reference = sum(s * r for s, r in zip(self.smooth, past, strict=False))
        return reference, target, come == size

    def act(self, volts: float, error: Number, filled: bool) -> None:
        jump = volts - self.volts if filled else 0.0  # the target takes over from the first one
        if self.law == "positional":
            self.positional(volts, error, jump)
        else:
            self.incremental(volts, error, jump)
        self.volts = volts
        self.proportional = None if error is None else self.kp * error
        self.started = True

    def limit(self, unlimited: float) -> float:
        """What is cut off the drive that is asked for."""
        low, high = self.limits
        allowed = min(max(unlimited, low), high)
        drive = within(allowed, self.drive, self.slew * self.dt)
        self.saturated_count += allowed != unlimited
        self.slewing_count += drive != allowed
        self.drive = drive
        return unlimited - drive

    def carry(self, volts: float) -> None:
        """A difference that would be a jump, for the bumpless term to take."""
        if volts != 0.0:
            self.bumpless += volts
            self.left = self.bumpless_samples

    def fade(self, error: Number, jump: float) -> None:
        """One sample of a straight line to zero."""
        self.bumpless -= self.bumpless / self.left if self.left > 1 else self.bumpless
        self.left = max(0, self.left - 1)
        if error is None and self.proportional is not None:
            jump -= self.proportional
        elif error is not None and self.proportional is None:
            jump += self.kp * error
        self.carry(-jump)

    def integrand(self, error: Number) -> float:
        """Nothing at a start or after a hold or a stop, until the bumpless term is gone."""
        return 0.0 if error is None or self.resting > 0 else self.ki * self.dt * error

    def begin(self, wanted: float) -> None:
        """A motion, from the present drive."""
        self.bumpless = self.drive - wanted
        self.left = self.bumpless_samples if self.bumpless != 0.0 else 0
        self.resting = min(self.resting, self.left)

    def positional(self, volts: float, error: Number, jump: float) -> None:
        proportional = 0.0 if error is None else self.kp * error
        change = self.integrand(error)
        wanted = volts + proportional + self.integral + change
        if self.started:
            self.fade(error, jump)
            self.resting = max(0, self.resting - 1)
        else:
            self.begin(wanted)
        excess = self.limit(wanted + self.bumpless if self.started else self.drive)
        if self.anti_windup == "back_calculation":
            self.integral += change - (0.0 if error is None else self.share * excess)
        elif not (excess > 0.0 < change or excess < 0.0 > change):
            self.integral += change

    def incremental(self, volts: float, error: Number, jump: float) -> None:
        """Increments of the last drive, for one motion: no hold, no measurement missing."""
        assert error is not None
        if not self.started:
            self.begin(volts + self.kp * error)
            self.limit(self.drive)
            return
        assert self.proportional is not None
        before, integrand = self.bumpless, self.integrand(error)
        self.fade(error, jump)
        self.resting = max(0, self.resting - 1)
        change = volts - self.volts + self.kp * error - self.proportional
        self.limit(self.drive + change + integrand + self.bumpless - before)


def within(x: float, center: float, step: float) -> float:
    """The nearest to x that is at most a step from the center, also when computed in doubles."""
    low, high = center - step, center + step
    if center - low > step:
        low = math.nextafter(low, math.inf)
    if high - center > step:
        high = math.nextafter(high, -math.inf)
    return min(max(x, low), high)
