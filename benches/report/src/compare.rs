//! A run against a reference: what became worse, and what could not be compared.
//!
//! Times of two machines or two hours cannot be compared. Instruction counts can, and so can ratios to the loops of the
//! same run, with more room for noise.

use std::fmt;

use crate::cases::{Case, What};
use crate::results::{Results, Row};

/// More instructions than this factor times the reference's are worse.
pub const INSTRUCTIONS: f64 = 1.05;

/// A ratio to a loop above this factor times the reference's is worse.
pub const RATIO: f64 = 1.25;

/// Something worse than in the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worse {
    /// Where.
    pub case: Case,
    /// What.
    pub quantity: &'static str,
    /// The number of the reference.
    pub was: f64,
    /// The number now.
    pub is: f64,
}

impl fmt::Display for Worse {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { case, quantity, was, is } = self;
        write!(f, "{case}: {quantity} {was:.4} -> {is:.4} (+{:.0} %)", 100.0 * (is / was - 1.0))
    }
}

/// The outcome of a comparison.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Comparison {
    /// What became worse.
    pub worse: Vec<Worse>,
    /// What was not compared, and why.
    pub notes: Vec<String>,
    /// How many numbers were compared.
    pub compared: usize,
}

/// Compares every case of the reference with the run.
#[must_use]
pub fn compare(reference: &Results, now: &Results) -> Comparison {
    let mut outcome = Comparison::default();
    if reference.machine.rustc != now.machine.rustc {
        let (was, is) = (&reference.machine.rustc, &now.machine.rustc);
        outcome.notes.push(format!("another compiler ({was} -> {is}): instruction counts may differ by it"));
    }
    let mut uncounted = 0;
    for row in &reference.cases {
        let Some(found) = now.row(row.case) else {
            outcome.notes.push(format!("{}: not in this run", row.case));
            continue;
        };
        uncounted += usize::from(row.instructions.is_some() && found.instructions.is_none());
        if row.to_plain_loop.is_some() && found.to_plain_loop.is_none() {
            outcome.notes.push(format!("{}: no plain loop in this run", row.case));
        }
        if row.to_fused_loop_v3.is_some() && found.to_fused_loop_v3.is_none() {
            outcome.notes.push(format!("{}: no fused loop for x86-64-v3 in this run", row.case));
        }
        outcome.row(row, found);
    }
    for row in now.cases.iter().filter(|row| reference.row(row.case).is_none()) {
        outcome.notes.push(format!("{}: not in the reference", row.case));
    }
    if uncounted > 0 {
        outcome.notes.push(format!("{uncounted} instruction counts of the reference have none in this run"));
    }
    outcome
}

impl Comparison {
    fn row(&mut self, was: &Row, is: &Row) {
        self.number(was.case, "instructions per sample", was.instructions, is.instructions, INSTRUCTIONS);
        if !What::YARDSTICKS.contains(&was.case.what) {
            self.number(was.case, "time : plain loop", was.to_plain_loop, is.to_plain_loop, RATIO);
            let (v3, now) = (was.to_fused_loop_v3, is.to_fused_loop_v3);
            self.number(was.case, "time : fused loop, x86-64-v3", v3, now, RATIO);
        }
    }

    fn number(&mut self, case: Case, quantity: &'static str, was: Option<f64>, is: Option<f64>, factor: f64) {
        let (Some(was), Some(is)) = (was, is) else { return };
        self.compared += 1;
        if is > factor * was {
            self.worse.push(Worse { case, quantity, was, is });
        }
    }
}

#[cfg(test)]
mod tests {
    use yardsticks::Signal;

    use super::*;
    use crate::cases::Mode;
    use crate::results::{Machine, SCHEMA};
    fn row(what: What, instructions: Option<f64>, to_plain_loop: Option<f64>) -> Row {
        let case = Case { signal: Signal::White, operators: 20, what, mode: Mode::Step };
        Row { case, nanoseconds: 1.0, interval: [1.0, 1.0], instructions, to_plain_loop, to_fused_loop_v3: None }
    }

    fn results(cases: Vec<Row>) -> Results {
        let [cpu, rustc, target, flags, commit, date] = [const { String::new() }; 6];
        let machine = Machine { cpu, cores: 1, rustc, target, flags, commit, date };
        Results { schema: SCHEMA, machine, cases, latency: Vec::new() }
    }

    fn outcome(was: Row, is: Row) -> Comparison {
        compare(&results(vec![was]), &results(vec![is]))
    }

    #[test]
    fn what_is_on_one_side_only_is_noted() {
        let outcome = |was, is| compare(&results(was), &results(is)).notes;
        let (with, without) = (row(What::Forward, None, Some(0.1)), row(What::Forward, None, None));
        assert!(outcome(vec![with], vec![]).join("").ends_with("not in this run"));
        assert!(outcome(vec![], vec![with]).join("").ends_with("not in the reference"));
        assert!(outcome(vec![with], vec![without]).join("").ends_with("no plain loop in this run"));
    }

    #[test]
    fn the_same_run_is_not_worse() {
        let row = row(What::Forward, Some(100.0), Some(0.1));
        assert_eq!(outcome(row, row), Comparison { compared: 2, ..Comparison::default() });
    }

    #[test]
    fn more_instructions_are_named_from_5_per_cent_on() {
        let was = row(What::Forward, Some(100.0), None);
        assert!(outcome(was, row(What::Forward, Some(104.9), None)).worse.is_empty());
        let worse = outcome(was, row(What::Forward, Some(105.1), None)).worse;
        assert_eq!((worse.len(), worse[0].was, worse[0].is), (1, 100.0, 105.1));
        let text = worse[0].to_string();
        assert!(text.starts_with("white noise, full range, n = 20, forward step: instructions"), "{text}");
    }

    #[test]
    fn a_ratio_is_named_from_25_per_cent_on() {
        let was = row(What::Inverse, None, Some(0.1));
        assert!(outcome(was, row(What::Inverse, None, Some(0.124))).worse.is_empty());
        assert_eq!(outcome(was, row(What::Inverse, None, Some(0.126))).worse.len(), 1);
    }

    #[test]
    fn the_ratio_to_the_fused_loop_is_compared_too() {
        let beside = |ratio| Row { to_fused_loop_v3: ratio, ..row(What::Inverse, None, None) };
        let worse = outcome(beside(Some(0.8)), beside(Some(1.1))).worse;
        assert_eq!((worse.len(), worse[0].quantity), (1, "time : fused loop, x86-64-v3"));
        assert!(outcome(beside(Some(0.8)), beside(Some(0.99))).worse.is_empty());
        assert!(outcome(beside(Some(0.8)), beside(None)).notes.join("").ends_with("x86-64-v3 in this run"));
    }

    #[test]
    fn fewer_is_better_and_time_alone_is_not_compared() {
        let was = row(What::Forward, Some(100.0), Some(0.1));
        let is = Row { nanoseconds: 1e6, ..row(What::Forward, Some(10.0), Some(0.01)) };
        assert!(outcome(was, is).worse.is_empty());
    }

    #[test]
    fn what_cannot_be_compared_is_said() {
        let was = row(What::Forward, Some(100.0), Some(0.1));
        let gone = compare(&results(vec![was]), &results(Vec::new()));
        assert_eq!((gone.compared, gone.notes.len()), (0, 1));
        let uncounted = outcome(was, row(What::Forward, None, Some(0.1)));
        assert_eq!((uncounted.compared, uncounted.notes.len()), (1, 1));
    }
}
