use crate::error::{Error, check_finite};

pub(crate) fn check_weights(parameter: &'static str, weights: &[f64]) -> Result<(), Error> {
    if weights.is_empty() {
        return Err(Error::Empty { parameter });
    }
    for (i, w) in weights.iter().enumerate() {
        check_finite(parameter, Some(i), *w)?;
    }
    Ok(())
}
