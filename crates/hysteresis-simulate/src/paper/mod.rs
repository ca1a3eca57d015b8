//! What belongs to the paper alone, for the reproduction of its results.

mod printed_law;

pub use printed_law::PrintedLaw;
