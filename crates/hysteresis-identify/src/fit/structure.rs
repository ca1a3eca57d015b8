//! What is left to cross-validation once everything was fitted: which terms stay, the weight law, and how smooth the weights
//! are.

use crate::creep_model::CreepModel;
use crate::error::Error;
use crate::fit::folds::{CrossValidation, Stretches, StretchesUnderLaw, Terms};
use crate::fit::levels::{enough, levels};
use crate::fit::point::{Parameter, Point};
use crate::fit::space::Space;
use crate::fit::variety::Variety;
use crate::fit::weight_basis::WeightBasis;
use crate::loop_shift_model::LoopShiftModel;
use crate::map_model::MapModel;
use crate::options::{ModelKind, Options, Setting, WeightLaw};
use crate::record::Record;

/// The laws that cross-validation chooses from, those with fewer unknowns first.
const LAWS: [WeightLaw; 3] = [WeightLaw::Quadratic, WeightLaw::Free, WeightLaw::Split];

/// How smooth the weights are while the terms are chosen, where their smoothness is left open: ragged weights follow what
/// a term leaves.
pub(crate) const USUAL_SMOOTHNESS: f64 = 1e-3;

/// How smooth the weights are where all loops are alike.
const SMOOTHNESS_OF_LIKE_LOOPS: f64 = 1e-2;

/// A structure, and what cross-validation said of it and of others.
#[derive(Clone, Default)]
pub(crate) struct Structure {
    pub(crate) weights: WeightLaw,
    pub(crate) smoothness: f64,
    /// How many amplitudes of creep.
    pub(crate) creep: usize,
    pub(crate) loop_shift: LoopShiftModel,
    pub(crate) terms_tried: Vec<CrossValidation>,
    pub(crate) weights_tried: Vec<CrossValidation>,
    pub(crate) smoothness_tried: Vec<CrossValidation>,
}

/// What was asked for, and where its fit is.
pub(crate) struct StructureProblem<'a> {
    pub(crate) records: &'a [Record<'a>],
    /// What was asked for, with the number of operators chosen.
    pub(crate) asked: &'a Options,
    /// Where everything was fitted but what is chosen here.
    pub(crate) space: &'a Space,
    pub(crate) point: &'a Point,
}

