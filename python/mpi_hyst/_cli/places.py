"""`mpi-hyst places`: drives and images, or pairs, in; a stage out, without a position sensor."""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import click
import numpy as np
import numpy.typing as npt

import mpi_hyst as mh
from mpi_hyst._cli.inputs import assumed_of, shared_interval, trajectory
from mpi_hyst._cli.options import (
    FILE,
    Sampled,
    argument,
    asked,
    command,
    creep,
    dead_time,
    flags,
    group,
    input_offset,
    option,
    ratios,
    report,
    smoothness,
    thresholds,
)
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._cli.stage import name_options, refusing
from mpi_hyst._cli.terminal import CommandError, command_line, note, require_report_packages, say
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import places as page
from mpi_hyst._report.page import hashed_file, made_with
from mpi_hyst._report.places import Places, ScanImages
from mpi_hyst._types import Matrix, Samples

_PLACES = ("identify_places",)


def _yes_or_no(
    context: click.Context, option: click.Parameter, value: str | None
) -> bool | str | None:
    """Read a word that stands for a truth, or another one."""
    del context, option
    return {"yes": True, "no": False}.get(value or "", value)


@dataclass(frozen=True)
class Request:
    """The drives, what is known of places, and what is written."""

    drives: tuple[Path, ...] = argument("DRIVE.csv...", nargs=-1, required=True, type=FILE)
    result_path: Path | None = option("-o", help="Stage to write.")
    trace: tuple[Path, ...] = option(
        multiple=True, type=FILE, help="Image of the trace, .npy or text; once for each drive."
    )
    retrace: tuple[Path, ...] = option(
        multiple=True, type=FILE, help="Image of the retrace, rows in the order of time."
    )
    before: tuple[int, ...] = option(
        multiple=True,
        type=int,
        metavar="SAMPLES",
        help="Samples of the drive before the first line; once for each drive, or for all.  "
        "[default: 0]",
    )
    pairs: Path | None = option(
        help="More pairs, rows of drive number, instant, instant[, uncertainty]; .npy or text."
    )
    lengths: Path | None = option(
        help="Known lengths or loads, rows of drive number, instant, instant, distance[, std].",
    )
    position_unit: str = option(
        default="um",
        metavar="UNIT",
        help="Unit of the lengths, such as um or mV: that of the position.",
    )
    fringes: tuple[Path, ...] = option(
        multiple=True,
        type=FILE,
        help="Intensity of an interferometer at every sample, .npy or text; once for each drive. "
        "Its fringes are known lengths.",
    )
    wavelength: float | None = option(
        metavar="LENGTH", help="Wavelength of the interferometer, in the unit of the position."
    )
    lag: int = option(
        default=0,
        metavar="SAMPLES",
        help="By how many samples the stage turns later than its drive, for fringes.",
    )
    temperature: tuple[Path, ...] = option(
        multiple=True,
        type=FILE,
        help="Temperature at every sample, .npy or text; once for each drive.",
    )
    model: Literal["auto", "modified", "conventional"] = option(
        passed=_PLACES,
        default="auto",
        help="Model of coupled plays, or of plays. auto: by cross-validation.",
    )
    operators: int | None = option(passed=_PLACES, help="Number of operators.  [default: 20]")
    smoothness: float | Literal["auto"] = smoothness(passed=_PLACES)
    thresholds: Literal["uniform", "quantiles", "geometric"] = thresholds(passed=_PLACES)
    ratios: tuple[float, float, float] | Literal["fit"] | None = ratios(
        passed=_PLACES, help="Ratios ra/r, rb/r, rc/r of the coupled plays.  [default: fit]"
    )
    input_offset: float | None = input_offset(passed=_PLACES)
    dead_time: float | None = dead_time(passed=_PLACES)
    creep: int | Literal["auto", "none", "log"] | None = creep(passed=_PLACES)
    drift: bool | Literal["auto"] | None = option(
        passed=_PLACES,
        type=click.Choice(["auto", "yes", "no"]),
        callback=_yes_or_no,
        help="Drift of what is seen against the stage. auto: by cross-validation.  [default: auto]",
    )
    duhem: Literal["auto", "fit", "none"] | None = option(
        passed=_PLACES,
        help="Duhem operator beside the plays. auto: if cross-validation asks for it.  "
        "[default: auto]",
    )
    input_map: Literal["auto", "smooth", "none"] | None = option(
        passed=_PLACES,
        help="Smooth map of the drive in front of the hysteresis, which known lengths tell. auto: "
        "if cross-validation asks for it.  [default: auto]",
    )
    thermal_lag: float | None = option(
        passed=_PLACES,
        metavar="SECONDS",
        help="Time constant by which the position is behind the temperature.  [default: fitted]",
    )
    corrected: Path | None = option(help="Trace of the last scan on an even grid, to write (.npy).")
    report_path: Path | None = report()
    sampled: Sampled = group(Sampled, what="drive")


