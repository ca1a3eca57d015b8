"""`mpi-hyst demo`: identification and compensation without data."""
