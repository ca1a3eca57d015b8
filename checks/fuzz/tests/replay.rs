//! The seeds of all targets, what fuzzing has found, and mutations of both: what `make fuzz` does without end, for a
//! moment and on any machine. FUZZ_INPUTS sets how many mutations of each target are tried.

use std::fs;
use std::path::Path;

use fuzz_targets::TARGETS;

/// How many mutations of each target there are.
const INPUTS: usize = 2000;

fn seeds(name: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("seeds").join(name);
    let mut files: Vec<_> =
        fs::read_dir(folder).expect("every target has seeds").map(|file| file.unwrap().path()).collect();
    files.sort();
    assert!(!files.is_empty(), "{name}: a target without seeds tests nothing");
    files.iter().map(|file| fs::read(file).unwrap()).collect()
}

/// Some bytes changed, doubled, left out, or put in from another seed.
fn mutate(random: &mut fastrand::Rng, seeds: &[Vec<u8>]) -> Vec<u8> {
    let mut data = random.choice(seeds).expect("there are seeds").clone();
    for _ in 0..random.usize(1..6) {
        let (one, other) = (random.usize(..=data.len()), random.usize(..=data.len()));
        let (from, to) = (one.min(other), one.max(other).min(one.min(other) + 64));
        match random.u8(..5) {
            0 => data.iter_mut().skip(from).take(1).for_each(|byte| *byte = random.u8(..)),
            1 => data.iter_mut().skip(from).take(1).for_each(|byte| *byte ^= 1 << random.u8(..8)),
            2 => drop(data.drain(from..to)),
            3 => {
                let again = data[from..to].to_vec();
                data.splice(from..from, again);
            }
            _ => {
                let from_other = random.choice(seeds).expect("there are seeds");
                let begin = random.usize(..=from_other.len());
                let piece = from_other[begin..from_other.len().min(begin + 64)].to_vec();
                data.splice(from..from, piece);
            }
        }
    }
    data
}

#[test]
fn what_must_hold_holds_for_seeds_and_for_what_was_found() {
    for (name, target) in TARGETS {
        for data in seeds(name) {
            target(&data);
        }
    }
}

#[test]
fn what_must_hold_holds_for_mutations_of_the_seeds() {
    let inputs = std::env::var("FUZZ_INPUTS").map_or(INPUTS, |text| text.parse().expect("FUZZ_INPUTS is a number"));
    for (name, target) in TARGETS {
        let seeds = seeds(name);
        let mut random = fastrand::Rng::with_seed(20_170_401);
        for _ in 0..inputs {
            target(&mutate(&mut random, &seeds));
        }
    }
}
