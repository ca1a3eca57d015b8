"""`mpi-hyst reproduce`: the tables and figures of the paper recomputed."""
