//! Rows of plain numbers in a text, on all cores. What is not plain is left to the reader in Python, which names its
//! place.
//!
//! A row is plain if it has exactly the cells of the table, holds no quotation mark and no NUL, does not begin as a
//! comment, and if each chosen cell is a decimal number: the reader would take the same numbers from it.

use std::num::NonZero;
use std::thread::{available_parallelism, scope};

use hysteresis_core::MAX_MAGNITUDE;
use hysteresis_python_macros::function;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

/// Bytes for which a thread is worth its start.
const WORTH_A_THREAD: usize = 1 << 20;
const MOST_THREADS: usize = 8;
/// Of a number in a text, in bytes; a longer cell is left to the reader.
const LONGEST: usize = 64;
/// With a decimal mark among them.
const FEW_DIGITS: usize = 15;
const POWERS: [f64; FEW_DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// How rows are written, and what is taken of them.
struct Layout {
    delimiter: u8,
    decimal: u8,
    /// How many cells of a row have names, and how many it has: those behind are empty.
    named: usize,
    width: usize,
    /// For each column where its numbers go, if anywhere.
    places: Vec<Option<usize>>,
    chosen: usize,
}

impl Layout {
    /// Whether any blanks part cells.
    fn in_blanks(&self) -> bool {
        self.delimiter == b' '
    }

    fn ends_cell(&self, one: u8) -> bool {
        one == b'\n' || one == self.delimiter || (one == b'\t' && self.in_blanks())
    }
}

/// The rows at the beginning of a part that are plain.
struct Taken {
    columns: Vec<Vec<f64>>,
    bytes: usize,
    rows: usize,
    /// Whether all of the part is taken.
    whole: bool,
}

/// Bytes and rows that were taken, and the numbers of each column.
type Columns<'py> = (usize, usize, Vec<Bound<'py, PyArray1<f64>>>);

/// Takes numbers from the plain rows at the beginning of a text.
///
/// Parameters
/// ----------
/// text : bytes
///     Whole lines, each with its line feed.
/// delimiter : str
///     What separates cells; a space stands for any blanks.
/// decimal : str
///     The decimal mark; empty where none is known, and then rows with one are not plain.
/// named : int
///     The cells of a row that have names; those behind are empty.
/// width : int
///     The cells of a row.
/// columns : list of int
///     The columns to take.
///
/// Returns
/// -------
/// bytes : int
///     The bytes of these rows.
/// rows : int
///     How many there are, up to the first that is not plain.
/// columns : list of ndarray
///     Their numbers.
#[function]
pub(crate) fn plain_rows<'py>(
    py: Python<'py>,
    #[py("bytes")] text: &Bound<'py, PyAny>,
    #[py("str")] delimiter: &Bound<'py, PyAny>,
    #[py("str")] decimal: &Bound<'py, PyAny>,
    #[py("int")] named: &Bound<'py, PyAny>,
    #[py("int")] width: &Bound<'py, PyAny>,
    #[py("Sequence[int]")] columns: &Bound<'py, PyAny>,
) -> PyResult<Columns<'py>> {
    let columns: Vec<usize> = columns.extract()?;
    let (named, width) = (named.extract()?, width.extract()?);
    let mark = |one: &Bound<'_, PyAny>| one.extract::<String>().map(|one| one.bytes().next().unwrap_or(0));
    let mut places = vec![None; width];
    for (place, &column) in columns.iter().enumerate() {
        if let Some(one) = places.get_mut(column) {
            *one = Some(place);
        }
    }
    let (delimiter, decimal) = (mark(delimiter)?, mark(decimal)?);
    let layout = Layout { delimiter, decimal, named, width, places, chosen: columns.len() };
    let text = text.cast::<PyBytes>()?;
    let text = text.as_bytes();
    let parts = py.detach(|| in_parts(text, &layout));
    let bytes = parts.iter().map(|part| part.bytes).sum();
    let rows = parts.iter().map(|part| part.rows).sum();
    let mut joined: Vec<Vec<f64>> = (0..columns.len()).map(|_| Vec::new()).collect();
    for part in parts {
        for (all, mut column) in joined.iter_mut().zip(part.columns) {
            if all.is_empty() {
                *all = column;
            } else {
                all.append(&mut column);
            }
        }
    }
    let arrays = joined.into_iter().map(|column| PyArray1::from_vec(py, column)).collect();
    Ok((bytes, rows, arrays))
}

/// Takes the rows of parts of the text at once; what follows the first row that is not plain is dropped.
fn in_parts(text: &[u8], layout: &Layout) -> Vec<Taken> {
    let threads = available_parallelism().map_or(1, NonZero::get).min(MOST_THREADS);
    let count = (text.len() / WORTH_A_THREAD).clamp(1, threads);
    let mut parts = Vec::with_capacity(count);
    let mut rest = text;
    for left in (1..=count).rev() {
        let about = rest.len() / left;
        let end = if left == 1 {
            rest.len()
        } else {
            let from = rest.get(about..).unwrap_or_default();
            from.iter().position(|&one| one == b'\n').map_or(rest.len(), |at| about + at + 1)
        };
        let (part, behind) = rest.split_at(end);
        parts.push(part);
        rest = behind;
    }
    let mut taken: Vec<Taken> = scope(|threads| {
        let others: Vec<_> = parts.iter().skip(1).map(|part| threads.spawn(|| take(part, layout))).collect();
        let first = parts.first().map(|part| take(part, layout));
        // A thread that failed has taken nothing: its part goes to the reader.
        first.into_iter().chain(others.into_iter().map_while(|one| one.join().ok())).collect()
    });
    let end = taken.iter().position(|part| !part.whole).map_or(taken.len(), |at| at + 1);
    taken.truncate(end);
    taken
}

