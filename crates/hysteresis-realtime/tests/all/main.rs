//! The tests of what the crate promises, in one program: it is linked once.

mod learning;
mod misses;
mod real_clock;
mod record;
mod safety;
mod setup;
mod shared_memory;
mod udp;
