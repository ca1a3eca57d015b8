use alloc::vec::Vec;
use alloc::{format, vec};

use super::super::vectors::Processor;
use super::*;
use crate::model::{ModifiedPrandtlIshlinskii, Offsets, Ratios};

/// Of 64 samples 48 are small steps, on which the input often turns round, and 16 are jumps.
fn drive() -> impl Iterator<Item = f64> {
    let mut seed = 0x9E37_79B9_7F4A_7C15_u64;
    (0..2000).scan(0.0, move |x, k| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let noise = f64::from((seed >> 40) as u32) / f64::from(1_u32 << 24) - 0.5;
        *x = if k % 64 < 48 { *x + 3.0 * noise } else { 1200.0 * noise };
        Some(*x)
    })
}

/// Jumps that all go up, then all down, ten times.
fn staircases() -> impl Iterator<Item = f64> {
    (0..240).map(|k| if k / 12 % 2 == 0 { f64::from(k % 12) * 90.0 - 500.0 } else { 510.0 - f64::from(k % 12) * 87.0 })
}

/// Models with lanes left over and without, of few operators and of more, of whole and of split weights.
fn models() -> impl Iterator<Item = ModifiedPrandtlIshlinskii> {
    [1_u32, 3, 4, 21, 40].into_iter().flat_map(|n| {
        let r: Vec<f64> = (0..n).map(|i| 400.0 * f64::from(i) / f64::from(n)).collect();
        let weights: Vec<f64> = (0..n).map(|i| 1.0 / f64::from(1 + i)).collect();
        let whole = ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default()).unwrap();
        let below: Vec<f64> = weights.iter().map(|w| 0.5 * w).collect();
        [whole.clone(), whole.with_negative_weights(&below).unwrap()]
    })
}

/// The bank of every model on this processor and on any, from rest and from outputs that no input has led to.
fn banks() -> impl Iterator<Item = Bank> {
    models().flat_map(|model| {
        Processor::all_here().flat_map(move |processor| {
            let members = Arc::new(Members::on(processor, &model));
            let odd: Vec<f64> = (0..members.len()).map(|i| if i % 2 == 0 { 700.0 } else { -900.0 }).collect();
            [Bank::at_rest(members.clone()), Bank::new(members, &odd).unwrap()]
        })
    })
}

/// The operators of a bank by their equation, one by one.
struct OneByOne<'a> {
    members: &'a Members,
    z: Vec<f64>,
}

impl OneByOne<'_> {
    fn step(&mut self, x: f64) -> f64 {
        for (z, (_, operator)) in self.z.iter_mut().zip(self.members.iter()) {
            *z = operator.next(*z, x);
        }
        self.members.iter().zip(&self.z).map(|((weight, _), z)| weight.at(*z) * z).sum()
    }
}

#[test]
fn every_operator_is_where_its_equation_puts_it_on_any_processor() {
    for mut bank in banks() {
        let members = bank.members.clone();
        let mut truth = OneByOne { members: &members, z: bank.outputs().into() };
        let mut last = 0.0;
        for x in drive() {
            let sum = truth.step(x);
            // Sums of another order, of less than 2000 in all.
            assert!((bank.peek_input(last, x) - sum).abs() <= 1e-11, "{x}");
            bank.move_input(last, x);
            assert_eq!(bank.outputs(), truth.z, "{x}");
            assert!((bank.now().output - sum).abs() <= 1e-11, "{x}");
            last = x;
        }
    }
}

