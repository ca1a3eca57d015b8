"""Records of any lab: `read` returns columns of numbers by their names, and refuses anything else.

It reads text, Excel, NumPy, MATLAB, HDF5, TDMS and LabVIEW files, and tables in memory.
"""

from mpi_hyst._io.read import read
from mpi_hyst._io.record import Assumption, Columns, ReadError

__all__ = ["Assumption", "Columns", "ReadError", "read"]
