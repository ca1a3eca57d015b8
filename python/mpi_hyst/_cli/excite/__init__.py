"""`mpi-hyst excite`: a drive for identification or demagnetization."""
