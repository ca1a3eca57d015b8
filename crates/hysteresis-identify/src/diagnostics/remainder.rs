//! What residuals follow: input, rate, amplitude or time.

use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::numeric::as_f64;
use crate::record::Record;
use crate::signal;

/// The findings that residuals may give.
pub(super) const CODES: [FindingCode; 4] =
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

/// What the residual follows: the strongest first, and then what the rest of it follows. So what two causes share is told
/// once.
pub(super) fn followed(record: &Record<'_>, residual: &[f64], lag: f64) -> Vec<Finding> {
    let mut causes = causes(record, lag);
    let (mut left, mut found) = (residual.to_vec(), Vec::new());
    loop {
        let measured = causes.iter().filter_map(|cause| Some((cause, follow(record, &left, cause)?)));
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
fn follow(record: &Record<'_>, residual: &[f64], cause: &Cause) -> Option<Followed> {
    const CHANCE: f64 = 16.0;
    const EACH_MORE: f64 = 2.0;
    let part = signal::projection(residual, &cause.columns);
    let correlation = match &cause.columns[..] {
        [column] => signal::correlation(residual, column)?,
        _ => signal::correlation(residual, &part)?,
    };
    if correlation.abs() * signal::rms(residual) < cause.matters * record.output_range() {
        return None;
    }
    let both = (signal::neighbours(residual) * signal::neighbours(&part)).max(0.0);
    let independent = as_f64(residual.len()) * (1.0 - both) / (1.0 + both);
    let chance = (CHANCE + EACH_MORE * as_f64(cause.columns.len() - 1)) / independent;
    Some(Followed { correlation, limit: cause.strong.max(chance.sqrt()), part })
}
