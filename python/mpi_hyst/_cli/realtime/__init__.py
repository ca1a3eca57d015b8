"""`mpi-hyst realtime`: a stage in, its loop on the clock of this machine."""
