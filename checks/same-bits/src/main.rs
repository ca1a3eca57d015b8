//! Prints the digests for a stage file: `cargo run --release -p same-bits -- stage.json`.

use std::error::Error;

use hysteresis_control::stage::Stage;
use same_bits::{NAMES, digest, outputs};

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("expected the path of a stage file")?;
    let stage = Stage::from_json(&std::fs::read_to_string(path)?)?;
    for (name, numbers) in NAMES.iter().zip(&outputs(&stage)?) {
        println!("{name} {}", digest(numbers));
    }
    Ok(())
}
