"""Controllers and observers over arrays: references or drives, and measurements beside them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from support import Array, bits

DT = 1e-4
STAGE = mh.Stage(
    mh.paper.table_1_recovered(),
    limits=(-500.0, 500.0),
    dynamics=mh.plant.SecondOrder(800.0, 0.02),
    dead_time=DT,
    noise=0.01,
)
NUMBERS = np.random.default_rng(1)
FIRST: Array = 2.0 * np.sin(0.01 * np.arange(3000))
MEASURED: Array = FIRST + NUMBERS.normal(0.0, 0.1, FIRST.size)
MEASURED[[70, 900, 901]] = np.nan
CASES: dict[str, Callable[[], Any]] = {
    "references": lambda: STAGE.controller(DT),
    "drives": lambda: STAGE.observer(DT, drift=1.0),
}


@pytest.mark.parametrize("name", CASES)
def test_arrays_are_taken_like_samples(name: str) -> None:
    one, others = CASES[name](), [CASES[name]() for _ in range(3)]
    expected = bits([one.step(x, y) for x, y in zip(FIRST, MEASURED, strict=True)])
    assert bits(others[0].run(FIRST, MEASURED)) == expected
    into = np.empty_like(FIRST)
    assert others[1].run(FIRST, MEASURED, into) is into
    in_place = FIRST.copy()
    others[2].run(in_place, MEASURED, out=in_place)
    assert bits(into) == bits(in_place) == expected
    for other in others:
        assert other.state == one.state


@pytest.mark.parametrize("name", CASES)
def test_arrays_that_do_not_fit_are_refused(name: str) -> None:
    one = CASES[name]()
    before = one.state
    with pytest.raises(ValueError, match=f"^measurements: expected 3000 elements, as in {name}, "):
        one.run(FIRST, MEASURED[:-1])
    measured = MEASURED.copy()
    with pytest.raises(ValueError, match=r"^out: expected another array than measurements"):
        one.run(FIRST, measured, out=measured)
    with pytest.raises(ValueError, match=r"^out: expected 3000 elements"):
        one.run(FIRST, MEASURED, out=np.empty(7))
    with pytest.raises(TypeError, match=rf"^{name}: expected"):
        one.run("volts", MEASURED)
    assert one.state == before
