"""The figures of `mpi_hyst.datasets`, a folder for each device with the notice of its authors."""
