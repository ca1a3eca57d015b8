//! Acceptance on the measured loops of a piezo stack, which lie beside the project, not in it.

mod common;

use std::fs;
use std::path::Path;

use common::{input_offset, run};
use hysteresis_identify::{Form, Options, Record, Thresholds};

/// The first `rows` of voltage and displacement, or none with a note if the file is absent.
fn read(file: &str, rows: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/piezo_stack").join(file);
    let Ok(text) = fs::read_to_string(&path) else {
        println!("skipped: no {file}");
        return None;
    };
    let column = |line: &str, j: usize| line.split(',').nth(j).unwrap().parse::<f64>().unwrap();
    Some(text.lines().skip(1).take(rows).map(|line| (column(line, 1), column(line, 2))).unzip())
}

#[test]
fn both_models_reach_the_known_errors() {
    let (Some(major), Some(decaying)) = (read("major_loops.csv", 8000), read("decaying_loops.csv", 3850)) else {
        return;
    };
    let records = [Record::new(&major.0, &major.1, 1000).unwrap(), Record::new(&decaying.0, &decaying.1, 400).unwrap()];
    for (form, goal) in [(Form::Modified, 0.17), (Form::Conventional, 0.31)] {
        let options = Options { form, thresholds: Thresholds::Uniform(16), ..Options::default() };
        let found = run(&records, &options).unwrap();
        println!(
            "{form:?}: {:.4} um rms ({:.4?} per record), {:?}, delay {:.3}, input offset {:.4}, {} evaluations",
            found.fit.rmse,
            found.record_fits.iter().map(|quality| quality.rmse).collect::<Vec<_>>(),
            found.ratios,
            found.delay,
            input_offset(&found),
            found.evaluations,
        );
        assert!(found.fit.rmse <= goal, "{form:?}: {} um", found.fit.rmse);
    }
}
