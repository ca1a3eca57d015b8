"""`mpi-hyst identify`: records in, a model and a report out."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeVar

import numpy as np

import mpi_hyst as mh
from mpi_hyst import _findings
from mpi_hyst._errors import CommandError
from mpi_hyst._outputs import Output, check_outputs, write_outputs
from mpi_hyst._progress import Progress, progress_bar
from mpi_hyst._records import Quantity, Samples, read_columns
from mpi_hyst._tables import digits, in_unit, text_pairs, text_table

_Value = TypeVar("_Value", str, int)
Kind = Literal["modified", "conventional"]
Weights = Literal["free", "quadratic", "split"]
_SKIP = re.compile(r"(?P<count>\d+(\.\d+)?|\.\d+) ?(?P<seconds>s)?")


@dataclass(frozen=True)
class Request:
    """What was asked, by the names of the options."""

    data: tuple[Path, ...]
    input_column: str
    output_column: str
    model_path: Path | None = None
    report_path: Path | None = None
    skip: tuple[str, ...] = ()
    rows: tuple[int, ...] = ()
    time: str | None = None
    model: Kind = "modified"
    operators: int = 20
    weights: Weights = "free"
    thresholds: Literal["uniform", "quantiles"] = "uniform"
    ratios: tuple[float, float, float] | None = None
    input_offset: float | None = None
    delay: float | None = None

    @property
    def input(self) -> Quantity:
        """The drive."""
        return Quantity(self.input_column)

    @property
    def output(self) -> Quantity:
        """The displacement."""
        return Quantity(self.output_column)


@dataclass(frozen=True)
class Record:
    """One measured record, its first `skip` samples not to be fitted."""

    name: str
    input: Samples
    output: Samples
    seconds: Samples | None
    sample_time: float | None
    skip: int


def run(request: Request) -> str:
    """Fit, write what was asked for, and return the table of results."""
    check_outputs([request.model_path, request.report_path], request.data)
    if request.input_column == request.output_column:
        raise CommandError(f"--input and --output: both are column {request.input_column!r}")
    if request.model == "conventional" and request.ratios is not None:
        raise CommandError("--ratios: the conventional model has none")
    if request.model == "conventional" and request.weights == "split":
        raise CommandError("--weights: the conventional model has no split")
    if request.report_path is not None:
        from mpi_hyst._report import require

        require("--report")
    records = read(request)
    with progress_bar("fitting", request.output.unit) as progress:
        found = fit(records, request, progress)
    findings = diagnose(records, found)
    outputs = []
    if request.report_path is not None:
        from mpi_hyst._identify_report import report

        other: Kind = "modified" if request.model == "conventional" else "conventional"
        with progress_bar("comparing", request.output.unit) as progress:
            compared = fit(records, request, progress, other)
        page = report(records, found, compared, findings, request)
        outputs.append(Output.of_text(request.report_path, page))
    if request.model_path is not None:
        outputs.append(Output(request.model_path, found.model.save))
    write_outputs(outputs)
    warnings = _findings.text(findings, [record.name for record in records])
    return f"{summary(records, found, request)}\n\n{warnings}\n\n{_saved(request)}"


def read(request: Request) -> list[Record]:
    """Read the records, each with the part to skip."""
    skips = _per_file("--skip", request.skip, "0", request.data)
    rows = _per_file("--rows", request.rows, 0, request.data)
    names = [request.input_column, request.output_column]
    records = []
    for path, skip, count in zip(request.data, skips, rows, strict=True):
        columns = read_columns(path, names, time=request.time, rows=count or None)
        seconds = columns.seconds
        records.append(
            Record(
                name=path.name,
                input=columns.values[request.input_column],
                output=columns.values[request.output_column],
                seconds=seconds,
                sample_time=columns.sample_time,
                skip=_samples_to_skip(skip, seconds, columns.samples, path),
            )
        )
    _check_sample_times(records)
    return records


def fit(
    records: Sequence[Record], request: Request, progress: Progress, model: Kind | None = None
) -> mh.Identification:
    """Identify the model that was asked for, or the other kind for comparison."""
    kind = model or request.model
    # Beside a split model stands the conventional one with free weights: it has no split.
    unsplit = request.weights == "split" and kind == "conventional"
    weights: Weights = "free" if unsplit else request.weights
    try:
        return mh.identify(
            [(record.input, record.output) for record in records],
            model=kind,
            operators=request.operators,
            weights=weights,
            thresholds=request.thresholds,
            ratios=request.ratios if request.ratios and kind == "modified" else "fit",
            input_offset="fit" if request.input_offset is None else request.input_offset,
            delay="fit" if request.delay is None else request.delay,
            skip=[record.skip for record in records],
            progress=progress,
        )
    except (ValueError, TypeError) as error:
        raise CommandError(_in_terms_of_the_options(str(error), request)) from error


def diagnose(records: Sequence[Record], found: mh.Identification) -> list[mh.Finding]:
    """Look for what the records cannot tell and for what the model left in them."""
    return mh.diagnose(
        [(record.input, record.output) for record in records],
        None,
        found.model,
        skip=[record.skip for record in records],
        delay=found.delay,
    )


def residuals(record: Record, found: mh.Identification, index: int) -> Samples:
    """Measured minus modelled output, with the record's own output offset."""
    offset = float(found.output_offsets[index] - found.output_offsets[0])
    return record.output - (found.predict(record.input) + offset)


