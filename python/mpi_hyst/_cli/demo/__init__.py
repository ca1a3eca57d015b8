"""`mpi-hyst demo`: the whole chain without any data."""
