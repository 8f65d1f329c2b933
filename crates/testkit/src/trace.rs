//! What happened in a run, event by event, and where two runs part.

use std::fmt;
use std::sync::Arc;

use cohaptic_units::Instant;
use cohaptic_units::print::{Seconds, Span};
use cohaptic_wan::{DropCause, NodeId, Path};

use crate::hit::Verdict;
use crate::names::Names;

/// What happened, and when.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TraceEvent {
    /// When.
    pub at: Instant,
    /// What.
    pub what: Happening,
}

/// What can happen in a test bed. A host is named by its place among those of the run.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Happening {
    /// A host has sent a packet.
    Sent {
        /// Which one.
        packet: PacketName,
        /// How many bytes it carries.
        len: usize,
        /// FNV-1a of them, 64 bits; 0 with [`Testbed::without_digests`](crate::Testbed::without_digests).
        digest: u64,
    },
    /// The packet of the event before carries a segment of TCP.
    #[cfg(feature = "tcp")]
    Segment {
        /// Which packet.
        packet: PacketName,
        /// From which port to which.
        ports: [u16; 2],
        /// The flags.
        flags: cohaptic_tcp::Flags,
        /// The sequence number, counted from that of the SYN.
        sequence: u32,
        /// How many octets of data it carries.
        octets: u32,
        /// The octet that its sender expects next, if it says so, counted from the SYN of the peer.
        acknowledges: Option<u32>,
        /// The window \[byte\].
        window: u32,
    },
    /// A packet lies in the buffer of a socket.
    Arrived {
        /// Which one.
        packet: PacketName,
    },
    /// A packet has come to its end elsewhere.
    Lost {
        /// Which one.
        packet: PacketName,
        /// Why.
        why: Lost,
    },
    /// A link has made a copy of a packet.
    Copied {
        /// The copy.
        packet: PacketName,
    },
    /// A law has hit a packet that is offered to its link.
    Hit {
        /// The packet.
        packet: PacketName,
        /// The fate that the law wants.
        verdict: Verdict,
    },
    /// A host crashed.
    Crashed(NodeId),
    /// The program of a host was killed.
    Killed(NodeId),
    /// A host was restarted.
    Restarted(NodeId),
    /// A host has new addresses.
    Readdressed(NodeId),
    /// The way from one host to another was cut.
    Cut(Path),
    /// It was mended.
    Mended(Path),
    /// The link from one host to another became another one.
    Relinked(Path),
    /// What the program noted: see [`Bed::note`](crate::Bed::note).
    Note(String),
}

/// The name of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PacketName {
    /// From which host to which.
    pub path: Path,
    /// Its number on this path, from 0.
    pub sequence: u64,
    /// Which copy of it; 0 is the packet itself.
    pub copy: u8,
}

/// Why a packet did not come into the buffer of a socket.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[non_exhaustive]
pub enum Lost {
    /// Its link took it.
    Link(DropCause),
    /// The way was cut when it was sent, or when it would have arrived.
    Cut,
    /// The host was down when it arrived.
    HostDown,
    /// The host had another address when it arrived.
    NoSuchAddress,
    /// No socket was bound to its port. The sender is told so.
    NoSocket,
    /// The buffer of the socket was full.
    BufferFull,
    /// A link has damaged it, and a checksum of TCP or IP shows it.
    Checksum,
    /// As many connections as the listener lets wait were waiting.
    BacklogFull,
}

impl fmt::Display for Lost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Link(cause) => cause.name(),
            Self::Cut => "the way is cut",
            Self::HostDown => "the host is down",
            Self::NoSuchAddress => "the host has another address",
            Self::NoSocket => "no socket at that port",
            Self::BufferFull => "the socket's buffer is full",
            Self::Checksum => "a checksum is wrong",
            Self::BacklogFull => "the listener's queue is full",
        })
    }
}

/// All that happened in a run, in order.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Trace {
    hosts: Arc<Names>,
    events: Vec<TraceEvent>,
}

impl Trace {
    pub(crate) const fn new(hosts: Arc<Names>) -> Self {
        Self { hosts, events: Vec::new() }
    }

    pub(crate) fn push(&mut self, at: Instant, what: Happening) {
        self.events.push(TraceEvent { at, what });
    }

    /// The names of the hosts.
    #[must_use]
    pub fn hosts(&self) -> &[String] {
        &self.hosts
    }

    pub(crate) fn names(&self) -> &Names {
        &self.hosts
    }

    /// The events.
    #[must_use]
    pub fn events(&self) -> &[TraceEvent] {
        &self.events
    }

    /// Where two runs part; `None` if they are the same.
    #[must_use]
    pub fn first_difference<'a>(&'a self, other: &'a Self) -> Option<Difference<'a>> {
        let place = (0..).find(|place| {
            let (one, other) = (self.events.get(*place), other.events.get(*place));
            one != other || one.is_none()
        })?;
        let events = (self.events.get(place), other.events.get(place));
        (events != (None, None)).then_some(Difference { hosts: &self.hosts, place, events })
    }

    /// An event in words: `1.024 s  client -> server  packet 17 lost: queue-full`.
    pub fn words<'a>(&'a self, event: &'a TraceEvent) -> impl fmt::Display + 'a {
        Words { hosts: &self.hosts, event }
    }
}

/// Where two runs part.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Difference<'a> {
    hosts: &'a [String],
    /// The number of the first event that differs, from 0.
    pub place: usize,
    /// That event in the one run and in the other; `None` if the run has ended before.
    pub events: (Option<&'a TraceEvent>, Option<&'a TraceEvent>),
}

