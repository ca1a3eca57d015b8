//! The fit of a model: its output and rows at a point, the best weights there, and the descent to the best point.
//!
//! `point` names what is searched, `space` makes a model of a point. `rows` has its columns and derivatives for every
//! row of a record from those of `operator_blocks`, `projection` the best weights for these, `descent` steps to a
//! better point, and `joint` is what the search for the terms calls.

pub(crate) mod colour;
pub(crate) mod descent;
pub(crate) mod filter_lanes;
pub(crate) mod joint;
pub(crate) mod operator_blocks;
pub(crate) mod own_columns;
pub(crate) mod point;
pub(crate) mod progress;
pub(crate) mod projection;
pub(crate) mod response;
pub(crate) mod rows;
pub(crate) mod space;
pub(crate) mod tangent;
