//! The benchmark plant A1 behind UDP, on a clock of its own: the other side of `--example loop -- --udp`.
//!
//! At every sample it takes the newest drive, moves on, and sends a measurement. It loses datagrams of both directions,
//! as it is told to.

use std::error::Error;
use std::io::ErrorKind;
use std::net::UdpSocket;

use clap::Parser;
use hysteresis_realtime::clock::{Clock, RealClock};
use hysteresis_realtime::io::Packet;
use hysteresis_simulate::paper::Benchmark;
use hysteresis_simulate::plant::{Plant, PlantOptions};

/// The benchmark plant A1 behind UDP.
#[derive(Parser)]
struct Arguments {
    /// Samples per second
    #[arg(long, default_value_t = 1e3)]
    rate: f64,
    /// The share of datagrams that are lost, in each direction
    #[arg(long, default_value_t = 0.0)]
    lose: f64,
    /// When it dies, without a word
    #[arg(long)]
    seconds: Option<f64>,
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "intervals of at most a second")]
fn main() -> Result<(), Box<dyn Error>> {
    let asked = Arguments::parse();
    let mut plant = Plant::new(&Benchmark::A1.stage(), &PlantOptions::new(1.0 / asked.rate))?;
    let socket = UdpSocket::bind("127.0.0.1:47001")?;
    socket.connect("127.0.0.1:47002")?;
    socket.set_nonblocking(true)?;
    let (mut random, mut clock) = (fastrand::Rng::with_seed(1), RealClock);
    let (interval, start) = ((1e9 / asked.rate) as u64, clock.now());
    let last = asked.seconds.map_or(u64::MAX, |seconds| (seconds * asked.rate) as u64);
    let (mut drive, mut newest) = (0.0, None);
    for sequence in 0..last {
        clock.sleep_until(start + sequence * interval);
        while let Some(packet) = receive(&socket)? {
            if random.f64() >= asked.lose && newest < Some(packet.sequence) {
                (drive, newest) = (packet.value, Some(packet.sequence));
            }
        }
        let value = plant.step(drive);
        if random.f64() >= asked.lose {
            // Before and after the loop nobody listens.
            let _ = socket.send(&Packet { sequence, value }.to_bytes());
        }
    }
    Ok(())
}

fn receive(socket: &UdpSocket) -> Result<Option<Packet>, Box<dyn Error>> {
    let mut bytes = [0; 64];
    loop {
        match socket.recv(&mut bytes) {
            Ok(length) => {
                if let Some(packet) = Packet::from_bytes(&bytes[..length]) {
                    return Ok(Some(packet));
                }
            }
            Err(error) => match error.kind() {
                ErrorKind::WouldBlock => return Ok(None),
                ErrorKind::ConnectionRefused | ErrorKind::Interrupted => {}
                _ => return Err(error.into()),
            },
        }
    }
}
