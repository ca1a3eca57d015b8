"""The actuator of the paper: Tables I and II, the digits that Table I lost, and benchmark plants.

`plant` makes a plant on which the published law with `gains` gives the published errors.
"""

from mpi_hyst._core import gains, plant, table_1, table_1_recovered, table_2

__all__ = ["gains", "plant", "table_1", "table_1_recovered", "table_2"]
