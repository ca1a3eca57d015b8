//! A tuning in words.

use super::family::ModeUncertainty;
use super::options::{Tuning, TuningOptions};
use super::structure::Structure;
use crate::filters::FeedbackFilter;

impl Tuning {
    /// In a few sentences: which structure was chosen and why, the bound and what reaches it, and what the loop does.
    ///
    /// ```
    /// use hysteresis_control::linear::SecondOrder;
    /// use hysteresis_control::tuning::{TuningOptions, tune};
    /// let (stage, options) = (SecondOrder::new(400.0, 0.95)?.into(), TuningOptions::new((0.7, 1.0), 1e-4, 1.7));
    /// let explanation = tune(&stage, &options)?.explanation(&options);
    /// assert!(explanation.starts_with("Proportional and integral gain alone"), "{explanation}");
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn explanation(&self, options: &TuningOptions) -> String {
        [self.of_structure(options), self.of_bound(options), self.of_loop()].join(" ")
    }

    fn of_structure(&self, options: &TuningOptions) -> String {
        let made = match self.structure {
            Structure::ProportionalIntegral => "Proportional and integral gain alone, without filters.".into(),
            Structure::LowPass => "A low-pass before both gains keeps the loop away from the resonance.".into(),
            Structure::ActiveDamping => {
                "A low-pass and a negative proportional gain damp the resonance actively.".into()
            }
            Structure::Notch => self.of_notches(),
        };
        if self.tried.is_empty() {
            return format!("{made} No mode has a damping ratio below 0.5, so nothing else was tried.");
        }
        let reached = Structure::ALL.iter().filter_map(|structure| {
            let (_, ki) = self.tried.iter().find(|(one, _)| one == structure)?;
            Some(format!("{} with {}", short(*ki), structure.in_use()))
        });
        let reached = reached.collect::<Vec<_>>().join(", ");
        let why = match options.structure {
            Some(_) => "This structure was asked for.",
            None => "Of those within 5 % of the greatest this is the simplest.",
        };
        format!("{made} Roughly, ki reaches {reached}. {why}")
    }

    fn of_notches(&self) -> String {
        let frequency = |filter: &FeedbackFilter| match filter {
            FeedbackFilter::Notch(notch) => Some(short(notch.frequency())),
            _ => None,
        };
        let at = self.filters.iter().filter_map(frequency).collect::<Vec<_>>().join(" and ");
        if self.filters.len() == 1 {
            format!("A notch before both gains takes out the resonance at {at} Hz.")
        } else {
            format!("Notches before both gains take out the resonances at {at} Hz.")
        }
    }

    fn of_bound(&self, options: &TuningOptions) -> String {
        let ((low, high), ModeUncertainty { frequency, damping }) = (options.slopes, options.uncertainty);
        let modes = if self.tried.is_empty() || options.uncertainty == ModeUncertainty::NONE {
            String::new()
        } else {
            let (percent, factor) = (short(100.0 * frequency), short(damping));
            format!(", with mode frequencies {percent} % either way and damping by a factor of {factor} either way")
        };
        let (peak, limit, low, high) =
            (short(self.peak_sensitivity), short(options.peak_sensitivity), short(low), short(high));
        format!(
            "The sensitivity peaks at {peak}, of {limit} allowed, over all slopes of the hysteresis from {low} to {high}{modes}."
        )
    }

    fn of_loop(&self) -> String {
        let (a, b) = (&self.at_min_slope, &self.at_max_slope);
        let (low, high) = (a.crossover.min(b.crossover), a.crossover.max(b.crossover));
        let crossover = match (low, high) {
            (_, 0.0) => "nowhere".into(),
            (low, high) => format!("at {} to {} Hz", short(low), short(high)),
        };
        let margin = |a: f64, b: f64, unit: &str| match a.min(b) {
            least if least.is_finite() => format!("of at least {}{unit}", short(least)),
            _ => "without end".into(),
        };
        let gain = margin(a.gain_margin, b.gain_margin, "");
        let phase = margin(a.phase_margin, b.phase_margin, " degrees");
        let (rejection, noise) = (short(self.rejection_bandwidth), short(self.noise_bandwidth));
        format!(
            "With the dynamics as they are known, |L| crosses 1 {crossover}, with a gain margin {gain} and a phase margin {phase}. \
             Disturbances are reduced up to {rejection} Hz. The position follows white noise of the sensor with a bandwidth of \
             {noise} Hz."
        )
    }
}

/// With four digits, without an exponent.
fn short(number: f64) -> String {
    format!("{number:.3e}").parse().map_or_else(|_| number.to_string(), |rounded: f64| rounded.to_string())
}

impl Structure {
    /// Behind "with".
    fn in_use(self) -> &'static str {
        match self {
            Self::ProportionalIntegral => "gains alone",
            Self::LowPass => "a low-pass",
            Self::ActiveDamping => "active damping",
            Self::Notch => "a notch",
        }
    }
}
