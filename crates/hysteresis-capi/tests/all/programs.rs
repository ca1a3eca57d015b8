//! The examples in C and C++: compiled without a warning, run, and the same bits as in Rust.

use std::io::{Write, stderr};
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use hysteresis_control::multi_axis::{MultiAxisForward, MultiAxisStage, TrackingOptions};
use hysteresis_control::oscillator::{HystereticOscillator, OscillatorForward};
use hysteresis_control::stage::Stage;
use hysteresis_core::{ControllerOptions, Process};
// Else cargo does not build the libraries for this test.
use mpi_hyst as _;
use same_bits::{NAMES, SAMPLES, digest, outputs};

use crate::stages::files;

const HERE: &str = env!("CARGO_MANIFEST_DIR");
const C: [&str; 2] = ["cc", "-std=c99"];
const CPP: [&str; 2] = ["c++", "-std=c++17"];
/// What a program needs that holds the static library: as in mpi_hyst.pc.in.
const SYSTEM: &[&str] = if cfg!(target_os = "linux") {
    &["-lgcc_s", "-lutil", "-lrt", "-lpthread", "-lm", "-ldl", "-lc"]
} else {
    &["-lm"]
};

fn example(name: &str) -> PathBuf {
    Path::new(HERE).join("examples").join(name)
}

fn stage() -> PathBuf {
    example("stage.json")
}

fn numbers(file: &Path) -> Vec<f64> {
    let bytes = std::fs::read(file).unwrap();
    bytes.as_chunks().0.iter().map(|bytes| f64::from_ne_bytes(*bytes)).collect()
}

/// The folder of this test, where cargo puts the libraries too.
fn libraries() -> PathBuf {
    std::env::current_exe().unwrap().parent().unwrap().to_owned()
}

fn succeeded(program: &str, output: &Output) {
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{program}: {}\n{out}\n{err}", output.status);
}

/// Compiles an example; nothing, with a word about it, on a machine without the compiler.
fn compiled([compiler, standard]: [&str; 2], source: &str, library: &[&str]) -> Option<PathBuf> {
    if !there_is(compiler, &format!("{source} was not compiled")) {
        return None;
    }
    let name = source.replace(['/', '.'], "_");
    let program = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let mut command = Command::new(compiler);
    // Without contraction a product and a sum are two roundings, as in Rust.
    command.args([standard, "-pedantic", "-Wall", "-Wextra", "-Werror", "-O1", "-ffp-contract=off", "-I"]);
    command.arg(Path::new(HERE).join("include")).arg(Path::new(HERE).join("examples").join(source));
    command.arg("-o").arg(&program).arg("-L").arg(libraries()).args(library).arg("-lm");
    command.arg(format!("-Wl,-rpath,{}", libraries().display()));
    succeeded(source, &command.output().unwrap());
    Some(program)
}

/// Whether the program is on this machine; if not, a word about what is left out.
fn there_is(program: &str, left_out: &str) -> bool {
    let is_there = Command::new(program).arg("--version").output().is_ok();
    if !is_there {
        let mut told = stderr(); // not `eprintln!`: the test harness would keep that to itself
        writeln!(told, "SKIPPED: {left_out}, as there is no {program} on this machine").unwrap();
    }
    is_there
}

/// No byte is used that is not the program's own or was never written, and none is left behind.
fn clean_memory(program: &Path, arguments: &[&Path]) {
    if there_is("valgrind", "the memory of the C examples was not looked at") {
        let mut command = Command::new("valgrind");
        command.args([
            "--quiet",
            "--error-exitcode=9",
            "--leak-check=full",
            "--errors-for-leak-kinds=definite,possible",
        ]);
        succeeded("valgrind", &command.arg(program).args(arguments).output().unwrap());
    }
}

fn run(program: &Path, arguments: &[&Path]) -> Output {
    let output = Command::new(program).args(arguments).output().unwrap();
    succeeded(&program.display().to_string(), &output);
    output
}

