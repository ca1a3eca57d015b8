//! What is chosen: which terms a model has, how many operators, and which samples count.
//!
//! What the records cannot tell is closed first (`told`). `glitches` asks `search` for the best of everything that is
//! left open, and again without wrong samples. `search` fits the hysteresis alone, then the linear part (`linear_part`,
//! with `dynamics` and `modes`, or what `quiet_record` tells). From there the `table` of terms is gone through
//! (`term_search`): a term stays if it gains what it must (`must_gain`). Where coupled plays are better than plays,
//! `search` does all of it once more with them. The rest is left to cross-validation (`structure`). Where plays fail,
//! all of it is done once more with an operator of another family (`duhem`). Where loops are all alike, what was found
//! has `rivals`. Every step takes what was `found` so far and returns it with more, or with less.

pub(crate) mod cross_validation;
pub(crate) mod duhem;
pub(crate) mod dynamics;
pub(crate) mod found;
pub(crate) mod glitches;
pub(crate) mod linear_part;
pub(crate) mod modes;
pub(crate) mod must_gain;
pub(crate) mod quiet_record;
pub(crate) mod rivals;
pub(crate) mod search;
pub(crate) mod structure;
pub(crate) mod table;
pub(crate) mod term_search;
pub(crate) mod told;
pub(crate) mod trial;
