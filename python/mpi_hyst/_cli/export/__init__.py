"""`mpi-hyst export`: a stage for other tools."""
