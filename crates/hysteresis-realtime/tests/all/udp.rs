//! Datagrams over the loopback device.

use std::net::UdpSocket;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use crate::setup::{REST, SLEW, controller, said, settings, sine};
use hysteresis_realtime::clock::SimulatedClock;
use hysteresis_realtime::io::{Fault, Io, Packet, UdpCounts, UdpIo};
use hysteresis_realtime::{EndReason, Report, Settings, StopFlag, WatchdogTimes, run_on};
use hysteresis_simulate::paper::Benchmark;

fn pair() -> (UdpSocket, UdpIo) {
    let plant = UdpSocket::bind("127.0.0.1:0").unwrap();
    let io = UdpIo::connect("127.0.0.1:0", plant.local_addr().unwrap()).unwrap();
    plant.connect(io.local_address().unwrap()).unwrap();
    plant.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    (plant, io)
}

fn send(plant: &UdpSocket, sequence: u64, value: f64) {
    plant.send(&Packet { sequence, value }.to_bytes()).unwrap();
}

fn receive(plant: &UdpSocket) -> Packet {
    let mut bytes = [0; 99];
    let length = plant.recv(&mut bytes).unwrap();
    Packet::from_bytes(&bytes[..length]).unwrap()
}

#[test]
fn the_newest_measurement_counts() {
    let (plant, mut io) = pair();
    assert_eq!(io.read(), Ok(None));
    for (sequence, value) in [(5, 0.5), (6, 0.6), (9, 0.9), (7, 0.7), (9, 0.99)] {
        send(&plant, sequence, value);
    }
    assert_eq!(io.read(), Ok(Some(0.9)));
    assert_eq!(io.read(), Ok(None));
    send(&plant, 8, 0.8);
    assert_eq!(io.read(), Ok(None), "older than what was read");
    plant.send(&[0; 15]).unwrap();
    plant.send(&[0; 17]).unwrap();
    assert_eq!(io.read(), Ok(None));
    send(&plant, 10, 1.0);
    assert_eq!(io.read(), Ok(Some(1.0)));
    assert_eq!(io.counts(), UdpCounts { received: 4, lost: 2, late: 3, malformed: 2, refused: 0 });
}

#[test]
fn drives_are_counted_and_a_plant_that_is_gone_is_no_fault() {
    let (plant, mut io) = pair();
    io.write(1.5).unwrap();
    io.write(-2.5).unwrap();
    assert_eq!([receive(&plant), receive(&plant)].map(|packet| (packet.sequence, packet.value)), [(0, 1.5), (1, -2.5)]);
    drop(plant);
    for _ in 0..10 {
        // The second one is told what became of the first.
        assert_eq!([io.write(3.5), io.write(3.5)], [Ok(()), Ok(())]);
        assert_eq!(io.read(), Ok(None));
    }
    assert!(io.counts().refused > 0, "the system said that nobody listens");
}

/// Measurements until `dies_at`, of which each was refused once before; then one more refusal, and silence.
struct Limited {
    reads: u64,
    dies_at: u64,
    refuses: bool,
}

impl Io for Limited {
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        self.reads += 1;
        Ok((self.reads <= self.dies_at).then_some(0.0))
    }

    fn datagrams(&self) -> Option<UdpCounts> {
        let refused = if self.refuses { self.reads.min(self.dies_at + 1) } else { self.reads.min(self.dies_at - 1) };
        Some(UdpCounts { refused, ..UdpCounts::default() })
    }

    fn write(&mut self, _: f64) -> Result<(), Fault> {
        Ok(())
    }
}

#[test]
fn a_refusal_after_the_last_measurement_warns_although_the_rest_drive_is_not_answered() {
    for (refuses, refused) in [(true, 2), (false, 0)] {
        let io = Limited { reads: 0, dies_at: 100, refuses };
        let watchdog = Some(WatchdogTimes { stale_after: 0.0, rest_after: 50e-4 });
        let asked = Settings { watchdog, seconds: None, ..settings() };
        let outcome = run_on(SimulatedClock::new(), controller(), io, sine(), asked, &StopFlag::default()).unwrap();
        let Report { at_rest, rest_refused, .. } = outcome.report;
        let io = said(&outcome.report, "io: ");
        assert_eq!((at_rest, rest_refused, io.len()), (true, refused, usize::from(refuses)), "{io:?}");
    }
}