/// The numbers that a bank puts out for moves to these inputs: by peeks, moves, the inverse and a run.
fn bits_of(mut bank: Bank, inputs: &[f64]) -> Vec<u64> {
    let (mut bits, mut last, mut run) = (Vec::new(), 0.0, bank.clone());
    for (k, x) in inputs.iter().enumerate() {
        let (mut inverse, at) = (bank.clone(), Point { input: last, output: bank.now().output });
        bits.push(bank.peek_input(last, *x).to_bits());
        bank.move_input(last, *x);
        bits.push(bank.now().output.to_bits());
        bits.extend(bank.outputs().iter().map(|z| z.to_bits()));
        let line = bank.ahead();
        bits.extend(
            line.iter()
                .flat_map(|piece| [piece.line.slope, piece.line.offset, piece.begin, piece.end].map(f64::to_bits)),
        );
        // Every third sample is left to the inverse too.
        if k % 3 == 0 {
            let to = bank.now().output;
            let direction = if to < at.output { Direction::Falling } else { Direction::Rising };
            bits.push(inverse.peek_output(direction, at, to, (-450.0, 450.0)).input.to_bits());
            bits.push(inverse.move_output(direction, at, to, (-450.0, 450.0)).input.to_bits());
        }
        last = *x;
    }
    let mut outputs = inputs.to_vec();
    run.move_input(0.0, 300.0);
    if let Some(taken) = run.run(inputs, &mut outputs, Point { input: 0.0, output: 0.0 }) {
        bits.extend(outputs.iter().take(taken.samples).map(|y| y.to_bits()));
    }
    bits
}

#[test]
fn every_bit_is_the_same_on_any_processor() {
    let inputs: Vec<f64> = drive().chain(staircases()).collect();
    for model in models() {
        let odd: Vec<f64> = (0..model.weights().len()).map(|i| if i % 2 == 0 { 700.0 } else { -900.0 }).collect();
        for initial in [vec![0.0; odd.len()], odd] {
            let on = |processor| Bank::new(Arc::new(Members::on(processor, &model)), &initial).unwrap();
            let any = bits_of(on(Processor::Portable), &inputs);
            for processor in Processor::all_here() {
                assert_eq!(bits_of(on(processor), &inputs), any, "{processor:?}");
            }
        }
    }
}

#[test]
fn a_leap_is_a_jump() {
    let mut leapt = 0;
    for mut jumps in banks() {
        let (mut leaps, mut last) = (jumps.clone(), 0.0);
        for x in drive().chain(staircases()) {
            let leap = leaps.leap(x);
            leapt += usize::from(leap.is_some());
            if leap.is_none() {
                leaps.move_input(last, x);
            }
            jumps.move_input(last, x);
            let state = |bank: &Bank| (bank.now().output.to_bits(), format!("{:?}", bank.state(x)));
            assert_eq!(state(&leaps), state(&jumps), "from {last} to {x}");
            assert!(leap.is_none_or(|y| y.to_bits() == jumps.now().output.to_bits()));
            last = x;
        }
    }
    assert!(leapt > 100, "{leapt}");
}

#[test]
fn a_run_is_its_samples_up_to_the_next_line_on_any_processor() {
    let origin = Point { input: 5.0, output: -3.0 };
    let mut samples: Vec<f64> = drive().chain(staircases()).collect();
    (samples[50], samples[70], samples[2100]) = (f64::INFINITY, f64::NAN, -2e100);
    for mut bank in banks() {
        if !bank.knows_its_input() {
            bank.move_input(0.0, 0.0);
        }
        let (mut one_by_one, mut last, mut taken, mut rejected) = (bank.clone(), 0.0, 0, 0);
        while taken < samples.len() {
            let mut outputs = samples.clone();
            if let Some(part) = bank.run(&samples[taken..], &mut outputs[taken..], origin) {
                rejected += part.rejected;
                for k in taken..taken + part.samples {
                    if samples[k].abs() < 1e100 {
                        let x = samples[k] - origin.input;
                        assert_ne!(one_by_one.jump(last, x), None, "sample {k}");
                        last = x;
                    }
                    let output = one_by_one.now().output + origin.output;
                    assert_eq!(outputs[k].to_bits(), output.to_bits(), "sample {k}");
                }
                taken += part.samples;
                let next = samples.get(taken).map(|sample| one_by_one.clone().jump(last, sample - origin.input));
                assert!(matches!(next, None | Some(None)), "sample {taken}");
            }
            // On the line.
            if let Some(sample) = samples.get(taken) {
                if sample.abs() < 1e100 {
                    let x = sample - origin.input;
                    one_by_one.move_input(last, x);
                    bank.move_input(last, x);
                    last = x;
                } else {
                    rejected += 1;
                }
                taken += 1;
            }
        }
        assert_eq!(rejected, 3);
        assert_eq!((bank.outputs(), bank.now().input), (one_by_one.outputs(), one_by_one.now().input));
    }
}

