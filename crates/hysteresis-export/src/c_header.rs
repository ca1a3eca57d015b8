//! A header of constants for C99 and C++11, and the stage as bytes.

use std::fmt::Write as _;

use hysteresis_control::binary::Binary;
use hysteresis_control::filters::sections;
use hysteresis_control::linear::Creep;
use hysteresis_control::oscillator::tables;
use hysteresis_control::stage::{PEAK_SENSITIVITY, Stage};
use hysteresis_core::{CoupledPlay, PiecewiseLinearMap};
use sha2::{Digest, Sha256};

use crate::error::Error;

/// What is asked of a header.
#[derive(Clone, Copy, Debug)]
pub struct HeaderOptions<'a> {
    /// What every name begins with: a name of C.
    pub name: &'a str,
    /// The sampling interval in seconds for which a controller is tuned; without it there is no controller.
    pub dt: Option<f64>,
    /// The SHA-256 of the stage file; without it that of the file that the stage would be saved as.
    pub sha256: Option<&'a str>,
}

/// The header: thresholds, weights, offsets, limits, maps and, for a sampling interval, gains and filters; then the
/// stage as bytes.
///
/// Numbers are written so that a compiler reads them back bit for bit.
///
/// ```
/// use hysteresis_control::stage::{Stage, StageParts};
/// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// use hysteresis_export::{HeaderOptions, c_header};
/// let hysteresis =
///     ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 20.0], Ratios::PAPER, Offsets::default())?;
/// let stage = Stage::new(StageParts::new(hysteresis))?;
/// let header = c_header(&stage, &HeaderOptions { name: "x_axis", dt: None, sha256: None })?;
/// assert!(header.contains("#define X_AXIS_OPERATORS 2\n"));
/// assert!(header.contains("static const X_AXIS_REAL x_axis_r[2] = {\n    0.0, 20.0,\n};\n"));
/// # Ok::<(), hysteresis_export::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for a name that is none of C, and as [`Stage::tune`] for a sampling interval.
pub fn c_header(stage: &Stage, options: &HeaderOptions<'_>) -> Result<String, Error> {
    let name = options.name;
    if name.is_empty() || c_name(name) != name {
        return Err(Error::argument("name", "a name of C: letters, digits and underscores, no digit first", name));
    }
    let mut header = Header { name, upper: name.to_ascii_uppercase(), text: String::new() };
    header.open(stage, options.sha256);
    header.properties(stage);
    header.operators(stage);
    header.surroundings(stage);
    if let Some(dt) = options.dt {
        header.controller(stage, dt)?;
    }
    header.bytes(&stage.to_bytes());
    Ok(header.text)
}

struct Header<'a> {
    name: &'a str,
    upper: String,
    text: String,
}

