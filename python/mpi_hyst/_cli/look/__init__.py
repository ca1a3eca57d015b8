"""`mpi-hyst look`: what is in a file, and how to identify from it."""