fn take(part: &[u8], layout: &Layout) -> Taken {
    // About as many as are like the first: a vector that grows is copied.
    let rows = part.iter().position(|&one| one == b'\n').map_or(1, |first| 1 + part.len() / (first + 1));
    let columns = (0..layout.chosen).map(|_| Vec::with_capacity(rows)).collect();
    let mut taken = Taken { columns, bytes: 0, rows: 0, whole: true };
    let mut row = vec![0.0; layout.chosen];
    let mut rest = part;
    while !rest.is_empty() {
        let Some(size) = row_of(rest, layout, &mut row) else {
            taken.whole = false;
            break;
        };
        for (column, &value) in taken.columns.iter_mut().zip(&row) {
            column.push(value);
        }
        taken.bytes += size;
        taken.rows += 1;
        rest = &rest[size..];
    }
    taken
}

/// Reads one row into `row`, and returns its bytes with the line feed; nothing if it is not plain.
fn row_of(text: &[u8], layout: &Layout, row: &mut [f64]) -> Option<usize> {
    if matches!(text.iter().find(|one| !matches!(one, b' ' | b'\t'))?, b'#' | b'%' | b'/' | b';') {
        return None;
    }
    let (mut cell, mut from) = (0, 0);
    loop {
        let rest = text.get(from..)?;
        let place = layout.places.get(cell).copied().flatten();
        let (size, value) = match place.and_then(|_| few_digits(rest, layout)) {
            Some((size, value)) => (size, Some(value)),
            None => (size_of_cell(rest, layout)?, None),
        };
        // Blanks at the ends of a line and in a row part no cells.
        if size > 0 || !layout.in_blanks() {
            let text = rest.get(..size)?;
            if cell >= layout.width || (cell >= layout.named && !text.trim_ascii().is_empty()) {
                return None;
            }
            if let Some(place) = place {
                row[place] = value.or_else(|| any_number(text.trim_ascii(), layout.decimal))?;
            }
            cell += 1;
        }
        from += size + 1;
        if rest.get(size) == Some(&b'\n') {
            return (cell == layout.width).then_some(from);
        }
    }
}

/// Returns the bytes of the cell that comes next, if nothing in it asks for the reader.
fn size_of_cell(text: &[u8], layout: &Layout) -> Option<usize> {
    let blanks = layout.in_blanks();
    let size = text.iter().position(|&one| {
        layout.ends_cell(one) || one == b'"' || one < b'\t' || (blanks && !(b' '..0x7f).contains(&one))
    })?;
    layout.ends_cell(text[size]).then_some(size)
}

/// Returns bytes and number of the cell that comes next, if few digits without an exponent are all it holds.
///
/// They are a whole number below 2^53 over a power of ten that is exact: one division rounds once, as the parser of the
/// standard library does.
fn few_digits(text: &[u8], layout: &Layout) -> Option<(usize, f64)> {
    let blank = usize::from(text.first() == Some(&b' ') && !layout.in_blanks());
    let sign = text.get(blank)?;
    let start = blank + usize::from(matches!(sign, b'-' | b'+'));
    let (mut whole, mut size, mut mark) = (0_u64, 0, None);
    let end = text.get(start..)?.iter().find(|&&one| {
        let digit = one.wrapping_sub(b'0');
        if digit < 10 {
            whole = whole.wrapping_mul(10).wrapping_add(u64::from(digit));
        } else if one == layout.decimal && mark.is_none() {
            mark = Some(size + 1);
        } else {
            return true;
        }
        size += 1;
        false
    })?;
    let has_digits = size > usize::from(mark.is_some());
    if size > FEW_DIGITS || !has_digits || !layout.ends_cell(*end) {
        return None;
    }
    #[expect(clippy::cast_precision_loss, reason = "of so few digits it is exact")]
    let value = whole as f64 / POWERS.get(mark.map_or(0, |mark| size - mark))?;
    Some((start + size, if *sign == b'-' { -value } else { value }))
}

/// Returns the number in a cell, as the standard library parses it, if it is written as a decimal number.
fn any_number(cell: &[u8], decimal: u8) -> Option<f64> {
    let mut digits = [0; LONGEST];
    let digits = digits.get_mut(..cell.len())?;
    for (to, &from) in digits.iter_mut().zip(cell) {
        *to = match from {
            b'0'..=b'9' | b'+' | b'-' | b'e' | b'E' => from,
            mark if mark == decimal => b'.',
            _ => return None,
        };
    }
    let value: f64 = std::str::from_utf8(digits).ok()?.parse().ok()?;
    (value.abs() <= MAX_MAGNITUDE).then_some(value)
}
