"""`mpi-hyst simulate`: a controller that follows a reference on a simulated stage."""
