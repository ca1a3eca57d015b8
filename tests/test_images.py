"""Places from images and fringes: simulated scans of an unknown sample, by other code."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import mpi_hyst as mh
import numpy as np
import pytest
from reference.models import PrandtlIshlinskii as ReferenceModel
from support import Array

# What types would refuse.
WRONG: Any = "x"
NONE: Any = None

pytest.importorskip("skimage", reason="the extra `images` is not installed")

WEIGHTS = [0.6, 0.1, 0.1, 0.1, 0.09, 0.08]
THRESHOLDS = [0.0, 0.15, 0.4, 0.8, 1.2, 1.7]
MIDDLE = 1.0
"""V, where the drive of the first scan has its middle."""


def stage(drive: Array) -> Array:
    model = ReferenceModel(WEIGHTS, THRESHOLDS, input_offset=MIDDLE)
    return np.array([model.step(u) for u in drive])


@dataclass
class Scan:
    """A scan of so many lines, and where its samples truly were."""

    drive: Array
    position: Array
    trace: Array
    retrace: Array
    lead: int


def scan(size: float, middle: float, pixels: int, seed: int, noise: float = 0.05) -> Scan:
    """Triangles about the middle after a way from rest; heights with noise, drift of the lines."""
    rng = np.random.default_rng(seed)
    there = np.linspace(-1.0, 1.0, pixels)
    line = np.concatenate([there, there[::-1]])
    lead = np.concatenate([np.linspace(0, 1, pixels // 2), np.linspace(1, -1, pixels)])
    drive = middle + size * np.concatenate([lead, np.tile(line, pixels)])
    # The loops of plays close after one period.
    settled = stage(middle + size * np.concatenate([lead, line, line]))
    position = np.concatenate([settled, np.tile(settled[-2 * pixels :], pixels - 2)])
    at = position[lead.size :].reshape(pixels, 2, pixels)
    # An unknown sample: waves of many lengths, which change slowly from line to line.
    waves = np.random.default_rng(99)
    pitch = np.exp(waves.uniform(np.log(0.15), np.log(1.5), 40))
    phase = waves.uniform(0, 2 * np.pi, 40)
    turn = waves.normal(0.0, 3.0, 40)
    along = np.arange(pixels)[:, None, None] / pixels
    height = sum(
        np.sin(2 * np.pi * at / p + f + t * along)
        for p, f, t in zip(pitch, phase, turn, strict=True)
    ) / np.sqrt(20)
    height = height + noise * rng.normal(size=height.shape)
    drift = np.cumsum(rng.normal(0.0, 0.1, pixels))
    height = height + drift[:, None, None] + np.array([0.0, 0.3])[None, :, None]
    return Scan(drive, position, height[:, 0], height[:, 1], lead.size)


def pairs_of(one: Scan, number: int) -> Array:
    pixels = one.trace.shape[1]
    trace, retrace = mh.images.instants(pixels, pixels)
    at = (trace + one.lead, retrace + one.lead)
    return mh.images.match(one.trace, one.retrace, drive=number, at=at)


def known_length(one: Scan) -> tuple[int, int, int, float]:
    """Two marks in the last trace."""
    pixels = one.trace.shape[1]
    begin = one.drive.size - 2 * pixels
    first, last = begin + pixels // 5, begin + 4 * pixels // 5
    return 0, first, last, float(one.position[last] - one.position[first])


@pytest.fixture(scope="module")
def found() -> mh.results.PlacesIdentification:
    scans = [scan(1.8, MIDDLE, 128, 1), scan(1.0, MIDDLE - 0.2, 128, 2)]
    pairs = np.vstack([pairs_of(one, number) for number, one in enumerate(scans)])
    rng = np.random.default_rng(3)
    wrong = rng.random(len(pairs)) < 0.05
    pairs[wrong, 2] += rng.uniform(-60, 60, wrong.sum())
    return mh.identify_places(
        [one.drive for one in scans], pairs, [known_length(scans[0])], dt=1e-3
    )


def test_matches_are_at_the_same_place() -> None:
    one = scan(1.8, MIDDLE, 128, 1)
    pairs = pairs_of(one, 0)
    assert len(pairs) > 100
    places = [np.interp(at, np.arange(one.position.size), one.position) for at in pairs[:, 1:3].T]
    off = places[1] - places[0]
    assert np.median(np.abs(off)) < 0.003 * np.ptp(one.position)
    assert np.mean(np.abs(off) > 0.02 * np.ptp(one.position)) < 0.05


def test_positions_in_a_third_scan(found: mh.results.PlacesIdentification) -> None:
    third = scan(1.4, MIDDLE + 0.25, 128, 4)
    line = slice(-256, -128)
    true, said = third.position[line], found.predict(third.drive)[line]
    span = np.ptp(true)
    back = third.position[-128:][::-1]
    assert 0.08 < np.abs(back - true).max() / span < 0.15
    off = (said - said.mean()) - (true - true.mean())
    assert np.sqrt(np.mean(off**2)) < 0.01 * span
    told = found.predict(third.drive)[-256:]
    both = np.concatenate([true, third.position[-128:]])
    gap = (told - told.mean()) - (both - both.mean())
    assert np.abs(gap).max() < 0.02 * span


def test_an_offset_of_a_whole_scan_is_no_error_of_its_places(
    found: mh.results.PlacesIdentification,
) -> None:
    """Nothing says where the lines are from rest; within a scan places are told to a per cent."""
    assert "positions_not_told" not in [one.code for one in found.warnings]
    third = scan(1.4, MIDDLE + 0.25, 128, 4)
    line = slice(-256, -128)
    claimed = float(np.sqrt(np.mean(found.predict_std(third.drive)[line] ** 2)))
    assert claimed < 0.01 * np.ptp(third.position[line])


def test_a_corrected_image_has_both_ways_at_the_same_places(
    found: mh.results.PlacesIdentification,
) -> None:
    third = scan(1.4, MIDDLE + 0.25, 128, 4, noise=0.0)
    at = found.predict(third.drive)[third.lead :].reshape(128, 2, 128)
    trace, grid = mh.images.resample(third.trace, at[:, 0], 100)
    retrace, _ = mh.images.resample(third.retrace, at[:, 1], grid)
    inside = np.s_[2:, 5:-5]

    def differ(a: Array, b: Array) -> float:
        a, b = a[inside], b[inside]
        return float(
            np.std((a - a.mean(axis=1, keepdims=True)) - (b - b.mean(axis=1, keepdims=True)))
        )

    before = differ(third.trace, third.retrace[:, ::-1])
    # The shortest waves of the sample are 7 % of the range: 1 % off is 0.9 rad of them.
    assert differ(trace, retrace) < 0.35 * before


def test_pixels_that_go_the_other_way_at_an_end_are_left_out() -> None:
    # Behind a dead time a trace begins while the stage still goes back.
    seen_at = np.array([[0.3, 0.1, 0.0, 1.0, 2.0, 4.0], [0.2, 0.1, 0.0, 1.5, 3.0, 4.0]])
    for turned in (seen_at, seen_at[:, ::-1]):
        even, grid = mh.images.resample(2.0 * turned, turned, 5)
        assert grid == pytest.approx([0.0, 1.0, 2.0, 3.0, 4.0])
        assert even == pytest.approx(np.tile(2.0 * grid, (2, 1)))


def test_an_image_behind_a_dead_time_is_corrected() -> None:
    one = scan(1.8, MIDDLE, 64, 1, noise=0.0)
    late = np.concatenate([np.full(3, one.position[0]), one.position[:-3]])
    at = late[one.lead :].reshape(64, 2, 64)
    trace, grid = mh.images.resample(at[:, 0], at[:, 0], 50)
    retrace, _ = mh.images.resample(at[:, 1], at[:, 1], grid)
    assert trace[:, 5:-5] == pytest.approx(np.tile(grid, (64, 1))[:, 5:-5])
    assert retrace[:, 5:-5] == pytest.approx(np.tile(grid, (64, 1))[:, 5:-5])


def test_uncertainties_are_those_of_places_where_the_pixel_is_said() -> None:
    one = scan(1.8, MIDDLE, 64, 1)
    plain, small = (mh.images.match(one.trace, one.retrace, pixel=pixel) for pixel in (1.0, 0.01))
    assert small[:, 3] == pytest.approx(0.01 * plain[:, 3])
    np.testing.assert_array_equal(small[:, :3], plain[:, :3])


def test_a_slope_alone_is_matched_with_nothing() -> None:
    # A wave longer than the scan, in noise: windows are slopes, and any of them fits any other.
    there = np.linspace(-1.0, 1.0, 128)
    shown = 0.5 * np.sin(np.pi * there)
    noise = np.random.default_rng(3).normal(0.0, 0.05, (2, 32, 128))
    assert len(mh.images.match(shown + noise[0], shown[::-1] + noise[1])) == 0
    finer = shown + 0.5 * np.sin(40.0 * there)
    assert len(mh.images.match(finer + noise[0], finer[::-1] + noise[1])) > 10


@pytest.mark.parametrize("plays", [([0.5, 0.2, 0.1], [0.0, 0.4, 1.0]), ([0.6, 0.3], [0.0, 0.7])])
def test_exact_fringes_accuse_none_of_them(plays: tuple[list[float], list[float]]) -> None:
    """What smooth weights leave at a play that stands alone is no fault of a fringe."""
    triangle = np.interp(np.arange(2000), [0, 500, 1500, 1999], [0.0, 1.0, -1.0, 0.0])
    drive = np.concatenate([size * triangle for size in (2.0, 1.0, 0.5)])
    place = mh.PrandtlIshlinskii(*plays).forward().run(drive)
    lengths = mh.images.fringes(np.cos(4.0 * np.pi * place / 0.1), drive, 0.1)
    found = mh.identify_places(drive, [], lengths, dt=1e-3)
    assert found.verdict == "green" and not found.wrong_lengths
    assert np.abs(found.predict(drive) - place).max() < 1e-3 * np.ptp(place)


def test_fringes_count_places() -> None:
    turn = np.concatenate(
        [np.linspace(0, 1, 400), np.linspace(1, 0.2, 300), np.linspace(0.2, 0.8, 300)]
    )
    drive = MIDDLE + 1.5 * turn
    position = 2.0 * stage(drive)
    signal = 3.0 + np.cos(4 * np.pi * position / 0.633 + 0.4)
    lengths = mh.images.fringes(signal, drive, 0.633, number=2)
    assert np.all(lengths[:, 0] == 2)
    at = [np.interp(one, np.arange(position.size), position) for one in lengths[:, 1:3].T]
    assert at[1] - at[0] == pytest.approx(lengths[:, 3], abs=0.01)


def test_noise_at_the_middle_is_no_fringe() -> None:
    way = np.linspace(0.0, 1.0, 400)
    # It rests for a while where the signal is at its middle.
    drive = np.concatenate([way, np.full(300, 1.0), np.linspace(1.0, 2.0, 400)])
    phase = 2.0 * np.pi * (drive - 1.0) * 3.0 + 0.5 * np.pi
    noisy = np.cos(phase) + 0.02 * np.random.default_rng(1).normal(size=drive.size)
    lengths = mh.images.fringes(noisy, drive, 2.0 / 3.0)
    clean = mh.images.fringes(np.cos(phase + 0.01), drive, 2.0 / 3.0)
    assert len(lengths) == len(clean)
    assert lengths[:, 3] == pytest.approx(clean[:, 3])


def test_a_stage_that_turns_later_than_its_drive_has_a_lag() -> None:
    drive = np.concatenate([np.linspace(0, 3, 300), np.linspace(3, 0, 300)])
    lag = 12
    late = np.concatenate([np.zeros(lag), drive[:-lag]])
    # It passes the middle of a fringe within the lag behind the turn of the drive.
    signal = np.cos(4 * np.pi * (late - 2.97) / 0.633 + 0.5 * np.pi)
    lengths = mh.images.fringes(signal, drive, 0.633, lag=lag)
    at = [np.interp(one, np.arange(late.size), late) for one in lengths[:, 1:3].T]
    assert at[1] - at[0] == pytest.approx(lengths[:, 3], abs=0.01)
    wrong = mh.images.fringes(signal, drive, 0.633)
    assert np.abs(wrong[:, 3] - lengths[:, 3]).max() > 0.1


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: mh.images.match(np.zeros(3), np.zeros(3)), "trace: expected an array of shape"),
        (
            lambda: mh.images.match(np.zeros((2, 64)), np.zeros((2, 63))),
            "retrace: expected the shape",
        ),
        (
            lambda: mh.images.match(np.zeros((2, 64)), np.zeros((2, 64)), window=40),
            "window: expected",
        ),
        (
            lambda: mh.images.match(np.full((2, 64), np.nan), np.zeros((2, 64))),
            "trace: expected finite",
        ),
        (lambda: mh.images.resample(np.zeros((2, 4)), np.zeros((2, 3)), 4), "positions: expected"),
        (
            lambda: mh.images.resample(np.zeros((1, 4)), [[0, 2, 1, 3]], 4),
            "positions: expected places",
        ),
        (
            lambda: mh.images.resample(np.zeros((1, 3)), [[0, 1, 2]], 1),
            "grid: expected at least two",
        ),
        (lambda: mh.images.fringes(np.zeros(9), np.zeros(8), 1.0), "signal: expected 8 samples"),
        (lambda: mh.images.fringes(np.zeros(9), np.arange(9.0), 0.0), "wavelength: expected"),
        (lambda: mh.images.fringes(np.ones(9), np.arange(9.0), 1.0), "signal: expected at least"),
        (
            lambda: mh.images.fringes(np.cos(np.arange(40.0)), np.ones(40), 1.0),
            "drive: expected one",
        ),
        (lambda: mh.images.fringes(np.ones(9), np.arange(9.0), 1.0, lag=-1), "lag: expected 0"),
        (lambda: mh.images.fringes([], [], 1.0), "signal: expected a one-dimensional"),
        (
            lambda: mh.images.fringes(np.zeros((2, 9)), np.zeros(9), 1.0),
            r"signal: expected a one-dimensional array, got shape \(2, 9\)",
        ),
        (
            lambda: mh.images.fringes([1.0, np.nan, 2.0], np.zeros(3), 1.0),
            "signal: expected finite numbers, got nan at 1",
        ),
        (lambda: mh.images.fringes(np.ones(9), np.ones(9), WRONG), "wavelength: expected a number"),
        (
            lambda: mh.images.match(np.zeros(64), np.zeros((2, 64))),
            r"trace: expected an array of shape \(lines, pixels\), got shape \(64,\)",
        ),
        (lambda: mh.images.match(NONE, np.zeros((2, 64))), "trace: .*, got dtype object"),
        (lambda: mh.images.match("a", np.zeros((2, 64))), "trace: .*, got dtype <U1"),
        (lambda: mh.images.match(5.0, np.zeros((2, 64))), "trace: .*, got a single number"),
        (
            lambda: mh.images.match([[1, 2], [3]], np.zeros((2, 64))),
            "trace: .*, got rows of different lengths",
        ),
        (
            lambda: mh.images.match(np.zeros((2, 64)) + 1j, np.zeros((2, 64))),
            "trace: .* of real numbers, got dtype complex128",
        ),
        (
            lambda: mh.images.match(np.zeros((2, 64)), np.zeros((2, 64)), pixel=WRONG),
            "pixel: expected a number above 0, got 'x'",
        ),
        (
            lambda: mh.images.match(
                np.zeros((2, 64)), np.zeros((2, 64)), at=(np.zeros((2, 64)), np.zeros((3, 64)))
            ),
            r"at: expected two arrays of the shape of the trace, .*, got \[\(2, 64\), \(3, 64\)\]",
        ),
        (
            lambda: mh.images.resample(np.zeros((1, 3)), [[0, 1, 2]], "a"),
            "grid: expected a number of places, .*, got dtype <U1",
        ),
        (lambda: mh.images.instants(0, 3), "lines: expected 1 or more, got 0"),
        (
            lambda: mh.images.match(np.zeros((2, 9)), np.zeros((2, 9))),
            "trace: expected lines of 16",
        ),
        (
            lambda: mh.images.match(np.zeros((2, 64)), np.zeros((2, 64)), pixel=0.0),
            "pixel: expected a number above 0",
        ),
        (
            lambda: mh.images.match(np.zeros((2, 64)), np.zeros((2, 64)), drive=-1),
            "drive: expected 0 or more, got -1",
        ),
        (
            lambda: mh.images.resample(np.zeros((2, 2)), [[0, 1], [2, 3]], 4),
            "positions: expected lines that have places in common",
        ),
        (lambda: mh.images.resample(np.zeros((1, 2)), [[0, 1]], 4.5), "grid: expected"),
        (
            lambda: mh.images.resample(np.zeros((1, 2)), [[0, 1]], [0.0, np.nan]),
            "grid: expected finite numbers, got nan at 1",
        ),
    ],
)
def test_wrong_input_is_named(call: object, message: str) -> None:
    assert callable(call)
    with pytest.raises((ValueError, TypeError), match=message):
        call()


@pytest.mark.parametrize("name", ["window", "together", "drive"])
def test_what_is_no_whole_number_is_named(name: str) -> None:
    image = np.zeros((2, 64))
    given: dict[str, Any] = {name: 20.5}
    with pytest.raises(TypeError, match=f"{name}: expected a whole number, got 20.5"):
        mh.images.match(image, image, **given)