@command(Request, short_help="Identify a stage from images or pairs, without a position sensor.")
def places(request: Request) -> None:
    """Identify a stage without a position sensor.

    DRIVE.csv are the drives, each from rest on. Trace and retrace of a scan say when the stage was
    at the same place: one pixel at each sample of the drive, line after line, the trace first. A
    known length or the fringes of an interferometer set the scale; known loads on a gauge are
    lengths, and need no pairs. Images need the extra `images`.
    """
    say(run(request))


def run(request: Request) -> str:
    """Identify, write what was asked for, and return the summary."""
    inputs = [*request.drives, *request.trace, *request.retrace]
    inputs += [*request.fringes, *request.temperature]
    inputs += [path for path in (request.lengths, request.pairs) if path is not None]
    outputs = [request.result_path, request.corrected, request.report_path]
    check_outputs(outputs, inputs)
    if request.report_path is not None:
        require_report_packages("--report")
    if not request.fringes and request.wavelength is not None:
        raise CommandError("--wavelength: expected --fringes beside it, got none")
    scans = _images(request)
    if request.lengths is None and not request.fringes:
        raise CommandError("--lengths: expected known lengths, or --fringes, got neither")
    if not scans and request.corrected is not None:
        raise CommandError("--corrected: expected --trace and --retrace, got neither")
    columns = [trajectory(path, request.sampled) for path in request.drives]
    drives = [columns[name] for columns, name in columns]
    one, name = columns[0]
    drive_unit = Quantity(name, one.units.get(name, "")).suffix or "V"
    for one, name in columns:
        for said in assumed_of(one, name, drive_unit, request.sampled):
            note(said)
    dt = shared_interval([one for one, _ in columns], request.sampled.rate)
    before = _before(request)
    ends = _ends(drives, scans, before)
    pairs = [] if request.pairs is None else [_matrix(request.pairs)]
    temperature = _signals("--temperature", request.temperature, drives)
    with refusing(request.drives[0], _names(request)):
        matched = []
        for number, (scan, first, end) in enumerate(zip(scans, before, ends, strict=False)):
            there, back = mh.images.instants(*scan.trace.shape)
            at = (there + first, back + first)
            pixel = float(np.ptp(drives[number][first:end])) / max(1, scan.trace.shape[1] - 1)
            files = {"trace": request.trace[number], "retrace": request.retrace[number]}
            with _naming({name: str(path) for name, path in files.items()}):
                matched.append(
                    mh.images.match(scan.trace, scan.retrace, drive=number, at=at, pixel=pixel)
                )
            if not matched[-1].size:
                raise CommandError(
                    f"{request.trace[number]}: expected marks that are in "
                    f"{request.retrace[number]}, too, lines in the order of time; found none"
                )
        found = mh.identify_places(
            drives,
            _joined(pairs, matched),
            _lengths(request, drives),
            dt=dt,
            temperature=temperature or None,
            **asked(request, "identify_places"),
        )
        corrected = _corrected(found, drives, temperature, scans, before)
    result = Places(found, tuple(map(str, request.drives)), corrected)
    _write(request, result, inputs, (drive_unit, request.position_unit))
    return page.summary(result)


def _names(request: Request) -> dict[str, str]:
    """Return the options and files that stand for arguments of the library."""
    names = {**flags(Request), "drives": str(request.drives[0])}
    lengths = "--fringes" if request.lengths is None else str(request.lengths)
    if request.pairs is None and request.trace:
        names["pairs"] = "--trace and --retrace"
    return names | {"dt": "--rate", "lengths": lengths}


def _signals(option: str, paths: Sequence[Path], drives: Sequence[Samples]) -> list[Samples]:
    """Read a number for each sample of a drive, from a file for each; none from no files."""
    if paths and len(paths) != len(drives):
        raise CommandError(
            f"{option}: expected one for each of {len(drives)} drives, got {len(paths)}"
        )
    read = [_numbers(path).reshape(-1) for path in paths]
    for path, signal, drive in zip(paths, read, drives, strict=False):
        if signal.size != drive.size:
            raise CommandError(
                f"{path}: expected a number for each of {drive.size} samples, got {signal.size}"
            )
    return read


def _lengths(request: Request, drives: Sequence[Samples]) -> Matrix:
    """Return the lengths of the file, and those between fringes."""
    known = [] if request.lengths is None else [_matrix(request.lengths)]
    signals = _signals("--fringes", request.fringes, drives)
    if signals and request.wavelength is None:
        raise CommandError("--wavelength: expected that of the --fringes, got none")
    if signals and known and known[0].shape[1] != 4:
        raise CommandError(
            f"{request.lengths}: expected 4 columns beside --fringes, got {known[0].shape[1]}"
        )
    for number, (signal, drive) in enumerate(zip(signals, drives, strict=False)):
        assert request.wavelength is not None
        with _naming({**_names(request), "signal": str(request.fringes[number])}):
            known.append(
                mh.images.fringes(signal, drive, request.wavelength, number=number, lag=request.lag)
            )
    return np.vstack(known)


def _matrix(path: Path) -> Matrix:
    """Read a table of numbers."""
    matrix = _numbers(path)
    if matrix.ndim != 2:
        raise CommandError(f"{path}: expected rows and columns, got shape {matrix.shape}")
    return matrix