impl Header<'_> {
    fn line(&mut self, line: &str) {
        self.text.push_str(line);
        self.text.push('\n');
    }

    fn open(&mut self, stage: &Stage, sha256: Option<&str>) {
        let (upper, version) = (self.upper.clone(), env!("CARGO_PKG_VERSION"));
        let units = &stage.parts().units;
        let (drive, position) = (comment(&units.drive), comment(&units.position));
        let own = || digest(&[&stage.to_json(), "\n"]);
        let sha256 = sha256.map_or_else(own, comment);
        self.text = format!(
            r#"/* The constants of a stage, for C99 and C++11. Made by mpi_hyst {version} (mpi-hyst export --c).
 * Drives are in {drive}, positions in {position}, times in seconds, frequencies in Hz.
 *
 * Operator i has the weight w, the weight v below zero, and the thresholds r, ra, rb, rc in {drive}. It is two one-sided plays:
 *     p_i = max(0, x - r, min(x + rb, p_i))    n_i = max(0, -x - ra, min(-x + rc, n_i))    x = drive - input offset
 *     position = output offset + sum of (w_i p_i - v_i n_i)
 * A map in front of it changes the drive, one behind it the position. */
#ifndef {upper}_H
#define {upper}_H

/* Define it as float before this line for numbers of that type. */
#ifndef {upper}_REAL
#define {upper}_REAL double
#endif

/* Of the stage file, or of the one that this stage would be saved as. */
#define {upper}_SHA256 "{sha256}"

"#
        );
    }

    /// A number.
    fn number(&mut self, what: &str, value: f64, unit: &str) {
        let upper = &self.upper;
        let _ = writeln!(self.text, "#define {upper}_{what} (({upper}_REAL){value:?}) /* {unit} */");
    }

    /// A number of things.
    fn count(&mut self, what: &str, count: usize) {
        let _ = writeln!(self.text, "#define {}_{what} {count}", self.upper);
    }

    /// Numbers that may be missing: then there is no macro of their names.
    fn optional<const N: usize>(&mut self, what: &str, numbers: Option<[(&str, f64); N]>, unit: &str) {
        self.count(&format!("HAS_{what}"), usize::from(numbers.is_some()));
        for (name, value) in numbers.into_iter().flatten() {
            self.number(name, value, unit);
        }
    }

    /// An array, one number or one row for each element.
    fn array(&mut self, what: &str, dimensions: &str, numbers: impl IntoIterator<Item = String>) {
        let (name, upper) = (self.name, &self.upper);
        let _ = writeln!(self.text, "static const {upper}_REAL {name}_{what}{dimensions} = {{");
        self.rows(numbers, 8);
        self.line("};");
    }

    fn rows(&mut self, elements: impl IntoIterator<Item = String>, in_a_row: usize) {
        let elements: Vec<String> = elements.into_iter().collect();
        for row in elements.chunks(in_a_row) {
            self.line(&format!("    {},", row.join(", ")));
        }
    }

    fn numbers(&mut self, what: &str, numbers: &[f64]) {
        self.array(what, &format!("[{}]", numbers.len()), numbers.iter().map(|x| format!("{x:?}")));
    }

    fn properties(&mut self, stage: &Stage) {
        let parts = stage.parts();
        let (drive, position) = (comment(&parts.units.drive), comment(&parts.units.position));
        let limits = |low, high| move |(from, to): (f64, f64)| [(low, from), (high, to)];
        self.line("/* What the drive may do, and what comes of it. */");
        self.optional("LIMITS", parts.limits.map(limits("LIMIT_LOW", "LIMIT_HIGH")), &drive);
        let slew = parts.slew.map(|slew| [("SLEW", slew)]);
        self.optional("SLEW", slew, &format!("{drive} per second"));
        self.number("REST_DRIVE", stage.rest_drive(), &drive);
        let range = stage.position_range().map(limits("POSITION_LOW", "POSITION_HIGH"));
        self.optional("POSITION_RANGE", range, &position);
        let (low, high) = stage.slope_range();
        let slope = format!("{position} per {drive}");
        self.number("SLOPE_LOW", low, &slope);
        self.number("SLOPE_HIGH", high, &slope);
        self.number("DEAD_TIME", parts.dead_time, "s");
        let noise = parts.noise.map(|noise| [("NOISE", noise)]);
        self.optional("NOISE", noise, &format!("{position}, rms"));
        let bandwidth = parts.amplifier.map(|amplifier| [("AMPLIFIER_BANDWIDTH", amplifier.frequency())]);
        self.optional("AMPLIFIER", bandwidth, "Hz");
        self.count("DYNAMICS_ORDER", parts.dynamics.order());
        self.line("");
    }

    fn operators(&mut self, stage: &Stage) {
        let (model, units) = (&stage.parts().hysteresis, &stage.parts().units);
        let (drive, position) = (comment(&units.drive), comment(&units.position));
        self.line(&format!("/* The hysteresis: weights in {position} per {drive}, thresholds in {drive}. */"));
        self.count("OPERATORS", model.operators().len());
        self.number("INPUT_OFFSET", model.offsets().input, &drive);
        self.number("OUTPUT_OFFSET", model.offsets().output, &position);
        self.numbers("w", model.weights());
        self.numbers("v", model.weights_negative());
        let of = |which: fn(&CoupledPlay) -> f64| model.operators().iter().map(which).collect::<Vec<_>>();
        for (name, numbers) in [
            ("r", of(CoupledPlay::r)),
            ("ra", of(CoupledPlay::ra)),
            ("rb", of(CoupledPlay::rb)),
            ("rc", of(CoupledPlay::rc)),
        ] {
            self.numbers(name, &numbers);
        }
        self.line("");
    }

    /// Maps, loop shift, relaxing plays, slow gain, creep and temperature.
    fn surroundings(&mut self, stage: &Stage) {
        let parts = stage.parts();
        self.line("/* Around the hysteresis: points of the maps, straight lines between them. */");
        for (name, map) in [("input_map", &parts.input_map), ("output_map", &parts.output_map)] {
            let points = map.iter().flat_map(PiecewiseLinearMap::points);
            let (x, y): (Vec<f64>, Vec<f64>) = points.unzip();
            self.count(&format!("{}_POINTS", name.to_ascii_uppercase()), x.len());
            if !x.is_empty() {
                self.numbers(&format!("{name}_x"), &x);
                self.numbers(&format!("{name}_y"), &y);
            }
        }
        let tables = parts.duhem.as_ref().map(|duhem| tables(duhem));
        self.count("DUHEM_KNOTS", tables.as_ref().map_or(0, |[knots, ..]| knots.len()));
        if let Some([knots, rising, falling]) = tables {
            self.line("/* z of a Duhem operator is added to the hysteresis, 0 at x = 0: dz/dx where x rises, and where it falls, at knots of z.");
            self.line(" * Straight lines between them. Beyond the outer knots dz/dx stays, but where it is above 0 and grows outwards its line goes on. */");
            self.numbers("duhem_knots", &knots);
            self.numbers("duhem_rising", &rising);
            self.numbers("duhem_falling", &falling);
        }
        self.count("HAS_LOOP_SHIFT", usize::from(parts.loop_shift.is_some()));
        let plays = parts.relaxing_plays.as_ref();
        self.count("RELAXING_PLAYS", plays.map_or(0, |plays| plays.thresholds().len()));
        if let Some(plays) = plays {
            self.line("/* Plays of the drive less the origin go through first-order lags beside the loop shift: a row of weights for every lag. */");
            self.count("RELAXING_LAGS", plays.time_constants().len());
            self.numbers("relaxing_thresholds", plays.thresholds());
            self.numbers("relaxing_origin", &[plays.origin()]);
            self.numbers("relaxing_time_constants", plays.time_constants());
            self.numbers("relaxing_weights", &plays.weights().concat());
        }
        self.count("HAS_SLOW_GAIN", usize::from(parts.slow_gain.is_some()));
        if let Some(gain) = &parts.slow_gain {
            self.line("/* Loops become smaller while the drive cycles: half range, amplitude, zero, time constant. */");
            self.numbers("slow_gain", &[gain.half_range(), gain.amplitude(), gain.zero(), gain.time_constant()]);
        }
        let (amplitudes, times) = parts
            .creep
            .as_ref()
            .map_or((&[][..], &[][..]), |creep: &Creep| (creep.amplitudes(), creep.time_constants()));
        self.count("CREEP_TERMS", amplitudes.len());
        if !amplitudes.is_empty() {
            self.numbers("creep_amplitudes", amplitudes);
            self.numbers("creep_time_constants", times);
        }
        self.count("HAS_TEMPERATURE", usize::from(parts.temperature.is_some()));
        if let Some(term) = &parts.temperature {
            self.line("/* Behind all of it theta follows the temperature with the time constant, and sensitivity (theta - reference)");
            self.line(" * is added to the position: sensitivity, time constant, reference. */");
            self.numbers("temperature", &[term.sensitivity(), term.time_constant(), term.reference()]);
        }
        self.line("");
    }

    fn controller(&mut self, stage: &Stage, dt: f64) -> Result<(), Error> {
        let tuning = stage.tune(dt, PEAK_SENSITIVITY)?;
        let filters = sections(&tuning.filters, dt)?;
        let filters = filters.as_slice();
        let units = &stage.parts().units;
        let gain = format!("{} per {}", comment(&units.drive), comment(&units.position));
        self.line(&format!("/* The feedback tuned for this sampling interval, as `controller` has it: peak sensitivity {PEAK_SENSITIVITY:?}."));
        self.line(
            " * Filter i stands before both gains: y(k) = b0 x(k) + b1 x(k-1) + b2 x(k-2) - a1 y(k-1) - a2 y(k-2). */",
        );
        self.number("DT", dt, "s");
        self.number("KP", tuning.kp, &gain);
        self.number("KI", tuning.ki, &format!("{gain} and second"));
        self.count("FILTERS", filters.len());
        if !filters.is_empty() {
            let row = |numbers: &[f64]| {
                format!("{{{}}}", numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(", "))
            };
            self.array(
                "filter_b",
                &format!("[{}][3]", filters.len()),
                filters.iter().map(|filter| row(&filter.numerator())),
            );
            self.array(
                "filter_a",
                &format!("[{}][2]", filters.len()),
                filters.iter().map(|filter| row(&filter.denominator())),
            );
        }
        self.line("");
        Ok(())
    }

    fn bytes(&mut self, bytes: &[u8]) {
        let (name, n) = (self.name, bytes.len());
        self.line(&format!(
            "/* The whole stage: mpih_stage_from_bytes({name}_stage, sizeof {name}_stage, &stage) of mpi_hyst.h. */"
        ));
        self.line(&format!("static const unsigned char {name}_stage[{n}] = {{"));
        self.rows(bytes.iter().map(|byte| format!("0x{byte:02x}")), 20);
        self.line("};");
        self.line("");
        self.line("#endif");
    }
}

/// A text in a comment or a string: without what ends those, on one line.
fn comment(text: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || " %.^°-()[]·²³".contains(c);
    text.chars().map(|c| if plain(c) { c } else { '_' }).collect()
}

/// A name of C for a text: what no name may have becomes an underscore.
///
/// ```
/// assert_eq!(hysteresis_export::c_name("x axis-2"), "x_axis_2");
/// assert_eq!(hysteresis_export::c_name("2nd"), "_2nd");
/// ```
#[must_use]
pub fn c_name(text: &str) -> String {
    let name: String = text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_') { name } else { format!("_{name}") }
}

/// Of texts, one behind the other.
pub(crate) fn digest(texts: &[&str]) -> String {
    let mut hash = Sha256::new();
    for text in texts {
        hash.update(text);
    }
    let digits = |byte: &u8| [byte >> 4, byte & 15].map(|digit| char::from_digit(digit.into(), 16).unwrap_or_default());
    hash.finalize().iter().flat_map(digits).collect()
}
