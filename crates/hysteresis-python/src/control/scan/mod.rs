//! Scans of a plane: `Raster`, `Spiral` and `Lissajous` of `mpi_hyst.trajectories`.

pub(crate) mod axis;
pub(crate) mod lissajous;
pub(crate) mod raster;
pub(crate) mod spiral;
