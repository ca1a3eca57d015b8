"""A stage for other tools: functional mock-up units and headers for C.

`fmu` packs a stage for tools of co-simulation (FMI 2.0). `c_header` writes its constants for C and
C++. Both files appear only when they are complete. A stage as bytes is `stage.to_bytes()`.
"""

from __future__ import annotations

import os
from typing import Literal

from mpi_hyst._core import Stage, c_header_text, c_name
from mpi_hyst._files import path_of, write_file
from mpi_hyst._fmu import packed

__all__ = ["c_header", "fmu"]


def __dir__() -> list[str]:
    return __all__


def fmu(
    stage: Stage,
    path: str | os.PathLike[str],
    kind: Literal["forward", "inverse", "controller"] = "forward",
    *,
    dt: float,
    feedforward: Literal["inverse", "preview"] = "inverse",
    gains: tuple[float, float] | None = None,
    name: str | None = None,
) -> None:
    """Write a functional mock-up unit of a stage: FMI 2.0, co-simulation.

    It runs in any tool that takes such units, on the platform of this package, and gives the bits
    of this package. A step of the tool is a whole number of sampling intervals.

    Parameters
    ----------
    stage : Stage
        The stage; it is not changed.
    path : str or os.PathLike
        The file to write, usually *.fmu; one that is there is replaced.
    kind : "forward", "inverse" or "controller"
        forward: `drive` in, `position` at the end of the step out, as `advance` of
        `stage.forward(dt)`. inverse: `target` in, `drive` out, as `stage.inverse(dt)`.
        controller: `reference` and `measurement` in, `drive` out, as `stage.controller(dt)`.
    dt : float
        The sampling interval in seconds.
    feedforward : "inverse" or "preview"
        Of a controller, as in `stage.controller`.
    gains : (float, float), optional
        kp and ki of a controller, without filters; by default both are tuned.
    name : str, optional
        What tools show; by default the name of the file without its ending.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.
    OSError
        If the file cannot be written, or this package has no library for units.

    Examples
    --------
    >>> import mpi_hyst as mh, tempfile, pathlib, zipfile
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "actuator.fmu"
    >>> mh.export.fmu(stage, path, "inverse", dt=1e-4)
    >>> "modelDescription.xml" in zipfile.ZipFile(path).namelist()
    True

    """
    path = path_of(path)
    called = path.stem if name is None else name
    write_file(path, packed(stage, kind, called, dt=dt, feedforward=feedforward, gains=gains))


def c_header(
    stage: Stage,
    path: str | os.PathLike[str],
    *,
    dt: float | None = None,
    name: str | None = None,
) -> None:
    """Write the constants of a stage as a header for C99 and C++11.

    It has thresholds, weights, offsets, limits, slew rate, maps, creep and what a temperature adds.
    With a sampling interval it also has tuned gains and filters. Every number reads back bit for
    bit. The stage is in it as bytes too, for `mpih_stage_from_bytes` of the C library.

    Parameters
    ----------
    stage : Stage
        The stage; it is not changed.
    path : str or os.PathLike
        The file to write, usually *.h; one that is there is replaced.
    dt : float, optional
        The sampling interval in seconds.
    name : str, optional
        What all names begin with; by default the name of the file without its ending.

    Raises
    ------
    ValueError, TypeError
        That name the argument, what was expected and what came.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import mpi_hyst as mh, tempfile, pathlib
    >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
    >>> path = pathlib.Path(tempfile.mkdtemp()) / "actuator.h"
    >>> mh.export.c_header(stage, path)
    >>> "#define ACTUATOR_LIMIT_LOW ((ACTUATOR_REAL)-500.0) /* V */" in path.read_text()
    True

    """
    path = path_of(path)
    write_file(path, c_header_text(stage, c_name(path.stem) if name is None else name, dt))
