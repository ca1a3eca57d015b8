//! How large residuals are, where, and what they follow: input, rate, amplitude or time.

use crate::fit::colour::Colour;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::judge::sample_ranges::named_sample;
use crate::records::record::Record;
use crate::records::signal;
use crate::records::signal::{SWING, as_f64};

/// More is left than noise, beside the range of the position in all records.
pub(crate) fn poor_fit(residual: &[f64], range: f64) -> Finding {
    const LIMIT: f64 = 0.005;
    /// Noise counts as well, but by this share: rows that were put in another order leave nothing else.
    const NOISE: f64 = 0.15;
    let (whole, noise) = (signal::rms(residual) / range, signal::noise(residual) / range);
    let value = (whole * whole - noise * noise).max(0.0).sqrt().max(NOISE * whole);
    let message = format!(
        "the model leaves {:.2} % of the range rms of the position, of which noise is {:.2} %",
        100.0 * whole,
        100.0 * noise.min(whole)
    );
    Finding::new(FindingCode::PoorFit, value, LIMIT, message)
}

/// Residuals that are not white, where that matters beside the `range` of the position in all records and beside their
/// noise: a long record tells what is far below it.
pub(crate) fn coloured(colour: Colour, range: f64) -> Option<Finding> {
    const MATTERS: f64 = 1e-3;
    /// The share of the whole residual: less than a tenth of its squares.
    const SHARE: f64 = 0.3;
    let (share, limit) = (colour.correlated / range, MATTERS.max(SHARE * colour.whole / range));
    let message = format!(
        "the residual is correlated in time (statistic {:.0} of Ljung and Box), {:.2} % of the range rms is no white noise: the \
         noise is coloured or something is not modelled; the standard errors allow for it",
        colour.statistic,
        100.0 * share
    );
    let code = FindingCode::ResidualColoured;
    (colour.is_coloured() && share > limit).then(|| Finding::new(code, share, limit, message))
}

/// A beginning that lies on no loop of the model: until the residual is about as small as later on. It matters beside
/// the `range` of the position in all records.
pub(crate) fn start_up(record: &Record<'_>, residual: &[f64], range: f64) -> Option<Finding> {
    const LIMIT: f64 = 3.0;
    const BLOCKS: usize = 100;
    const SHORTEST: usize = 10;
    /// Fewer blocks have no beginning.
    const FEWEST: usize = 10;
    /// The longest beginning, as a share of the record.
    const LONGEST: f64 = 0.3;
    /// What is left of the beginning matters from this share of the range on.
    const MATTERS: f64 = 1e-3;
    /// The beginning ends where the residual is at most so many times that of most of the rest.
    const SETTLED: f64 = 1.5;
    let size = (residual.len() / BLOCKS).max(SHORTEST);
    let middle = signal::median(residual);
    let levels: Vec<f64> = residual.chunks_exact(size).map(|block| level(block, middle)).collect();
    if levels.len() < FEWEST {
        return None;
    }
    let largest = |levels: &[f64]| levels.iter().copied().fold(0.0, f64::max);
    let input = &record.input()[record.skip()..];
    let beginnings = (1..levels.len()).take_while(|blocks| as_f64(*blocks) <= LONGEST * as_f64(levels.len()));
    let is_large = |blocks: &usize| {
        let (begin, later) = (largest(&levels[..*blocks]), largest(&levels[*blocks..]));
        begin > (MATTERS * range).max(LIMIT * later) && swings_on(input, blocks * size)
    };
    let settles = |blocks: &usize| {
        levels[*blocks] <= SETTLED * signal::median(&levels[*blocks..]) && swings_on(input, blocks * size)
    };
    let first = beginnings.clone().find(is_large)?;
    let blocks = beginnings.filter(|blocks| (first..=2 * first).contains(blocks)).find(settles).unwrap_or(first);
    // What decays goes on after it is small, and the fit has taken a part of it up.
    let end = record.skip() + blocks * size + blocks * size / 2;
    let value = largest(&levels[..first]) / largest(&levels[first..]);
    let message =
        format!("the residual before {} is {value:.1} times as large as ever after", named_sample(record, end));
    let finding = Finding::new(FindingCode::StartUpTransient, value, LIMIT, message).at(end);
    Some(finding.try_next(format!("skip the first {end} samples of this record: --skip {end}")))
}