def _numbers(path: Path) -> npt.NDArray[np.float64]:
    """Read numbers: a file of numpy, or text."""
    try:
        data = path.read_bytes()
        if path.suffix.lower() == ".npy":
            read = np.load(io.BytesIO(data), allow_pickle=False)
        else:
            text = data.decode("utf-8-sig")
            # Between semicolons a comma is a decimal mark.
            text = text.replace(",", "." if ";" in text else " ").replace(";", " ")
            read = np.loadtxt(io.StringIO(text), ndmin=2)
        if np.iscomplexobj(read):
            raise ValueError("its numbers are complex")
        return np.asarray(read, dtype=np.float64)
    except (ValueError, UnicodeDecodeError, EOFError) as error:
        raise CommandError(f"{path}: expected a table of numbers, .npy or text: {error}") from error


def _joined(pairs: Sequence[Matrix], matched: Sequence[Matrix]) -> Matrix:
    """Join pairs; those of a file without an uncertainty get the median one of the matches."""
    known = np.concatenate([one[:, 3] for one in matched]) if matched else np.ones(1)
    usual = float(np.median(known)) if known.size else 1.0
    given = [
        np.column_stack([one, np.full(len(one), usual)]) if one.shape[1] == 3 else one
        for one in pairs
    ]
    widths = {one.shape[1] for one in given}
    if matched and not widths <= {4}:
        raise CommandError(f"--pairs: expected rows of 3 or 4 numbers, got {max(widths)}")
    both = [*given, *matched]
    return np.vstack(both) if both else np.zeros((0, 4))


@contextmanager
def _naming(names: Mapping[str, str]) -> Iterator[None]:
    """Name options and files where `mh.images` refuses: its errors carry no name of an argument."""
    try:
        yield
    except ImportError as error:
        raise CommandError(str(error)) from error
    except ValueError as error:
        raise CommandError(name_options(str(error), names)) from error


def _ends(
    drives: Sequence[Samples], scans: Sequence[ScanImages], before: Sequence[int]
) -> list[int]:
    """Return up to which sample of its drive each scan goes."""
    ends = [first + 2 * one.trace.size for one, first in zip(scans, before, strict=False)]
    for number, (drive, end) in enumerate(zip(drives, ends, strict=False)):
        if drive.size < end:
            raise CommandError(
                f"--before: expected {end} samples of drive {number} for the pixels of its images, "
                f"got {drive.size}"
            )
    return ends


def _images(request: Request) -> list[ScanImages]:
    if len(request.trace) != len(request.retrace):
        counts = f"{len(request.trace)} and {len(request.retrace)}"
        raise CommandError(f"--retrace: expected one for each --trace, got {counts}")
    if len(request.trace) > len(request.drives):
        raise CommandError(
            f"--trace: expected at most one for each of {len(request.drives)} drives, "
            f"got {len(request.trace)}"
        )
    both = zip(request.trace, request.retrace, strict=True)
    return [ScanImages(_matrix(one), _matrix(other)) for one, other in both]


def _before(request: Request) -> Sequence[int]:
    given = request.before or (0,)
    if len(given) not in (1, len(request.drives)) or min(given) < 0:
        said = ", ".join(map(str, given))
        raise CommandError(
            "--before: expected samples from 0 on, one number for all drives or one for each of "
            f"{len(request.drives)}, got {said}"
        )
    return given * len(request.drives) if len(given) == 1 else given


def _corrected(
    found: mh.results.PlacesIdentification,
    drives: Sequence[Samples],
    temperature: Sequence[Samples],
    scans: Sequence[ScanImages],
    before: Sequence[int],
) -> page.Corrected | None:
    """Put the images of the last scan on an even grid."""
    if not scans:
        return None
    last, number = scans[-1], len(scans) - 1
    lines, pixels = last.trace.shape
    end = before[number] + 2 * lines * pixels
    warmth = temperature[number] if temperature else None
    seen_at = found.predict(drives[number], temperature=warmth) + found.drift(number)
    at = seen_at[before[number] : end].reshape(lines, 2, pixels)
    with _naming({"positions": "--before"}):
        trace, grid = mh.images.resample(last.trace, at[:, 0], pixels)
        retrace, _ = mh.images.resample(last.retrace, at[:, 1], grid)
    return page.Corrected(last, trace, retrace, grid)


def _write(
    request: Request, result: Places, inputs: Sequence[Path], units: tuple[str, str]
) -> None:
    outputs = []
    if request.result_path is not None:
        outputs.append(Output(request.result_path, result.found.stage.replace(units=units).save))
    if request.corrected is not None and result.corrected is not None:
        content = io.BytesIO()
        np.save(content, result.corrected.trace)
        outputs.append(Output.of(request.corrected, content.getvalue()))
    if request.report_path is not None:
        made = made_with(command_line(), [hashed_file(path) for path in inputs])
        outputs.append(Output.of(request.report_path, page.report(result, made)))
    write_outputs(outputs)
