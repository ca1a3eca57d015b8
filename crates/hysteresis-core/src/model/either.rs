use super::conventional::PrandtlIshlinskii;
use super::modified::ModifiedPrandtlIshlinskii;

/// A model of either kind, as a file holds it.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// Play operators.
    Conventional(PrandtlIshlinskii),
    /// Coupled-play operators.
    Modified(ModifiedPrandtlIshlinskii),
}

impl From<PrandtlIshlinskii> for Model {
    fn from(model: PrandtlIshlinskii) -> Self {
        Self::Conventional(model)
    }
}

impl From<ModifiedPrandtlIshlinskii> for Model {
    fn from(model: ModifiedPrandtlIshlinskii) -> Self {
        Self::Modified(model)
    }
}

impl From<Model> for ModifiedPrandtlIshlinskii {
    fn from(model: Model) -> Self {
        match model {
            Model::Conventional(model) => (&model).into(),
            Model::Modified(model) => model,
        }
    }
}
