//! Samples on their way from the loop to the recorder.

use rtrb::{Consumer, Producer, RingBuffer};

/// A row of a record.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Row {
    /// When the sample began, in seconds from the first deadline.
    pub time: f64,
    /// The reference of now.
    pub reference: f64,
    /// What the controller was given: NaN for nothing.
    pub measurement: f64,
    /// The drive that the amplifier has after this sample, in volts.
    pub drive: f64,
    /// How late the sample began, in seconds.
    pub lateness: f64,
}

/// The names of the columns of a record, in their order.
pub const COLUMNS: [&str; 5] = ["time", "reference", "measurement", "drive", "lateness"];

impl Row {
    pub(crate) fn numbers(&self) -> [f64; COLUMNS.len()] {
        [self.time, self.reference, self.measurement, self.drive, self.lateness]
    }
}

/// The end at the loop: it never waits.
#[derive(Debug)]
pub(crate) struct Sender {
    ring: Producer<Row>,
    lost: u64,
}

impl Sender {
    /// Counts a row for which there is no room.
    #[inline]
    pub(crate) fn send(&mut self, row: Row) {
        self.lost += u64::from(self.ring.push(row).is_err());
    }

    pub(crate) fn lost(&self) -> u64 {
        self.lost
    }
}

/// A ring of so many rows, all memory of which is touched: later no page has to be found.
pub(crate) fn ring(rows: usize) -> (Sender, Consumer<Row>) {
    let (mut producer, mut consumer) = RingBuffer::new(rows);
    while producer.push(Row::default()).is_ok() {}
    while consumer.pop().is_ok() {}
    (Sender { ring: producer, lost: 0 }, consumer)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_come_in_order_and_lost_ones_are_counted() {
        let (mut sender, mut receiver) = ring(3);
        let row = |time| Row { time, ..Row::default() };
        for time in [1.0, 2.0, 3.0, 4.0, 5.0] {
            sender.send(row(time));
        }
        assert_eq!(sender.lost(), 2);
        assert_eq!([1.0, 2.0, 3.0].map(|_| receiver.pop().unwrap().time), [1.0, 2.0, 3.0]);
        sender.send(row(6.0));
        assert_eq!((receiver.pop().unwrap(), sender.lost()), (row(6.0), 2));
    }
}
