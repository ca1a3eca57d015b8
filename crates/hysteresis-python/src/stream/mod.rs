//! Streams of models and of arrays, sample by sample.

pub(crate) mod actuators;
pub(crate) mod array_bracket;
pub(crate) mod blocks;
pub(crate) mod bracket;
pub(crate) mod of_kind;
pub(crate) mod process;
pub(crate) mod single_argument;
pub(crate) mod stream_arrays;
pub(crate) mod streams;
