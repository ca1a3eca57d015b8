"""Reports from Python: one HTML file that needs nothing else, for a browser, a phone or paper.

They are the pages of `mpi-hyst identify` and `mpi-hyst simulate`, and need `mpi_hyst[report]`. They
say with which version, when and from which data they were made. `Identification.report` and
`Run.report` are the same functions as methods.
"""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy.typing as npt

from mpi_hyst._arguments import expect, interval, quantities, require_matplotlib
from mpi_hyst._core import Identification, Run
from mpi_hyst._files import path_of, write_file
from mpi_hyst._types import Counted, Units

__all__ = ["identification", "run"]


def __dir__() -> list[str]:
    return __all__


def identification(
    found: Identification,
    path: str | os.PathLike[str],
    u: npt.ArrayLike | Sequence[tuple[npt.ArrayLike, npt.ArrayLike]] | None = None,
    y: npt.ArrayLike | None = None,
    *,
    skip: int | Sequence[int] = 0,
    names: Sequence[str] | None = None,
    units: Units = None,
    beside: Identification | None = None,
    validate: Counted | Sequence[Counted] | None = None,
) -> None:
    """Write the report of an identification.

    A result does not keep its records. With them the report has all that `mpi-hyst identify`
    leaves: loops, residuals, loops left out, uncertainty. Without them it has the verdict, errors,
    findings, the loops of the model, and the parameters with their standard errors.

    Parameters
    ----------
    found : results.Identification
        Made by `identify`.
    path : str or path
        The file to write, completely or not at all.
    u, y : arrays of n floats, optional
        The samples that were fitted. Or, for several records, a list of (u, y) pairs alone.
    skip : int or list of int
        Leading samples of each record that were not fitted.
    names : list of str, optional
        Of the records; by default "record 1" and so on.
    units : (str, str), optional
        Of drive and position.
    beside : results.Identification, optional
        Another model, fitted to the same records, to show beside it.
    validate : (u, y), (u, y, skip) or a list of these, optional
        The records that `identify` was given to predict, for their errors and residuals.

    Raises
    ------
    ImportError
        If matplotlib or jinja2 is not installed.
    OSError
        If the file cannot be written.
    TypeError, ValueError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import mpi_hyst as mh
    >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
    >>> y = mh.paper.table_1_recovered().forward().run(u)
    >>> found = mh.identify(u, y, operators=8, input_offset=0.0, dead_time=0.0)
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = pathlib.Path(directory) / "report.html"
    ...     found.report(path, u, y, units=("V", "um"))
    ...     path.read_text("utf-8").startswith("<!DOCTYPE html>")
    True

    """
    expect("found", found, (Identification,))
    if beside is not None:
        expect("beside", beside, (Identification,))
    if validate is not None and u is None:
        raise TypeError("validate: expected None without the records u and y that were fitted")
    place, named = path_of(path), quantities(units)
    require_matplotlib("a report")
    from mpi_hyst._report.identify import report_of_arrays
    from mpi_hyst._report.records import records_of_arrays

    records = records_of_arrays(found, u, y, skip, names, validate)
    write_file(place, report_of_arrays(found, records, named, beside))


def run(
    run: Run,
    path: str | os.PathLike[str],
    *,
    dt: float,
    name: str = "closed loop",
    units: Units = None,
) -> None:
    """Write the report of a closed loop: reference and position, errors, drive, what happened.

    Parameters
    ----------
    run : plant.Run
        Made by `Stage.simulate` or `plant.simulate`, or from a record of your own.
    path : str or path
        The file to write, completely or not at all.
    dt : float
        Sampling interval in seconds.
    name : str
        What stands below the title.
    units : (str, str), optional
        Of drive and position.

    Raises
    ------
    ImportError
        If matplotlib or jinja2 is not installed.
    OSError
        If the file cannot be written.
    TypeError, ValueError
        That name the argument, what was expected and what came.

    Examples
    --------
    >>> import pathlib, tempfile
    >>> import mpi_hyst as mh
    >>> target = mh.signals.sine(2.5, 10.0, seconds=0.3, rate=1e4)
    >>> run = mh.paper.plant("A1").stage.simulate(target, dt=1e-4)
    >>> with tempfile.TemporaryDirectory() as directory:
    ...     path = pathlib.Path(directory) / "run.html"
    ...     run.report(path, dt=1e-4, units=("V", "um"))
    ...     "largest error" in path.read_text("utf-8")
    True

    """
    expect("run", run, (Run,))
    if not isinstance(name, str):
        raise TypeError(f"name: expected a text, got {name!r}")
    place, named, known = path_of(path), quantities(units), interval(dt)
    if known is None:
        raise TypeError("dt: expected a number of seconds, got None")
    require_matplotlib("a report")
    from mpi_hyst._report.simulate import report_of_run

    write_file(place, report_of_run(run, known, name, named))