/// The rms of a block about the middle of all residuals, without the two largest, which may be outliers.
fn level(block: &[f64], middle: f64) -> f64 {
    const OUTLIERS: usize = 2;
    let mut magnitudes: Vec<f64> = block.iter().map(|e| (e - middle).abs()).collect();
    magnitudes.sort_unstable_by(f64::total_cmp);
    signal::rms(&magnitudes[..block.len() - OUTLIERS])
}

/// Whether the input moves about as far in the next loop or two as it did until `end`: a smaller residual of a smaller
/// motion is no sign of a transient.
fn swings_on(input: &[f64], end: usize) -> bool {
    const SAME: f64 = 0.7;
    /// The usual step before and after is alike within this factor: what a chirp does later is no settled beginning.
    const ALIKE: f64 = 2.5;
    let range = |values: &[f64]| {
        let (low, high) = signal::bounds(values);
        high - low
    };
    let turns = signal::turns(input, SWING * range(input));
    let next = turns.iter().copied().filter(|turn| *turn > end).nth(2).unwrap_or(input.len());
    let step = |values: &[f64]| signal::median(&signal::steps(values));
    let (before, after) = (step(&input[..end]), step(&input[end..]));
    // Less than a whole swing may lie about a turn, where a sine hardly moves.
    let is_alike = turns.get(2).is_none_or(|turn| *turn > end) || before.max(after) <= ALIKE * before.min(after);
    is_alike && range(&input[end..next.max(2 * end).min(input.len())]) >= SAME * range(&input[..end])
}

/// `unexplained` is what moves while the input stays at its end: the output, or with dynamics and creep the residual.
pub(crate) fn clipped_input(record: &Record<'_>, unexplained: &[f64], residual: &[f64]) -> Finding {
    const HELD: f64 = 0.05;
    const NOISE: f64 = 8.0;
    let (input, range) = (&record.input()[record.skip()..], record.output_range());
    let (value, first) = signal::travel_at_the_ends(input, unexplained, range);
    let limit = HELD + NOISE * signal::noise(residual) / range;
    let message = format!(
        "the recorded input stays at {:.6} from {} on while the output moves by {:.1} % of its range: a monitor at its end",
        input[first],
        named_sample(record, record.skip() + first),
        100.0 * value
    );
    Finding::new(FindingCode::ClippedInput, value, limit, message).at(record.skip() + first)
}

/// The findings that residuals may give.
pub(crate) const CODES: [FindingCode; 4] =
    [FindingCode::RateEffects, FindingCode::Drift, FindingCode::AmplitudeEffects, FindingCode::InputEffects];

/// Something that a residual may follow.
struct Cause {
    code: FindingCode,
    name: &'static str,
    means: &'static str,
    columns: Vec<Vec<f64>>,
    /// The multiple correlation from which on it counts.
    strong: f64,
    /// The share of the range, rms, from which on it counts.
    matters: f64,
}

/// What of the residual follows a cause.
struct Followed {
    correlation: f64,
    limit: f64,
    part: Vec<f64>,
}