#[test]
fn the_closed_loop_runs_in_c_with_the_static_library() {
    let library = libraries().join("libmpi_hyst.a");
    let library: Vec<&str> = library.to_str().into_iter().chain(SYSTEM.iter().copied()).collect();
    let Some(program) = compiled(C, "c/closed_loop.c", &library) else { return };
    let said = String::from_utf8(run(&program, &[&stage()]).stdout).unwrap();
    assert!(said.contains("drives from -30 to 150 V") && said.contains("stopped at 0"), "{said}");
    clean_memory(&program, &[&stage()]);
}

#[test]
fn the_closed_loop_runs_in_cpp_with_the_shared_library() {
    let Some(program) = compiled(CPP, "cpp/closed_loop.cpp", &["-lmpi_hyst"]) else { return };
    let said = String::from_utf8(run(&program, &[&stage()]).stdout).unwrap();
    let refused = "MPIH_STATUS_ARGUMENT: dt: expected a finite number above 0";
    assert!(said.contains(refused), "{said}");
}

#[test]
fn a_million_mixed_samples_give_the_same_bits_in_c_as_in_rust() {
    let Some(program) = compiled(C, "c/same_bits.c", &["-lmpi_hyst"]) else { return };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (json, file) = (folder.join("same_bits.json"), folder.join("same_bits.f64"));
    for text in files() {
        std::fs::write(&json, &text).unwrap();
        run(&program, &[&json, &file]);
        let numbers = numbers(&file);
        assert_eq!(numbers.len(), NAMES.len() * SAMPLES);
        let stage = Stage::from_json(&text).unwrap();
        for ((name, rust), c) in NAMES.iter().zip(&outputs(&stage).unwrap()).zip(numbers.chunks(SAMPLES)) {
            assert!(rust.iter().all(|number| number.is_finite()), "{name}");
            assert_eq!(digest(c), digest(rust), "{name}");
        }
    }
}

/// What examples/c/axes.c writes: the drives and the positions of both axes, and the positions of the oscillator.
fn axes_in_rust() -> Vec<f64> {
    const SAMPLES: usize = 2000;
    let text = |name: &str| std::fs::read_to_string(example(name)).unwrap();
    let square = |k: usize, period: usize| if (k / period).is_multiple_of(2) { 0.5 } else { -0.25 };
    let stage = MultiAxisStage::from_json(&text("axes.json")).unwrap();
    let options = ControllerOptions { slew: Some(4000.0), ..ControllerOptions::new(1.0, 0.0, stage.dt(), (-9.0, 9.0)) };
    let mut controller = stage.controller(&[options; 2], &TrackingOptions::default()).unwrap();
    let ahead = controller.tracking().unwrap().ahead();
    let (mut plant, mut y, mut all) = (MultiAxisForward::new(&stage), [0.3, -0.2], Vec::new());
    let mut positions = Vec::new();
    for k in 0..SAMPLES {
        let references = [0.3 + square(k + ahead, 400), -0.2 + square(k + ahead, 300)];
        let seen = [y[0], if k % 97 == 0 { f64::NAN } else { y[1] }];
        let mut drives = [0.0; 2];
        controller.step((&references).into(), &seen, &mut drives).unwrap();
        plant.advance(&drives, &mut y).unwrap();
        all.extend(drives);
        positions.extend(y);
    }
    all.extend(positions);
    let oscillator = HystereticOscillator::from_json(&text("oscillator.json")).unwrap();
    let mut forward = OscillatorForward::new(&oscillator, 2.5e-4, None).unwrap();
    all.extend((0..SAMPLES).map(|k| forward.step(if k % 101 == 0 { f64::NAN } else { 100.0 * square(k, 130) })));
    all
}

#[test]
fn axes_and_oscillators_give_the_same_bits_in_c_as_in_rust() {
    let Some(program) = compiled(C, "c/axes.c", &["-lmpi_hyst"]) else { return };
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("axes.f64");
    let (stage, oscillator) = (example("axes.json"), example("oscillator.json"));
    let said = String::from_utf8(run(&program, &[&stage, &oscillator, &file]).stdout).unwrap();
    assert!(said.contains("stopped at 0 and 0") && said.contains("20 drives were no numbers"), "{said}");
    let bits = |numbers: &[f64]| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&numbers(&file)), bits(&axes_in_rust()));
    clean_memory(&program, &[&stage, &oscillator, &file]);
}
