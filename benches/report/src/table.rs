//! Results as markdown, for the terminal and the README.

use comfy_table::presets::ASCII_MARKDOWN;
use comfy_table::{CellAlignment, Table};
use yardsticks::Signal;

use crate::cases::{ARRAY, ARRAY_OPERATORS, Case, DUHEM_SIGNALS, Mode, OPERATORS, What};
use crate::results::{Latency, Machine, Results, Row, find};

/// All that was measured.
#[must_use]
pub fn full(results: &Results) -> String {
    let sections = [
        machine(&results.machine),
        streams(&results.cases, &Signal::ALL, &OPERATORS),
        runs(&results.cases, &Signal::ALL, &OPERATORS),
        counts(&results.cases, &Signal::ALL, &OPERATORS),
        array(&results.cases, &Signal::ALL),
        individual(&results.cases),
        controllers(&results.cases),
        duhem(&results.cases),
        copy(&results.cases),
        latency(&results.latency, |_| true),
    ];
    sections.join("\n\n")
}

/// Times alone, as far as they were measured.
#[must_use]
pub fn times(rows: &[Row]) -> String {
    let sections = [streams(rows, &Signal::ALL, &OPERATORS), runs(rows, &Signal::ALL, &OPERATORS), controllers(rows)];
    sections.join("\n\n")
}

/// What the README of the project shows: few operators on a smooth, a noisy and the worst signal.
#[must_use]
pub fn readme(results: &Results) -> String {
    let rows = &results.cases;
    let yardsticks = measured(rows);
    let kinds: Vec<What> = [What::Forward, What::Inverse].into_iter().chain(yardsticks).collect();
    let header = ["signal at 10 kHz".to_owned()].into_iter().chain(kinds.iter().map(|what| match what {
        What::Inverse => "exact inverse".to_owned(),
        What::Forward => "forward".to_owned(),
        yardstick => name(*yardstick),
    }));
    let line = |signal: Signal| {
        let case = |what| Case { signal, operators: 20, what, mode: Mode::Step };
        let time = |what: &What| cell(find(rows, case(*what)).map(|row| row.nanoseconds), nanoseconds);
        [signal.to_string()].into_iter().chain(kinds.iter().map(time)).collect()
    };
    let signals = [Signal::SlowSine, Signal::NoisySine, Signal::White];
    let table = table(&header.collect::<Vec<_>>(), 1, signals.map(line));
    format!("{}\n\n{table}", machine(&results.machine))
}

