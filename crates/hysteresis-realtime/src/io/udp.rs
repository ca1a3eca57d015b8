//! Datagrams: a plant on another computer or in another process.
//!
//! A datagram has [`PACKET`] bytes, in little-endian order: a sequence number (`u64`) and a number (`f64`). The plant
//! sends measurements, the loop drives. Both count their datagrams upwards from any number.

use std::io::ErrorKind;
use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};

use super::{Fault, Io, UdpCounts};

/// Bytes of a datagram.
pub const PACKET: usize = 16;
/// At most so many datagrams are taken at a sample, so that its time is bounded.
const AT_ONCE: usize = 64;

/// The rest drive is sent so often: all but one may be lost.
const REST_WRITES: u32 = 20;

/// What a datagram holds.
///
/// ```
/// use hysteresis_realtime::io::Packet;
/// let packet = Packet { sequence: 7, value: -1.5 };
/// assert_eq!(Packet::from_bytes(&packet.to_bytes()), Some(packet));
/// assert_eq!(Packet::from_bytes(&[0; 15]), None);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packet {
    /// Its number: later ones are greater.
    pub sequence: u64,
    /// The measurement or the drive.
    pub value: f64,
}

impl Packet {
    /// As it is sent.
    #[must_use]
    pub fn to_bytes(self) -> [u8; PACKET] {
        let mut bytes = [0; PACKET];
        bytes[..8].copy_from_slice(&self.sequence.to_le_bytes());
        bytes[8..].copy_from_slice(&self.value.to_le_bytes());
        bytes
    }

    /// What was received; None for another number of bytes.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (sequence, value) = bytes.split_first_chunk()?;
        let value = value.try_into().ok()?;
        Some(Self { sequence: u64::from_le_bytes(*sequence), value: f64::from_le_bytes(value) })
    }
}

/// Input and output by datagrams.
///
/// The newest measurement counts. A plant that starts again with lower sequence numbers is not listened to: the
/// watchdog ends the loop. A drive counts as written when the network has taken it: whether it arrives is the plant's
/// to watch. The rest drive is sent 20 times, a sample after the other, so that a lost datagram does not leave the
/// amplifier where it was.
///
/// The other computer may say that nobody listens. This refuses an earlier datagram, so the present write has not
/// failed. No measurement comes then either, and the watchdog ends the loop. The report warns if datagrams were refused
/// after the last measurement, or after the rest drive was written first. It can only warn if the other computer says
/// so: one that is off says nothing.
#[derive(Debug)]
pub struct UdpIo {
    socket: UdpSocket,
    newest: Option<u64>,
    sent: u64,
    counts: UdpCounts,
}

impl UdpIo {
    /// A socket at `local` that listens to `plant` alone and sends drives there.
    ///
    /// # Errors
    /// Those of the socket.
    ///
    /// ```
    /// use std::net::UdpSocket;
    /// use hysteresis_realtime::io::{Io, UdpIo};
    /// let plant = UdpSocket::bind("127.0.0.1:0")?;
    /// let mut io = UdpIo::connect("127.0.0.1:0", plant.local_addr()?)?;
    /// assert_eq!(io.read(), Ok(None));
    /// assert_eq!(io.write(5.0), Ok(()));
    /// # Ok::<(), std::io::Error>(())
    /// ```
    pub fn connect(local: impl ToSocketAddrs, plant: impl ToSocketAddrs) -> std::io::Result<Self> {
        let socket = UdpSocket::bind(local)?;
        socket.connect(plant)?;
        socket.set_nonblocking(true)?;
        Ok(Self { socket, newest: None, sent: 0, counts: UdpCounts::default() })
    }

    /// The address of this side.
    ///
    /// # Errors
    /// Those of the socket.
    pub fn local_address(&self) -> std::io::Result<SocketAddr> {
        self.socket.local_addr()
    }

    /// What became of the datagrams until now.
    #[must_use]
    pub fn counts(&self) -> UdpCounts {
        self.counts
    }

    /// Whether a datagram is the newest one. The first one is, whatever its number.
    fn is_newest(&mut self, sequence: u64) -> bool {
        let gap = match self.newest {
            Some(newest) if sequence <= newest => {
                self.counts.late += 1;
                return false;
            }
            Some(newest) => sequence - newest - 1,
            None => 0,
        };
        self.counts.lost = self.counts.lost.saturating_add(gap);
        self.counts.received += 1;
        self.newest = Some(sequence);
        true
    }
}

impl Io for UdpIo {
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        // One byte more than a datagram has, to tell longer ones.
        let mut bytes = [0; PACKET + 1];
        let mut fresh = None;
        for _ in 0..AT_ONCE {
            match self.socket.recv(&mut bytes) {
                Ok(length) => match Packet::from_bytes(&bytes[..length]) {
                    Some(packet) if self.is_newest(packet.sequence) => fresh = Some(packet.value),
                    Some(_) => {}
                    None => self.counts.malformed += 1,
                },
                Err(error) => match error.kind() {
                    ErrorKind::WouldBlock => break,
                    ErrorKind::ConnectionRefused | ErrorKind::ConnectionReset => self.counts.refused += 1,
                    ErrorKind::Interrupted => {}
                    kind if fresh.is_none() => return Err(Fault::System(kind)),
                    _ => break,
                },
            }
        }
        Ok(fresh)
    }

    fn rest_writes(&self) -> u32 {
        REST_WRITES
    }

    fn datagrams(&self) -> Option<UdpCounts> {
        Some(self.counts)
    }

    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        let bytes = Packet { sequence: self.sent, value: drive }.to_bytes();
        let mut sent = self.socket.send(&bytes);
        if let Err(error) = &sent
            && matches!(error.kind(), ErrorKind::ConnectionRefused | ErrorKind::ConnectionReset)
        {
            self.counts.refused += 1;
            sent = self.socket.send(&bytes);
        }
        sent?;
        self.sent += 1;
        Ok(())
    }
}
