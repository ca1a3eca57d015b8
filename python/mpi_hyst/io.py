"""CSV files: `read` returns columns of numbers by their names, and refuses anything else."""

from mpi_hyst._csv import Columns, ReadError, read

__all__ = ["Columns", "ReadError", "read"]
