"""Filters of the feedback: their responses, their coefficients, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import signal
from support import bits

DT = 1e-4
LIMITS = (-10.0, 10.0)
FREQUENCIES = st.floats(1.0, 4900.0)
DAMPINGS = st.floats(1e-3, 5.0)
Filter = mh.control.Notch | mh.control.LowPass | mh.control.Lead | mh.control.Biquad


def controller(**keywords: Any) -> mh.control.HybridController:
    given = {"kp": 0.1, "ki": 10.0, "dt": DT, "limits": LIMITS, **keywords}
    return mh.control.HybridController(None, **given)


def bilinear(b: list[float], a: list[float], frequency: float) -> tuple[list[float], list[float]]:
    """Return the transform of scipy of a filter whose own frequency in rad/s is 1, prewarped."""
    rate = 0.5 / np.tan(np.pi * frequency * DT)
    numerator, denominator = signal.bilinear(b, a, rate)
    pad = [0.0] * (3 - len(numerator))
    return [*numerator, *pad], [*denominator[1:], *pad]


@given(FREQUENCIES, st.floats(0.0, 5.0), DAMPINGS)
def test_sections_are_the_bilinear_transform(f: float, depth: float, width: float) -> None:
    cases: list[tuple[Filter, list[float], list[float]]] = [
        (mh.control.Notch(f, depth, width), [1.0, 2 * depth, 1.0], [1.0, 2 * width, 1.0]),
        (mh.control.LowPass(f, width), [1.0], [1.0, 2 * width, 1.0]),
        (mh.control.LowPass(f), [1.0], [1.0, 1.0]),
    ]
    for one, b, a in cases:
        section, (numerator, denominator) = one.section(DT), bilinear(b, a, f)
        # scipy multiplies polynomials out: a few roundings of coefficients of a few units.
        assert section.b == pytest.approx(numerator, rel=1e-9, abs=1e-12)
        assert section.a == pytest.approx(denominator, rel=1e-9, abs=1e-12)


@given(FREQUENCIES, FREQUENCIES, DAMPINGS)
def test_at_its_own_frequency_a_filter_is_the_continuous_one(
    f: float, other: float, zeta: float
) -> None:
    own = [f, 0.0]
    notch = mh.control.Notch(f, 0.25 * zeta, zeta).response(own, DT)
    np.testing.assert_allclose(notch, [0.25, 1.0], rtol=1e-6)
    second = mh.control.LowPass(f, zeta).response(own, DT)
    np.testing.assert_allclose(second, [1.0 / (2j * zeta), 1.0], rtol=1e-6)
    np.testing.assert_allclose(
        mh.control.LowPass(f).response(own, DT), [1 / (1 + 1j), 1.0], rtol=1e-9
    )
    # A lead has two frequencies of its own: at its zero the numerator is 1 + i.
    lead = mh.control.Lead(f, other).response([f], DT)[0] * (
        1 + 1j * np.tan(np.pi * f * DT) / np.tan(np.pi * other * DT)
    )
    assert lead == pytest.approx(1 + 1j, rel=1e-9)


def test_a_controller_has_the_sections_of_its_filters() -> None:
    notch, slow = mh.control.Notch(800.0, 0.02, 1.0), mh.control.LowPass(2000.0)
    made = controller(filters=[notch, slow])
    assert made.filters == (notch.section(DT), slow.section(DT))
    assert controller(filters=notch).filters == (notch.section(DT),)
    assert controller().filters == ()
    again = controller(filters=made.filters)
    made.step(1.0, 0.0)
    again.state = made.state
    assert again.step(2.0, 0.5) == made.step(2.0, 0.5)


def test_the_terms_show_what_the_filters_make_of_the_error() -> None:
    slow = mh.control.LowPass(100.0)
    made = controller(filters=slow)
    made.step(0.0, 0.0)
    made.step(1.0, 0.0)
    assert made.terms.error == 1.0
    assert made.terms.filtered_error == slow.section(DT).b[0]
    assert made.terms.proportional == 0.1 * slow.section(DT).b[0]


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (
            lambda: mh.control.Notch(0.0, 0.1, 1.0),
            ValueError,
            "frequency: expected a finite number",
        ),
        (lambda: mh.control.Notch(8.0, -0.1, 1.0), ValueError, "depth: expected 0 to 100"),
        (lambda: mh.control.Notch(8.0, 0.1, 0.0), ValueError, "width: expected a damping ratio"),
        (lambda: mh.control.LowPass(8.0, np.nan), ValueError, "damping: expected a damping ratio"),
        (lambda: mh.control.Lead(8.0, np.inf), ValueError, "pole: expected a finite number"),
        (
            lambda: mh.control.Notch(800.0, 0.1, 1.0).section(1e-3),
            ValueError,
            "frequency: expected a number below half of the sampling rate = 500.0, got 800.0",
        ),
        (
            lambda: controller(filters=mh.control.LowPass(6000.0)),
            ValueError,
            "frequency: expected a number below half of the sampling rate = 5000.0, got 6000.0",
        ),
        (
            lambda: mh.control.Biquad([1.0, 0.0, 0.0], [0.0, 1.0]),
            ValueError,
            r"a\[1\]: expected a stable section",
        ),
        (
            lambda: controller(filters=["notch"]),
            TypeError,
            "filters: expected Notch, LowPass, Lead, Biquad, or a list of them, got 'notch'",
        ),
        (
            lambda: controller(filters=[mh.control.LowPass(100.0)] * 7),
            ValueError,
            "sections: expected at most 6 sections, got 7",
        ),
        (lambda: controller(kp=-0.1), ValueError, "kp: expected a finite number >= 0, got -0.1"),
        (
            lambda: controller(kp=-0.1, filters=mh.control.LowPass(100.0)).set_filters([]),
            ValueError,
            "kp: expected a finite number >= 0, got -0.1",
        ),
    ],
)
def test_what_is_no_filter_is_refused(
    make: Callable[[], object], error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=f"^{message}"):
        make()


@given(st.lists(st.floats(-10.0, 10.0) | st.just(np.nan), max_size=40))
def test_a_filter_takes_arrays_like_samples(samples: list[float]) -> None:
    filters: list[Filter] = [mh.control.Notch(800.0, 0.02, 1.0), mh.control.LowPass(300.0)]
    one, other = mh.control.Filter(filters, DT), mh.control.Filter(filters, DT)
    peeked, stepped = [], []
    for x in samples:
        peeked.append(one.peek(x))
        stepped.append(one.step(x))
    assert bits(peeked) == bits(stepped) == bits(other.run(samples))
    assert one.state == other.state
    assert one.rejected == other.rejected == sum(np.isnan(samples))
    finite = [x for x in samples if np.isfinite(x)]
    sections = np.array([[*f.section(DT).b, 1.0, *f.section(DT).a] for f in filters])
    if finite:
        expected = signal.sosfilt(sections, finite)
        np.testing.assert_allclose(
            mh.control.Filter(filters, DT).run(finite), expected, rtol=1e-9, atol=1e-12
        )


def test_a_filter_changes_without_a_jump_and_goes_on_from_a_state() -> None:
    one = mh.control.Filter(mh.control.LowPass(300.0), DT)
    one.run([1.0, 2.0, 0.5])
    state, last = one.state, one.peek(0.5)
    one.set_filters(mh.control.LowPass(30.0))
    assert one.filters == (mh.control.LowPass(30.0).section(DT),)
    assert one.step(0.5) == pytest.approx(state["output"], rel=1e-12)
    one.set_filters(mh.control.LowPass(300.0))
    one.state = state
    assert one.step(0.5) == last
