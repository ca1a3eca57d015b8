//! Time per sample of streams and of the controller, beside loops over all operators in the same run: `cargo bench`.
//!
//! A minute, and nothing but the standard library. `make bench` measures more: arrays, stages, instructions, and
//! whether anything became slower.

use std::hint::black_box;
use std::time::{Duration, Instant};
use std::{iter, mem, slice};

use hysteresis_core::{
    CompiledModel, ControllerOptions, DuhemForward, DuhemInverse, Forward, HybridController, Inverse, Process,
};
use yardsticks::{BESIDE, FusedLoop, Instructions, PlainLoop, REACH, Signal, actuator, duhem};

/// How long a cell of the first table is measured; there are 63, if the processor has three fused loops.
const LONG: Duration = Duration::from_millis(400);

/// Different seconds of noise: of few, a branch predictor learns each sample by heart.
const SECONDS: u64 = 32;

/// Single steps of a row of the second table.
const STEPS: usize = 1_000_000;

const SIGNALS: [Signal; 3] = [Signal::SlowSine, Signal::NoisySine, Signal::White];
const OPERATORS: [u32; 3] = [1, 20, 1_000];

/// What is timed, in a column of the first table and a row of the second.
struct Algorithm {
    name: String,
    /// Made anew for each number of operators and each signal.
    prepare: Box<dyn Fn(u32, Signal) -> Prepared>,
}

/// Takes samples, one after the other.
type Take = Box<dyn FnMut(&[f64])>;

struct Prepared {
    take: Take,
    /// The samples that it takes, second by second, for ever.
    seconds: Vec<Vec<f64>>,
}

impl Prepared {
    fn new(seconds: Vec<Vec<f64>>, mut step: impl FnMut(f64) -> f64 + 'static) -> Self {
        let take = move |samples: &[f64]| {
            for x in samples {
                black_box(step(*x));
            }
        };
        Self { take: Box::new(take), seconds }
    }
}

fn algorithms() -> Vec<Algorithm> {
    fn algorithm(name: impl Into<String>, prepare: impl Fn(u32, Signal) -> Prepared + 'static) -> Algorithm {
        Algorithm { name: name.into(), prepare: Box::new(prepare) }
    }
    let forward = algorithm("forward", |operators, signal| {
        let mut stream = Forward::new(&compiled(operators));
        Prepared::new(drives(signal), move |x| stream.step(x))
    });
    let inverse = algorithm("inverse", |operators, signal| {
        let mut stream = Inverse::new(&compiled(operators), None).expect("the weights are positive");
        Prepared::new(targets(operators, signal), move |y| stream.step(y))
    });
    let controller = algorithm("controller", |operators, signal| {
        let (mut controller, mut last) = (controller(operators), 0.0);
        // The measurement lags by a sample: the error never rests.
        Prepared::new(targets(operators, signal), move |reference| {
            controller.step(reference.into(), mem::replace(&mut last, reference))
        })
    });
    let plain = algorithm("plain loop", |operators, signal| {
        let mut plain = PlainLoop::new(&actuator(operators));
        Prepared::new(thinned(operators, signal), move |x| plain.step(x))
    });
    let fused = Instructions::ALL.into_iter().filter(|instructions| instructions.are_here()).map(|instructions| {
        algorithm(format!("fused loop, {}", instructions.name()), move |operators, signal| {
            let mut fused = FusedLoop::new(&[actuator(operators)], instructions).expect("they are here");
            let take = move |samples: &[f64]| fused.steps(samples, |y| _ = black_box(y));
            Prepared { take: Box::new(take), seconds: thinned(operators, signal) }
        })
    });
    [forward, inverse, controller, plain].into_iter().chain(fused).collect()
}

/// The columns of the table of that operator: its output, and its inverse beside a slope along the outputs of the sum.
fn duhem_times(signal: Signal) -> [f64; 2] {
    let (mut forward, mut plant) = (DuhemForward::new(duhem()), DuhemForward::new(duhem()));
    let mut inverse = DuhemInverse::new(duhem(), BESIDE).expect("both slopes are above 0");
    let along = |second: &Vec<f64>| second.iter().map(|x| BESIDE * x + plant.step(*x)).collect();
    let targets = drives(signal).iter().map(along).collect();
    let times = Prepared::new(drives(signal), move |x| forward.step(x));
    [median(times), median(Prepared::new(targets, move |y| inverse.step(y)))]
}

fn compiled(operators: u32) -> CompiledModel {
    CompiledModel::new(&actuator(operators))
}

fn controller(operators: u32) -> HybridController {
    let limits = (-1.1 * REACH, 1.1 * REACH);
    let inverse = Inverse::new(&compiled(operators), Some(limits)).expect("the weights are positive");
    let options = ControllerOptions { slew: Some(1e7), ..ControllerOptions::new(5.0, 6e3, 1e-4, limits) };
    HybridController::new(inverse.into(), None, &options).expect("the options are valid")
}

fn drives(signal: Signal) -> Vec<Vec<f64>> {
    let seconds = if signal.is_noise() { SECONDS } else { 1 };
    (0..seconds).map(|second| signal.samples(second)).collect()
}

