"""`mpi-hyst identify`: records in, a model and a report out."""
