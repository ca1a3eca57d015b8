"""Places from images and fringes: what `identify_places` takes, where no sensor measures.

`match` finds where the retrace of a scan shows what its trace shows: the stage was at the same
place. `fringes` counts those of an interferometer. `resample` puts an image that is there already
on an even grid, with the positions that the identified stage says. `match` needs
`mpi_hyst[images]`.

A scan is a pair of arrays of shape (lines, pixels), trace and retrace, each row in the order of
time: the retrace runs backwards through the sample. Instants are samples of the drive. Unless you
say where pixels are read, line after line has its trace and then its retrace, a pixel at each
sample: pixel p of the trace of line i at 2 i pixels + p, of the retrace at 2 i pixels + pixels + p.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from operator import index
from typing import Any

import numpy as np
import numpy.typing as npt

from mpi_hyst._types import Matrix, Samples

__all__ = ["fringes", "instants", "match", "resample"]


def __dir__() -> list[str]:
    return __all__


# A match worse than that is none: noise alone correlates by less over a window.
_WORST = 0.7

# Beside a straight line in each row: what is seen must have a shape, seven times what chance gives.
_LEAST_AGREEMENT = 0.5

# What the parabola itself errs by, in pixels, rms: without noise, on waves of 16 pixels and more.
_PARABOLA = 0.05

# Fringes: how far out of its middle a signal must have been, as a share of its amplitude.
_OUT = 0.2

# The pixels between windows, as a share of their width.
_STRIDE = 0.5

# How far a match may lie from where those before it lead, as a share of the width of a window.
_SEARCHED = 0.3

# After a turn the stage moves less for the same drive, so the other way shows a window wider or
# narrower: by which factors, at the turn and from one window to the next, and in all.
_FIRST_STRETCHES = (1.0, 1.3, 1.7, 2.2)
_STRETCHES = (0.85, 1.0, 1.18)
_STRETCHED = (0.3, 3.0)


def _matcher() -> Any:
    try:
        return import_module("skimage.feature").match_template
    except ModuleNotFoundError as error:
        needed = f"images.match needs {error.name}: pip install 'mpi_hyst[images]'"
        raise ImportError(needed) from error


def _numbers(name: str, value: npt.ArrayLike, expected: str, dimensions: int) -> Matrix:
    """Return an array of so many dimensions, or say what came in its place."""
    try:
        given = np.asarray(value)
    except ValueError as error:
        raise TypeError(f"{name}: expected {expected}, got rows of different lengths") from error
    if given.dtype.kind not in "buif":
        raise TypeError(f"{name}: expected {expected} of real numbers, got dtype {given.dtype}")
    if given.ndim != dimensions or not given.size:
        shape = "a single number" if given.ndim == 0 else f"shape {given.shape}"
        raise ValueError(f"{name}: expected {expected}, got {shape}")
    made = given.astype(float)
    strange = np.argwhere(~np.isfinite(made))
    if strange.size:
        at = tuple(int(place) for place in strange[0])
        where = at[0] if len(at) == 1 else at
        raise ValueError(f"{name}: expected finite numbers, got {made[at]} at {where}")
    return made


def _image(name: str, value: npt.ArrayLike) -> Matrix:
    return _numbers(name, value, "an array of shape (lines, pixels)", 2)


def _positive(name: str, value: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        raise TypeError(f"{name}: expected a number above 0, got {value!r}")
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{name}: expected a number above 0, got {value!r}")
    return float(value)


def _whole(name: str, value: int, least: int) -> int:
    try:
        whole = index(value)
    except TypeError as error:
        raise TypeError(f"{name}: expected a whole number, got {value!r}") from error
    if whole < least:
        raise ValueError(f"{name}: expected {least} or more, got {whole}")
    return whole


def instants(lines: int, pixels: int) -> tuple[Matrix, Matrix]:
    """Return the samples at which trace and retrace are read, a pixel at each sample.

    Parameters
    ----------
    lines, pixels : int
        Of the scan.

    Returns
    -------
    trace, retrace : arrays of shape (lines, pixels)

    Raises
    ------
    ValueError
        For less than one line or pixel.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> trace, retrace = mh.images.instants(2, 3)
    >>> trace.tolist(), retrace.tolist()
    ([[0.0, 1.0, 2.0], [6.0, 7.0, 8.0]], [[3.0, 4.0, 5.0], [9.0, 10.0, 11.0]])

    """
    _whole("lines", lines, 1)
    _whole("pixels", pixels, 1)
    all_of_them = np.arange(2.0 * lines * pixels).reshape(lines, 2, pixels)
    return all_of_them[:, 0], all_of_them[:, 1]


def match(
    trace: npt.ArrayLike,
    retrace: npt.ArrayLike,
    *,
    drive: int = 0,
    at: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    window: int | None = None,
    together: int = 16,
    pixel: float = 1.0,
) -> Matrix:
    """Find the pairs of instants at which trace and retrace show the same place.

    Windows of the trace, of `together` lines, are looked for in the retrace by normalised
    cross-correlation (scikit-image; J. P. Lewis, Vision Interface 1995, p. 120), from the turn
    between both backwards: there they are at the same place, and each match begins where the one
    before it leads. Windows are stretched, as after a turn a stage moves less. A parabola through
    the three best shifts gives the part of a pixel. Each line counts about its own mean, so that
    drift of the height does not matter.

    The standard deviation of a match is that of a shift under white noise, s^2 = (1 - c^2) /
    (-c c'' n), in pixels: c the correlation, c'' its second difference, n the pixels of the
    window; and 0.05 pixels of the parabola. A window that correlates by less than 0.7 gives no
    pair, nor one that does by less than 0.5 beside a straight line: a slope looks like any other.

    Parameters
    ----------
    trace, retrace : arrays of shape (lines, pixels)
        Each row in the order of time.
    drive : int
        The number of the drive of this scan among those that `identify_places` gets.
    at : (array, array), optional
        The instants of both in samples of the drive, each of shape (lines, pixels).
    window : int, optional
        The pixels of a window; a tenth of the line, and at least 16, if it is left open. More than
        the noise blurs, fewer than the pitch of what repeats.
    together : int
        How many lines are matched together. They must show much the same place along the line.
    pixel : float
        How far a pixel is, in drive or in place. Say it where scans differ in size: a pixel of a
        small scan is a smaller error.

    Returns
    -------
    array of shape (m, 4)
        The rows of `pairs`: drive, instant in the trace, instant in the retrace, standard
        deviation in pixels times `pixel`.

    Raises
    ------
    ImportError
        Without scikit-image.
    ValueError, TypeError
        That names the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> places = np.linspace(0.0, 10.0, 256)
    >>> height = np.sin(places**2 / 2.0) + 0.3 * np.sin(7.0 * places)
    >>> trace = np.tile(height, (16, 1))
    >>> pairs = mh.images.match(trace, trace[:, ::-1])  # no hysteresis: mirror images
    >>> there, back = pairs[:, 1] % 512, pairs[:, 2] % 512
    >>> bool(np.abs(there + back - 511).max() < 0.2)
    True

    """
    ahead, behind = _image("trace", trace), _image("retrace", retrace)
    if behind.shape != ahead.shape:
        raise ValueError(
            f"retrace: expected the shape of the trace, {ahead.shape}, got {behind.shape}"
        )
    lines, pixels = ahead.shape
    if pixels < 16:
        raise ValueError(f"trace: expected lines of 16 pixels or more, got {pixels}")
    usual = min(max(16, pixels // 10), pixels // 2)
    width = usual if window is None else _whole("window", window, 8)
    if not 8 <= width <= pixels // 2:
        raise ValueError(f"window: expected 8 to half of {pixels} pixels, got {width}")
    _whole("together", together, 1)
    _whole("drive", drive, 0)
    far = _positive("pixel", pixel)
    read = [_image("at", one) for one in (instants(lines, pixels) if at is None else at)]
    shapes = [one.shape for one in read]
    if shapes != [ahead.shape] * 2:
        expected = f"two arrays of the shape of the trace, {ahead.shape}"
        raise ValueError(f"at: expected {expected}, got {shapes}")
    mirrored = behind[:, ::-1]
    found = []
    for first in range(0, lines, together):
        block = slice(first, min(first + together, lines))
        middle = (block.start + block.stop) // 2
        shown = [one[block] - one[block].mean(axis=1, keepdims=True) for one in (ahead, mirrored)]
        for there, back, std in _matches(shown[0], shown[1], width):
            times = (
                np.interp(there, np.arange(pixels), read[0][middle]),
                np.interp(pixels - 1 - back, np.arange(pixels), read[1][middle]),
            )
            found.append((float(drive), *times, far * std))
    return np.array(found).reshape(-1, 4)


def _matches(ahead: Matrix, mirrored: Matrix, window: int) -> Iterator[tuple[float, float, float]]:
    """Yield the centre of each window, where the other one shows it, and how uncertain that is."""
    pixels = ahead.shape[1]
    stride = max(1, round(_STRIDE * window))
    last: tuple[float, float] | None = None
    stretch, missed = 1.0, 0
    for start in range(pixels - window, -1, -stride):
        centre = start + 0.5 * (window - 1)
        # Both ways meet at the turn, and one step on the other way goes on by so much more or less.
        begin, met = (pixels - 0.5, pixels - 0.5) if last is None else last
        choices = _FIRST_STRETCHES if last is None else _STRETCHES
        tried = [
            _match(
                (ahead, mirrored),
                (start, window),
                met - (begin - centre) * stretch * one,
                stretch * one,
                round(_SEARCHED * window * (1 + missed)),
            )
            for one in choices
        ]
        best = max(tried, key=lambda one: one[0])
        if best[0] >= _WORST:
            last, missed = (centre, best[1]), 0
            stretch = float(np.clip(best[3], *_STRETCHED))
            yield centre, best[1], best[2]
        elif last is not None:
            missed = min(missed + 1, 2)
            stretch = 0.5 * (1.0 + stretch)


def _match(
    images: tuple[Matrix, Matrix],
    where: tuple[int, int],
    expected: float,
    stretch: float,
    reach: int,
) -> tuple[float, float, float, float]:
    """Return correlation, place, its standard deviation and the stretch; -1 where none is."""
    none = (-1.0, 0.0, np.inf, stretch)
    (ahead, mirrored), (start, window) = images, where
    pixels, width = ahead.shape[1], max(8, round(window * stretch))
    first = round(expected - 0.5 * (width - 1))
    low, high = max(0, first - reach), min(pixels, first + width + reach)
    if high - low < width + 2:
        return none
    at = np.linspace(0.0, window - 1.0, width)
    below = np.minimum(at.astype(int), window - 2)
    part = ahead[:, start : start + window]
    template = part[:, below] + (at - below) * (part[:, below + 1] - part[:, below])
    correlation = _matcher()(mirrored[:, low:high], template)[0]
    best = int(np.argmax(correlation))
    if not 0 < best < correlation.size - 1:
        return none
    before, peak, after = correlation[best - 1 : best + 2]
    bend = before - 2.0 * peak + after
    if not (peak > 0.0 and bend < 0.0):
        return none
    if _agreement(template, mirrored[:, low + best : low + best + width]) < _LEAST_AGREEMENT:
        return none
    found = low + best + 0.5 * (before - after) / bend + 0.5 * (width - 1)
    noise = max(1.0 - peak**2, 1e-6) / (-peak * bend * template.size)
    return float(peak), found, float(np.hypot(np.sqrt(noise), _PARABOLA)), stretch


def _agreement(one: Matrix, other: Matrix) -> float:
    """Return the correlation beside a straight line in each row: a slope alone fits any slope."""
    about = np.arange(one.shape[1]) - 0.5 * (one.shape[1] - 1)
    line = np.stack([np.ones_like(about) / np.sqrt(about.size), about / np.linalg.norm(about)])
    left = [image - image @ line.T @ line for image in (one, other)]
    scale = float(np.linalg.norm(left[0]) * np.linalg.norm(left[1]))
    return float(np.vdot(*left)) / scale if scale > 0.0 else 0.0


def fringes(
    signal: npt.ArrayLike,
    drive: npt.ArrayLike,
    wavelength: float,
    *,
    number: int = 0,
    lag: int = 0,
) -> Matrix:
    """Count the fringes of an interferometer: places a quarter of a wavelength apart.

    The signal is a + b cos(4 pi y / wavelength + c) for a reflected beam and the position y (P.
    Hariharan, Optical Interferometry, 2003): a fringe is half a wavelength. So it goes through its
    middle wherever the position has moved by a quarter. From one to the next the position
    goes on as the drive does; the last one before a turn of the drive and the first one after it
    are the same place. So the stage must turn with the drive: within a pass, and take `lag` away
    where it does not.

    Parameters
    ----------
    signal : array of n floats
        The intensity, of several fringes.
    drive : array of n floats
        In V; the position rises with it.
    wavelength : float
        In the unit of the position.
    number : int
        The number of this drive among those that `identify_places` gets.
    lag : int
        By how many samples the stage turns later than the drive: its dead time.

    Returns
    -------
    array of shape (m, 4)
        The rows of `lengths`: drive, first instant, instant, and how far apart they are.

    Raises
    ------
    ValueError, TypeError
        That names the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> drive = np.concatenate([np.linspace(0, 3, 300), np.linspace(3, 0, 300)])
    >>> position = 0.5 * drive
    >>> signal = np.cos(4 * np.pi * position / 0.633)
    >>> lengths = mh.images.fringes(signal, drive, 0.633)
    >>> moved = np.interp(lengths[:, 2], np.arange(600), position) - np.interp(
    ...     lengths[:, 1], np.arange(600), position
    ... )
    >>> bool(np.abs(moved - lengths[:, 3]).max() < 0.005)
    True

    """
    expected = "a one-dimensional array"
    light, u = _numbers("signal", signal, expected, 1), _numbers("drive", drive, expected, 1)
    if light.size != u.size:
        raise ValueError(f"signal: expected {u.size} samples like the drive, got {light.size}")
    quarter = 0.25 * _positive("wavelength", wavelength)
    _whole("number", number, 0)
    _whole("lag", lag, 0)
    at = _passes(light - 0.5 * (light.min() + light.max()))
    if at.size < 3:
        raise ValueError(
            f"signal: expected at least three passes through its middle, got {at.size}"
        )
    steps = np.diff(u)
    moving = np.flatnonzero(steps)
    if not moving.size:
        raise ValueError("drive: expected one that moves, got a constant")
    # Where the drive rests, the position goes on as before.
    last = np.searchsorted(moving, np.floor(at) - lag, "right") - 1
    direction = np.sign(steps[moving])[np.maximum(last, 0)]
    same_branch = direction[1:] == direction[:-1]
    place = np.concatenate([[0.0], np.cumsum(np.where(same_branch, direction[1:], 0.0))])
    rows = [np.full(at.size, float(number)), np.full(at.size, at[0]), at, quarter * place]
    return np.column_stack(rows)[1:]


def _passes(about: Samples) -> Samples:
    """Return the instants at which a signal goes from one side of its middle to the other.

    It must have been out by a fifth of its amplitude on both sides: noise near the middle is none.
    """
    out = np.flatnonzero(np.abs(about) > _OUT * np.abs(about).max())
    changes = np.flatnonzero((about[out[:-1]] < 0) != (about[out[1:]] < 0))
    found = []
    for begin, end in zip(out[changes], out[changes + 1], strict=True):
        part = about[begin : end + 1]
        crossings = np.flatnonzero((part[:-1] < 0) != (part[1:] < 0))
        at = crossings + part[crossings] / (part[crossings] - part[crossings + 1])
        found.append(begin + float(np.mean(at)))
    return np.array(found)


def resample(
    image: npt.ArrayLike, positions: npt.ArrayLike, grid: npt.ArrayLike
) -> tuple[Matrix, Samples]:
    """Put an image on an even grid, straight between its pixels.

    Parameters
    ----------
    image : array of shape (lines, pixels)
        A trace or a retrace.
    positions : array of shape (lines, pixels)
        Where each pixel was, as the stage says: `found.predict(drive)` at its instants. They rise,
        or they fall, along each line. Pixels at its ends that were read while the stage still went
        the other way, behind a dead time, are left out.
    grid : int or array of floats
        How many places across what all lines have seen, or the places themselves.

    Returns
    -------
    image, grid : array of shape (lines, places), array of floats
        The image at these places; NaN beyond the ends of a line.

    Raises
    ------
    ValueError, TypeError
        That names the argument, what was expected and what came.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> import numpy as np
    >>> seen_at = np.array([[0.0, 1.0, 4.0, 9.0]])
    >>> even, grid = mh.images.resample(2.0 * seen_at, seen_at, 4)
    >>> even.tolist(), grid.tolist()
    ([[0.0, 6.0, 12.0, 18.0]], [0.0, 3.0, 6.0, 9.0])

    """
    shown, seen_at = _image("image", image), _image("positions", positions)
    if seen_at.shape != shown.shape:
        raise ValueError(
            f"positions: expected the shape of the image, {shown.shape}, got {seen_at.shape}"
        )
    if seen_at[:, -1].sum() < seen_at[:, 0].sum():
        shown, seen_at = shown[:, ::-1], seen_at[:, ::-1]
    ways = [slice(int(at.argmin()), int(at.argmax()) + 1) for at in seen_at]
    if any(
        at[way].size < 2 or (np.diff(at[way]) < 0).any()
        for at, way in zip(seen_at, ways, strict=True)
    ):
        raise ValueError("positions: expected places that rise, or that fall, along all lines")
    places = _grid(grid, float(seen_at.min(axis=1).max()), float(seen_at.max(axis=1).min()))
    lines = [
        np.interp(places, at[way], line[way], left=np.nan, right=np.nan)
        for at, line, way in zip(seen_at, shown, ways, strict=True)
    ]
    return np.array(lines), places


def _grid(grid: npt.ArrayLike, low: float, high: float) -> Samples:
    """Return the places that are asked for: so many between both ends, or themselves."""
    expected = "a number of places, or a one-dimensional array of them"
    if np.ndim(grid) == 0:
        count = float(_numbers("grid", grid, expected, 0))
        if count < 2 or count != int(count):
            raise ValueError(f"grid: expected at least two places, got {count:g}")
        if low >= high:
            raise ValueError("positions: expected lines that have places in common")
        return np.linspace(low, high, int(count))
    return _numbers("grid", grid, expected, 1)
