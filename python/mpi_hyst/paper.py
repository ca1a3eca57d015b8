"""The actuator of the paper: Tables I and II, and the digits that Table I lost."""

from mpi_hyst._core import table_1, table_1_recovered, table_2

__all__ = ["table_1", "table_1_recovered", "table_2"]
