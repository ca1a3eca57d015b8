"""Beyond the paper: schemes on plant A1 with its noise, judged by the true position.

Every scheme is judged over one second: after the first period, or after three periods or seconds
of learning. The reference may be led through inverse dynamics, and model and dynamics be wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

import mpi_hyst as mh
from mpi_hyst._paper.benchmark import (
    DT,
    LIMITS,
    NOISE,
    RATE,
    STAGE,
    TRIANGLE,
    Belief,
    Motion,
    beliefs,
    controller,
    median,
    part,
    whole_sine,
)
from mpi_hyst._types import Samples

JUDGED = 1.0  # s
LEARNING = 3.0  # s, or periods
BANDWIDTH = 150.0  # Hz, up to which is learned
DRIFT = 0.5  # um in a second: what the observer's model may not know
FORGETTING = 0.9999
AHEAD = 4  # samples that a preview sees
MOTIONS = (TRIANGLE, *(whole_sine(f) for f in (5.0, 10.0, 15.0, 20.0, 50.0, 100.0)))
GAINS = mh.paper.gains("A1")


@dataclass(frozen=True)
class Floor:
    """Largest and root mean square of an error, um."""

    max: float
    rms: float

    @classmethod
    def of(cls, metrics: mh.plant.Metrics) -> Floor:
        """Take the error of the true position."""
        return cls(metrics.max_position_error, metrics.position_rmse)


@dataclass(frozen=True)
class Scheme:
    """A way to control, and what the controller takes the actuator for."""

    name: str
    believes: str
    run: Callable[[Motion, int], Floor]


@dataclass(frozen=True)
class Outcome:
    """What a scheme leaves at each motion, median over the seeds."""

    name: str
    believes: str
    errors: dict[str, Floor]


def schemes() -> list[Scheme]:
    """Return them all, from the paper's to those that learn, and the floors last."""
    named = beliefs()
    right, model, both = named["right"], named["model wrong"], named["both wrong"]
    inverse, dynamics = "exact inverse", "inverse dynamics"
    full = f"{inverse}, {dynamics}"
    return [
        Scheme("the paper's law: Table II + P-I", "-", _published),
        Scheme(f"{inverse} + same P-I", "right", _without_dynamics),
        *(Scheme(f"{full} + same P-I", belief.name, _shaped(belief)) for belief in named.values()),
        Scheme(f"the same, {AHEAD} samples of preview", "right", _previewed(right)),
        *(Scheme("tuned gains", belief.name, _tuned(belief, 1.0, 1.0)) for belief in (right, both)),
        Scheme("half the tuned kp, a quarter of ki", both.name, _tuned(both, 0.5, 0.25)),
        *(Scheme("observer", belief.name, _observed(belief)) for belief in (right, both)),
        Scheme("iterative learning, 3 periods", both.name, _learned(both)),
        Scheme("repetitive control, 3 s", both.name, _repeated(both)),
        *(Scheme("adaptation, 3 s", belief.name, _adapted(belief)) for belief in (model, both)),
        Scheme("floor: right, without noise", "right", _noiseless(right)),
        Scheme("floor: the sensor noise itself", "-", _sensor),
    ]


def outcomes(seeds: int, advance: Callable[[], None]) -> list[Outcome]:
    """Run all schemes along all motions."""
    found = []
    for scheme in schemes():
        errors = {}
        for motion in MOTIONS:
            floors = [scheme.run(motion, seed) for seed in range(seeds)]
            errors[motion.name] = Floor(
                median([floor.max for floor in floors]), median([floor.rms for floor in floors])
            )
            advance()
        found.append(Outcome(scheme.name, scheme.believes, errors))
    return found


def outcomes_to_run() -> int:
    """Return how many steps `outcomes` takes: for a progress bar."""
    return len(schemes()) * len(MOTIONS)


def _plant(seed: int) -> mh.plant.Plant:
    return mh.paper.plant("A1", seed=seed)


def _after_a_period(
    law: mh.control.HybridController,
    plant: mh.plant.Plant,
    motion: Motion,
    target: Samples | None = None,
) -> mh.plant.Metrics:
    reference = motion.reference(_seconds(motion))
    return part(mh.plant.simulate(law, plant, reference, target=target), motion.samples)


def _seconds(motion: Motion) -> float:
    return motion.samples * DT + JUDGED


def _published(motion: Motion, seed: int) -> Floor:
    law = controller(mh.paper.table_2().forward(), GAINS)
    return Floor.of(_after_a_period(law, _plant(seed), motion))


def _without_dynamics(motion: Motion, seed: int) -> Floor:
    law = controller(beliefs()["right"].inverse(), GAINS)
    return Floor.of(_after_a_period(law, _plant(seed), motion))


def _shaped(belief: Belief, gains: tuple[float, float] = GAINS) -> Callable[[Motion, int], Floor]:
    def run(motion: Motion, seed: int) -> Floor:
        target = motion.target(_seconds(motion), belief.dynamics)
        law = controller(belief.inverse(), gains)
        return Floor.of(_after_a_period(law, _plant(seed), motion, target))

    return run


