"""`mpi-hyst excite`: the drive to identify from, or to demagnetise with."""
