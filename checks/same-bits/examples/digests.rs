//! Prints the digests for a stage file: `cargo run --release -p same-bits --example digests -- stage.json`.
//!
//! An example, as `cargo test` builds these from its own crates: for a program all would be compiled once more, with
//! other features.

use std::error::Error;

use hysteresis_control::stage::Stage;
use same_bits::{BANK_NAMES, NAMES, digest, outputs, outputs_by_bank};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("expected the path of a stage file")?;
    let stage = Stage::from_json(&std::fs::read_to_string(path)?)?;
    let (of_stage, by_bank) = (outputs(&stage)?, outputs_by_bank(&stage)?);
    for (name, numbers) in NAMES.iter().zip(&of_stage).chain(BANK_NAMES.iter().zip(&by_bank)) {
        println!("{name} {}", digest(numbers));
    }
    Ok(())
}
