"""The options of `mpi-hyst look`."""

from __future__ import annotations

from typing import Any

import click

from mpi_hyst._cli.options import FILE, options
from mpi_hyst._cli.terminal import say


@click.command(short_help="Show what is in a file, and how to identify from it.")
@options(
    click.argument("data", metavar="FILE", type=FILE),
    click.option(
        "--plot",
        "plot_path",
        type=FILE,
        metavar="FILE|DIRECTORY",
        help="Figure of the record to write: .svg, .png or .pdf, or a directory for look.svg.",
    ),
    click.option("--rows", type=click.IntRange(min=1), help="Rows to read.  [default: all]"),
)
def look(**given: Any) -> None:
    """Show format, columns and sampling of a file, and guess drive, position and time.

    The last line is the command to run next. Formats: text (CSV and others), NumPy, MATLAB, HDF5,
    TDMS, LabVIEW measurements.
    """
    from mpi_hyst._cli.look.run import Request, run

    say(run(Request(**given)))