/// What the residual follows: the strongest first, and then what the rest of it follows. So what two causes share is
/// told once. It matters beside the `range` of the position in all records.
pub(crate) fn followed(record: &Record<'_>, residual: &[f64], lag: f64, range: f64) -> Vec<Finding> {
    let mut causes = causes(record, lag);
    let (mut left, mut found) = (residual.to_vec(), Vec::new());
    loop {
        let measured = causes.iter().filter_map(|cause| Some((cause, follow(range, &left, cause)?)));
        let past = measured.filter(|(_, followed)| followed.correlation.abs() > followed.limit);
        let Some((cause, followed)) = past.max_by(|a, b| weight(a).total_cmp(&weight(b))) else {
            return found;
        };
        let value = followed.correlation;
        let message = format!("the residual follows {}, correlation {value:.2}: {}", cause.name, cause.means);
        found.push(Finding::new(cause.code, value.abs(), followed.limit, message));
        for (left, part) in left.iter_mut().zip(&followed.part) {
            *left -= part;
        }
        let code = cause.code;
        causes.retain(|cause| cause.code != code);
    }
}

/// How much speaks for a cause. In a drive that only decays, amplitude is time: then what is simpler counts.
fn weight((cause, followed): &(&Cause, Followed)) -> f64 {
    const OF_SEVERAL_COLUMNS: f64 = 0.9;
    followed.correlation.abs() * if cause.columns.len() > 1 { OF_SEVERAL_COLUMNS } else { 1.0 }
}

fn causes(record: &Record<'_>, lag: f64) -> Vec<Cause> {
    let input = &record.input()[record.skip()..];
    let (low, high) = signal::bounds(input);
    let place = |u: &f64| (2.0 * u - low - high) / (high - low);
    let power = |exponent: i32| input.iter().map(|u| place(u).powi(exponent)).collect();
    let amplitude = signal::last_swings(record.input(), 0.05 * (high - low)).split_off(record.skip());
    let product = input.iter().zip(&amplitude).map(|(u, swing)| place(u) * swing).collect();
    let time: Vec<f64> = (0..input.len()).map(as_f64).collect();
    let logarithm = time.iter().map(|t| t.ln_1p()).collect();
    let slow = "creep, temperature or another slow change";
    let cause = |code, name, means, columns, (strong, matters)| Cause { code, name, means, columns, strong, matters };
    let (slow_or_fast, of_amplitude, of_input) = ((0.3, 1e-4), (0.45, 1e-3), (0.6, 2e-3));
    vec![
        cause(
            FindingCode::RateEffects,
            "the speed of the input",
            "a lag, another rate effect, or loop width that the model lacks",
            vec![signal::speed(record.input(), record.skip(), lag)],
            slow_or_fast,
        ),
        cause(FindingCode::Drift, "time", slow, vec![time], slow_or_fast),
        cause(FindingCode::Drift, "the logarithm of time", slow, vec![logarithm], slow_or_fast),
        cause(
            FindingCode::AmplitudeEffects,
            "the amplitude of the last swing",
            "the gain or the centre of the loops changes with it",
            vec![amplitude, product],
            of_amplitude,
        ),
        cause(
            FindingCode::InputEffects,
            "the input",
            "a bend of the whole curve that the model lacks",
            vec![power(1), power(2), power(3)],
            of_input,
        ),
    ]
}

/// The part of the residual that follows a cause; nothing if it is too small to matter.
fn follow(range: f64, residual: &[f64], cause: &Cause) -> Option<Followed> {
    const CHANCE: f64 = 16.0;
    const EACH_MORE: f64 = 2.0;
    let part = signal::projection(residual, &cause.columns);
    let correlation = match &cause.columns[..] {
        [column] => signal::correlation(residual, column)?,
        _ => signal::correlation(residual, &part)?,
    };
    if correlation.abs() * signal::rms(residual) < cause.matters * range {
        return None;
    }
    let both = (signal::neighbours(residual) * signal::neighbours(&part)).max(0.0);
    let independent = as_f64(residual.len()) * (1.0 - both) / (1.0 + both);
    let chance = (CHANCE + EACH_MORE * as_f64(cause.columns.len() - 1)) / independent;
    Some(Followed { correlation, limit: cause.strong.max(chance.sqrt()), part })
}
