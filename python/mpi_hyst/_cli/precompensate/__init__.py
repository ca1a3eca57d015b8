"""`mpi-hyst precompensate`: a model and a trajectory in, the drive out."""
