//! The medians of the last `cargo bench`, as a table: time per sample and its ratio to the plain loop.

use std::env;
use std::error::Error;
use std::fs;
use std::path::Path;

use hysteresis_bench::{OPERATORS, SAMPLES, Signal};
use serde_json::Value;

/// Median time per sample in ns, as criterion left it.
fn median(signal: &str, case: &str, operators: u32) -> Result<f64, Box<dyn Error>> {
    let target = env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into());
    let directory = Path::new(&target).join("criterion").join(signal).join(case).join(operators.to_string());
    let path = directory.join("new/estimates.json");
    let text = fs::read_to_string(&path).map_err(|error| format!("{}: {error}; run `make bench`", path.display()))?;
    let estimates: Value = serde_json::from_str(&text)?;
    let nanoseconds = estimates["median"]["point_estimate"].as_f64().ok_or("estimates.json: no median")?;
    Ok(nanoseconds / f64::from(SAMPLES))
}

fn main() -> Result<(), Box<dyn Error>> {
    println!("| signal at 10 kHz | n | forward | exact inverse | plain loop | forward : loop | inverse : loop |");
    println!("|---|---|---|---|---|---|---|");
    for (_, signal) in Signal::ALL {
        for operators in OPERATORS {
            let [plain, forward, inverse] =
                ["plain loop", "forward", "inverse"].map(|case| median(signal, case, operators));
            let (plain, forward, inverse) = (plain?, forward?, inverse?);
            println!(
                "| {signal} | {operators} | {forward:.1} ns | {inverse:.1} ns | {plain:.0} ns | 1/{:.1} | 1/{:.1} |",
                plain / forward,
                plain / inverse
            );
        }
    }
    Ok(())
}