impl StructureProblem<'_> {
    /// Chooses the terms with weights of the widest law, then law and smoothness with these terms: of the candidates that
    /// predict stretches as well as the best, the simplest.
    pub(crate) fn choose(&self) -> Result<Structure, Error> {
        let Self { records, asked, space, .. } = *self;
        let space = space.with_loop_shift(records, asked.loop_shift)?;
        let shifts = space.shift_len();
        let laws = self.laws(&space)?;
        let laws: Vec<_> = laws.iter().map(|options| (options, WeightBasis::new(options, shifts))).collect();
        let Some((_, widest)) = laws.last() else { return Ok(Structure::default()) };
        let usual = if asked.smoothness == Setting::Fit { USUAL_SMOOTHNESS } else { asked.given_smoothness() };
        let levels = levels(records, &space, widest, usual, true)?;
        let projection = &levels[levels.len() - 1];
        let fit = projection.fit(self.point, None);
        let stretches = Stretches::new(projection, &fit);
        let under: Vec<_> = laws.iter().map(|(options, law)| stretches.under(options, law)).collect();
        let (terms, terms_tried) = self.terms(&under[under.len() - 1], &space, usual);
        let (best, tried): (Vec<_>, Vec<_>) = under.iter().map(|law| self.smoothness(law, &terms)).unzip();
        let good = CrossValidation::good(&best, self.margin()).next().unwrap_or(0);
        let is_chosen = |more: &[CrossValidation]| more.len() > 1;
        Ok(Structure {
            weights: best[good].weights,
            smoothness: best[good].smoothness,
            creep: terms.creep,
            loop_shift: terms.loop_shift,
            terms_tried,
            smoothness_tried: tried.into_iter().nth(good).filter(|tried| is_chosen(tried)).unwrap_or_default(),
            weights_tried: if is_chosen(&best) { best } else { Vec::new() },
        })
    }

    /// The options with every law to choose from, the widest one last: those for which there are too few samples left out.
    fn laws(&self, space: &Space) -> Result<Vec<Options>, Error> {
        let asked = self.asked;
        if asked.weights != WeightLaw::Auto {
            return Ok(vec![asked.clone()]);
        }
        let with = |weights| Options { weights, ..asked.clone() };
        // Few samples are no reason to believe in the law of few unknowns.
        enough(self.records, space, &WeightBasis::new(&with(WeightLaw::Free), space.shift_len()))?;
        let is_borne =
            |options: &Options| enough(self.records, space, &WeightBasis::new(options, space.shift_len())).is_ok();
        Ok(LAWS.into_iter().map(with).filter(Options::is_law_of_its_own).filter(is_borne).collect())
    }

    /// The terms that stay, and what cross-validation said of the best of every kind.
    fn terms(
        &self,
        stretches: &StretchesUnderLaw<'_>,
        space: &Space,
        smoothness: f64,
    ) -> (Terms, Vec<CrossValidation>) {
        let all = space.creep_amplitudes();
        let creeps: Vec<usize> = if self.asked.creep == CreepModel::Auto { (0..=all).collect() } else { vec![all] };
        let kinds = shift_kinds(self.asked.loop_shift, space);
        let (mut tried, mut candidates_of_kinds) = (Vec::new(), Vec::new());
        for shifts in kinds {
            for creep in &creeps {
                let candidates = shifts.iter().map(|shift| Terms { creep: *creep, loop_shift: *shift, smoothness });
                let validated = candidates.map(|terms| (stretches.cross_validate(&terms), terms));
                let best = validated.min_by(|(p, _), (q, _)| p.rmse.total_cmp(&q.rmse));
                candidates_of_kinds.extend(best.map(|(validation, terms)| {
                    tried.push(validation);
                    terms
                }));
            }
        }
        let good = CrossValidation::good(&tried, 1.0).next().unwrap_or(0);
        (candidates_of_kinds[good], if tried.len() > 1 { tried } else { Vec::new() })
    }

    /// The smoothness that predicts best under a law, and all that were tried. Where loops are alike one predicts the other
    /// with any weights: then it is a usual one, unless that is clearly worse.
    fn smoothness(&self, law: &StretchesUnderLaw<'_>, terms: &Terms) -> (CrossValidation, Vec<CrossValidation>) {
        let with = |smoothness: &f64| law.cross_validate(&Terms { smoothness: *smoothness, ..*terms });
        let tried: Vec<_> = self.asked.smoothnesses().iter().map(with).collect();
        let margin = self.margin();
        let is_alike = |place: &usize| margin > 1.0 && tried[*place].smoothness == SMOOTHNESS_OF_LIKE_LOOPS;
        let alike = CrossValidation::good(&tried, margin).find(is_alike).map(|place| &tried[place]);
        let best = alike.or_else(|| CrossValidation::best(&tried)).cloned();
        (best.unwrap_or_else(|| with(&0.0)), tried)
    }

    /// By which factor of the mean square error a law must be better than a simpler one.
    fn margin(&self) -> f64 {
        Variety::of(self.records).margin()
    }
}

/// The loop shifts to choose from, those of as many amplitudes together: none, one, two.
fn shift_kinds(asked: LoopShiftModel, space: &Space) -> Vec<Vec<LoopShiftModel>> {
    let Some(shift) = space.shift() else { return vec![vec![LoopShiftModel::None]] };
    if asked != LoopShiftModel::Auto {
        return vec![vec![asked]];
    }
    let of = |kind: fn(f64) -> LoopShiftModel| shift.filters.iter().map(|filter| kind(filter.time_constant)).collect();
    vec![vec![LoopShiftModel::None], of(LoopShiftModel::Square), of(LoopShiftModel::Both)]
}

/// Whether anything is left to [`StructureProblem::choose`].
pub(crate) fn is_open(options: &Options) -> bool {
    let laws = options.model == ModelKind::Modified || options.operators() > 4;
    (options.weights == WeightLaw::Auto && laws)
        || options.smoothness == Setting::Fit
        || options.creep == CreepModel::Auto
        || options.loop_shift == LoopShiftModel::Auto
        || options.input_map != MapModel::None
        || options.output_map != MapModel::None
}

/// A point with only the first amplitudes of creep.
pub(crate) fn with_creep_amplitudes(point: &Point, space: &Space, amplitudes: usize) -> Point {
    (amplitudes..space.creep_amplitudes()).fold(*point, |point, number| point.with(Parameter::Creep(number), 0.0))
}
