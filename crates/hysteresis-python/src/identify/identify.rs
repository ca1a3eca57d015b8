//! Identification: arguments in, a model and its errors out.

use hysteresis_identify::{
    self as identification, AmplifierModel, CreepModel, DuhemModel, DynamicsModel, LoopShiftModel, Loss, MapModel,
    ModelKind, ModesModel, Options, RatiosModel, RelaxingPlaysModel, Setting, SlowGainModel, Stop, WeightLaw,
};
use hysteresis_python_macros::function;
use pyo3::prelude::*;

use super::identification::Identification;
use super::options::{Operators, Placing, Smoothness, placed};
use super::records::{GivenRecords, HeldOut, Interval, Skips};
use super::watch::Watch;
use crate::argument::Callable;
use crate::convert::errors;

/// Fits a model to measured records.
///
/// y = output_offset + G[creep[g (sum_i w_i z_i + z + s + r)]], z_i the operators at u - input_offset, z the Duhem
/// operator there, s the loop shift, r plays that relax, g the slow gain, G the linear dynamics and a dead time; y(k)
/// is read at the moment at which u(k) is put out. Weights are non-negative least squares, exact at every step of a
/// search over everything else. Every record starts from the virgin state, at rest at its first input, and has its own
/// output offset.
///
/// What is "auto" is left to cross-validation: stretches of the records are predicted from fits to the others, and the
/// simplest model that predicts as well as the best stays.
///
/// Parameters
/// ----------
/// u, y : arrays of n floats
///     Input (V) and measured output (um). Or, for several records in one fit, a list of (u, y) pairs as the only
///     argument.
/// dt : float or list of float, optional
///     Sampling interval in seconds, one for all records or one for each. Without it times are in samples, and only the
///     hysteresis can be fitted.
/// times : array or list of arrays, optional
///     When every sample was taken, in seconds, for each record. They change no fit, and give no dt: a warning tells
///     gaps and jitter. Times that do not increase are refused, and so are those whose usual step differs from dt by
///     more than 1 % and their jitter.
/// model : "modified" or "conventional"
///     Coupled plays, or plays for comparison.
/// weights : "auto", "free", "quadratic" or "split"
///     Any w_i >= 0; or w_0 >= 0 and w_i = c0 + c1 i + c2 i^2 >= 0; or weights of their own below zero, which only the
///     modified model has. "auto" takes the first of quadratic, free and split that predicts held-out stretches of the
///     records as well as the best, within the standard error of the ratio of their mean squares. Where that is the
///     quadratic law, free weights are judged once more with every number of operators that is tried.
/// operators : int or "auto", optional
///     How many. With uniform thresholds r_i = i X / n; the first is the identity. X is half the range of u for plays,
///     and the largest |u - input_offset| for coupled plays. Without a number there are as many as thresholds that are
///     given; else 20, or 40 or 80 where each doubling predicts held-out stretches of the records better, by 2 % of the
///     error at least and by more than its standard error. "auto" takes the fewest of 4 to 80 that predict them as well
///     as any. Either is chosen with everything else in the model; every stretch is predicted from weights fitted to
///     the others, all that is searched linearised about its values for all. A sample costs the same with any number of
///     operators.
/// ratios : "auto", "fit" or (ra, rb, rc)
///     Thresholds of the coupled plays as fractions of r. Plays have (1, 1, 1). "auto" takes plays, unless coupled
///     plays predict held-out stretches better by a tenth of the error; then everything is searched once more with
///     these. "fit" takes coupled plays. So does "auto" where weights, smoothness and all terms are given. Beside a
///     `Duhem` that is given it takes plays.
/// input_offset : "fit" or float
///     In the unit of u. That of plays says where they are virgin: "fit" is where the first record begins, or 0, an end
///     of the range or its middle if the plays alone fit far better with that. The conventional model fixes it at the
///     middle of the input range.
/// dead_time : "fit" or float
///     What y lags u besides, in seconds; in samples where there is no dt. In loops of one size and speed, more than a
///     sample must lower the error of prediction by a tenth, unless another term would take its place.
/// dynamics : "auto", None, 2 or 1
///     Linear dynamics behind the hysteresis: of second order, or a first-order lag. They need dt and records that
///     reach their frequency; a warning says if these do not tell those that were asked for. "auto" is 2, 1 or None: 1
///     in the place of an overdamped 2 that is not told from it, or where that predicts better behind a map. In loops of
///     one size and speed, a mode without damping must halve the error of prediction.
/// modes : "auto", 1, 2 or 3
///     How many modes in parallel the second-order dynamics have: G(s) = sum_i g_i / ((s/w_i)^2 + 2 zeta_i s/w_i + 1),
///     the gains g_i sum to 1. "auto" begins with one, and adds a second and a third as far as the records tell them. A
///     warning says if they tell fewer than were asked for.
/// creep : "auto", None, "log", int or array
///     Creep: log-type with one amplitude, so many terms a decade apart, or these time constants in seconds. "auto" is
///     none, log-type with one amplitude or with two, or a term with an amplitude of its own at 10 ms, 0.1 s, 1 s, 10 s
///     and 100 s, as the records tell it.
/// loop_shift : "auto", None or float
///     How far the centre of a loop moves with its amplitude, of this time constant in seconds: see `plant.LoopShift`.
///     It holds at the rates of the records only.
/// relaxing_plays : "auto", None, "fit", float or array
///     Plays that follow within a time of their own, for loops whose width depends on the rate: see
///     `plant.RelaxingPlays`. Their thresholds are five from 0 to 0.6 of half the range of u. Their time constants, in
///     seconds, are the given ones; or, of "fit", about two in a decade, from 1 ms (ten samples) to 100 s (a third of
///     the longest record). They are virgin where the search of the input offset begins: at the first drive of the
///     first record, or at the `input_offset` that is given. "auto" has them in place of creep where loops are of
///     several sizes, the drive moves at several speeds or rests, and they lower the error of held-out stretches by a
///     tenth.
/// slow_gain : "auto", None, "fit" or float
///     How the size of all loops changes while the drive cycles, of this time constant in seconds, or of one that is
///     searched: see `plant.SlowGain`. About 30 s for piezo stacks; it is told by records that last at least as long.
///     "auto" has one of 30 s where such records are predicted better with it by a tenth.
/// duhem : "auto", None, "fit" or Duhem
///     A Duhem operator beside the plays, for loops that do not close or that plays do not describe: f+ and f- at up to
///     five knots. "auto" searches one where plays leave 0.03 % of the range and more than white noise, and an operator
///     of a few shapes, added or subtracted, promises a twentieth of the error; it stays if it predicts held-out
///     stretches better by a tenth. It must halve the error where loops only decay or are all alike, and where what
///     plays leave looks like a drift. Of loops that are all alike it must leave no more beside the noise than the
///     noise, too: many operators follow such loops. "fit" has one wherever it lowers the error, leaves an inverse and
///     does not run away on other drives. A `Duhem` is where the search begins: its knots move with its amplitude, by a
///     factor of 4.5 at most. See the findings `no_inverse` and `operator_runs_away`.
/// amplifier : "auto", None or float
///     The amplifier in front of the hysteresis, a first-order lag: of this bandwidth in Hz, beside second-order
///     dynamics or with `dynamics=None`. "auto" fits one beside second-order dynamics if the records tell its lag from
///     a dead time. It has one in place of dynamics where that predicts held-out stretches better by a tenth.
/// input_map, output_map : "auto", None or "smooth"
///     A rising map of the drive in front of the hysteresis, and of the position behind it, over the range of the
///     records: the logarithm of its slope is a cubic, all of them straight pieces in the stage. "auto" fits the one
///     that predicts held-out stretches better by a tenth of the error, and both if the other one gains as much again.
///     Where loops are all alike a map must halve the error of a fit that leaves 0.5 % of the range, or lower it by
///     more where less is left; where 2 % is left, by a fifth. Loops that only decay must say more for a map than for
///     a loop shift: see the finding `map_not_told`.
/// thresholds : "uniform", "quantiles", "geometric" or array, optional
///     The r_i: evenly spaced, at quantiles of the amplitudes at which u turns round, growing by a constant factor, or
///     given. "geometric" gives small loops more operators: r_i = X / q^(n - i), i >= 1, q = min(2, 100^(1 / (n - 1))):
///     from X / 100 on.
/// smoothness : float or "auto"
///     Adds smoothness U D to the sum of squared errors: U the sum of squares of u about its mean, D that of the second
///     differences w_(i-1) - 2 w_i + w_(i+1), i >= 1, of each family (of weights per threshold interval, divided, where
///     thresholds are uneven). A number without unit: 1 weighs such a difference like an error of the slope w_0.
///     "auto" takes of 0 and the decades 1e-6 to 100 the one that predicts held-out stretches best.
/// loss : "auto", "squares" or "robust"
///     What glitches of y do to the fit: single wrong samples, or runs of up to 25. "auto" leaves those out that lie
///     more than seven standard deviations of the residual from the samples about them, and begin and end abruptly; a
///     record without any gives the very fit of "squares", which counts all samples. "robust" does so from 4.5 standard
///     deviations on, for records that are known to have glitches. `left_out_samples` of the result names them.
/// skip : int or list of int
///     Leading samples of each record that set the memory but are not fitted, or a time such as "2s".
/// validate : (u, y), (u, y, skip), a list of these, float, int or list of int, optional
///     Records that are held out, each judged with the output offset that suits it. Or a part at the end of every
///     record that is held out, judged with the record's own offset: a share, or the sample or time ("2s") from which
///     on, one for all records or a list of one for each.
/// progress : callable, optional
///     Called with (fraction done, best rms error so far), in the calling thread. Ctrl-C stops either way. Records of
///     10 000 samples or more together are fitted on all processors; the result has the same bits for any number of
///     them.
/// keep_partial : bool
///     Whether Ctrl-C, or a KeyboardInterrupt that progress raises, ends the search with the best so far as the result,
///     its `partial` True, instead of a KeyboardInterrupt.
///
/// Returns
/// -------
/// Identification
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> actuator = mh.paper.table_1_recovered()
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=1000)
/// >>> found = mh.identify(u, actuator.forward().run(u), input_offset=0.0, dead_time=0.0)
/// >>> [round(ratio, 4) for ratio in found.ratios]
/// [0.95, 0.3, 0.35]
#[function]
#[gather(options: Options)]
pub(crate) fn identify(
    py: Python<'_>,
    #[py("Records")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike | None" = None)] y: Option<&Bound<'_, PyAny>>,
    #[py(*, = None)] dt: Option<Interval>,
    #[py("ArrayLike | Sequence[ArrayLike | None] | None" = None)] times: Option<&Bound<'_, PyAny>>,
    #[py(field = "modified")] model: ModelKind,
    #[py(= None)] operators: Option<Operators>,
    #[py(field = "auto")] weights: WeightLaw,
    #[py(field = "auto")] ratios: RatiosModel,
    #[py(field = "fit")] input_offset: Setting<f64>,
    #[py(field = "fit")] dead_time: Setting<f64>,
    #[py(field = "auto")] dynamics: DynamicsModel,
    #[py(field = "auto")] modes: ModesModel,
    #[py(field = "auto")] creep: CreepModel,
    #[py(field = "auto")] loop_shift: LoopShiftModel,
    #[py(field = "auto")] relaxing_plays: RelaxingPlaysModel,
    #[py(field = "auto")] slow_gain: SlowGainModel,
    #[py(field = "auto")] duhem: DuhemModel,
    #[py(field = "auto")] amplifier: AmplifierModel,
    #[py(field = "auto")] input_map: MapModel,
    #[py(field = "auto")] output_map: MapModel,
    #[py(= None)] thresholds: Option<Placing>,
    #[py(field = "auto")] smoothness: Smoothness,
    #[py(field = "auto")] loss: Loss,
    #[py(= 0)] skip: Skips,
    #[py("HeldOut | Sequence[HeldOut] | float | str | Sequence[Skip] | None" = None)] validate: Option<
        &Bound<'_, PyAny>,
    >,
    #[py("Callable[[float, float], object] | None" = None)] progress: Option<Callable>,
    #[py(= false)] keep_partial: bool,
) -> PyResult<Identification> {
    let given = GivenRecords::new(u, y, Some(&skip), dt, &[])?.at(times)?;
    let options = Options { dt: given.common_dt(), thresholds: placed(thresholds, operators)?, ..options };
    let held_out = validate.map(|validate| HeldOut::from_python(validate, &given)).transpose()?;
    let records = given.fitted(held_out.as_ref())?;
    let validations = held_out.as_ref().map_or(Ok(Vec::new()), |held_out| held_out.records(&given))?;
    let mut watch = Watch::new(progress);
    let found = py.detach(|| {
        identification::identify(&records, &options, &mut |now| {
            let looked = watch.look((now.fraction, now.best_rmse));
            let keeps = || keep_partial && watch.is_interrupted();
            looked.map_break(|()| if keeps() { Stop::KeepBest } else { Stop::Discard })
        })
    });
    let mut found = found.or_else(|error| {
        watch.check()?;
        Err(match error {
            identification::Error::Record { record, error } => given.refused(record, error),
            error => errors::identification(error),
        })
    })?;
    let has_own_offsets = held_out.as_ref().is_some_and(HeldOut::has_own_offsets);
    let own_offset = |i: usize| has_own_offsets.then(|| found.output_offsets[i]);
    let validations: Vec<_> = validations.into_iter().enumerate().map(|(i, record)| (record, own_offset(i))).collect();
    let validations = found.validate_all(&validations);
    Ok(Identification::new(found, validations))
}
