//! Trace of a run, event by event, and the first difference of two traces.

use std::fmt;
use std::net::SocketAddr;
use std::sync::Arc;

use cohaptic_units::Instant;
use cohaptic_units::print::{Seconds, Span};
use cohaptic_wan::{DropCause, NodeId, Path, PathPart};

use crate::hit::Verdict;
use crate::names::Names;

/// Event of a run.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct TraceEvent {
    /// Instant of the event.
    pub at: Instant,
    /// Kind of the event, with its details.
    pub what: Happening,
}

/// Kind of an event in a test bed. A host is given by its index in the list of hosts.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum Happening {
    /// A host has sent a packet.
    Sent {
        /// The packet.
        packet: PacketName,
        /// Number of bytes that the packet carries.
        len: usize,
        /// FNV-1a hash of the bytes, 64 bits; 0 with [`Testbed::without_digests`](crate::Testbed::without_digests).
        digest: u64,
    },
    /// The packet of the previous event carries a segment of TCP.
    #[cfg(feature = "tcp")]
    Segment {
        /// The packet.
        packet: PacketName,
        /// Source port and destination port.
        ports: [u16; 2],
        /// Flags of the segment.
        flags: cohaptic_tcp::Flags,
        /// Sequence number, relative to the SYN.
        sequence: u32,
        /// Number of octets of data.
        octets: u32,
        /// Next octet that the sender of the segment expects, relative to the SYN of the peer. `None` without the flag ACK.
        acknowledges: Option<u32>,
        /// Window \[byte\].
        window: u32,
    },
    /// A packet lies in the buffer of a socket.
    Arrived {
        /// The packet.
        packet: PacketName,
    },
    /// A packet was lost.
    Lost {
        /// The packet.
        packet: PacketName,
        /// Cause of the loss.
        why: Lost,
    },
    /// A NAT has translated a packet, or a firewall has let the packet pass. The packet goes on over the next link.
    Forwarded {
        /// The packet, on the link to the NAT or the firewall.
        packet: PacketName,
        /// Source and destination before the NAT.
        before: [SocketAddr; 2],
        /// Source and destination after the NAT.
        after: [SocketAddr; 2],
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
    /// A NAT or a firewall forgot its mappings.
    Forgotten(NodeId),
    /// A NAT or a firewall behaves otherwise from now on.
    Reconfigured(NodeId),
    /// The path from a host to another host was cut.
    Cut(Path),
    /// The cut of a path has ended.
    Mended(Path),
    /// The path from a host to another host was put on hold.
    Held(Path),
    /// The hold of a path has ended, and the packets that have waited arrive.
    Released(Path),
    /// The link from a host to another host was replaced.
    Relinked(Path),
    /// The program added a note: see [`Bed::note`](crate::Bed::note).
    Note(String),
}

/// Identity of a packet in a trace.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct PacketName {
    /// Sending and receiving host.
    pub path: Path,
    /// Number of the packet on this path, from 0.
    pub sequence: u64,
    /// Number of the copy; 0 is the packet itself.
    pub copy: u8,
}

/// Cause of the loss of a packet, which did not reach the buffer of a socket.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[non_exhaustive]
pub enum Lost {
    /// The link dropped the packet.
    Link(DropCause),
    /// The uplink of the sender dropped the packet: see `Testbed::access` (feature `files`).
    Uplink(DropCause),
    /// The downlink of the receiver dropped the packet.
    Downlink(DropCause),
    /// The path was cut when the packet was sent, or when it would have arrived.
    Cut,
    /// The host was down when the packet arrived.
    HostDown,
    /// The host had another address when the packet arrived.
    NoSuchAddress,
    /// The filter of a NAT or a firewall did not permit the source.
    Filtered,
    /// The NAT or firewall had no mapping for the packet, or no free port for a new mapping.
    NoMapping,
    /// The packet went from inside of a NAT to the NAT's own external address, and the NAT does not hairpin.
    NoHairpin,
    /// No socket was bound to the port. The sender of a datagram is told.
    NoSocket,
    /// The buffer of the socket was full.
    BufferFull,
    /// The link has damaged the packet, and a checksum of TCP or IP reveals it.
    Checksum,
    /// As many connections were waiting as the backlog of the listener permits.
    BacklogFull,
}

impl Lost {
    /// Returns the loss of a packet that was dropped on a part of its path.
    pub(crate) const fn on(part: PathPart, cause: DropCause) -> Self {
        match part {
            PathPart::Uplink => Self::Uplink(cause),
            PathPart::Link => Self::Link(cause),
            PathPart::Downlink => Self::Downlink(cause),
        }
    }
}

