"""Maps that are chosen by themselves, on stages of other physics that are simulated in small steps.

The magnetostrictive stage follows Jiles and Atherton: J. Magn. Magn. Mater. 61, 48 (1986).
"""

from __future__ import annotations

from functools import cache
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from law_stages import DT as LAW_DT
from law_stages import NOISE, activated_cells, measured, named, varied, way
from support import Array

DT = 0.012  # s
CURRENT = 2.0  # A
LOOP = 4.0  # s, of full stroke


def magnetisation(field: Array) -> Array:
    """Return M / M_s for a field in A/m from the virgin state."""
    shape, coupling, pinning, reversible = 1100.0, 1.6e-3 * 1.6e6, 400.0 / 1.6e6, 0.2
    m, last, out = 0.0, float(field[0]), []
    for h in field.tolist():
        steps = max(1, int(abs(h - last) / 20.0))
        dh = (h - last) / steps
        for _ in range(steps):
            x = (last + coupling * m) / shape
            small = abs(x) < 1e-4
            anhysteretic = x / 3.0 if small else 1.0 / np.tanh(x) - 1.0 / x
            slope = (1.0 / 3.0 if small else 1.0 / x**2 - 1.0 / np.sinh(x) ** 2) / shape
            pull = (anhysteretic - m) * np.sign(dh)
            moved = pull / (pinning * 1.6e6 - coupling * pull) if pull > 0.0 else 0.0
            rate = (1.0 - reversible) * moved + reversible * slope
            m += rate / (1.0 - coupling * reversible * slope) * dh
            last += dh
        out.append(m)
    return np.array(out)


def triangle(ends: list[float], low: float, high: float, start: float) -> Array:
    """Return straight ways from end to end, at the speed of a full loop in `LOOP`."""
    step = 2.0 * (high - low) / LOOP * DT
    ways, last = [np.array([start])], start
    for end in ends:
        ways.append(np.linspace(last, end, max(1, round(abs(end - last) / step)) + 1)[1:])
        last = end
    return np.concatenate(ways)


