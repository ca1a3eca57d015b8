"""The hybrid controller, equation (8) with errata 10 to 12, in plain Python.

One float at a time and as plain as it gets: the feed-forward is any function with a memory, the
incremental laws add increments to the last drive. Clarity before speed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

Number = float | None
LARGEST = 1e100
MANY = 2**32 - 1


def is_good(x: float) -> bool:
    return math.isfinite(x) and abs(x) <= LARGEST


class Controller:
    """u = H^-1[target] + kp e + sum of ki e + transition, e = reference - measurement.

    feedforward: target in, volts out, once per sample; None for 0 V; "given" if they come with
    every sample. Positions in um, drives in volts, ki per sample.
    """

    def __init__(
        self,
        feedforward: Callable[[float], float] | str | None,
        *,
        kp: float,
        ki: float,
        dt: float = 1e-4,
        limits: tuple[float, float],
        slew: float = math.inf,
        law: str = "positional",
        anti_windup: str = "conditional",
        tracking_time: float | None = None,
        transition: float = 0.005,
        max_missing: int = 10,
        window: tuple[Sequence[float], int] | None = None,
    ) -> None:
        """As mh.HybridController."""
        self.feedforward, self.kp, self.ki = feedforward, kp, ki
        self.limits, self.step_limit = limits, slew * dt
        self.law, self.anti_windup = law, anti_windup
        integral_time = dt * kp / ki if ki else 0.0
        self.share = min(1.0, dt / max(tracking_time or integral_time, dt)) if ki else 0.0
        self.fading = int(transition / dt + 0.5)  # samples
        self.left = 0  # samples until the transition is gone
        self.resting = MANY  # samples in which the integral rests; no more than a start takes
        self.max_missing, self.window = max_missing, window
        self.drive = min(max(0.0, limits[0]), limits[1])
        self.mode = "run"
        self.resumes = "run"
        self.integral = self.transition = 0.0
        self.proportional: Number = None  # of the last sample, if it had a measurement
        self.volts = 0.0  # the last feed-forward
        self.started = False
        self.missing_in_a_row = 0
        self.references: list[float] = []  # newest first
        self.rejected = self.missing = self.saturated = self.slewing = 0

    def set_mode(self, mode: str) -> None:
        if mode == "hold":
            self.started, self.references, self.resting = False, [], MANY
        else:
            self.resumes = mode
        self.mode = mode

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
        if self.mode == "hold":
            return self.drive
        good = all(is_good(x) for x in (reference, given, target) if x is not None)
        if not good or (given is None and self.feedforward == "given"):
            self.rejected += 1
            self.started, self.references = False, []
            return self.drive
        reference, seen = self.look(reference)
        target = seen if target is None else target
        measured = is_good(measurement)
        if measured:
            self.missing_in_a_row = 0
        else:
            self.missing += 1
            self.missing_in_a_row += 1
            if self.mode == "run" and self.missing_in_a_row <= self.max_missing:
                self.started = False
                return self.drive
        volts = self.feedforward(target) if callable(self.feedforward) else 0.0
        volts = volts if given is None else given
        if measured:
            self.error = reference - measurement
        self.act(volts, self.error if measured and self.mode == "run" else None)
        return self.drive

    def look(self, newest: float) -> tuple[float, float]:
        """The reference of the feedback and the target, out of the window."""
        coefficients, ahead = self.window or ([1.0], 0)
        known = self.references or [newest] * len(coefficients)
        self.references = [newest, *known][: len(coefficients)]
        target = sum(c * r for c, r in zip(coefficients, self.references, strict=True))
        return self.references[ahead], target

    def act(self, volts: float, error: Number) -> None:
        if self.law == "positional":
            self.positional(volts, error)
        else:
            self.incremental(volts, error)
        self.volts = volts
        self.proportional = None if error is None else self.kp * error
        self.started = True

    def limit(self, demanded: float) -> float:
        """What is cut off the demand."""
        low, high = self.limits
        allowed = min(max(demanded, low), high)
        drive = min(max(allowed, self.drive - self.step_limit), self.drive + self.step_limit)
        self.saturated += allowed != demanded
        self.slewing += drive != allowed
        self.drive = drive
        return demanded - drive

    def carry(self, volts: float) -> None:
        """A difference that would be a jump, for the transition to take."""
        if volts != 0.0:
            self.transition += volts
            self.left = self.fading

    def fade(self, error: Number) -> None:
        """One sample of a straight line to zero."""
        self.transition -= self.transition / self.left if self.left > 1 else self.transition
        self.left = max(0, self.left - 1)
        if error is None and self.proportional is not None:
            self.transition, self.left = self.transition + self.proportional, self.fading
        elif error is not None and self.proportional is None:
            self.transition, self.left = self.transition - self.kp * error, self.fading

    def integrand(self, error: Number) -> float:
        """Nothing at the first start and after a hold, and until the transition is gone."""
        return 0.0 if error is None or self.resting > 0 else self.ki * error

    def begin(self, wanted: float) -> None:
        """A motion, from the present drive."""
        self.transition = self.drive - wanted
        self.left = self.fading if self.transition != 0.0 else 0
        self.resting = min(self.resting, self.left)

    def positional(self, volts: float, error: Number) -> None:
        proportional = 0.0 if error is None else self.kp * error
        change = self.integrand(error)
        wanted = volts + proportional + self.integral + change
        if self.started:
            self.fade(error)
            self.resting = max(0, self.resting - 1)
        else:
            self.begin(wanted)
        excess = self.limit(wanted + self.transition if self.started else self.drive)
        if self.anti_windup == "back_calculation":
            self.integral += change - (0.0 if error is None else self.share * excess)
        elif not (excess > 0.0 < change or excess < 0.0 > change):
            self.integral += change

    def incremental(self, volts: float, error: Number) -> None:
        """Increments of the last drive, for one motion: no hold, no measurement missing."""
        assert error is not None
        if not self.started:
            self.begin(volts + self.kp * error)
            self.limit(self.drive)
            return
        assert self.proportional is not None
        before, integrand = self.transition, self.integrand(error)
        self.fade(error)
        self.resting = max(0, self.resting - 1)
        change = volts - self.volts if self.law == "incremental" else volts
        change += self.kp * error - self.proportional
        self.limit(self.drive + change + integrand + self.transition - before)
