//! Results as markdown, for the terminal and the README.

use comfy_table::presets::ASCII_MARKDOWN;
use comfy_table::{CellAlignment, Table};

use crate::cases::{ARRAY, ARRAY_OPERATORS, Case, Mode, OPERATORS, What};
use crate::results::{Latency, Machine, Results};
use crate::signals::Signal;

/// All that was measured.
#[must_use]
pub fn full(results: &Results) -> String {
    let sections = [
        machine(&results.machine),
        streams(results, &Signal::ALL, &OPERATORS, true),
        array(results, &Signal::ALL),
        copy(results),
        latency(&results.latency, |_| true),
    ];
    sections.join("\n\n")
}

/// What the README shows.
#[must_use]
pub fn brief(results: &Results) -> String {
    let signals = [Signal::SlowSine, Signal::NoisySine, Signal::White];
    let sections = [
        machine(&results.machine),
        streams(results, &signals, &[20, 1_000, 10_000], false),
        array(results, &[Signal::SlowSine]),
        copy(results),
        latency(&results.latency, |row| row.step.is_none_or(|step| step.operators == 20)),
    ];
    sections.join("\n\n")
}

fn machine(machine: &Machine) -> String {
    let Machine { cpu, cores, rustc, target, flags, commit, date } = machine;
    let flags = if flags.is_empty() { "portable build" } else { flags };
    format!("{cpu}, {cores} cores; {rustc}, {target}, {flags}; commit {commit}, {date}.")
}

/// A table with text on the left and numbers on the right.
fn table(header: &[&str], words: usize, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(ASCII_MARKDOWN).set_header(header).add_rows(rows);
    for column in table.column_iter_mut().skip(words) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}

/// Time and instructions per sample of single streams.
fn streams(results: &Results, signals: &[Signal], operators: &[u32], with_run: bool) -> String {
    const STEP: [&str; 10] = [
        "signal at 10 kHz",
        "n",
        "forward",
        "inverse",
        "plain loop",
        "forward : loop",
        "inverse : loop",
        "forward, instr.",
        "inverse, instr.",
        "loop, instr.",
    ];
    let run: &[&str] = if with_run { &["forward, run", "inverse, run"] } else { &[] };
    let rows = signals.iter().flat_map(|&signal| {
        operators.iter().map(move |&operators| {
            let row = |what, mode| results.row(Case { signal, operators, what, mode });
            let steps = [What::Forward, What::Inverse, What::PlainLoop].map(|what| row(what, Mode::Step));
            let runs = [What::Forward, What::Inverse].map(|what| row(what, Mode::Run));
            let mut cells = vec![signal.to_string(), operators.to_string()];
            cells.extend(steps.map(|row| cell(row.map(|row| row.nanoseconds), nanoseconds)));
            cells.extend(steps[..2].iter().map(|row| cell(row.and_then(|row| row.to_plain_loop), ratio)));
            cells.extend(steps.map(|row| cell(row.and_then(|row| row.instructions), |count| format!("{count:.0}"))));
            cells.extend(runs.iter().filter(|_| with_run).map(|row| cell(row.map(|row| row.nanoseconds), nanoseconds)));
            cells
        })
    });
    table(&[&STEP, run].concat(), 1, rows)
}

/// Instructions per sample alone, for a run without times.
#[must_use]
pub fn instructions(counts: &[(Case, Option<f64>)]) -> String {
    let kinds = [(What::Forward, Mode::Step), (What::Inverse, Mode::Step), (What::PlainLoop, Mode::Step)];
    let rows = Signal::ALL.into_iter().flat_map(|signal| {
        OPERATORS.into_iter().map(move |operators| {
            let count = |(what, mode)| {
                let case = Case { signal, operators, what, mode };
                let found = counts.iter().find(|(counted, _)| *counted == case);
                cell(found.and_then(|(_, count)| *count), |count| format!("{count:.1}"))
            };
            [vec![signal.to_string(), operators.to_string()], kinds.map(count).to_vec()].concat()
        })
    });
    table(&["instructions per sample, step", "n", "forward", "inverse", "plain loop"], 1, rows)
}