def _previewed(belief: Belief) -> Callable[[Motion, int], Floor]:
    def run(motion: Motion, seed: int) -> Floor:
        preview = mh.control.preview(belief.dynamics, DT, ahead=AHEAD)
        law = controller(belief.inverse(), GAINS, preview=preview)
        # At the end of the record there is nothing more to see ahead, and a corner for the window.
        reference = motion.reference(_seconds(motion) + 4 * AHEAD * DT)
        done = mh.plant.simulate(law, _plant(seed), reference)
        return Floor.of(part(done, motion.samples, -4 * AHEAD))

    return run


def _tuned(belief: Belief, of_kp: float, of_ki: float) -> Callable[[Motion, int], Floor]:
    tuned = mh.control.tune(belief.model, dt=DT, dynamics=belief.dynamics)
    return _shaped(belief, (of_kp * tuned.kp, of_ki * tuned.ki))


def _observed(belief: Belief) -> Callable[[Motion, int], Floor]:
    def run(motion: Motion, seed: int) -> Floor:
        seconds = _seconds(motion)
        observer = mh.control.Observer(
            belief.model, dynamics=belief.dynamics, noise=NOISE, drift=DRIFT
        )
        done = mh.plant.simulate(
            controller(belief.inverse(), GAINS),
            _plant(seed),
            motion.reference(seconds),
            target=motion.target(seconds, belief.dynamics),
            observer=observer,
        )
        return Floor.of(part(done, motion.samples))

    return run


def _slope(belief: Belief) -> float:
    return sum(belief.model.slope_range) / 2.0


def _learned(belief: Belief) -> Callable[[Motion, int], Floor]:
    def run(motion: Motion, seed: int) -> Floor:
        law, plant = controller(belief.inverse(), GAINS), _plant(seed)
        reference = motion.reference(motion.samples * DT)
        learning = mh.control.IterativeLearning(
            motion.period_of_target(belief.dynamics),
            kp=law.kp,
            ki=law.ki,
            slope=_slope(belief),
            dynamics=belief.dynamics,
            bandwidth=BANDWIDTH,
        )
        # The first period is the start, which does not come again.
        mh.plant.simulate(law, plant, reference, target=learning.target)
        for _ in range(int(LEARNING)):
            period = mh.plant.simulate(law, plant, reference, target=learning.target)
            learning.update(period.reference - period.measured)
        times = max(1, round(JUDGED * RATE / motion.samples))
        target = np.tile(learning.target, times)
        return Floor.of(
            mh.plant.simulate(law, plant, np.tile(reference, times), target=target).metrics
        )

    return run


def _repeated(belief: Belief) -> Callable[[Motion, int], Floor]:
    def run(motion: Motion, seed: int) -> Floor:
        law = controller(belief.inverse(), GAINS)
        repetitive = mh.control.RepetitiveControl(
            motion.samples,
            kp=law.kp,
            ki=law.ki,
            slope=_slope(belief),
            dynamics=belief.dynamics,
            bandwidth=BANDWIDTH,
        )
        seconds = LEARNING + JUDGED
        done = mh.plant.simulate(
            law,
            _plant(seed),
            motion.reference(seconds),
            target=motion.target(seconds, belief.dynamics),
            repetitive=repetitive,
        )
        return Floor.of(part(done, round(LEARNING * RATE)))

    return run


def _adapted(belief: Belief) -> Callable[[Motion, int], Floor]:
    def run(motion: Motion, seed: int) -> Floor:
        seconds = LEARNING + JUDGED
        done = mh.plant.simulate(
            controller(belief.inverse(), GAINS),
            _plant(seed),
            motion.reference(seconds),
            target=motion.target(seconds, belief.dynamics),
            identifier=mh.RecursiveIdentifier(
                belief.model, forgetting=FORGETTING, dynamics=belief.dynamics
            ),
        )
        return Floor.of(part(done, round(LEARNING * RATE)))

    return run


def _noiseless(belief: Belief) -> Callable[[Motion, int], Floor]:
    def run(motion: Motion, _: int) -> Floor:
        plant = mh.plant.Plant(mh.paper.table_1_recovered(), dynamics=STAGE, limits=LIMITS)
        target = motion.target(_seconds(motion), belief.dynamics)
        law = controller(belief.inverse(), GAINS)
        return Floor.of(_after_a_period(law, plant, motion, target))

    return run


def _sensor(_: Motion, seed: int) -> Floor:
    """Let the plant rest: what is measured then is noise alone."""
    resting = np.zeros(round(JUDGED * RATE))
    measured, position = _plant(seed).run(resting)
    return Floor.of(mh.plant.Run(measured, measured, position, resting).metrics)


def example(motion: Motion) -> Sequence[tuple[str, mh.plant.Run]]:
    """Return one run of the paper's law and one of the full scheme, for a picture."""
    right = beliefs()["right"]
    seconds = _seconds(motion)
    reference = motion.reference(seconds)
    target = motion.target(seconds, right.dynamics)
    paper = controller(mh.paper.table_2().forward(), GAINS)
    full = controller(right.inverse(), GAINS)
    return (
        ("the paper's law", mh.plant.simulate(paper, _plant(0), reference)),
        (
            "exact inverse and inverse dynamics",
            mh.plant.simulate(full, _plant(0), reference, target=target),
        ),
    )
