//! `soak [samples] [operators] [seed]`: mixed signals through an actuator's inverse and the actuator, compared ten
//! times with a bank that is fed the reduced history. Then a hundredth as many samples of every loop with a plant that
//! shows and does anything, in set-ups that begin with the seed.

use std::error::Error;
use std::time::Instant;

use soak::loops::{self, Actuators, Axes, Axis, Episode, Learning};
use soak::{Soak, actuator};

const SEED: u64 = 2017;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let samples: f64 = arguments.next().as_deref().unwrap_or("1e9").parse()?;
    let operators: u32 = arguments.next().as_deref().unwrap_or("100").parse()?;
    let seed: u64 = arguments.next().as_deref().unwrap_or("0").parse()?;
    let mut soak = Soak::new(&actuator(operators, SEED)?, SEED)?;
    println!("{samples:e} samples, {operators} operators");
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of samples, 1e9 in short")]
    let block = (samples / 10.0).ceil().max(1.0) as u64;
    for tenth in 1..=10 {
        let start = Instant::now();
        soak.run(block)?;
        println!(
            "{:.1e} samples, largest difference {:.1e} of the range, longest history {}, {:.0} ns a sample",
            samples * f64::from(tenth) / 10.0,
            soak.largest(),
            soak.longest(),
            start.elapsed().as_secs_f64() * 1e10 / samples,
        );
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of set-ups, 1e4 in short")]
    let episodes = (samples / 100.0 / f64::from(EPISODE)).ceil().max(1.0) as u64;
    report::<Axis>(seed, episodes, EPISODE)?;
    report::<Axes>(seed, episodes, EPISODE)?;
    report::<Actuators>(seed, episodes, EPISODE)?;
    // Of some hundred samples each.
    report::<Learning>(seed, episodes, EPISODE / 100)
}

/// Samples of a set-up.
const EPISODE: u32 = 2000;

fn report<E: Episode>(seed: u64, episodes: u64, samples: u32) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let held_back = loops::run::<E>(seed, episodes, samples.into())?;
    let seconds = start.elapsed().as_secs_f64();
    println!("{}: {episodes} set-ups, limits or slew held {held_back} drives back, {seconds:.0} s", E::NAME);
    Ok(())
}