/// Below zero a bank is seen in the mirror, where zero has the other sign.
#[test]
fn zero_has_one_sign_by_run_and_by_step() {
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[1.0, 1.0], &[10.0, 20.0], Ratios::PAPER, Offsets::default());
    let members = Arc::new(Members::of(&model.unwrap()));
    let (mut at_once, nowhere) = (Bank::at_rest(members), Point { input: 0.0, output: 0.0 });
    at_once.move_input(0.0, 50.0);
    let (mut one_by_one, mut last, samples) = (at_once.clone(), 50.0, [40.0, 20.0, 0.0, -7.0]);
    at_once.run(&samples, &mut [0.0; 4], nowhere);
    for x in samples {
        one_by_one.move_input(last, x);
        last = x;
    }
    assert_eq!(one_by_one.now().output.to_bits(), 0.0_f64.to_bits());
    assert_eq!(at_once.now().output.to_bits(), 0.0_f64.to_bits());
}

#[test]
fn a_line_is_the_output_from_one_end_to_the_other_and_no_further() {
    let mut both_sides = 0;
    for mut bank in banks() {
        let members = bank.members.clone();
        let mut last = 0.0;
        for x in drive().take(600) {
            bank.move_input(last, x);
            last = x;
            for direction in [Direction::Rising, Direction::Falling] {
                bank.draw_line(direction);
                let Piece { line, begin, end, .. } = bank.ahead().unwrap();
                let off_line = |place| {
                    let mut truth = OneByOne { members: &members, z: bank.outputs().into() };
                    (line.at(place) - truth.step(place)).abs()
                };
                // z + r may be a rounding beyond the x at which z became x - r.
                assert!(
                    direction.sign::<f64>() * (begin - x) <= 1e-12 && direction.has_passed(x, end),
                    "{begin} {x} {end}"
                );
                let far = if end.is_finite() { end } else { x + 1000.0 * direction.sign::<f64>() };
                for place in [x, 0.5 * (x + far), far] {
                    assert!(off_line(place) <= 1e-10, "{direction:?} from {x}, {place}");
                }
                // The weights are a hundredth and more. At zero every line ends, as an identity may weigh otherwise
                // there.
                let ends = |end: f64, beyond| end == 0.0 || end.is_infinite() || off_line(beyond) > 1e-6;
                assert!(ends(end, end + 1e-3 * direction.sign::<f64>()), "{direction:?} from {x} to {end}");
                if let Some(back) = bank.back().filter(|back| back.is_finite()) {
                    assert!(off_line(back) <= 1e-10, "{direction:?} from {x} back to {back}");
                    assert!(ends(back, back - 1e-3 * direction.sign::<f64>()), "{direction:?} from {x} back to {back}");
                    both_sides += 1;
                }
            }
        }
    }
    assert!(both_sides > 100, "{both_sides}");
}

#[test]
fn from_a_place_on_its_line_a_bank_goes_on_as_if_it_had_been_moved_there() {
    let mut places = 0;
    for mut bank in banks() {
        let mut last = 0.0;
        let mut to = drive().skip(1);
        for x in drive().take(600) {
            bank.move_input(last, x);
            last = x;
            let (Some(Piece { end, .. }), Some(to)) = (bank.ahead(), to.next()) else { continue };
            last = if end.is_finite() { 0.5 * (x + end) } else { x };
            let mut moved = bank.clone();
            moved.settle(last);
            assert_eq!(bank.state(last), moved.state(last));
            assert_eq!(bank.peek_input(last, to), moved.peek_input(last, to));
            moved.move_input(last, to);
            let mut jumped = bank.clone();
            jumped.move_input(last, to);
            assert_eq!(
                (jumped.outputs(), jumped.now().output),
                (moved.outputs(), moved.now().output),
                "{x} {last} {to}"
            );
            places += 1;
        }
    }
    assert!(places > 1000, "{places}");
}

