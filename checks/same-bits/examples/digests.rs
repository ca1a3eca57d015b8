//! Prints the digests for a stage file, and those of the first samples if so many are named:
//! `cargo run --release -p same-bits --example digests -- stage.json 100000`.
//!
//! An example, as `cargo test` builds these from its own crates: for a program all would be compiled once more, with
//! other features.

use std::error::Error;

use hysteresis_control::stage::Stage;
use same_bits::{BANK_NAMES, NAMES, SAMPLES, digest, outputs, outputs_by_bank};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments.next().ok_or("expected the path of a stage file")?;
    let first = arguments.next().map_or(Ok(SAMPLES), |count| count.parse())?;
    let stage = Stage::from_json(&std::fs::read_to_string(path)?)?;
    let (of_stage, by_bank) = (outputs(&stage)?, outputs_by_bank(&stage)?);
    for (name, numbers) in NAMES.iter().zip(&of_stage).chain(BANK_NAMES.iter().zip(&by_bank)) {
        println!("{name} {}", digest(numbers));
        if first < SAMPLES {
            println!("{name}-begins {}", digest(&numbers[..first]));
        }
    }
    Ok(())
}
