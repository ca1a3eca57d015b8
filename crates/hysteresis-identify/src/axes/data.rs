//! Records of several drives and positions, in units of their own size, and which of their samples are fitted.

use std::ops::Range;

use crate::error::{Error, RecordError};
use crate::records::record::check_skip;
use crate::records::signal::as_f64;

/// A record of several drives and positions: rows of samples, one after the other, from rest.
#[derive(Clone, Copy, Debug)]
pub struct AxesRecord<'a> {
    /// The drives, `m` for each sample.
    pub u: &'a [f64],
    /// The positions, `p` for each sample, read when the drives of the row are put out.
    pub y: &'a [f64],
}

/// Of several records the last of these share are held out, of one its last samples.
const HELD_OUT: f64 = 0.3;

/// The records, each signal over its standard deviation.
pub(super) struct Data {
    /// Drives and positions, in rows.
    pub(super) records: Vec<(Vec<f64>, Vec<f64>)>,
    pub(super) drives: usize,
    pub(super) positions: usize,
    pub(super) drive_scale: Vec<f64>,
    pub(super) position_scale: Vec<f64>,
    pub(super) position_mean: Vec<f64>,
    pub(super) skip: usize,
}

/// A record, and the samples of it that count.
pub(super) type Stretch = (usize, Range<usize>);

impl Data {
    pub(super) fn new(records: &[AxesRecord<'_>], m: usize, p: usize, skip: usize) -> Result<Self, Error> {
        for (name, got) in [("u", m), ("y", p)] {
            if !(1..=64).contains(&got) {
                return Err(Error::whole(name, "1 to 64 columns", got));
            }
        }
        if records.is_empty() {
            return Err(Error::whole("u", "a record at least", 0));
        }
        for (number, record) in records.iter().enumerate() {
            check(record, m, p, skip).map_err(|error| error.in_record(number))?;
        }
        let columns = |signal: fn(&AxesRecord<'_>) -> Vec<f64>, width: usize| -> Vec<(f64, f64)> {
            let all: Vec<Vec<f64>> = records.iter().map(signal).collect();
            (0..width).map(|j| spread(&all, width, j, skip)).collect()
        };
        let (u, y) = (columns(|record| record.u.to_vec(), m), columns(|record| record.y.to_vec(), p));
        for (name, spreads) in [("u", &u), ("y", &y)] {
            if let Some((j, (mean, _))) = spreads.iter().enumerate().find(|(_, (_, deviation))| *deviation < 1e-100) {
                return Err(Error::domain(name, Some(j), "a column with samples that vary", *mean));
            }
        }
        let scaled = |record: &AxesRecord<'_>| {
            let drives = record.u.iter().enumerate().map(|(i, value)| value / u[i % m].1).collect();
            let position = |(i, value): (usize, &f64)| (value - y[i % p].0) / y[i % p].1;
            (drives, record.y.iter().enumerate().map(position).collect())
        };
        Ok(Self {
            records: records.iter().map(scaled).collect(),
            drives: m,
            positions: p,
            drive_scale: u.iter().map(|(_, deviation)| *deviation).collect(),
            position_scale: y.iter().map(|(_, deviation)| *deviation).collect(),
            position_mean: y.iter().map(|(mean, _)| *mean).collect(),
            skip,
        })
    }

    pub(super) fn samples(&self, record: usize) -> usize {
        self.records[record].0.len() / self.drives
    }

    /// All samples that count.
    pub(super) fn all(&self) -> Vec<Stretch> {
        (0..self.records.len()).map(|number| (number, self.skip..self.samples(number))).collect()
    }

    /// Those that are fitted, and those that are held out: whole records if there are several.
    pub(super) fn split(&self) -> (Vec<Stretch>, Vec<Stretch>) {
        let all = self.all();
        if let [(number, range)] = &all[..] {
            let behind = range.end - share(range.len());
            return (vec![(*number, range.start..behind)], vec![(*number, behind..range.end)]);
        }
        let (fitted, held_out) = all.split_at(all.len() - share(all.len()));
        (fitted.to_vec(), held_out.to_vec())
    }

    /// The largest magnitude of a drive.
    pub(super) fn reach(&self, drive: usize) -> f64 {
        let column = |u: &Vec<f64>| u[drive..].iter().step_by(self.drives).fold(0.0, |most: f64, u| most.max(u.abs()));
        self.records.iter().map(|(u, _)| column(u)).fold(0.0, f64::max)
    }
}

/// How many of a count are held out: one at least.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a count")]
fn share(count: usize) -> usize {
    ((HELD_OUT * as_f64(count)) as usize).max(1)
}

fn check(record: &AxesRecord<'_>, m: usize, p: usize, skip: usize) -> Result<(), RecordError> {
    let samples = record.u.len() / m;
    if record.u.len() != samples * m {
        return Err(RecordError::Length { argument: "u", expected: samples * m, got: record.u.len() });
    }
    if record.y.len() != samples * p {
        return Err(RecordError::Length { argument: "y", expected: samples, got: record.y.len().div_ceil(p) });
    }
    check_skip("u", samples, skip)?;
    for (argument, signal, columns) in [("u", record.u, m), ("y", record.y, p)] {
        if let Some(place) = signal.iter().position(|value| !hysteresis_core::is_admissible(*value)) {
            return Err(RecordError::NotFinite { argument, index: place / columns, got: signal[place] });
        }
    }
    Ok(())
}

/// Mean and standard deviation of a column over all samples that count.
fn spread(signals: &[Vec<f64>], width: usize, column: usize, skip: usize) -> (f64, f64) {
    let values = || signals.iter().flat_map(|signal| signal[skip * width + column..].iter().step_by(width));
    let count = as_f64(values().count());
    let mean = values().sum::<f64>() / count;
    (mean, (values().map(|value| (value - mean).powi(2)).sum::<f64>() / count).sqrt())
}
