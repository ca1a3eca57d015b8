"""Stages of other physics, identified with default settings from one experiment alone."""

from __future__ import annotations

from functools import cache

import mpi_hyst as mh
import numpy as np
import pytest
from physics import DAMPING, DEAD_TIME, HIGH, STAGES, STROKE, Bench, PhysicalStage
from support import Array

DT = 1e-3  # s
PERIOD = 1000  # samples of a raster

# % of the stroke, rms, on a raster that was not seen: in the class of the model, and beside it.
INSIDE, BESIDE = 0.10, 0.40
BESIDE_CLASS = ("Bouc-Wen, slow amplifier", "thresholds that grow with speed")
# % of the stroke, rms: with feedback, and in the tenth period of learning. No weights follow
# thresholds that grow with speed.
FEEDBACK, LEARNED = 0.03, 0.012
FEEDBACK_BESIDE = {"thresholds that grow with speed": 0.05}
LEARNED_BESIDE = {"thresholds that grow with speed": 0.04}


SLOW = ("a mode at 60 Hz", "thresholds that grow with speed")
EVERY = [pytest.param(one, marks=pytest.mark.slow if one in SLOW else ()) for one in STAGES]


@cache
def identified(name: str) -> mh.results.Identification:
    parts = mh.signals.experiment(0.0, HIGH, slew=500.0, rate=100.0, fast_rate=1.0 / DT)
    records = [
        (part.drive, STAGES[name].measured(part.drive, 1.0 / part.rate, seed=number))
        for number, part in enumerate(parts)
    ]
    return mh.identify(records, dt=[1.0 / part.rate for part in parts])


@pytest.mark.parametrize("name", EVERY)
def test_an_experiment_tells_the_whole_stage(name: str) -> None:
    found, truth = identified(name), STAGES[name]
    assert isinstance(found.dynamics, mh.plant.SecondOrder)
    assert found.dynamics.frequency == pytest.approx(truth.frequency, rel=0.002)
    assert found.dynamics.damping == pytest.approx(DAMPING, rel=0.1)
    told = {finding.code for finding in found.warnings}
    assert found.dead_time is not None
    off = abs(found.dead_time - DEAD_TIME) * 100.0  # samples of the slow records
    assert off < 0.1 or told & {"dead_time_confounded", "dead_time_undetermined"}, off
    assert open_loop_error(found.stage, truth) < (BESIDE if name in BESIDE_CLASS else INSIDE)


@pytest.mark.parametrize("name", EVERY)
def test_feedback_and_learning_follow_a_raster(name: str) -> None:
    stage = identified(name).stage.replace(limits=(0.0, HIGH))
    with_feedback = loop_errors(stage, STAGES[name], periods=3)
    assert with_feedback[-1] < FEEDBACK_BESIDE.get(name, FEEDBACK)
    learned = loop_errors(stage, STAGES[name], periods=10, learns=True)
    assert learned[-1] < LEARNED_BESIDE.get(name, LEARNED)


def raster(periods: int) -> Array:
    """Return a 1 Hz raster of 70 % of the stroke, from its lowest position on."""
    phase = np.sin(2.0 * np.pi * np.arange(periods * PERIOD) / PERIOD - 0.5 * np.pi)
    wave: Array = np.arcsin(0.98 * phase) / np.arcsin(0.98)
    return 0.5 * STROKE + 0.35 * STROKE * wave


def error(position: Array, target: Array) -> float:
    """Return the rms error in % of the stroke."""
    return 100.0 * float(np.sqrt(np.mean((position - target) ** 2))) / STROKE


def open_loop_error(stage: mh.Stage, truth: PhysicalStage) -> float:
    """Return the error of a raster after feed-forward."""
    target = raster(5)
    drive = stage.replace(limits=(0.0, HIGH)).precompensate(target, dt=DT, lead_in=1.0)
    return error(Bench(truth, DT).positions(drive)[-target.size :], target)


def loop_errors(
    stage: mh.Stage, truth: PhysicalStage, periods: int, *, learns: bool = False
) -> list[float]:
    """Return the error of every period of a raster with preview and feedback."""
    controller, bench = stage.controller(DT, feedforward="preview"), Bench(truth, DT)
    assert controller.preview is not None
    ahead, wave = controller.preview.ahead, raster(1)
    learning = stage.iterative_learning(wave, DT) if learns else None
    way = np.r_[np.linspace(0.0, wave[0], PERIOD), np.full(300, wave[0])]
    coming = np.r_[way, np.tile(wave, periods + 1)]
    for k in range(way.size):
        bench.write(controller.step(coming[k + ahead], bench.read()))
    errors = []
    for period in range(periods):
        start = way.size + period * PERIOD
        measured, position = np.empty(PERIOD), np.empty(PERIOD)
        correction = learning.correction if learning is not None else np.zeros(PERIOD)
        for k in range(PERIOD):
            measured[k], position[k] = bench.read(), bench.position
            reference = coming[start + k + ahead]
            bench.write(controller.step(reference, measured[k], correction=correction[k]))
        errors.append(error(position, wave))
        if learning is not None:
            learning.update(wave - measured)
    return errors