impl Difference<'_> {
    /// When the two runs part.
    #[must_use]
    pub fn at(&self) -> Instant {
        let (one, other) = self.events;
        one.into_iter().chain(other).map(|event| event.at).min().unwrap_or(Instant::ZERO)
    }
}

impl fmt::Display for Difference<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "the runs part at {} s, with event {}:", Seconds(self.at()), self.place)?;
        for (name, event) in [("first ", self.events.0), ("second", self.events.1)] {
            match event {
                Some(event) => writeln!(f, "  {name}: {}", Words { hosts: self.hosts, event })?,
                None => writeln!(f, "  {name}: nothing more")?,
            }
        }
        Ok(())
    }
}

/// An event in words.
struct Words<'a> {
    hosts: &'a [String],
    event: &'a TraceEvent,
}

impl Words<'_> {
    fn name(&self, host: NodeId) -> &str {
        self.hosts.get(host.index()).map_or("?", |name| name)
    }

    fn path(&self, f: &mut fmt::Formatter<'_>, path: Path) -> fmt::Result {
        write!(f, "{} -> {}", self.name(path.from), self.name(path.to))
    }

    fn packet(&self, f: &mut fmt::Formatter<'_>, packet: PacketName) -> fmt::Result {
        self.path(f, packet.path)?;
        write!(f, "  packet {}", packet.sequence)?;
        if packet.copy == 0 { Ok(()) } else { write!(f, " (copy {})", packet.copy) }
    }
}

impl fmt::Display for Words<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} s  ", Seconds(self.event.at))?;
        match &self.event.what {
            Happening::Sent { packet, len, digest } => {
                self.packet(f, *packet)?;
                write!(f, " sent, {len} bytes")?;
                if *digest == 0 { Ok(()) } else { write!(f, ", digest {digest:016x}") }
            }
            #[cfg(feature = "tcp")]
            Happening::Segment { packet, ports: [from, to], flags, sequence, octets, acknowledges, window } => {
                self.packet(f, *packet)?;
                write!(f, " is {flags} {from} > {to}, sequence {sequence}, {octets} octets")?;
                if let Some(acknowledges) = acknowledges {
                    write!(f, ", acknowledges {acknowledges}")?;
                }
                write!(f, ", window {window}")
            }
            Happening::Arrived { packet } => {
                self.packet(f, *packet)?;
                f.write_str(" arrived")
            }
            Happening::Lost { packet, why } => {
                self.packet(f, *packet)?;
                write!(f, " lost: {why}")
            }
            Happening::Copied { packet } => {
                self.packet(f, *packet)?;
                f.write_str(" copied")
            }
            Happening::Hit { packet, verdict } => {
                self.packet(f, *packet)?;
                match verdict {
                    Verdict::Pass => f.write_str(" passed"),
                    Verdict::Drop => f.write_str(" hit: dropped"),
                    Verdict::Delay(by) => write!(f, " hit: delayed by {}", Span(*by)),
                    Verdict::Duplicate(by) => write!(f, " hit: copied, the copy {} later", Span(*by)),
                    Verdict::Corrupt(bit) => write!(f, " hit: bit {bit} flipped"),
                    Verdict::Behind(count) => write!(f, " hit: held behind {count} more"),
                }
            }
            Happening::Crashed(host) => write!(f, "{} crashed", self.name(*host)),
            Happening::Killed(host) => write!(f, "the program of {} was killed", self.name(*host)),
            Happening::Restarted(host) => write!(f, "{} restarted", self.name(*host)),
            Happening::Readdressed(host) => write!(f, "{} has new addresses", self.name(*host)),
            Happening::Cut(path) => {
                self.path(f, *path)?;
                f.write_str(" cut")
            }
            Happening::Mended(path) => {
                self.path(f, *path)?;
                f.write_str(" mended")
            }
            Happening::Relinked(path) => {
                self.path(f, *path)?;
                f.write_str(" is another link")
            }
            Happening::Note(note) => write!(f, "note: {note}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sent(at: u64, sequence: u64) -> TraceEvent {
        let packet = PacketName { path: Path { from: NodeId(0), to: NodeId(1) }, sequence, copy: 0 };
        TraceEvent { at: Instant::from_nanos(at), what: Happening::Sent { packet, len: 3, digest: 7 } }
    }

    #[test]
    fn the_first_difference_is_told_with_its_time() {
        let trace = |events: Vec<TraceEvent>| Trace { hosts: Arc::new(["a", "b"].into_iter().collect()), events };
        let one = trace(vec![sent(0, 0), sent(5_000, 1), sent(9_000, 2)]);
        assert_eq!(one.first_difference(&one.clone()), None);
        let other = trace(vec![sent(0, 0), sent(5_001, 1), sent(9_000, 2)]);
        let difference = one.first_difference(&other).unwrap();
        assert_eq!((difference.at(), difference.place), (Instant::from_nanos(5_000), 1));
        let shorter = trace(vec![sent(0, 0)]);
        assert_eq!(shorter.first_difference(&one).unwrap().at(), Instant::from_nanos(5_000));
        assert_eq!(
            shorter.first_difference(&one).unwrap().to_string(),
            "the runs part at 0.000005 s, with event 1:\n  first : nothing more\n  second: 0.000005 s  a -> b  packet 1 sent, 3 bytes, digest 0000000000000007\n"
        );
    }
}
