"""`mpi-hyst track`: a controller that follows a reference on a simulated stage."""