#[test]
fn a_move_to_where_a_bank_without_a_line_is_changes_nothing() {
    let mut jumps = 0;
    for mut bank in banks() {
        let mut last = 0.0;
        for x in drive().take(600) {
            bank.move_input(last, x);
            last = x;
            if bank.ahead().is_some() {
                continue;
            }
            let (state, output) = (bank.state(x), bank.now().output);
            assert_eq!(bank.peek_input(x, x), output, "{x}");
            bank.move_input(x, x);
            assert_eq!((bank.state(x), bank.now().output), (state, output), "{x}");
            jumps += 1;
        }
    }
    assert!(jumps > 1000, "{jumps}");
}

#[test]
fn the_line_of_a_first_move_is_the_output_there_with_its_slope() {
    for bank in banks().filter(|bank| !bank.knows_its_input()) {
        for x in drive().take(300) {
            let line = bank.first_line(x);
            let (near, far) = (bank.peek_input(0.0, x), bank.peek_input(0.0, x + 1e-6));
            assert!((line.at(x) - near).abs() <= 1e-10, "{x}");
            // 1e-6 ahead there is no breakpoint here.
            assert!((line.slope - (far - near) / 1e-6).abs() < 1e-5, "{x}");
        }
    }
}

/// Where a line is looked at has no part in its bits: a restored stream draws it elsewhere.
#[test]
fn a_line_has_the_same_bits_from_anywhere_on_it() {
    for mut bank in banks() {
        let mut last = 0.0;
        for x in drive().take(600) {
            bank.move_input(last, x);
            last = x;
            let Some(Piece { direction, line, end, .. }) = bank.ahead().filter(|piece| piece.end.is_finite()) else {
                continue;
            };
            let mut other = bank.clone();
            other.settle(0.75 * x + 0.25 * end);
            other.draw_line(direction);
            assert_eq!(other.ahead().map(|piece| piece.line), Some(line), "{x} to {end}");
        }
    }
}

/// Two operators are pushed from inputs that differ by a rounding. A look between them sees a piece that begins beyond
/// it.
#[test]
fn a_target_at_a_kink_of_two_operators_is_found() {
    let (r, rc) = (
        [0.0, 0.0, 16.666_666_666_666_668, 33.333_333_333_333_336],
        [0.0, 0.0, 16.666_666_666_666_668, 33.333_333_333_333_336],
    );
    let ra = [0.0, 13.137_289_532_145_14, 37.041_820_125_948_94, 57.357_402_734_020_08];
    let rb = [0.0, 0.0, 28.406_883_998_651_39, 54.937_953_358_834_19];
    let above = [0.2, 0.0, 0.325_139_646_038_842_8, 0.0];
    let below = [1.667_902_080_302_201, 0.393_311_575_720_360_96, 0.239_347_844_452_909_21, 0.760_140_048_218_771_7];
    let model = ModifiedPrandtlIshlinskii::new(&above, &r, &ra, &rb, &rc, Offsets::default());
    let model = model.unwrap().with_negative_weights(&below).unwrap();
    for processor in Processor::all_here() {
        let mut bank = Bank::at_rest(Arc::new(Members::on(processor, &model)));
        let outputs =
            [-47.095_751_169_551_42, -39.010_292_929_558_595, -17.792_343_786_680_085, -34.459_010_453_346_75].into();
        let (input, output, to) = (-47.095_751_169_551_42, -124.346_534_131_212_34, -32.772_494_052_728_95);
        bank.restore(&BankState { outputs, line: None, small_moves: 0 }, input, output).unwrap();
        let reach = bank.move_output(Direction::Rising, Point { input, output }, to, (-1e3, 1e3));
        assert!((reach.input - -1.125_677_120_013_416).abs() < 1e-12, "{reach:?}");
        assert!((bank.now().output - to).abs() < 1e-12);
    }
}