/// One step of a whole array.
fn array(results: &Results, signals: &[Signal]) -> String {
    let line = |&signal: &Signal| {
        let [forward, inverse] = [What::Forward, What::Inverse].map(|what| {
            let row = results.row(Case { signal, operators: ARRAY_OPERATORS, what, mode: Mode::Array });
            cell(row, |row| format!("{:.1} us", row.nanoseconds * f64::from(ARRAY) * 1e-3))
        });
        format!("{signal}: forward {forward}, inverse {inverse}")
    };
    let lines: Vec<String> = signals.iter().map(line).collect();
    let what =
        format!("One step of {ARRAY} actuators with {ARRAY_OPERATORS} operators each, every actuator elsewhere in");
    if let [line] = &lines[..] { format!("{what} a {line}.") } else { format!("{what}\n- {}", lines.join("\n- ")) }
}

/// `run` on a smooth signal beside the copy of as many samples.
fn copy(results: &Results) -> String {
    let copy = Case::COPY;
    let Some(copied) = results.row(copy) else { return "The copy was not measured.".to_owned() };
    let run = |what| results.row(Case { operators: 20, what, ..copy });
    let [forward, inverse] = [What::Forward, What::Inverse]
        .map(|what| cell(run(what), |row| format!("{:.1}", row.nanoseconds / copied.nanoseconds)));
    format!(
        "Copying an array takes {:.2} ns per sample; `run` over a {} with n = 20 takes {forward} times as long \
         forward, {inverse} times inverse.",
        copied.nanoseconds, copy.signal
    )
}

/// The distribution of single steps.
fn latency(rows: &[Latency], shown: impl Fn(&Latency) -> bool) -> String {
    let header = ["one step, clock included", "n", "steps", "median", "p99", "p99.9", "maximum"];
    let rows = rows.iter().filter(|row| shown(row)).map(|row| {
        let Latency { step, count, median, p99, p999, max } = row;
        let (name, operators) = match step {
            None => ("nothing (the clock alone)".to_owned(), "-".to_owned()),
            Some(step) => (format!("{}, {}", step.signal, step.what), step.operators.to_string()),
        };
        let times = [median, p99, p999, max].map(|time| latency_time(*time));
        [vec![name, operators, format!("{count:e}")], times.to_vec()].concat()
    });
    table(&header, 1, rows)
}

fn cell<T>(value: Option<T>, show: impl Fn(T) -> String) -> String {
    value.map_or_else(|| "-".to_owned(), show)
}

fn nanoseconds(time: f64) -> String {
    if time < 100.0 { format!("{time:.1} ns") } else { format!("{time:.0} ns") }
}

/// Quantiles to the nanosecond, the rare stop of milliseconds to what can be read.
fn latency_time(time: u64) -> String {
    match time {
        0..10_000 => format!("{time} ns"),
        10_000..1_000_000 => format!("{} us", time / 1_000),
        _ => format!("{} ms", time / 1_000_000),
    }
}

fn ratio(ratio: f64) -> String {
    if ratio < 1.0 { format!("1/{:.1}", 1.0 / ratio) } else { format!("{ratio:.1}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_for_reading() {
        assert_eq!([nanoseconds(1.64), nanoseconds(1612.3)], ["1.6 ns", "1612 ns"]);
        assert_eq!([366, 52_700, 4_075_519].map(latency_time), ["366 ns", "52 us", "4 ms"]);
        assert_eq!([ratio(0.05), ratio(2.61)], ["1/20.0", "2.6"]);
    }

    #[test]
    fn a_table_is_markdown_and_numbers_stand_on_the_right() {
        let text = table(&["what", "n"], 1, [["a", "10"], ["bc", "5"]].map(|row| row.map(str::to_owned).to_vec()));
        assert_eq!(text, "| what |  n |\n|------|----|\n| a    | 10 |\n| bc   |  5 |");
    }
}