/// Fewer samples for a loop: one costs the same wherever it lies, and a pass is to be shorter than the slice of time
/// that a busy machine gives to a program.
fn thinned(operators: u32, signal: Signal) -> Vec<Vec<f64>> {
    let every = (operators as usize / 100).max(1);
    drives(signal).iter().map(|second| second.iter().step_by(every).copied().collect()).collect()
}

/// The outputs of the model along a drive that repeats for ever.
fn targets(operators: u32, signal: Signal) -> Vec<Vec<f64>> {
    let (mut plant, drives) = (Forward::new(&compiled(operators)), drives(signal));
    drives.iter().flatten().for_each(|x| _ = plant.step(*x));
    drives.iter().map(|second| second.iter().map(|x| plant.step(*x)).collect()).collect()
}

/// Nanoseconds per sample: the median of passes over a second of the signal each, after one that is not timed.
fn median(mut prepared: Prepared) -> f64 {
    (prepared.take)(&prepared.seconds[0]);
    let (begin, mut passes) = (Instant::now(), Vec::new());
    for second in prepared.seconds.iter().cycle() {
        let start = Instant::now();
        (prepared.take)(black_box(second));
        let time = start.elapsed().as_secs_f64();
        #[expect(clippy::cast_precision_loss, reason = "a second has 10 000 samples")]
        let samples = second.len() as f64;
        passes.push(time / samples);
        if begin.elapsed() > LONG {
            break;
        }
    }
    passes.sort_by(f64::total_cmp);
    1e9 * passes[passes.len() / 2]
}

/// Single steps, the reading of the clock included: the median, 99 % and the longest.
fn single_steps(mut prepared: Prepared) -> [Duration; 3] {
    let timed = prepared.seconds.iter().flatten().cycle().take(STEPS).map(|x| {
        let start = Instant::now();
        (prepared.take)(black_box(slice::from_ref(x)));
        start.elapsed()
    });
    let mut times: Vec<_> = timed.collect();
    times.sort_unstable();
    [times[STEPS / 2], times[STEPS / 100 * 99], times[STEPS - 1]]
}

/// One decimal where it tells something.
fn nanoseconds(time: f64) -> String {
    if time < 100.0 { format!("{time:.1} ns") } else { format!("{time:.0} ns") }
}

/// A table as markdown, numbers to the right.
fn print(header: &[&str], rows: &[Vec<String>]) {
    let header: Vec<String> = header.iter().map(ToString::to_string).collect();
    let width = |column: usize| iter::once(&header).chain(rows).map(|row| row[column].len()).max();
    let widths: Vec<usize> = (0..header.len()).filter_map(width).collect();
    let line = |row: &[String]| {
        let cells = row.iter().zip(&widths).enumerate().map(|(column, (cell, &width))| {
            if column == 0 { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        println!("| {} |", cells.collect::<Vec<_>>().join(" | "));
    };
    line(&header);
    line(&widths.iter().map(|width| "-".repeat(*width)).collect::<Vec<_>>());
    for row in rows {
        line(row);
    }
}

fn main() {
    let algorithms = algorithms();
    let names = || algorithms.iter().map(|algorithm| &algorithm.name[..]);
    println!(
        "Time per sample, step by step: the median over seconds of a signal at 10 kHz. n is the number of operators.\n"
    );
    let lines = SIGNALS.iter().flat_map(|signal| OPERATORS.map(|operators| (*signal, operators)));
    let line = |(signal, operators): (Signal, u32)| {
        let times = algorithms.iter().map(|algorithm| nanoseconds(median((algorithm.prepare)(operators, signal))));
        [signal.to_string(), operators.to_string()].into_iter().chain(times).collect()
    };
    let header: Vec<&str> = ["signal", "n"].into_iter().chain(names()).collect();
    print(&header, &lines.map(line).collect::<Vec<_>>());

    println!("\nA Duhem operator of nine knots, and its inverse beside a slope.\n");
    let line = |signal: Signal| {
        let [forward, inverse] = duhem_times(signal).map(nanoseconds);
        vec![signal.to_string(), forward, inverse]
    };
    print(&["signal", "forward", "inverse"], &SIGNALS.map(line));

    println!("\nSingle steps of 20 operators, the clock included, {STEPS} of each.\n");
    let line = |name: String, prepared| {
        let times = single_steps(prepared).map(|time| format!("{time:.0?}"));
        iter::once(name).chain(times).collect::<Vec<_>>()
    };
    let mut rows = vec![line("nothing (the clock alone)".to_owned(), Prepared::new(drives(Signal::SlowSine), |x| x))];
    for signal in [Signal::SlowSine, Signal::White] {
        let prepared = |algorithm: &Algorithm| (algorithm.prepare)(20, signal);
        let lines =
            algorithms.iter().map(|algorithm| line(format!("{signal}, {}", algorithm.name), prepared(algorithm)));
        rows.extend(lines);
    }
    print(&["one step", "median", "p99", "maximum"], &rows);

    println!("\nThe longest step of nothing is the scheduler's: it stops any program for so long.");
    println!("Instructions per sample are left out. `make bench-instructions` counts them, if valgrind is installed,");
    println!("and first installs their runner, gungraun-runner.");
}
