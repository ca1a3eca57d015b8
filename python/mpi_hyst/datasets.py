"""Measured records of real devices, which come with the package.

`piezo_stack` reads the records of a piezo stack on a bench, with their provenance and licence.
A file is read when it is asked for.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import as_file, files
from typing import Literal

from mpi_hyst._io.read import read
from mpi_hyst._types import Samples

__all__ = ["Record", "piezo_stack"]


def __dir__() -> list[str]:
    return __all__


_STACK = {
    "major_loops": "40 periods of full stroke",
    "decaying_loops": "full stroke, then decaying minor loops, then rest",
}
_SOURCE = (
    "PI P-885.91 PICMA stack in a flexure stage, capacitive displacement sensor. Files "
    "Model_Vi_Do.dat and Test_Vi_Do_Di.dat, columns 0 and 4, of the public repository "
    "yan9a/DiscreteBacklashOperator at commit 79fd060d86cd. Paper: Aye and Ang, ICSTSD 2018."
)


@dataclass(frozen=True, eq=False)
class Record:
    """A measured record: the drive that was put out, and the position that was read.

    Attributes
    ----------
    name : str
        The name of the record.
    description : str
        What was driven.
    u, y : arrays
        Drive and position, a row for each sample.
    units : (str, str)
        The units of drive and position.
    dt : float
        The sampling interval in seconds.
    skip : int
        So many samples at the beginning are a transient that lies on no loop: for `identify`.
    source, licence : str
        Where the figures come from, and the notice under which they are here.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> record = mh.datasets.piezo_stack("decaying_loops")
    >>> columns = mh.io.read(record.columns)  # a dictionary, as mh.io takes
    >>> columns.sample_time == record.dt, columns.units["displacement_um"]
    (True, 'um')

    """

    name: str
    description: str
    u: Samples
    y: Samples
    units: tuple[str, str]
    dt: float
    skip: int
    source: str
    licence: str
    columns: dict[str, Samples]
    """All columns of the file by their names: time, drive and position."""

    @property
    def time(self) -> Samples:
        """The time of every sample in seconds."""
        return self.columns["time_s"]


def piezo_stack(name: Literal["major_loops", "decaying_loops"]) -> Record:
    """Read a measured record of a piezo stack: a PI P-885.91 in a flexure stage.

    Driven by a sine of 1 Hz, 0 to 3.6 V at the input of the amplifier, and sampled at 200 Hz.
    The position has an arbitrary zero and moves by 45 um.

    - The drive has one sign. So the zero of the coupled plays must be free to lie elsewhere than
      at 0 V: leave `input_offset` to `identify`.
    - The position is about 3 samples (15 ms) late. Minor loops show it, full loops do not. As
      there is one frequency, it cannot be told from other effects of the rate.
    - The noise of the sensor at rest is 0.065 to 0.072 um rms.
    - Judge a model by a record to which it was not fitted.

    Parameters
    ----------
    name : "major_loops" or "decaying_loops"
        40 periods of full stroke (8027 samples); or full stroke, then decaying minor loops, then
        rest (4200 samples).

    Returns
    -------
    Record
        Its figures are those of the authors, bit for bit. It is read anew at every call.

    Raises
    ------
    ValueError
        If there is no record of this name.

    Examples
    --------
    >>> import mpi_hyst as mh
    >>> record = mh.datasets.piezo_stack("decaying_loops")
    >>> record.u.size, record.dt, record.units
    (4200, 0.005, ('V', 'um'))
    >>> found = mh.identify(record.u, record.y, dt=record.dt, skip=record.skip, operators=8,
    ...                     weights="quadratic", dynamics=None, creep=None, loop_shift=None,
    ...                     input_map=None, output_map=None)
    >>> bool(found.fit.rmse < 0.2)  # um, of a range of 45 um
    True

    """
    if name not in _STACK:
        raise ValueError(f"name: expected {' or '.join(map(repr, _STACK))}, got {name!r}")
    folder = files("mpi_hyst._datasets").joinpath("piezo_stack")
    with as_file(folder.joinpath(f"{name}.csv.gz")) as path:
        table = read(path)
    drive, position = "voltage_v", "displacement_um"
    dt = table.sample_time
    assert dt is not None
    return Record(
        name,
        _STACK[name],
        table[drive],
        table[position],
        (table.units[drive], table.units[position]),
        dt,
        400,
        _SOURCE,
        folder.joinpath("LICENSE").read_text("utf-8"),
        table.values,
    )
