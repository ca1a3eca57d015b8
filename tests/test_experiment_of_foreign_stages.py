"""`identify` by default on the whole experiment of `excite`, on stages that are simulated here."""

from __future__ import annotations

import math
from collections.abc import Callable

import mpi_hyst as mh
import numpy as np
import pytest
from law_stages import lagged, plays, preisach
from support import Array

LOW, HIGH = 0.0, 150.0  # V
NOISE = 0.05  # um
FREQUENCY, DAMPING = 900.0, 0.03


def uneven_plays(u: Array) -> Array:
    """Plays between the thresholds that a fit has."""
    thresholds = np.linspace(0.0, 67.5, 19)
    return plays(u, thresholds, np.r_[0.6, 0.04 * np.exp(-thresholds[1:] / 37.5)])


def relays(u: Array) -> Array:
    return 1.5 * preisach((u - 75.0) / 1.5)


def behind_mode(x: Array, dt: float) -> Array:
    """Return x, held from sample to sample, behind a mode: the exact solution."""
    w = 2.0 * math.pi * FREQUENCY
    wd, decay = w * math.sqrt(1.0 - DAMPING**2), math.exp(-DAMPING * w * dt)
    c, s = decay * math.cos(wd * dt), decay * math.sin(wd * dt)
    a, b = c + DAMPING * w / wd * s, s / wd
    e, f = -w * w * s / wd, c - DAMPING * w / wd * s
    p, v, out = x[0], 0.0, np.empty(x.size)
    for k, now in enumerate(x.tolist()):
        out[k] = p
        p, v = now + a * (p - now) + b * v, e * (p - now) + f * v
    return out


def with_creep(x: Array, dt: float) -> Array:
    slow = [lagged(x, time, dt) - x[0] for time in (0.1, 1.0, 10.0)]
    return np.asarray(x + 0.01 * np.sum(slow, axis=0))


def position(hysteresis: Callable[[Array], Array], u: Array, dt: float) -> Array:
    return behind_mode(with_creep(hysteresis(u), dt), dt)


def identified(hysteresis: Callable[[Array], Array]) -> mh.results.Identification:
    experiment = mh.signals.experiment(LOW, HIGH, slew=2000.0, rate=1000.0, fast_rate=10_000.0)
    random, records = np.random.default_rng(2), []
    for record in experiment:
        u = np.asarray(record.drive)
        y = position(hysteresis, u, 1.0 / record.rate)
        records.append((u, y + random.normal(0.0, NOISE, u.size)))
    return mh.identify(records, dt=[1.0 / record.rate for record in experiment])


def off_on_another_drive(
    found: mh.results.Identification, hysteresis: Callable[[Array], Array]
) -> float:
    """Return the error without noise, rms, as a share of the range."""
    dt = 5e-4
    t = np.arange(20_000) * dt
    u = 75.0 - 75.0 * np.cos(8.2 * t) * (0.6 + 0.4 * np.cos(0.6 * t))
    true = position(hysteresis, u, dt)
    left = (np.asarray(found.predict(u, dt=dt)) - true)[4000:]
    return float(np.std(left) / np.ptp(true))


# A minute of processor: `tests/test_law_of_the_default.py` looks at the same on short records.
@pytest.mark.slow
def test_uneven_plays_have_no_amplifier_that_stands_for_what_they_lack() -> None:
    found = identified(uneven_plays)
    assert found.fit.rmse < 1.02 * NOISE
    assert found.stage.amplifier_bandwidth is None
    assert off_on_another_drive(found, uneven_plays) < 3e-4


# A minute of processor. Where the output map that they need was linear about the weights of another
# fit, 1.8 % were left in sample.
@pytest.mark.slow
def test_relays_behind_a_mode_are_fitted_as_well_as_their_maps_allow() -> None:
    found = identified(relays)
    assert found.fit.rmse < 5e-3 * np.ptp(found.position_range)
    assert off_on_another_drive(found, relays) < 5e-3
