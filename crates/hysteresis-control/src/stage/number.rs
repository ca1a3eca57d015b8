//! Numbers that may be infinite or none at all, in files: `#[serde(with = "number")]`.
//!
//! JSON has no word for them, so there they are written as text. Bytes have the number itself. A `null`, which serde
//! writes for all of them where nothing is said, is read as no number.

use serde::de::DeserializeOwned;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A number, or numbers in lists, as text has them.
pub trait AsText: Serialize + DeserializeOwned {
    /// The same with words for what is no finite number.
    type Text: Serialize + DeserializeOwned;

    /// In words.
    fn to_text(&self) -> Self::Text;

    /// Out of words.
    fn from_text(text: Self::Text) -> Self;
}

/// A number as text has it.
#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(untagged)]
pub enum AnyNumber {
    /// A finite number.
    Finite(f64),
    /// Another one.
    Other(Other),
    /// What serde writes for another one by itself.
    Missing,
}

/// What is no finite number.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub enum Other {
    /// Above all numbers.
    #[serde(rename = "inf")]
    Infinite,
    /// Below all numbers.
    #[serde(rename = "-inf")]
    MinusInfinite,
    /// No number.
    #[serde(rename = "nan")]
    NotANumber,
}

impl AsText for f64 {
    type Text = AnyNumber;

    fn to_text(&self) -> AnyNumber {
        if self.is_finite() {
            AnyNumber::Finite(*self)
        } else if self.is_nan() {
            AnyNumber::Other(Other::NotANumber)
        } else {
            AnyNumber::Other(if *self > 0.0 { Other::Infinite } else { Other::MinusInfinite })
        }
    }

    fn from_text(text: AnyNumber) -> Self {
        match text {
            AnyNumber::Finite(number) => number,
            AnyNumber::Other(Other::Infinite) => Self::INFINITY,
            AnyNumber::Other(Other::MinusInfinite) => Self::NEG_INFINITY,
            AnyNumber::Other(Other::NotANumber) | AnyNumber::Missing => Self::NAN,
        }
    }
}

impl<T: AsText> AsText for Vec<T> {
    type Text = Vec<T::Text>;

    fn to_text(&self) -> Self::Text {
        self.iter().map(T::to_text).collect()
    }

    fn from_text(text: Self::Text) -> Self {
        text.into_iter().map(T::from_text).collect()
    }
}

impl AsText for [f64; 3] {
    type Text = [AnyNumber; 3];

    fn to_text(&self) -> Self::Text {
        self.map(|number| number.to_text())
    }

    fn from_text(text: Self::Text) -> Self {
        text.map(f64::from_text)
    }
}

/// Writes numbers of a field.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<T: AsText, S: Serializer>(numbers: &T, serializer: S) -> Result<S::Ok, S::Error> {
    if serializer.is_human_readable() {
        return numbers.to_text().serialize(serializer);
    }
    numbers.serialize(serializer)
}

/// Reads numbers of a field.
///
/// # Errors
/// Those of the deserializer.
pub fn deserialize<'de, T: AsText, D: Deserializer<'de>>(deserializer: D) -> Result<T, D::Error> {
    if deserializer.is_human_readable() {
        return T::Text::deserialize(deserializer).map(T::from_text);
    }
    T::deserialize(deserializer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Serialize, Deserialize)]
    struct Numbers(#[serde(with = "super")] Vec<Vec<f64>>, #[serde(with = "super")] [f64; 3]);

    #[test]
    fn every_number_reads_back_from_text() {
        let all = [1.5, f64::INFINITY, f64::NEG_INFINITY, f64::NAN, -0.0];
        let text = serde_json::to_string(&Numbers(vec![all.to_vec(), vec![]], [f64::NAN, 0.1, f64::MAX])).unwrap();
        assert!(text.starts_with(r#"[[[1.5,"inf","-inf","nan",-0.0],[]],["nan",0.1,"#), "{text}");
        let Numbers(rows, three) = serde_json::from_str(&text).unwrap();
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!((bits(&rows[0]), rows[1].len()), (bits(&all), 0));
        assert_eq!(bits(&three), bits(&[f64::NAN, 0.1, f64::MAX]));
        let Numbers(rows, _) = serde_json::from_str("[[[null, 2]], [1, 2, 3]]").unwrap();
        assert!(rows[0][0].is_nan() && rows[0][1] == 2.0);
        assert!(serde_json::from_str::<Numbers>(r#"[[["none"]], [1, 2, 3]]"#).is_err());
    }
}
