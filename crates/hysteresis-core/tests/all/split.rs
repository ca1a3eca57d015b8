//! Models with weights of their own for the family below zero.

use crate::support::models::actuator;
use hysteresis_core::{Error, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};

fn model(above: &[f64], below: &[f64]) -> ModifiedPrandtlIshlinskii {
    let r: Vec<f64> = [0.0, 1.0, 2.0][..above.len()].to_vec();
    ModifiedPrandtlIshlinskii::from_ratios(above, &r, Ratios::PLAY, Offsets::default())
        .unwrap()
        .with_negative_weights(below)
        .unwrap()
}

#[test]
fn equal_weights_and_no_split_are_the_same_model() {
    let plain = actuator();
    let same = plain.clone().with_negative_weights(plain.weights()).unwrap();
    assert_eq!(same, plain);
    assert!(!same.is_split() && same.weights_negative() == plain.weights());
    let other = model(&[1.0, 0.5], &[1.0, 0.25]);
    assert!(other.is_split() && other.weights() == [1.0, 0.5] && other.weights_negative() == [1.0, 0.25]);
    assert_ne!(other, model(&[1.0, 0.5], &[1.0, 0.5]));
    // A split is taken back.
    assert_eq!(other.with_negative_weights(&[1.0, 0.5]).unwrap(), model(&[1.0, 0.5], &[1.0, 0.5]));
}

#[test]
fn wrong_negative_weights_are_named() {
    let refused = |below: &[f64]| actuator().with_negative_weights(below).unwrap_err().to_string();
    assert_eq!(refused(&[1.0]), "weights_negative: expected 20 elements, got 1");
    let mut below = [1.0; 20];
    below[3] = f64::NAN;
    assert!(refused(&below).starts_with("weights_negative[3]: expected a finite number"));
}

#[test]
fn the_smaller_weight_of_every_operator_counts() {
    let check = |above: &[f64], below: &[f64]| model(above, below).check_invertible();
    assert_eq!(check(&[1.0, 0.5], &[2.0, -0.9]), Ok(()));
    assert_eq!(
        check(&[2.0, 0.5], &[1.0, -1.0]),
        Err(Error::NotInvertible { identity_weight: 1.0, negative_sum: -1.0 })
    );
    // Each family alone keeps the slope at 0.2, but while the input rises through zero the operator of small r slides
    // above zero and the one of large rc below: 1 - 0.8 - 0.8.
    assert!(check(&[1.0, -0.8, 0.0], &[1.0, 0.0, -0.8]).is_err());
    let mut stream = model(&[1.0, -0.8, 0.0], &[1.0, 0.0, -0.8]).forward();
    stream.step(-9.0);
    stream.step(1.5);
    assert!((stream.peek(1.6) - stream.peek(1.5) + 0.06).abs() < 1e-12, "both slide: the slope is -0.6");
}

#[test]
fn a_split_model_has_no_closed_form() {
    let error = model(&[1.0, 0.5], &[1.0, 0.25]).parametric_inverse(Ratios::PAPER_INVERSE).unwrap_err();
    let expected = "no closed-form inverse: operator 1: expected the same weight in both families, got 0.25";
    assert_eq!(error.to_string(), expected);
}

#[cfg(feature = "json")]
mod files {
    use hysteresis_core::{Model, SCHEMA, SCHEMA_SPLIT};

    use super::{actuator, model};

    #[test]
    fn only_a_split_model_is_of_schema_2() {
        let plain = Model::from(actuator()).to_json();
        assert!(plain.contains(SCHEMA) && !plain.contains("weights_negative"));
        let split = Model::from(model(&[1.0, 0.5], &[1.0, 0.25]));
        let text = split.to_json();
        assert!(text.contains(SCHEMA_SPLIT));
        assert_eq!(Model::from_json(&text).unwrap(), split);
        for cut in 0..text.trim_end().len() {
            assert!(Model::from_json(&text[..cut]).is_err(), "cut at {cut}");
        }
    }

    #[test]
    fn the_field_belongs_to_its_schema() {
        let text = Model::from(model(&[1.0, 0.5], &[1.0, 0.25])).to_json();
        let refused = |text: String| Model::from_json(&text).unwrap_err().to_string();
        let without = text.replace("weights_negative", "weights_negated");
        assert!(refused(without).contains("unknown field `weights_negated`"));
        assert!(refused(text.replace(SCHEMA_SPLIT, SCHEMA)).contains("unknown field `weights_negative` for schema"));
        let plain = Model::from(actuator()).to_json();
        assert!(refused(plain.replace(SCHEMA, SCHEMA_SPLIT)).contains("missing field `weights_negative`"));
        assert!(refused(text.replace("0.25", "1e999")).contains("not a model file"));
        assert!(refused(text.replace("0.25\n", "0.25, 0.1\n")).contains("weights_negative: expected 2 elements"));
        let null = plain.replace("\"input_offset\"", "\"weights_negative\": null, \"input_offset\"");
        assert!(refused(null).contains("not a model file"));
        let conventional = "{\"schema\": \"mpi_hyst/model/2\", \"model\": \"conventional\", \"weights\": [1.0], \
                            \"thresholds\": [0.0], \"input_offset\": 0.0, \"output_offset\": 0.0}";
        assert!(refused(conventional.into()).contains("a conventional model for schema"));
    }
}
