//! Laws of filters of second-order sections.

use hysteresis_core::{Biquad, Filter, FilterState, MAX_SECTIONS, Process, Sections};
use proptest::prelude::*;

/// A stable section: poles at radius r and angle t, or two real ones.
fn sections() -> impl Strategy<Value = Vec<Biquad>> {
    let section = (prop::array::uniform3(-2.0..2.0_f64), 0.0..0.98_f64, 0.0..3.1_f64)
        .prop_map(|(b, r, t)| Biquad::new(b, [-2.0 * r * t.cos(), r * r]).unwrap());
    prop::collection::vec(section, 0..=MAX_SECTIONS)
}

fn signal() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-10.0..10.0_f64, 1..60)
}

/// The difference equation as it is written, section by section.
fn plain(sections: &[Biquad], input: &[f64]) -> Vec<f64> {
    let one = |input: Vec<f64>, section: &Biquad| {
        let ([b0, b1, b2], [a1, a2]) = (section.numerator(), section.denominator());
        let mut output: Vec<f64> = Vec::new();
        for k in 0..input.len() {
            let u = |back: usize| k.checked_sub(back).map_or(0.0, |k| input[k]);
            let y = |back: usize| k.checked_sub(back).map_or(0.0, |k| output[k]);
            output.push(b0 * u(0) + b1 * u(1) + b2 * u(2) - a1 * y(1) - a2 * y(2));
        }
        output
    };
    sections.iter().fold(input.to_vec(), one)
}

/// How much rounding may differ: sums of up to six sections of gain up to about 1e4 each.
fn close(a: f64, b: f64, largest: f64) -> bool {
    (a - b).abs() <= 1e-10 * (1.0 + largest)
}

proptest! {
    /// After a reset a filter is as it was made.
    #[test]
    fn a_reset_filter_is_a_new_one(sections in sections(), input in signal()) {
        let mut new = Filter::new(&sections).unwrap();
        let mut used = new.clone();
        for x in input.iter().chain(&[f64::NAN]) {
            used.step(*x);
        }
        used.reset();
        prop_assert_eq!(used.rejected(), 0);
        for x in input {
            prop_assert_eq!(used.step(x).to_bits(), new.step(x).to_bits());
        }
    }

    /// The form of the states changes rounding alone.
    #[test]
    fn equals_the_difference_equation(sections in sections(), input in signal()) {
        let mut filter = Filter::new(&sections).unwrap();
        let expected = plain(&sections, &input);
        let largest = expected.iter().fold(0.0_f64, |m, y| m.max(y.abs()));
        for (u, y) in input.iter().zip(&expected) {
            let got = filter.step(*u);
            prop_assert!(close(got, *y, largest), "{} {}", got, y);
        }
    }

    /// What a look ahead says comes, a block is its samples, and a restored state goes on, bit for bit.
    #[test]
    fn peek_run_and_states_are_step_bit_for_bit(sections in sections(), input in signal(), cut in 0_usize..60) {
        let mut filter = Filter::new(&sections).unwrap();
        let mut block = filter.clone();
        let mut outputs = vec![0.0; input.len()];
        block.run(&input, &mut outputs).unwrap();
        let mut saved: Option<FilterState> = None;
        for (k, (u, y)) in input.iter().zip(&outputs).enumerate() {
            if k == cut {
                saved = Some(filter.state());
            }
            prop_assert_eq!(filter.peek(*u).to_bits(), y.to_bits());
            prop_assert_eq!(filter.step(*u).to_bits(), y.to_bits());
        }
        if let Some(saved) = saved {
            let mut again = Filter::new(&sections).unwrap();
            again.set_state(&saved).unwrap();
            for (u, y) in input[cut..].iter().zip(&outputs[cut..]) {
                prop_assert_eq!(again.step(*u).to_bits(), y.to_bits());
            }
        }
    }

    /// At rest at an input it stays there.
    #[test]
    fn rests_where_it_settles(sections in sections(), input in -10.0..10.0_f64) {
        let mut filter = Filter::new(&sections).unwrap();
        filter.settle(input).unwrap();
        let rest = filter.sections().static_gain() * input;
        for _ in 0..20 {
            let output = filter.step(input);
            prop_assert!(close(output, rest, 1e4 * rest.abs()), "{} {}", output, rest);
        }
    }

    /// Other sections take over without a jump, and come to their own rest.
    #[test]
    fn other_sections_take_over_without_a_jump(first in sections(), then in sections(), input in signal()) {
        let mut filter = Filter::new(&first).unwrap();
        let mut last = 0.0;
        for u in &input {
            last = filter.step(*u);
        }
        let newest = *input.last().unwrap();
        filter.set_sections(&then).unwrap();
        let next = filter.step(newest);
        if then.is_empty() {
            prop_assert_eq!(next, newest);
        } else {
            let size = filter.state().inputs.iter().fold(last.abs(), |m, x| m.max(x.abs()));
            prop_assert!(close(next, last, 1e3 * size), "{} {}", next, last);
        }
    }

    /// What is not admissible is counted, and nothing else happens.
    #[test]
    fn bad_samples_leave_everything_as_it_is(sections in sections(), input in signal()) {
        let mut filter = Filter::new(&sections).unwrap();
        for u in &input {
            filter.step(*u);
        }
        let (before, last) = (filter.state(), filter.peek(f64::NAN));
        for (count, bad) in [f64::NAN, f64::INFINITY, -1e101].into_iter().enumerate() {
            prop_assert_eq!(filter.step(bad), last);
            prop_assert_eq!((filter.state(), filter.rejected()), (before, count as u64 + 1));
        }
    }
}

#[test]
fn wrong_sections_and_states_are_refused() {
    let says = |b, a| Biquad::new(b, a).unwrap_err().to_string();
    let one = [1.0, 0.0, 0.0];
    assert_eq!(
        says([f64::NAN, 0.0, 0.0], [0.0; 2]),
        "b[0]: expected a finite number (at most 1e100 in magnitude), got NaN"
    );
    assert_eq!(says([0.0, 1e13, 0.0], [0.0; 2]), "b[1]: expected at most 1e12 in magnitude, got 10000000000000.0");
    assert!(says(one, [-1.99, 0.98]).starts_with("a[0]: expected a stable section"));
    assert!(says(one, [0.0, -1.0]).starts_with("a[1]: expected a stable section"));
    assert!(Biquad::new(one, [-1.97, 0.98]).is_ok());
    let too_many = Sections::new(&[Biquad::IDENTITY; MAX_SECTIONS + 1]).unwrap_err().to_string();
    assert_eq!(too_many, "sections: expected at most 6 sections, got 7");
    let mut filter = Filter::new(&[Biquad::IDENTITY]).unwrap();
    let fine = filter.state();
    for spoil in [
        |state: &mut FilterState| state.states[0][1] = f64::NAN,
        |state: &mut FilterState| state.inputs[3] = 1.0,
        |state: &mut FilterState| state.output = f64::INFINITY,
    ] {
        let mut state = fine;
        spoil(&mut state);
        assert!(filter.set_state(&state).unwrap_err().to_string().starts_with("state: expected a filter of"));
    }
    assert_eq!(filter.state(), fine);
}

#[test]
fn a_state_at_the_bound_is_taken_and_one_beyond_is_not() {
    let sections = Sections::default();
    let of = |output| FilterState { output, ..FilterState::default() };
    assert!(sections.check(&of(1e250)).is_ok() && sections.check(&of(-1e250)).is_ok());
    assert!(sections.check(&of(1.1e250)).is_err() && sections.check(&of(f64::NAN)).is_err());
}