def summary(records: Sequence[Record], found: mh.Identification, request: Request) -> str:
    """Return the parameters and the errors of the fit as a table."""
    count = "1 record" if len(records) == 1 else f"{len(records)} records"
    title = f"{model_name(found)} fitted to {found.fit.samples} samples of {count}"
    unit = request.output.unit
    header = [
        "record",
        "samples",
        *(f"{name} {unit}".rstrip() for name in ("max", "rms")),
        "max %",
        "rms %",
        *(f"{name} {unit}".rstrip() for name in ("range", "offset")),
    ]
    rows = [
        [record.name, *_quality(quality), digits(float(offset))]
        for record, quality, offset in zip(
            records, found.records, found.output_offsets, strict=True
        )
    ]
    if len(rows) > 1:
        rows.append(["all", *_quality(found.fit), ""])
    base = "  % of range: peak-to-peak of the measured output over the fitted samples"
    if len(rows) > 1:
        base += "; all: of the widest record"
    return "\n\n".join(
        [
            title,
            text_pairs(parameters(records, found, request)),
            text_table(header, rows) + "\n" + base,
        ]
    )


def model_name(found: mh.Identification) -> str:
    """Name the kind of model and its size."""
    if isinstance(found.model, mh.ModifiedPrandtlIshlinskii):
        return f"modified Prandtl-Ishlinskii model, {found.model.operators} coupled plays,"
    return f"conventional Prandtl-Ishlinskii model, {found.model.operators} plays,"


def parameters(
    records: Sequence[Record], found: mh.Identification, request: Request
) -> list[tuple[str, str]]:
    """Name the parameters of the model beside its weights, with their units."""
    pairs: list[tuple[str, str]] = []
    if request.weights != "free":
        pairs.append(("weights", request.weights))
    if isinstance(found.model, mh.ModifiedPrandtlIshlinskii):
        ratios = "  ".join(digits(ratio) for ratio in found.ratios)
        pairs.append(("ratios ra/r, rb/r, rc/r", ratios + _given(request.ratios)))
    offset = in_unit(found.model.input_offset, request.input.unit)
    pairs.append(("input offset", offset + _given(request.input_offset)))
    delay = f"{found.delay:.3f} samples"
    if (step := records[0].sample_time) is not None:
        delay += f" = {digits(1e3 * step * found.delay)} ms"
    pairs.append(("delay of the output", delay + _given(request.delay)))
    if found.model.not_invertible_because is not None:
        pairs.append(("not invertible", found.model.not_invertible_because))
    return pairs


def _given(value: object) -> str:
    return "" if value is None else "  (given)"


def _quality(quality: mh.Quality) -> list[str]:
    return [
        str(quality.samples),
        digits(quality.max_error),
        digits(quality.rmse),
        f"{quality.max_error_percent:.3f}",
        f"{quality.rmse_percent:.3f}",
        digits(quality.range),
    ]


def _saved(request: Request) -> str:
    lines = []
    if request.model_path is None:
        lines.append("not saved: add -o stage.json to keep the model")
    else:
        lines.append(f"model   {request.model_path}  (the delay is not part of it)")
    if request.report_path is not None:
        lines.append(f"report  {request.report_path}")
    return "\n".join(lines)


def _per_file(
    option: str, values: Sequence[_Value], default: _Value, data: Sequence[Path]
) -> list[_Value]:
    """Spread the values of an option over the files: one for all, or one for each."""
    if len(values) not in (0, 1, len(data)):
        raise CommandError(
            f"{option}: given {len(values)} times for {len(data)} files; once for all, or once each"
        )
    if len(values) == len(data):
        return list(values)
    return [values[0] if values else default] * len(data)


def _samples_to_skip(skip: str, seconds: Samples | None, samples: int, path: Path) -> int:
    match = _SKIP.fullmatch(skip.strip())
    if match is None or (not match["seconds"] and not match["count"].isdigit()):
        raise CommandError(f"--skip: expected rows as in 1000 or seconds as in 5s, got {skip!r}")
    if not match["seconds"]:
        count = int(match["count"])
    elif seconds is None:
        raise CommandError(f"{path}: --skip {skip} needs a time column, name it with --time")
    else:
        count = int(np.searchsorted(seconds - seconds[0], float(match["count"])))
    if count >= samples:
        raise CommandError(f"{path}: --skip {skip} leaves nothing of {samples} samples")
    return count


def _check_sample_times(records: Sequence[Record]) -> None:
    """Refuse records of different rates: their delay in samples would not be one number."""
    first = records[0]
    for record in records[1:]:
        if first.sample_time is None or record.sample_time is None:
            continue
        if abs(record.sample_time - first.sample_time) > 1e-3 * first.sample_time:
            times = f"{digits(first.sample_time)} s and {digits(record.sample_time)} s"
            raise CommandError(
                f"{record.name}: not sampled at the rate of {first.name} ({times} a sample)"
            )


def _in_terms_of_the_options(message: str, request: Request) -> str:
    """Say which file and column, or which option, the library means."""
    paths = request.data
    if match := re.match(r"record (\d+): ", message):
        paths, message = (request.data[int(match[1])],), message[match.end() :]
    argument, _, rest = message.partition(": ")
    if argument in ("operators", "delay", "skip", "ratios", "input_offset"):
        return f"--{argument.replace('_', '-')}: {rest}"
    if argument in ("ra", "rb", "rc"):
        return f"--ratios: {message}"
    columns = {"u": request.input_column, "y": request.output_column}
    files = ", ".join(map(str, paths))
    if argument in columns:
        return f"{files}: column {columns[argument]}: {rest}"
    return f"{files}: {rest if argument == 'records' else message}"