/// The loop waits until the plant has dealt with the last drive, as long as there is a plant: so the test does not
/// depend on time.
struct InStep {
    io: UdpIo,
    drives: Vec<f64>,
    /// A datagram for every drive that was dealt with.
    answered: UdpSocket,
    gone: Arc<AtomicBool>,
}

impl Io for InStep {
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        if self.drives.is_empty() {
            return Ok(Some(0.0));
        }
        if !self.gone.load(Ordering::Acquire) {
            self.answered.recv(&mut [0; 1])?;
        }
        self.io.read()
    }

    fn rest_writes(&self) -> u32 {
        self.io.rest_writes()
    }

    fn datagrams(&self) -> Option<UdpCounts> {
        self.io.datagrams()
    }

    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        self.io.write(drive)?;
        self.drives.push(drive);
        Ok(())
    }
}

/// A plant that loses every 20th measurement and dies at a sample.
fn plant_thread(plant: UdpSocket, answered: UdpSocket, dies_at: u64, gone: Arc<AtomicBool>) -> thread::JoinHandle<f64> {
    thread::spawn(move || {
        let mut stage = Benchmark::A1.plant(5);
        loop {
            let packet = receive(&plant);
            if packet.sequence == dies_at {
                drop(plant);
                gone.store(true, Ordering::Release);
                answered.send(&[0]).unwrap();
                return stage.drive();
            }
            let measured = stage.step(packet.value);
            if packet.sequence % 20 != 19 {
                send(&plant, packet.sequence, measured);
            }
            answered.send(&[0]).unwrap();
        }
    })
}

#[test]
fn a_loop_over_datagrams_bears_losses_and_rests_when_the_plant_dies() {
    let (plant, io) = pair();
    let answered = UdpSocket::bind("127.0.0.1:0").unwrap();
    let answers = UdpSocket::bind("127.0.0.1:0").unwrap();
    answers.connect(answered.local_addr().unwrap()).unwrap();
    let gone = Arc::new(AtomicBool::new(false));
    let thread = plant_thread(plant, answers, 700, Arc::clone(&gone));
    answered.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    let io = InStep { io, drives: Vec::new(), answered, gone };
    let watchdog = Some(WatchdogTimes { stale_after: 0.0, rest_after: 50e-4 });
    let asked = Settings { watchdog, seconds: None, ..settings() };
    let outcome = run_on(SimulatedClock::new(), controller(), io, sine(), asked, &StopFlag::default()).unwrap();
    let (report, drives) = (&outcome.report, &outcome.io.drives);
    assert_eq!((report.end, report.at_rest, drives.last()), (EndReason::Watchdog, true, Some(&REST)));
    let at_rest = drives.iter().rev().take_while(|drive| **drive == REST).count();
    assert_eq!(at_rest, 20, "a lost datagram must not leave the amplifier where it was");
    assert!(drives.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= SLEW * 1e-4), "a jump");
    assert_eq!(thread.join().unwrap(), drives[699], "the plant had all drives until it died");
    // Drives 0 to 699 were answered, but for every 20th; the first sample needs no answer.
    assert_eq!((report.counts.fresh, outcome.io.io.counts().lost), (1 + 700 - 35, 34));
    assert_eq!((report.counts.write_faults, report.datagrams), (0, Some(outcome.io.io.counts())));
    // Drive 700 ended the plant. Every one after it was refused before the next one was sent; of the last one nobody
    // asks.
    let refused = drives.len() as u64 - 702;
    assert_eq!((report.rest_refused, outcome.io.io.counts().refused), (refused, refused));
    let nobody = format!("it was sent 20 times, and {refused} times the other side said that nobody listens");
    assert_eq!(said(report, "io: "), [format!("io: the rest drive may have reached nobody: {nobody}")]);
    // It was coming back from the last loss, so the last measurement stood in for `max_missing` samples more.
    assert!(drives[712..=740].iter().all(|drive| *drive == drives[711]), "held until the watchdog's time is over");
}
