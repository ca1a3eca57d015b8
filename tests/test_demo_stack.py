"""What the demo shows of the measured stack: errors on a record that was not fitted."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from mpi_hyst._paper import demo
from mpi_hyst._report.demo import report, stack_cards, stack_errors, stack_values


@pytest.fixture(scope="module")
def measured() -> demo.MeasuredStack:
    told: list[str] = []

    @contextmanager
    def watch(what: str, unit: str) -> Iterator[demo.Progress | None]:
        told.append(f"{what} in {unit}")
        yield None

    found = demo.compute_stack(watch)
    assert told == [f"measured stack, {name} model in µm" for name in ("modified", "conventional")]
    return found


def test_the_model_predicts_the_record_that_it_has_not_seen(measured: demo.MeasuredStack) -> None:
    assert measured.fitted.name == "decaying_loops" and measured.unseen.name == "major_loops"
    line, conventional, modified = (one.unseen for one in measured.predictions)
    # The noise of the sensor is a bound from below; measured 0.132, 0.320 and 3.404 um rms.
    assert (
        demo.STACK_NOISE[0] < modified.rms < 0.14 < 0.3 < conventional.rms < 0.35 < 3.0 < line.rms
    )
    assert modified.base == pytest.approx(45.59, abs=0.01)  # um
    for one in measured.predictions:
        assert one.fitted.rms < one.unseen.rms
        kept = slice(measured.unseen.skip, None)
        residuals = (measured.unseen.y - one.output)[kept]
        assert np.sqrt(np.mean(residuals**2)) == pytest.approx(one.unseen.rms, rel=1e-12)
        # Each has the offset that suits the record: without it a line would look worse than it is.
        assert abs(residuals.mean()) < 0.02


def test_the_page_says_what_was_computed(measured: demo.MeasuredStack) -> None:
    shown = stack_values(measured)
    _, rows = stack_errors(measured)
    assert len(rows) == 6 and [row[1] for row in rows[:3]] == [row[1] for row in rows[3:]]
    assert (
        shown["stack_errors"][1] == rows
        and [rows[index][1] for index in shown["best_of_stack"]]
        == ["modified model (coupled plays)"] * 2
    )
    page = " ".join(report(measured, demo.compute(), Path("demo")).split())
    assert [card.value in page for card in stack_cards(measured)] == [True, True]
    for words in (
        *(cell for row in rows for cell in row),
        *("Measured, not simulated", "yan9a/DiscreteBacklashOperator", "0.065 to 0.072 µm rms"),
        f"{measured.modified.unseen.rms:.3f} µm",
        f"{measured.line.unseen.rms:.3f} µm",
    ):
        assert words in page
