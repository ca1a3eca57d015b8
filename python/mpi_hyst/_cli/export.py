"""`mpi-hyst export`: a stage in, a file for another tool out."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import mpi_hyst as mh
from mpi_hyst._cli.inputs import interval_of_rate
from mpi_hyst._cli.options import argument, command, flag, flags, group, limits, numbers, option
from mpi_hyst._cli.outputs import Output, check_outputs, write_outputs
from mpi_hyst._cli.stage import StageOptions, load_stage, refusing, say_red
from mpi_hyst._cli.terminal import CommandError, say
from mpi_hyst._core import c_header_text, c_name, read_bytes
from mpi_hyst._fmu import packed
from mpi_hyst._text import digits, text_pairs

_ENDINGS = {"--fmu": ".fmu", "--c": ".h", "--bytes": ".bin"}


@dataclass(frozen=True)
class Request:
    """The stage, and what is written of it."""

    stage_path: Path = argument("STAGE.json")
    fmu: bool = flag(help="Functional mock-up unit (FMI 2.0).")
    c: bool = flag(help="Header of constants for C and C++.")
    as_bytes: bool = flag("--bytes", help="The stage as bytes, for the C library.")
    result_path: Path | None = option("-o", help="File to write.  [default: STAGE.fmu, .h or .bin]")
    kind: Literal["forward", "inverse", "controller"] | None = option(
        help="What the unit runs.  [default: forward]"
    )
    dt: float | None = option(metavar="SECONDS", help="Sampling interval of unit or gains.")
    rate: float | None = option(metavar="HZ", help="The same as samples per second.")
    feedforward: Literal["inverse", "preview"] | None = option(
        help="Of a controller.  [default: inverse]"
    )
    gains: tuple[float, float] | None = option(
        **numbers("KP,KI"),
        help="Proportional gain (V/µm) and integral gain (V/µm/s) of a controller.  "
        "[default: tuned]",
    )
    name: str | None = option(help="What the unit is called, or names in C begin with.")
    limits: tuple[float, float] | None = limits("those of the stage")
    stage: StageOptions = group(StageOptions)

    def format(self) -> str:
        """Return the option of the file to write."""
        asked = dict(zip(_ENDINGS, (self.fmu, self.c, self.as_bytes), strict=True))
        chosen = [name for name, is_asked in asked.items() if is_asked]
        if len(chosen) != 1:
            got = " and ".join(chosen) or "none"
            raise CommandError(f"expected one of {', '.join(_ENDINGS)}, got {got}")
        return chosen[0]

    def interval(self) -> float | None:
        """Return the sampling interval in seconds, if one was given."""
        if self.rate is None:
            return self.dt
        if self.dt is not None:
            raise CommandError("--rate: expected --dt or --rate, got both")
        return interval_of_rate(self.rate)


@command(Request, short_help="Write a stage for other tools: FMU, C, bytes.")
def export(request: Request) -> None:
    """Write a stage for other tools.

    A functional mock-up unit runs in tools of co-simulation and needs --dt or --rate. A header has
    the constants of the stage for C and C++, with --dt also tuned gains and filters, and the stage
    as bytes.
    """
    say(run(request))


def run(request: Request) -> str:
    """Write the file, and return the summary."""
    made = request.format()
    _check_options(request, made)
    dt = request.interval()
    path = request.result_path or Path(request.stage_path.stem + _ENDINGS[made])
    check_outputs([path], [request.stage_path])
    # Once, as it may be a pipe.
    data = read_bytes(request.stage_path)
    stage = load_stage(request.stage_path, request.stage, data)
    say_red(request.stage_path, stage)
    names = {**flags(Request), "dt": "--dt" if request.rate is None else "--rate"}
    with refusing(request.stage_path, names | dict.fromkeys(("kp", "ki"), "--gains")):
        if request.limits is not None:
            stage = stage.replace(limits=request.limits)
        is_as_in_file = request.limits is None and not request.stage.changes()
        digest = hashlib.sha256(data).hexdigest() if is_as_in_file else None
        content, facts = _content(request, made, stage, path, dt, digest)
    write_outputs([Output.of(path, content)])
    return f"{request.stage_path}\n\n{text_pairs(facts)}\n\nwritten  {path}"


def _check_options(request: Request, made: str) -> None:
    """Refuse options that the file has no use for."""
    of_unit: dict[str, object] = {
        "--kind": request.kind,
        "--feedforward": request.feedforward,
        "--gains": request.gains,
    }
    of_controller = {name: of_unit[name] for name in ("--feedforward", "--gains")}
    useless: dict[str, object] = {} if made == "--fmu" else of_unit
    if made == "--fmu" and request.kind != "controller":
        useless = of_controller
    if made == "--bytes":
        useless = {**useless, "--dt": request.dt, "--rate": request.rate, "--name": request.name}
    for name, value in useless.items():
        if value is not None:
            only = "--fmu --kind controller" if name in of_controller else "--fmu"
            where = only if name in of_unit else "--fmu or --c"
            raise CommandError(f"{name}: has no effect without {where}")
    if made == "--fmu" and request.dt is None and request.rate is None:
        raise CommandError(
            "--dt: expected the sampling interval of the unit in seconds, or --rate in Hz"
        )


def _content(
    request: Request, made: str, stage: mh.Stage, path: Path, dt: float | None, digest: str | None
) -> tuple[bytes, list[tuple[str, str]]]:
    """Return what is written, and what is said of it."""
    seconds = [] if dt is None else [("sampling interval", f"{digits(dt)} s")]
    if made == "--bytes":
        content = stage.to_bytes()
        return content, [("stage", f"{len(content)} bytes")]
    if made == "--c":
        name = request.name or c_name(path.stem)
        text = c_header_text(stage, name, dt, digest)
        return text.encode(), [("names begin with", f"{name}_"), *seconds]
    assert dt is not None
    kind = request.kind or "forward"
    name = request.name or path.stem
    feedforward = request.feedforward or "inverse"
    content = packed(stage, kind, name, dt=dt, feedforward=feedforward, gains=request.gains)
    return content, [("unit", f"FMI 2.0, co-simulation, {kind}"), *seconds]
