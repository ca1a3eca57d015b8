//! Laws of the controller of an array, whatever happens to it.

use crate::support::array::{
    Actuator, DT, Event, M, S, Setup, asked, bits, case, happen, positions, references, setup, shown, wild,
};
use hysteresis_core::{ArrayController, ArrayInverse, ArrayOptions, ArraySample, Inverse, Mode, QuasiStaticInverse};
use proptest::collection::vec;
use proptest::prelude::*;

/// Which drives are well within their limits.
fn free<P: ArrayInverse>(controller: &ArrayController<P>) -> Vec<bool> {
    let inside = |(drive, (low, high)): (&f64, &(f64, f64))| {
        let margin = 0.1 * (high - low);
        low + margin < *drive && *drive < high - margin
    };
    controller.drives().iter().zip(controller.limits()).map(inside).collect()
}

/// How far each position would go from the last sample to the next one if the drives stayed.
fn drifts<P: ArrayInverse>(controller: &ArrayController<P>) -> Vec<f64> {
    let mut held = controller.clone();
    held.hold();
    held.step(&ArraySample::of(&[0.0; M]), &mut [0.0; M]).unwrap();
    positions(controller).iter().zip(positions(&held)).map(|(one, other)| (one - other).abs()).collect()
}

/// The laws of arrays of models, and of stages.
macro_rules! laws {
    ($inverse:ty) => {
        proptest! {
            #[test]
            fn no_drive_ever_leaves_limits_nor_slew((setup, events) in case()) {
                let mut controller = setup.make::<$inverse>();
                let (mut last, mut saved) = (controller.drives().to_vec(), None);
                for event in &events {
                    let told = happen(&mut controller, event, &mut saved);
                    for (i, (drive, before)) in controller.drives().iter().zip(&last).enumerate() {
                        let (low, high) = setup.limits[i];
                        prop_assert!(drive.is_finite() && low <= *drive && *drive <= high, "{drive}");
                        let slew = setup.options.slew.get(i).or(setup.options.slew.first());
                        let step = slew.map_or(f64::INFINITY, |slew| slew * DT);
                        prop_assert!(told || (drive - before).abs() <= step, "{before} to {drive}, at most {step}");
                        prop_assert!(told || asked(event).is_some() || drive == before, "{event:?} moves a drive");
                    }
                    last = controller.drives().to_vec();
                }
            }

            #[test]
            fn no_pair_is_ever_too_far_apart_but_where_it_was_already((setup, events) in case()) {
                let mut controller = setup.make::<$inverse>();
                let ArrayOptions { neighbours, max_difference, slew, .. } = &setup.options;
                let mut saved = None;
                for event in &events {
                    let (before, free) = (positions(&controller), free(&controller));
                    let (starts, drifts) = (!controller.state().started, drifts(&controller));
                    happen(&mut controller, event, &mut saved);
                    if asked(event).is_none() {
                        continue;
                    }
                    let (after, still_free) = (positions(&controller), self::free(&controller));
                    let stays = starts || !controller.state().started || controller.mode() == Mode::Hold;
                    for (pair, (i, j)) in neighbours.iter().enumerate() {
                        let most = max_difference[if max_difference.len() == 1 { 0 } else { pair }];
                        let (was, is) = ((before[*i] - before[*j]).abs(), (after[*i] - after[*j]).abs());
                        let is_free = slew.is_empty() && [*i, *j].iter().all(|i| free[*i] && still_free[*i]);
                        // What creeps is countered, unless drives stay or something holds them back.
                        let creeps = if stays || !is_free { drifts[*i] + drifts[*j] } else { 0.0 };
                        // Inside the limit without any tolerance; outside it to the roundings of positions of some um.
                        let beyond = if creeps > 0.0 { most.max(was) + creeps } else { was };
                        prop_assert!(is <= most || is <= beyond + 1e-13, "{was} to {is}, at most {most} and {creeps}");
                    }
                }
            }

            #[test]
            fn the_memory_is_that_of_the_drives_that_went_out((setup, events) in case()) {
                let mut controller = setup.make::<$inverse>();
                let mut saved = None;
                let unchanged = |event: &&Event| !matches!(event, Event::Model(..) | Event::Reset | Event::Load);
                for event in events.iter().filter(unchanged) {
                    let mut mirror: Vec<$inverse> = controller.state().streams.iter().enumerate().map(|(i, state)| {
                        let mut stream = <$inverse>::made(i, 1.0, setup.limits[i]);
                        stream.set_state(state).unwrap();
                        stream
                    }).collect();
                    happen(&mut controller, event, &mut saved);
                    if asked(event).is_none() && !matches!(event, Event::Follow(_)) {
                        continue; // no sample passes
                    }
                    let now = controller.state().streams;
                    for (i, (stream, drive)) in mirror.iter_mut().zip(controller.drives()).enumerate() {
                        let there = ArrayInverse::look_at_drive(stream, *drive);
                        stream.follow_drive(*drive);
                        // A sample passes also where the drive stays.
                        let mut same = <$inverse>::made(i, 1.0, setup.limits[i]);
                        same.set_state(&now[i]).unwrap();
                        prop_assert!((ArrayInverse::reached(stream) - ArrayInverse::reached(&same)).abs() < 1e-12);
                        let follows = matches!(event, Event::Follow(_));
                        let expected = if follows { ArrayInverse::reached(stream) } else { there };
                        prop_assert!((expected - positions(&controller)[i]).abs() < 1e-12);
                        prop_assert!((stream.output() - drive).abs() < 1e-10);
                    }
                }
            }

            #[test]
            fn a_peek_changes_nothing_and_a_step_follows_it((setup, events) in case()) {
                let mut controller = setup.make::<$inverse>();
                let mut saved = None;
                for event in &events {
                    if let Some(sample) = asked(event) {
                        let (before, mut ahead) = (shown(&controller), [0.0; M]);
                        controller.peek(&sample, &mut ahead).unwrap();
                        prop_assert_eq!(&before, &shown(&controller));
                        happen(&mut controller, event, &mut saved);
                        prop_assert_eq!(ahead.map(f64::to_bits).to_vec(), bits(controller.drives()));
                    } else {
                        happen(&mut controller, event, &mut saved);
                    }
                }
            }

            #[test]
            fn a_restored_controller_goes_on_bit_for_bit((setup, events) in case(), cut in 0..60_usize) {
                let (before, after) = events.split_at(cut.min(events.len()));
                let models = |event: &&Event| !matches!(event, Event::Model(..) | Event::Gains(_) | Event::Load);
                let (mut one, mut other) = (setup.make::<$inverse>(), setup.make::<$inverse>());
                for event in before.iter().filter(models) {
                    happen(&mut one, event, &mut None);
                }
                other.set_state(&one.state()).unwrap();
                for event in after.iter().filter(models) {
                    happen(&mut one, event, &mut None);
                    happen(&mut other, event, &mut None);
                    prop_assert_eq!(shown(&one), shown(&other));
                }
            }

            #[test]
            fn a_block_is_its_samples(
                setup in setup(),
                rows in vec((references(), vec(wild(), M)), 0..40),
                fed in any::<bool>(),
            ) {
                let (mut stepped, mut ran) = (setup.make::<$inverse>(), setup.make::<$inverse>());
                let sensors = stepped.sensors();
                let reference: Vec<f64> = rows.iter().flat_map(|(r, _)| *r).collect();
                let measurement: Vec<f64> = rows.iter().flat_map(|(_, y)| y[..sensors].to_vec()).collect();
                let mut expected = vec![];
                for (r, y) in &rows {
                    let mut drives = [0.0; M];
                    let measured = fed.then_some(&y[..sensors]);
                    stepped.step(&ArraySample { measurement: measured, ..ArraySample::of(r) }, &mut drives).unwrap();
                    expected.extend(drives);
                }
                let mut drives = vec![0.0; reference.len()];
                let block = ArraySample { measurement: fed.then_some(&measurement[..]), ..ArraySample::of(&reference) };
                ran.run(&block, &mut drives).unwrap();
                prop_assert_eq!(bits(&drives), bits(&expected));
                prop_assert_eq!(shown(&ran), shown(&stepped));
            }

            #[test]
            fn a_motion_starts_from_the_drives_that_are_there((setup, events) in case(), r in references()) {
                let mut controller = setup.make::<$inverse>();
                let mut saved = None;
                for event in &events {
                    happen(&mut controller, event, &mut saved);
                }
                controller.hold();
                let before = controller.drives().to_vec();
                let mut drives = [9.0; M];
                controller.step(&ArraySample::of(&r), &mut drives).unwrap();
                prop_assert_eq!(bits(&drives), bits(&before));
                controller.release();
                prop_assert_eq!(controller.mode(), Mode::Run);
                controller.step(&ArraySample::of(&r), &mut drives).unwrap();
                prop_assert_eq!(bits(&drives), bits(&before));
            }

            #[test]
            fn the_integral_follows_its_equation(
                rows in vec((vec(-0.3..0.3, M), vec(-0.2..0.2, S)), 1..40),
                matrix in vec(-1.0..1.0, M * S),
                ki in 0.0..200.0,
                leak in 0.0..200.0,
            ) {
                let reconstruction = Some(matrix.clone());
                let set = ArrayOptions { ki, leak, reconstruction, bumpless_time: 0.0, ..ArrayOptions::new(DT) };
                let mut controller = Setup { options: set, limits: vec![(-500.0, 500.0); M] }.make::<$inverse>();
                let (mut integral, mut drives) = ([0.0; M], [0.0; M]);
                for (k, (r, y)) in rows.iter().enumerate() {
                    controller.step(&ArraySample { measurement: Some(y), ..ArraySample::of(r) }, &mut drives).unwrap();
                    // The first sample starts the motion.
                    for (a, row) in integral.iter_mut().zip(matrix.chunks(S)).filter(|_| k > 0) {
                        let error = row.iter().zip(y).fold(0.0, |sum, (gain, y)| sum + gain * -y);
                        *a += (ki * DT) * error - (leak * DT) * *a;
                    }
                    prop_assert_eq!(bits(controller.integral()), bits(&integral));
                    let aims = r.iter().zip(&integral).map(|(r, a)| r + a);
                    if k > 0 {
                        prop_assert!(aims.zip(positions(&controller)).all(|(aim, p)| (aim - p).abs() < 1e-13));
                    }
                }
            }
        }
    };
}

mod of_models {
    use super::*;

    laws!(Inverse);
}

mod of_stages {
    use super::*;

    laws!(QuasiStaticInverse);
}
