//! What an identification leaves: the model, how well it fits, and what it predicts.

pub(crate) mod identification;
pub(crate) mod left_out;
pub(crate) mod quality;
