"""Chirps and multisines: where they start and end, their frequencies, and how fast they change."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpi_hyst import signals
from support import Array

SWEEPS = st.sampled_from(["linear", "logarithmic"])


@st.composite
def chirps(draw: st.DrawFn) -> tuple[tuple[float, float, float], dict[str, Any]]:
    """The arguments of a chirp: positional and keywords."""
    rate = draw(st.floats(1.0, 1e5))
    shares = draw(st.tuples(st.floats(1e-3, 0.5), st.floats(1e-3, 0.5)))
    keywords = {
        "seconds": draw(st.integers(3, 3000)) / rate,
        "rate": rate,
        "center": draw(st.floats(-1e3, 1e3)),
        "sweep": draw(SWEEPS),
        "taper": draw(st.floats(1e-3, 0.5)),
    }
    return (draw(st.floats(0.0, 1e3)), shares[0] * rate, shares[1] * rate), keywords


@st.composite
def multisines(draw: st.DrawFn) -> dict[str, Any]:
    """The arguments of a multisine."""
    samples = draw(st.integers(8, 400))
    lines = st.lists(st.integers(1, (samples - 1) // 2), min_size=1, max_size=3, unique=True)
    return {
        "amplitude": draw(st.floats(1e-3, 1e3)),
        "lines": draw(lines),
        "samples": samples,
        "periods": draw(st.integers(1, 3)),
        "seed": draw(st.none() | st.integers(0, 2**64 - 1)),
        "fade": draw(st.integers(0, 500)),
        "center": draw(st.floats(-1e3, 1e3)),
    }


@given(chirps())
def test_a_chirp_starts_and_ends_at_its_center_and_keeps_within_its_swing(
    chirp: tuple[tuple[float, float, float], dict[str, Any]],
) -> None:
    (amplitude, *frequencies), keywords = chirp
    u = signals.chirp(amplitude, *frequencies, **keywords)
    center = keywords["center"]
    assert u[0] == center == u[-1]
    assert center - amplitude <= u.min() and u.max() <= center + amplitude


@given(chirps())
def test_a_chirp_changes_no_faster_than_it_says(
    chirp: tuple[tuple[float, float, float], dict[str, Any]],
) -> None:
    (amplitude, first, last), keywords = chirp
    u = signals.chirp(amplitude, first, last, **keywords)
    seconds = (u.size - 1) / keywords["rate"]
    bound = amplitude * (2 * np.pi * max(first, last) + np.pi / (2 * keywords["taper"] * seconds))
    # a step is a difference of two numbers, each with the rounding of a phase of up to 1e4 rad
    rounding = 1e-15 * abs(keywords["center"]) + 1e-11 * amplitude
    assert np.abs(np.diff(u)).max() <= bound / keywords["rate"] + rounding


@given(sweep=SWEEPS, first=st.floats(1.0, 20.0), last=st.floats(1.0, 20.0))
def test_the_frequency_of_a_chirp_sweeps_as_stated(sweep: Any, first: float, last: float) -> None:
    u = signals.chirp(1.0, first, last, seconds=10.0, rate=1e4, sweep=sweep, taper=0.01)
    k = np.flatnonzero((u[:-2] < 0) & (u[1:-1] >= 0)) + 1
    crossings = (k - u[k] / (u[k] - u[k - 1])) / 1e4
    share = 0.5 * (crossings[:-1] + crossings[1:]) * 1e4 / (u.size - 1)
    expected = first + (last - first) * share
    if sweep == "logarithmic":
        expected = first * (last / first) ** share
    # the law is curved within a cycle, the crossings are interpolated
    np.testing.assert_allclose(1.0 / np.diff(crossings), expected, rtol=0.03)


def test_a_chirp_is_the_formula() -> None:
    u = signals.chirp(2.0, 5.0, 80.0, seconds=4.0, rate=1e3, center=1.0, sweep="logarithmic")
    s = np.arange(4000) / 3999
    phase = 2 * np.pi * 5.0 * 3.999 * (16.0**s - 1) / np.log(16.0)
    fade = np.sin(0.5 * np.pi * np.minimum(np.minimum(s, 1 - s) / 0.05, 1.0)) ** 2
    # phases of up to 700 rad, known to 1e-13
    np.testing.assert_allclose(u, 1.0 + 2.0 * fade * np.sin(phase), rtol=0, atol=1e-11)


@given(multisines())
def test_a_multisine_keeps_within_its_swing_and_repeats(options: dict[str, Any]) -> None:
    u = signals.multisine(**options)
    center, amplitude, fade = options["center"], options["amplitude"], options["fade"]
    assert center - amplitude <= u.min() and u.max() <= center + amplitude
    whole = u[fade : u.size - fade].reshape(options["periods"], options["samples"])
    assert np.all(whole == whole[0])
    assert abs(np.abs(whole - center).max() - amplitude) <= 1e-12 * (amplitude + abs(center))
    assert fade == 0 or (u[0] == center == u[-1])


@given(multisines())
def test_a_multisine_has_the_lines_asked_for_and_no_others(options: dict[str, Any]) -> None:
    period = signals.multisine(**{**options, "periods": 1, "fade": 0})
    sizes = np.abs(np.fft.rfft((period - options["center"]) / options["amplitude"]))
    sizes /= options["samples"]
    wanted = np.zeros_like(sizes)
    wanted[options["lines"]] = sizes[options["lines"][0]]
    assert wanted.max() > 0.05
    # the center leaves a rounding in every sample
    rounding = 1e-12 * (1 + abs(options["center"]) / options["amplitude"])
    np.testing.assert_allclose(sizes, wanted, rtol=0, atol=rounding)


def test_schroeder_phases_have_a_low_crest_factor() -> None:
    crest = {
        seed: 1.0
        / np.sqrt(np.mean(signals.multisine(1.0, range(1, 101), samples=1000, seed=seed) ** 2))
        for seed in (None, 1)
    }
    assert crest[None] < 2.0 < crest[1] < 4.5


REFUSED: list[tuple[Callable[[], Array], str]] = [
    (
        lambda: signals.chirp(1, 1, 51, seconds=1, rate=100),
        "stop_frequency: expected a number above",
    ),
    (
        lambda: signals.chirp(1, 0, 5, seconds=1, rate=100),
        "start_frequency: expected a number above",
    ),
    (lambda: signals.chirp(1, 1, 5, seconds=-1), "seconds: expected a finite number, 0 or more"),
    (
        lambda: signals.chirp(1, 1, 5, seconds=1, taper=0),
        "taper: expected a number above 0, at most",
    ),
    (lambda: signals.chirp(1, 1, 5, seconds=1, sweep="up"), 'sweep: expected "linear" or "logar'),  # type: ignore[arg-type]
    (lambda: signals.multisine(1, [], samples=9), "lines: expected at least one line"),
    (lambda: signals.multisine(1, [5], samples=10), "lines: expected whole numbers above 0, below"),
    (lambda: signals.multisine(1, [2, 2], samples=10), "lines: expected every line once"),
    (
        lambda: signals.multisine(1, [2], samples=0),
        "samples: expected a whole number of at least one",
    ),
    (lambda: signals.multisine(1, [2], samples=9, periods=10**9), "periods: expected at most"),
    (lambda: signals.multisine(1, [2], samples=9, seed=-1), "seed: expected a whole number of at"),
    (lambda: signals.multisine(1, [2], samples=9, fade=-1), "fade: expected a whole number of at"),
]


@pytest.mark.parametrize(("make", "message"), REFUSED)
def test_what_no_signal_can_have_is_named(make: Callable[[], Array], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}.*, got "):
        make()


def test_lines_are_whole_numbers() -> None:
    with pytest.raises(TypeError, match=r"^lines: expected whole numbers above 0, got \[1\.5\]"):
        signals.multisine(1.0, [1.5], samples=9)  # type: ignore[list-item]