def decaying(low: float, high: float, start: float) -> tuple[Array, int]:
    """Return full strokes, then smaller and smaller ones, and how many samples to skip."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    sizes = np.repeat(1.0 - np.arange(9) / 9.0, 2) * np.tile([1.0, -1.0], 9)
    first = triangle([high, low], low, high, start)
    ends = (middle + half * sizes).tolist()
    return np.r_[first, triangle(ends, low, high, low)[1:]], first.size


def bouc_wen(drive: Array) -> Array:
    """Return x = u - 0.5 h, dh = du - 0.02 |du| h - 0.01 du |h|."""
    h, last, out = 0.0, float(drive[0]), []
    for u in drive.tolist():
        steps = max(1, int(abs(u - last) / 0.05))
        du = (u - last) / steps
        for _ in range(steps):
            h += du - 0.02 * abs(du) * h - 0.01 * du * abs(h)
        last = u
        out.append(u - 0.5 * h)
    return np.array(out)


def magnet(drive: Array) -> Array:
    return 60.0 * magnetisation(3000.0 * drive)


@cache
def magnetic_records() -> tuple[Array, Array, Array, Array, int]:
    """Return decaying loops with noise, first-order reversal curves without, and what to skip."""
    u, skip = decaying(-CURRENT, CURRENT, 0.0)
    ends = [CURRENT, -CURRENT]
    for reversal in np.linspace(-CURRENT, CURRENT, 8)[1:-1].tolist():
        ends += [CURRENT, reversal]
    unseen = triangle([*ends, CURRENT], -CURRENT, CURRENT, 0.0)
    y = magnet(u)
    noise = np.random.default_rng(1).normal(0.0, 1e-3 * np.ptp(y), u.size)
    return u, y + noise, unseen, magnet(unseen), skip


def unseen_error(found: mh.results.Identification) -> float:
    """Return the error on the curves that were not fitted, in % of the range."""
    _, _, u, y, skip = magnetic_records()
    left = (y - found.stage.forward(DT).run(u))[skip:]
    return float(100.0 * np.std(left) / np.ptp(y))


def test_a_saturating_magnetic_stage_gets_both_maps_from_decaying_loops() -> None:
    u, y, _, _, skip = magnetic_records()
    found = mh.identify(u, y, dt=DT, skip=skip)
    assert found.input_map is not None and found.output_map is not None
    assert unseen_error(found) < 1.5


def test_one_map_that_may_be_there_is_taken_from_decaying_loops() -> None:
    u, y, _, _, skip = magnetic_records()
    found = mh.identify(u, y, dt=DT, skip=skip, input_map=None)
    assert found.output_map is not None
    assert unseen_error(found) < 3.0  # without a map it is more than 10


@pytest.mark.parametrize("decays", [True, False])
def test_a_map_that_may_be_a_loop_shift_is_told(decays: bool) -> None:
    u, skip = decaying(0.0, 100.0, 0.0)
    if not decays:
        sizes = [0.6, 1.0, 0.3, 0.8, 0.45, 0.9, 0.2, 1.0]
        ends = [50.0 + 50.0 * end for size in sizes for end in (size, -size)]
        u = np.r_[u[:skip], triangle(ends, 0.0, 100.0, 0.0)[1:]]
    y = bouc_wen(u)
    y += np.random.default_rng(1).normal(0.0, 1e-3 * np.ptp(y), u.size)
    # A Duhem operator would explain it.
    found = mh.identify(u, y, dt=DT, skip=skip, duhem=None)
    told = [finding for finding in found.warnings if finding.code == "map_not_told"]
    assert bool(told) == decays
    for finding in told:
        assert found.input_map is None and found.output_map is None
        assert "put_map" in finding.hint and "loops grow again" in finding.hint
        assert finding.value > finding.limit == 1.2


def test_the_least_slope_does_not_undo_an_output_map() -> None:
    """Magnetostriction is even, so loops have slopes of zero: the square of a magnetisation."""
    middle, frequency = 1.5, 2.0 * 3.0 / LOOP / (2.0 * np.pi * 1.5) * 1.2
    head = triangle([3.0, 0.0, middle], 0.0, 3.0, 0.0)
    samples = int(10.0 / frequency / DT)
    k = np.arange(samples)
    sine = 1.5 * (1.0 - 0.95 * k / samples) * np.sin(2.0 * np.pi * frequency * DT * k)
    u = np.r_[head, middle + sine]
    y = 10.0 * (magnetisation(2500.0 * u) + 1.0) ** 2
    y += np.random.default_rng(11018).normal(0.0, 1e-3 * np.ptp(y), u.size)
    skip = triangle([3.0, 0.0], 0.0, 3.0, 0.0).size
    asked: dict[str, Any] = {"input_map": None, "output_map": "smooth"}
    assert mh.identify(u, y, dt=DT, skip=skip, **asked).fit.rmse_percent < 1.0


def test_where_no_loop_shift_can_be_told_it_is_no_rival_of_a_map() -> None:
    # Three equal triangles tell no loop shift: a map that halves the error is taken.
    drive = way([0.0, *[50.0, -50.0] * 3, 0.0], 200.0)
    y = activated_cells(drive, LAW_DT)
    y += 5e-4 * np.ptp(y) * np.random.default_rng(1).standard_normal(y.size)
    found = mh.identify(drive, y, dt=LAW_DT)
    assert found.input_map is not None or found.output_map is not None
    assert "map_not_told" not in {one.code for one in found.warnings}
    # On smaller loops it is better than the fit without a map.
    unseen = way([0.0, 40.0, -30.0, 20.0, -10.0, 25.0, -45.0, 5.0], 200.0)
    truth = activated_cells(unseen, LAW_DT)
    plain = mh.identify(drive, y, dt=LAW_DT, input_map=None, output_map=None)
    with_map, without = (np.std(one.predict(unseen) - truth) for one in (found, plain))
    assert with_map < 0.9 * without


def test_a_mode_is_found_behind_the_map_that_hides_it() -> None:
    """A square in front of a mode: no mode explains what plays leave of it without a map."""
    stage = named("mode of a square")
    u = varied(stage)
    y = measured(stage, u)
    without = mh.identify(u, y, dt=LAW_DT, input_map=None, output_map=None)
    assert without.dynamics is None
    found = mh.identify(u, y, dt=LAW_DT)
    assert isinstance(found.dynamics, mh.plant.SecondOrder)
    assert found.dynamics.frequency == pytest.approx(40.0, rel=0.01)
    assert found.dynamics.damping == pytest.approx(0.05, rel=0.05)
    assert found.fit.rmse < 1.5 * NOISE * np.ptp(y)
