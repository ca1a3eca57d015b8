"""The report of a run, from Python."""

from __future__ import annotations

import mpi_hyst as mh
from mpi_hyst._quantity import Quantity
from mpi_hyst._report import provenance
from mpi_hyst._report.simulate import page
from mpi_hyst._report.simulate.simulation import Simulation


def report(run: mh.plant.Run, dt: float, name: str, quantities: tuple[Quantity, Quantity]) -> str:
    """Return the HTML text."""
    drive, position = quantities
    arrays = (run.reference, run.measured, run.position, run.drive)
    data = provenance.of_arrays("reference, measured, position, drive as float64", arrays)
    made = provenance.rows("mpi_hyst.reports.run in Python", [data])
    return page.report(Simulation(run, dt, position, None, name, drive.label, drive.unit), made)