/// What the README of the benches shows.
#[must_use]
pub fn brief(results: &Results) -> String {
    let signals = [Signal::SlowSine, Signal::NoisySine, Signal::White];
    let sections = [
        machine(&results.machine),
        streams(&results.cases, &signals, &OPERATORS),
        runs(&results.cases, &signals, &[20, 100, 1_000]),
        counts(&results.cases, &signals, &[20, 1_000]),
        array(&results.cases, &signals),
        individual(&results.cases),
        controllers(&results.cases),
        duhem(&results.cases),
        copy(&results.cases),
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
fn table(header: &[impl ToString], words: usize, rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(ASCII_MARKDOWN).set_header(header.iter().map(ToString::to_string)).add_rows(rows);
    for column in table.column_iter_mut().skip(words) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.to_string()
}

/// The name of a yardstick, with its instruction set.
fn name(yardstick: What) -> String {
    yardstick.instructions().map_or("plain loop".to_owned(), |set| format!("fused loop, {}", set.name()))
}

/// The yardsticks that this run has.
fn measured(rows: &[Row]) -> Vec<What> {
    let found = |what: &What| rows.iter().any(|row| row.case.what == *what);
    What::YARDSTICKS.into_iter().filter(found).collect()
}

/// Time per sample of single streams, sample by sample, beside that of the loops.
fn streams(rows: &[Row], signals: &[Signal], operators: &[u32]) -> String {
    let yardsticks = measured(rows);
    let loops = yardsticks.iter().map(|what| name(*what));
    let header: Vec<_> = header("signal at 10 kHz").chain(loops).chain(ratio_names()).collect();
    let line = |case: Case| {
        let streams = STREAMS.map(|what| find(rows, Case { what, ..case }));
        let loops = yardsticks.iter().map(|what| find(rows, Case { what: *what, ..case }));
        let times = streams.into_iter().chain(loops).map(|row| cell(row.map(|row| row.nanoseconds), nanoseconds));
        times.chain(ratios(streams)).collect()
    };
    table(&header, 1, lines(signals, operators, Mode::Step, line))
}

/// Time per sample of `run` beside that of the loops, which take sample by sample.
fn runs(rows: &[Row], signals: &[Signal], operators: &[u32]) -> String {
    let header: Vec<_> = header("`run`").chain(ratio_names()).collect();
    let line = |case: Case| {
        let streams = STREAMS.map(|what| find(rows, Case { what, ..case }));
        let times = streams.map(|row| cell(row.map(|row| row.nanoseconds), nanoseconds));
        times.into_iter().chain(ratios(streams)).collect()
    };
    table(&header, 1, lines(signals, operators, Mode::Run, line))
}

/// The streams of the tables, in the order of their columns.
const STREAMS: [What; 4] = [What::Forward, What::Bank, What::Inverse, What::BankInverse];

/// The names of the columns of the streams, behind those of the signal and the number of operators.
fn header(first: &str) -> impl Iterator<Item = String> {
    [first.to_owned(), "n".to_owned()].into_iter().chain(STREAMS.map(|what| what.to_string()))
}

/// The names of the columns of [`ratios`].
fn ratio_names() -> impl Iterator<Item = String> {
    ["plain", "v3"].into_iter().flat_map(|unit| STREAMS.map(|what| format!("{what} : {unit}")))
}

/// The streams in units of the plain loop, then in units of the fused loop for x86-64-v3.
fn ratios(streams: [Option<&Row>; STREAMS.len()]) -> impl Iterator<Item = String> {
    let plain = streams.map(|row| cell(row.and_then(|row| row.to_plain_loop), ratio));
    let fused = streams.map(|row| cell(row.and_then(|row| row.to_fused_loop_v3), ratio));
    plain.into_iter().chain(fused)
}

/// A line for each signal and number of operators that was measured.
fn lines(
    signals: &[Signal],
    operators: &[u32],
    mode: Mode,
    line: impl Fn(Case) -> Vec<String>,
) -> impl Iterator<Item = Vec<String>> {
    let pairs = signals.iter().flat_map(move |signal| operators.iter().map(move |n| (*signal, *n)));
    pairs.filter_map(move |(signal, operators)| {
        let cells = line(Case { signal, operators, what: What::Forward, mode });
        let measured = cells.iter().any(|cell| cell != NOTHING);
        measured.then(|| [vec![signal.to_string(), operators.to_string()], cells].concat())
    })
}

/// Instructions per sample of single streams.
fn counts(rows: &[Row], signals: &[Signal], operators: &[u32]) -> String {
    let counts: Vec<_> = rows.iter().map(|row| (row.case, row.instructions)).collect();
    counted(&counts, signals, operators)
}

/// Instructions per sample alone, for a run without times.
#[must_use]
pub fn instructions(counts: &[(Case, Option<f64>)]) -> String {
    [counted(counts, &Signal::ALL, &OPERATORS), duhem_counts(counts)].join("\n\n")
}

fn counted(counts: &[(Case, Option<f64>)], signals: &[Signal], operators: &[u32]) -> String {
    let has = |what: &What| counts.iter().any(|(case, count)| case.what == *what && count.is_some());
    let loops: Vec<What> = What::YARDSTICKS.into_iter().filter(has).collect();
    let names = loops.iter().map(|what| name(*what));
    let header: Vec<_> = header("instructions per sample, step").chain(names).collect();
    let line = |case: Case| {
        let kinds = STREAMS.into_iter().chain(loops.iter().copied());
        kinds.map(|what| count(counts, Case { what, ..case })).collect()
    };
    table(&header, 1, lines(signals, operators, Mode::Step, line))
}

/// The instructions of a case.
fn count(counts: &[(Case, Option<f64>)], case: Case) -> String {
    let found = counts.iter().find(|(counted, _)| *counted == case);
    cell(found.and_then(|(_, count)| *count), number)
}

/// One step of a whole array.
fn array(rows: &[Row], signals: &[Signal]) -> String {
    let line = |&signal: &Signal| {
        let [forward, bank, inverse] = [What::Forward, What::Bank, What::Inverse].map(|what| {
            let row = find(rows, Case { signal, operators: ARRAY_OPERATORS, what, mode: Mode::Array });
            cell(row, |row| format!("{:.1} us", row.nanoseconds * f64::from(ARRAY) * 1e-3))
        });
        format!("{signal}: forward {forward}, by the bank {bank}, inverse {inverse}")
    };
    let lines: Vec<String> = signals.iter().map(line).collect();
    let what =
        format!("One step of {ARRAY} actuators with {ARRAY_OPERATORS} operators each, every actuator elsewhere in");
    if let [line] = &lines[..] { format!("{what} a {line}.") } else { format!("{what}\n- {}", lines.join("\n- ")) }
}

/// One step of actuators with models of their own, beside loops whose parameters are as many.
fn individual(rows: &[Row]) -> String {
    let what = format!("One step of {ARRAY} actuators with individual models of {ARRAY_OPERATORS} operators");
    let found: Vec<&Row> = rows.iter().filter(|row| row.case.mode == Mode::Individual).collect();
    let Some(first) = found.first() else { return format!("{what} was not measured.") };
    let kind = |what: What| if What::YARDSTICKS.contains(&what) { name(what) } else { what.to_string() };
    let step = |row: &Row| format!("{:.1} us", row.nanoseconds * f64::from(ARRAY) * 1e-3);
    let times: Vec<String> = found.iter().map(|row| format!("{} {}", kind(row.case.what), step(row))).collect();
    format!("{what}, {}: {}.", first.case.signal, times.join(", "))
}

/// A sample of what is built around the inverse.
fn controllers(rows: &[Row]) -> String {
    let lines = [Case::STAGE_INVERSE, Case::CONTROLLER, Case::OBSERVED_CONTROLLER].map(|case| {
        let row = find(rows, case);
        let time = cell(row.map(|row| row.nanoseconds), nanoseconds);
        let (plain, fused) = (row.and_then(|row| row.to_plain_loop), row.and_then(|row| row.to_fused_loop_v3));
        vec![case.what.to_string(), time, cell(plain, ratio), cell(fused, ratio)]
    });
    let Case { signal, operators, .. } = Case::CONTROLLER;
    table(&[&format!("{signal}, n = {operators}")[..], "time", ": plain loop", ": v3 loop"], 1, lines)
}

/// A sample of what has a Duhem operator: its time, then its instructions.
fn duhem(rows: &[Row]) -> String {
    let counts: Vec<_> = rows.iter().map(|row| (row.case, row.instructions)).collect();
    let time = |case| cell(find(rows, case).map(|row| row.nanoseconds), nanoseconds);
    [duhem_table("one Duhem operator, step", time), duhem_counts(&counts)].join("\n\n")
}

fn duhem_counts(counts: &[(Case, Option<f64>)]) -> String {
    duhem_table("instructions per sample, step", |case| count(counts, case))
}

fn duhem_table(title: &str, show: impl Fn(Case) -> String) -> String {
    let header: Vec<_> = [title.to_owned()].into_iter().chain(What::DUHEM.map(|what| what.to_string())).collect();
    let line = |signal: Signal| {
        let cells = What::DUHEM.map(|what| show(Case { signal, what, ..Case::DUHEM }));
        [signal.to_string()].into_iter().chain(cells).collect()
    };
    table(&header, 1, DUHEM_SIGNALS.map(line))
}

/// `run` on a smooth signal beside the copy of as many samples.
fn copy(rows: &[Row]) -> String {
    let copy = Case::COPY;
    let Some(copied) = find(rows, copy) else { return "The copy was not measured.".to_owned() };
    let run = |what| find(rows, Case { operators: 20, what, ..copy });
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

/// What stands where nothing was measured.
const NOTHING: &str = "-";

fn cell<T>(value: Option<T>, show: impl Fn(T) -> String) -> String {
    value.map_or_else(|| NOTHING.to_owned(), show)
}

/// One decimal where it tells something.
fn number(value: f64) -> String {
    if value < 100.0 { format!("{value:.1}") } else { format!("{value:.0}") }
}

fn nanoseconds(time: f64) -> String {
    format!("{} ns", number(time))
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
