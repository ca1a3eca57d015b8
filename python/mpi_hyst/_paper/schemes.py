"""Beyond the paper: control schemes on plant A1 with sensor noise, and laws that saturate.

The errors of a scheme are taken over one second: after the first period, or after three periods or
seconds of learning. A scheme may pass the reference through inverse dynamics. It assumes the exact
model and dynamics of the plant, or wrong ones.

A reference of 3.3 um with a drive limited to +-500 V, which reaches 3.06 um, saturates. The errors
are those after the first saturation, wherever the reference is within 2.5 um.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import mpi_hyst as mh
from mpi_hyst._paper.benchmark import (
    DT,
    RATE,
    TRIANGLE,
    FeedForward,
    Motion,
    a1,
    assumptions,
    controller,
    median,
    part,
    whole_sine,
)
from mpi_hyst._types import Samples

EVALUATED = 1.0  # s
LEARNING = 3.0  # s, or periods
BANDWIDTH = 150.0  # Hz, of the learning
DRIFT = 0.5  # um in one second, the drift that the observer allows for
FORGETTING = 0.9999
AHEAD = 4  # samples of preview
MOTIONS = (TRIANGLE, *(whole_sine(f) for f in (5.0, 10.0, 15.0, 20.0, 50.0, 100.0)))
GAINS = mh.paper.gains("A1")


@dataclass(frozen=True)
class Errors:
    """Largest error and root mean square error, um."""

    max: float
    rms: float

    @classmethod
    def of(cls, metrics: mh.plant.Metrics) -> Errors:
        """Return the errors of the true position."""
        return cls(metrics.max_position_error, metrics.position_rmse)


@dataclass(frozen=True)
class Scheme:
    """A control scheme and the assumption of its controller."""

    name: str
    assumed: str
    run: Callable[[Motion, int], Errors]


@dataclass(frozen=True)
class Outcome:
    """The errors of a scheme for each motion, medians over the seeds."""

    name: str
    assumed: str
    errors: dict[str, Errors]


def schemes() -> list[Scheme]:
    """Return all schemes, from the published law to learning, and two lower bounds."""
    named = assumptions()
    exact, model, both = named["exact"], named["wrong model"], named["wrong model and dynamics"]
    inverse, dynamics = "exact inverse", "inverse dynamics"
    full = f"{inverse}, {dynamics}"
    return [
        Scheme("published law: Table II + P-I", "-", _published),
        Scheme(f"{inverse} + same P-I", "exact", _without_dynamics),
        *(
            Scheme(f"{full} + same P-I", assumption.name, _shaped(assumption.stage))
            for assumption in named.values()
        ),
        Scheme(f"the same, {AHEAD} samples of preview", "exact", _previewed(exact.stage)),
        *(
            Scheme("tuned gains", assumption.name, _tuned(assumption.stage, 1.0, 1.0))
            for assumption in (exact, both)
        ),
        Scheme("half the tuned kp, a quarter of ki", both.name, _tuned(both.stage, 0.5, 0.25)),
        *(
            Scheme("observer", assumption.name, _observed(assumption.stage))
            for assumption in (exact, both)
        ),
        Scheme("iterative learning, 3 periods", both.name, _learned(both.stage)),
        Scheme("repetitive control, 3 s", both.name, _repeated(both.stage)),
        *(
            Scheme("adaptation, 3 s", assumption.name, _adapted(assumption.stage))
            for assumption in (model, both)
        ),
        Scheme("bound: exact, without noise", "exact", _noiseless),
        Scheme("bound: sensor noise alone", "-", _sensor),
    ]


def outcomes(seeds: int, advance: Callable[[], None]) -> list[Outcome]:
    """Simulate all schemes for all motions."""
    found = []
    for scheme in schemes():
        errors = {}
        for motion in MOTIONS:
            errors_by_seed = [scheme.run(motion, seed) for seed in range(seeds)]
            errors[motion.name] = Errors(
                median([one.max for one in errors_by_seed]),
                median([one.rms for one in errors_by_seed]),
            )
            advance()
        found.append(Outcome(scheme.name, scheme.assumed, errors))
    return found


def outcomes_to_run() -> int:
    """Return the number of steps of `outcomes`, for a progress bar."""
    return len(schemes()) * len(MOTIONS)


def _after_a_period(
    law: mh.control.HybridController,
    plant: mh.plant.Plant,
    motion: Motion,
    target: Samples | None = None,
) -> mh.plant.Metrics:
    reference = motion.reference(_seconds(motion))
    return part(mh.plant.simulate(law, plant, reference, target=target), motion.samples)


def _seconds(motion: Motion) -> float:
    return motion.samples * DT + EVALUATED


def _published(motion: Motion, seed: int) -> Errors:
    law = controller(mh.paper.table_2().forward(), GAINS)
    return Errors.of(_after_a_period(law, a1().plant(DT, seed), motion))


def _without_dynamics(motion: Motion, seed: int) -> Errors:
    law = controller(a1().inverse(DT), GAINS)
    return Errors.of(_after_a_period(law, a1().plant(DT, seed), motion))


def _shaped(stage: mh.Stage, gains: tuple[float, float] = GAINS) -> Callable[[Motion, int], Errors]:
    def run(motion: Motion, seed: int) -> Errors:
        target = motion.target(_seconds(motion), stage)
        law = controller(stage.inverse(DT), gains)
        return Errors.of(_after_a_period(law, a1().plant(DT, seed), motion, target))

    return run


def _previewed(stage: mh.Stage) -> Callable[[Motion, int], Errors]:
    def run(motion: Motion, seed: int) -> Errors:
        preview = stage.preview(DT, AHEAD)
        law = controller(stage.inverse(DT), GAINS, preview=preview)
        # The end of the record is left out: there is no preview, and the reference has a corner.
        reference = motion.reference(_seconds(motion) + 4 * AHEAD * DT)
        done = mh.plant.simulate(law, a1().plant(DT, seed), reference)
        return Errors.of(part(done, motion.samples, -4 * AHEAD))

    return run


def _tuned(stage: mh.Stage, of_kp: float, of_ki: float) -> Callable[[Motion, int], Errors]:
    tuned = stage.tune(DT)
    return _shaped(stage, (of_kp * tuned.kp, of_ki * tuned.ki))


def _observed(stage: mh.Stage) -> Callable[[Motion, int], Errors]:
    def run(motion: Motion, seed: int) -> Errors:
        seconds = _seconds(motion)
        done = mh.plant.simulate(
            controller(stage.inverse(DT), GAINS),
            a1().plant(DT, seed),
            motion.reference(seconds),
            target=motion.target(seconds, stage),
            observer=stage.observer(DT, drift=DRIFT),
        )
        return Errors.of(part(done, motion.samples))

    return run


def _slope(stage: mh.Stage) -> float:
    return sum(stage.slope_range) / 2.0


def _learned(stage: mh.Stage) -> Callable[[Motion, int], Errors]:
    def run(motion: Motion, seed: int) -> Errors:
        law, plant = controller(stage.inverse(DT), GAINS), a1().plant(DT, seed)
        reference = motion.reference(motion.samples * DT)
        learning = mh.control.IterativeLearning(
            motion.period_of_target(stage),
            kp=law.kp,
            ki=law.ki,
            slope=_slope(stage),
            dynamics=stage.dynamics,
            bandwidth=BANDWIDTH,
            dt=DT,
        )
        # The first period has the start, which does not repeat.
        mh.plant.simulate(law, plant, reference, target=learning.target)
        for _ in range(int(LEARNING)):
            period = mh.plant.simulate(law, plant, reference, target=learning.target)
            learning.update(period.reference - period.measured)
        times = max(1, round(EVALUATED * RATE / motion.samples))
        target = np.tile(learning.target, times)
        return Errors.of(
            mh.plant.simulate(law, plant, np.tile(reference, times), target=target).metrics
        )

    return run


def _repeated(stage: mh.Stage) -> Callable[[Motion, int], Errors]:
    def run(motion: Motion, seed: int) -> Errors:
        law = controller(stage.inverse(DT), GAINS)
        repetitive = mh.control.RepetitiveControl(
            motion.samples,
            kp=law.kp,
            ki=law.ki,
            slope=_slope(stage),
            dynamics=stage.dynamics,
            bandwidth=BANDWIDTH,
            dt=DT,
        )
        seconds = LEARNING + EVALUATED
        done = mh.plant.simulate(
            law,
            a1().plant(DT, seed),
            motion.reference(seconds),
            target=motion.target(seconds, stage),
            repetitive=repetitive,
        )
        return Errors.of(part(done, round(LEARNING * RATE)))

    return run


def _adapted(stage: mh.Stage) -> Callable[[Motion, int], Errors]:
    def run(motion: Motion, seed: int) -> Errors:
        seconds = LEARNING + EVALUATED
        done = mh.plant.simulate(
            controller(stage.inverse(DT), GAINS),
            a1().plant(DT, seed),
            motion.reference(seconds),
            target=motion.target(seconds, stage),
            identifier=mh.RecursiveIdentifier(
                stage.hysteresis, forgetting=FORGETTING, dynamics=stage.dynamics, dt=DT
            ),
        )
        return Errors.of(part(done, round(LEARNING * RATE)))

    return run


def _noiseless(motion: Motion, _: int) -> Errors:
    plant = a1().replace(noise=None).plant(DT)
    target = motion.target(_seconds(motion), a1())
    return Errors.of(_after_a_period(controller(a1().inverse(DT), GAINS), plant, motion, target))


def _sensor(_: Motion, seed: int) -> Errors:
    """Return the errors at rest, which are noise alone."""
    resting = np.zeros(round(EVALUATED * RATE))
    measured, position = a1().plant(DT, seed).run(resting)
    return Errors.of(mh.plant.Run(measured, measured, position, resting).metrics)


def example(motion: Motion) -> Sequence[tuple[str, mh.plant.Run]]:
    """Return one run of the published law and one of the full scheme, for a figure."""
    seconds = _seconds(motion)
    reference = motion.reference(seconds)
    target = motion.target(seconds, a1())
    paper = controller(mh.paper.table_2().forward(), GAINS)
    full = controller(a1().inverse(DT), GAINS)
    return (
        ("published law", mh.plant.simulate(paper, a1().plant(DT), reference)),
        (
            "exact inverse and inverse dynamics",
            mh.plant.simulate(full, a1().plant(DT), reference, target=target),
        ),
    )


DRIVE_LIMITS = (-500.0, 500.0)  # V
REACHED = 2.5  # um: the actuator reaches this within its limits
_SATURATED_SECONDS = 3.0


@dataclass(frozen=True)
class Saturation:
    """The result of one control law, medians over the seeds."""

    name: str
    law: str
    first: int
    samples: int
    max_error: float
    rmse: float
    shown: mh.plant.Run


def cases() -> Sequence[tuple[str, str, Callable[[], FeedForward], dict[str, Any]]]:
    """Return name, feed-forward and options of every law."""
    table, exact = mh.paper.table_2().forward, lambda: a1().inverse(DT, DRIVE_LIMITS)
    conditional = {"anti_windup": "conditional"}
    back = {"anti_windup": "back_calculation"}
    return (
        ("Table II + P-I", "positional, conditional integration", table, conditional),
        ("Table II + P-I", "positional, back-calculation", table, back),
        ("Table II + P-I", "incremental", table, {"law": "incremental"}),
        ("Table II + P-I", "as printed", table, {"law": "printed"}),
        ("exact inverse + P-I", "positional, conditional integration", exact, conditional),
        ("exact inverse + P-I", "positional, back-calculation", exact, back),
    )


def run_cases(seeds: int, advance: Callable[[], None]) -> list[Saturation]:
    """Simulate all laws."""
    found = []
    for name, law, feedforward, options in cases():
        runs = [_run_case(feedforward(), options, seed) for seed in range(seeds)]
        firsts, counts, maxima, rmse_values = zip(
            *(_after_saturation(run) for run in runs), strict=True
        )
        found.append(
            Saturation(
                name,
                law,
                round(median(list(firsts))),
                round(median(list(counts))),
                median(list(maxima)),
                median(list(rmse_values)),
                runs[0],
            )
        )
        advance()
    return found


class PrintedLaw:
    """Equation (8) as printed: it adds the whole feed-forward to the drive at every sample.

    u(k) = u(k-1) + H^-1[r(k)] + kp (e(k) - e(k-1)) + ki dt e(k), kept within the limits.
    """

    def __init__(self, feedforward: FeedForward) -> None:
        self._feedforward = feedforward
        self._drive, self._error = 0.0, 0.0

    def step(self, reference: float, measurement: float) -> float:
        """Take a sample and return the drive."""
        kp, ki = mh.paper.gains("A1")
        error = reference - measurement
        change = self._feedforward.step(reference) + kp * (error - self._error) + ki * DT * error
        low, high = DRIVE_LIMITS
        self._drive, self._error = min(max(self._drive + change, low), high), error
        return self._drive


def _run_case(feedforward: FeedForward, options: dict[str, Any], seed: int) -> mh.plant.Run:
    law: mh.control.HybridController | PrintedLaw
    if options.get("law") == "printed":
        law = PrintedLaw(feedforward)
    else:
        law = controller(feedforward, mh.paper.gains("A1"), limits=DRIVE_LIMITS, **options)
    return mh.plant.simulate(law, a1().plant(DT, seed), TRIANGLE.reference(_SATURATED_SECONDS))


def _after_saturation(run: mh.plant.Run) -> tuple[float, float, float, float]:
    """Return the first sample at a limit, the number of them, and the errors after that."""
    low, high = DRIVE_LIMITS
    at_limit = (run.drive <= low) | (run.drive >= high)
    first = int(np.argmax(at_limit))
    counted = np.abs(run.reference) <= REACHED
    counted[:first] = False
    arrays = (run.reference, run.measured, run.position, run.drive)
    metrics = mh.plant.Run(*(array[counted] for array in arrays)).metrics
    count = float(at_limit.sum())
    return float(first), count, metrics.max_position_error, metrics.position_rmse
