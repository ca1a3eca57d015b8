//! Tells the benches by which compiler, for which target and with which flags they were built.

use std::env;
use std::process::Command;

fn main() {
    let variable = |name: &str| env::var(name).unwrap_or_default();
    let version = Command::new(variable("RUSTC")).arg("--version").output();
    let rustc = version.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned());
    println!("cargo:rustc-env=BENCH_RUSTC={}", rustc.unwrap_or_default());
    println!("cargo:rustc-env=BENCH_TARGET={}", variable("TARGET"));
    println!("cargo:rustc-env=BENCH_FLAGS={}", variable("CARGO_ENCODED_RUSTFLAGS").replace('\u{1f}', " "));
    println!("cargo:rerun-if-changed=build.rs");
}
