//! Conversion of arguments and results, files, and the mapping of errors.

pub(crate) mod arguments;
pub(crate) mod arrays;
pub(crate) mod errors;
pub(crate) mod files;
pub(crate) mod objects;
