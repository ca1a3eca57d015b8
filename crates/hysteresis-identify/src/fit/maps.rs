//! Whether a map in front of the hysteresis or behind it predicts better than none.

use std::sync::Arc;

use super::choice::levels;
use super::folds::{CrossValidation, Stretches, Terms};
use super::monitor::{SearchMonitor, Span};
use super::point::Point;
use super::projection::ProjectedFit;
use super::regressor::Regressor;
use super::search::attempt;
use super::space::{OutputMap, Space};
use super::weight_basis::WeightBasis;
use crate::error::Error;
use crate::loop_shift_model::LoopShiftModel;
use crate::options::Options;
use crate::record::Record;

/// How many passes over the records a map may take to find its shape.
const PASSES: usize = 15;

/// Where a fit is, and what is fitted there.
#[derive(Clone)]
pub(crate) struct Place {
    pub(crate) space: Space,
    pub(crate) point: Point,
}

/// Records, and what is known before maps are searched.
pub(crate) struct MapProblem<'a> {
    pub(crate) records: &'a [Record<'a>],
    pub(crate) options: &'a Options,
    pub(crate) basis: &'a WeightBasis,
    pub(crate) smoothness: f64,
}

impl MapProblem<'_> {
    /// The best place without a map, with an input map or with an output map, as cross-validation asks for.
    pub(crate) fn choose(
        &self,
        found: &Place,
        fit: &ProjectedFit,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<Place, Error> {
        let spaces = [
            found.space.clone(),
            found.space.with_output_map(self.output_map(found, fit)),
            found.space.with_input_map(),
        ];
        let (mut places, mut tried) = (Vec::new(), Vec::new());
        for (number, space) in spaces.into_iter().enumerate() {
            let span = Span { from: 0.0, to: 0.5 };
            let span = Span { from: span.at(number, 3), to: span.at(number + 1, 3) };
            let levels = levels(self.records, &space, self.basis, self.smoothness, true)?;
            let fit = attempt(&levels[levels.len() - 1], self.basis, &found.point, PASSES, span, monitor)?;
            let stretches = Stretches::new(&levels[levels.len() - 1], &fit);
            let terms = Terms {
                creep: space.creep_amplitudes(),
                loop_shift: LoopShiftModel::Auto,
                smoothness: self.smoothness,
            };
            tried.push(stretches.under(self.options, self.basis).cross_validate(&terms));
            eprintln!("MAP {number} cv {} fit {}", tried[number].rmse, levels[levels.len()-1].rmse(fit.squares));
            drop(levels);
            places.push(Place { space, point: fit.point });
        }
        let good: Vec<usize> = CrossValidation::good(&tried, 1.0).collect();
        let least = |a: &usize, b: &usize| tried[*a].rmse.total_cmp(&tried[*b].rmse);
        let best = if good.contains(&0) { Some(0) } else { good.into_iter().min_by(least) };
        Ok(places.swap_remove(best.unwrap_or(0)))
    }

    /// An output map over what the hysteresis puts out.
    fn output_map(&self, found: &Place, fit: &ProjectedFit) -> OutputMap {
        let operators = found.space.operators(&found.point);
        let weights = &fit.weights;
        let mut bounds = (f64::INFINITY, f64::NEG_INFINITY);
        for (place, record) in self.records.iter().enumerate() {
            let dt = found.space.intervals().of_record(place);
            let mut regressor = Regressor::new(&operators, record.input(), 0.0, dt);
            for k in 0..record.input().len() {
                regressor.go_to(k, None);
                let h = regressor.output(weights);
                bounds = (bounds.0.min(h), bounds.1.max(h));
            }
        }
        OutputMap { bounds, reference: Arc::from(&weights[..operators.bank.len()]) }
    }
}