impl fmt::Display for Lost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Link(cause) => cause.name(),
            Self::Uplink(cause) => return write!(f, "{} (uplink)", cause.name()),
            Self::Downlink(cause) => return write!(f, "{} (downlink)", cause.name()),
            Self::Cut => "the path is cut",
            Self::HostDown => "the host is down",
            Self::NoSuchAddress => "the host has another address",
            Self::Filtered => "filtered",
            Self::NoMapping => "no mapping",
            Self::NoHairpin => "no hairpin",
            Self::NoSocket => "no socket at that port",
            Self::BufferFull => "the socket's buffer is full",
            Self::Checksum => "a checksum is wrong",
            Self::BacklogFull => "the listener's queue is full",
        })
    }
}

/// Events of a run, in their order.
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

    /// Returns the names of the hosts.
    #[must_use]
    pub fn hosts(&self) -> &[String] {
        &self.hosts
    }

    pub(crate) fn names(&self) -> &Names {
        &self.hosts
    }

    /// Returns the events.
    #[must_use]
    pub fn events(&self) -> &[TraceEvent] {
        &self.events
    }

    /// Returns the first difference between two runs, or `None` if they are equal.
    #[must_use]
    pub fn first_difference<'a>(&'a self, other: &'a Self) -> Option<Difference<'a>> {
        // The search ends at the first unequal pair, or where both traces end.
        let place = (0..).find(|place| {
            let (one, other) = (self.events.get(*place), other.events.get(*place));
            one != other || one.is_none()
        })?;
        let events = (self.events.get(place), other.events.get(place));
        (events != (None, None)).then_some(Difference { hosts: &self.hosts, place, events })
    }

    /// Returns an event in words, such as `1.024 s  client -> server  packet 17 lost: queue-full`.
    pub fn words<'a>(&'a self, event: &'a TraceEvent) -> impl fmt::Display + 'a {
        Words { hosts: &self.hosts, event }
    }
}

/// First difference between two runs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Difference<'a> {
    hosts: &'a [String],
    /// Index of the first event that differs.
    pub place: usize,
    /// The event in the first and in the second run; `None` if the run has ended before.
    pub events: (Option<&'a TraceEvent>, Option<&'a TraceEvent>),
}

impl Difference<'_> {
    /// Returns the instant of the difference: the earlier of the two events.
    #[must_use]
    pub fn at(&self) -> Instant {
        let (one, other) = self.events;
        one.into_iter().chain(other).map(|event| event.at).min().unwrap_or(Instant::ZERO)
    }
}

impl fmt::Display for Difference<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "the runs differ from {} s on, at event {}:", Seconds(self.at()), self.place)?;
        for (name, event) in [("first ", self.events.0), ("second", self.events.1)] {
            match event {
                Some(event) => writeln!(f, "  {name}: {}", Words { hosts: self.hosts, event })?,
                None => writeln!(f, "  {name}: nothing more")?,
            }
        }
        Ok(())
    }
}

/// Formatter of an event in words.
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
            Happening::Forwarded { packet, before: [from, to], after } => {
                self.packet(f, *packet)?;
                let [source, destination] = after;
                if [from, to] == [source, destination] {
                    write!(f, " passed: {from} > {to}")
                } else {
                    write!(f, " translated: {from} > {to} becomes {source} > {destination}")
                }
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
                    Verdict::Behind(count) => write!(f, " hit: held until {count} later packets have passed"),
                }
            }
            Happening::Crashed(host) => write!(f, "{} crashed", self.name(*host)),
            Happening::Killed(host) => write!(f, "the program of {} was killed", self.name(*host)),
            Happening::Restarted(host) => write!(f, "{} restarted", self.name(*host)),
            Happening::Readdressed(host) => write!(f, "{} has new addresses", self.name(*host)),
            Happening::Forgotten(nat) => write!(f, "{} forgot its mappings", self.name(*nat)),
            Happening::Reconfigured(nat) => write!(f, "{} behaves otherwise", self.name(*nat)),
            Happening::Cut(path) => {
                self.path(f, *path)?;
                f.write_str(" cut")
            }
            Happening::Mended(path) => {
                self.path(f, *path)?;
                f.write_str(" mended")
            }
            Happening::Held(path) => {
                self.path(f, *path)?;
                f.write_str(" on hold")
            }
            Happening::Released(path) => {
                self.path(f, *path)?;
                f.write_str(" released")
            }
            Happening::Relinked(path) => {
                self.path(f, *path)?;
                f.write_str(" has another link")
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
            "the runs differ from 0.000005 s on, at event 1:\n  first : nothing more\n  second: 0.000005 s  a -> b  packet 1 sent, 3 bytes, digest 0000000000000007\n"
        );
    }
}
