//! What an array has of its kind: it is of models of plays, or of stages.

/// Of an array of models, or of one of stages.
pub(crate) enum OfKind<M, S> {
    Models(M),
    Stages(S),
}

/// The same work with either: `of_kind!(&self.stream, stream => stream.len())`.
macro_rules! of_kind {
    ($of:expr, $each:pat => $work:expr) => {
        match $of {
            $crate::stream::of_kind::OfKind::Models($each) => $work,
            $crate::stream::of_kind::OfKind::Stages($each) => $work,
        }
    };
}

/// The same, and what is made of either is of its kind again.
macro_rules! map_kind {
    ($of:expr, $each:pat => $work:expr) => {
        match $of {
            $crate::stream::of_kind::OfKind::Models($each) => $crate::stream::of_kind::OfKind::Models($work),
            $crate::stream::of_kind::OfKind::Stages($each) => $crate::stream::of_kind::OfKind::Stages($work),
        }
    };
}

pub(crate) use {map_kind, of_kind};
