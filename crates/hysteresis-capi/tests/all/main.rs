//! The tests of what the crate promises, in one program: it is linked once.

mod axes;
mod bytes;
mod header;
mod interface;
mod objects;
mod options;
mod programs;
mod stages;
