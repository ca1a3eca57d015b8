//! `soak [samples] [operators]`: mixed signals through an actuator's inverse and the actuator, compared ten times with
//! a bank that is fed the reduced history.

use std::error::Error;
use std::time::Instant;

use soak::{Soak, actuator};

const SEED: u64 = 2017;

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let samples: f64 = arguments.next().as_deref().unwrap_or("1e9").parse()?;
    let operators: u32 = arguments.next().as_deref().unwrap_or("100").parse()?;
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
    Ok(())
}
