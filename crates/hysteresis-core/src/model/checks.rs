use crate::error::{Error, check_finite};

pub(super) fn check_weights(weights: &[f64]) -> Result<(), Error> {
    if weights.is_empty() {
        return Err(Error::Empty { parameter: "weights" });
    }
    for (i, w) in weights.iter().enumerate() {
        check_finite("weights", Some(i), *w)?;
    }
    Ok(())
}
