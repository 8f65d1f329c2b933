//! Content of a capture: the datagrams for the matching, and counts of all other frames.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use cohaptic_units::print::Counted;
use serde::Serialize;

use super::{frame, reader};

/// Counts of the frames of a capture.
#[derive(Clone, PartialEq, Eq, Debug, Default, Serialize)]
pub struct Contents {
    /// Frames in the file.
    pub frames: usize,
    /// Number of frames by kind. `UDP` counts the datagrams used; all other names count frames that were not used.
    pub kinds: BTreeMap<Cow<'static, str>, usize>,
    /// Frames showing a packet already shown by an earlier frame of the same capture, for example at another interface.
    pub seen_again: usize,
    /// Datagrams with several packets, cut or joined by the network card.
    pub super_packets: usize,
    /// `true` if the file ends within a block. All blocks before were read.
    pub cut_off: bool,
}

/// Largest number of kinds named in a text.
const MOST_NAMED: usize = 8;

impl fmt::Display for Contents {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", Counted(self.frames, "frame"))?;
        let mut kinds: Vec<(&str, usize)> = self.kinds.iter().map(|(kind, count)| (kind.as_ref(), *count)).collect();
        kinds.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
        for (place, (kind, count)) in kinds.iter().take(MOST_NAMED).enumerate() {
            write!(f, "{} {kind} {count}", if place == 0 { ":" } else { "," })?;
        }
        let others: usize = kinds.iter().skip(MOST_NAMED).map(|kind| kind.1).sum();
        if others > 0 { write!(f, ", others {others}") } else { Ok(()) }
    }
}

/// A datagram of a capture.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Datagram {
    /// Time of capture \[ns since 1970\].
    pub(super) nanos: i128,
    pub(super) destination_port: u16,
    /// Identification of the IPv4 header; `None` for IPv6.
    pub(super) identification: Option<u16>,
    /// Length of the payload as sent \[byte\].
    pub(super) length: usize,
    /// Hash of the captured part of the payload.
    pub(super) hash: u64,
    /// Hash of the place of capture: interface and headers before IP.
    pub(super) place: u64,
    /// Range of the captured payload in [`Capture::bytes`].
    range: Range<usize>,
}

impl Datagram {
    /// Returns the number of captured octets of the payload.
    pub(super) const fn captured(&self) -> usize {
        self.range.end - self.range.start
    }

    /// Returns the identification, if the sender gives each packet a different one. Zero counts as none, because senders that forbid fragments send zero.
    pub(super) fn own_identification(&self) -> Option<u16> {
        self.identification.filter(|number| *number != 0)
    }
}

/// Datagrams and counts of a capture.
#[derive(Debug)]
pub(super) struct Capture {
    /// Datagrams in the order of their times.
    pub(super) datagrams: Vec<Datagram>,
    /// Captured payloads of all datagrams, one after the other.
    bytes: Vec<u8>,
    /// Times of the first and the last frame of any kind \[ns since 1970\]. The capture ran in between.
    pub(super) ran: (i128, i128),
    pub(super) contents: Contents,
}

impl Capture {
    /// Returns a capture without frames.
    pub(super) fn empty() -> Self {
        Self { datagrams: Vec::new(), bytes: Vec::new(), ran: (i128::MAX, i128::MIN), contents: Contents::default() }
    }

    /// Adds a frame: a datagram to the list, and any frame to the counts.
    pub(super) fn add(&mut self, frame: &reader::Frame<'_>, port: Option<u16>) {
        self.contents.frames += 1;
        if let Some(nanos) = frame.nanos {
            self.ran = (self.ran.0.min(nanos), self.ran.1.max(nanos));
        }
        let kind = match (frame::datagram(frame), frame.nanos) {
            (Err(kind), _) => kind,
            (Ok(found), _) if port.is_some_and(|port| port != found.destination_port) => "UDP to other ports".into(),
            (Ok(_), None) => "UDP without a time".into(),
            (Ok(found), Some(nanos)) => {
                let begin = self.bytes.len();
                self.bytes.extend(found.payload);
                self.datagrams.push(Datagram {
                    nanos,
                    destination_port: found.destination_port,
                    identification: found.identification,
                    length: found.length,
                    hash: hash(found.payload),
                    place: found.place,
                    range: begin..self.bytes.len(),
                });
                "UDP".into()
            }
        };
        *self.contents.kinds.entry(kind).or_default() += 1;
    }

    /// Returns the captured part of a payload.
    pub(super) fn payload(&self, datagram: &Datagram) -> &[u8] {
        &self.bytes[datagram.range.clone()]
    }

    /// Divides a datagram into the packets made by the network card: `octets` octets each, and at most as many in the last. Identifications count up from
    /// the first, as in Linux.
    pub(super) fn pieces(&self, datagram: &Datagram, octets: usize) -> Vec<Datagram> {
        let piece = |(number, begin): (u16, usize)| {
            let range = begin..datagram.range.end.min(begin + octets);
            Datagram {
                identification: datagram.own_identification().map(|first| first.wrapping_add(number)),
                length: range.len(),
                hash: hash(&self.bytes[range.clone()]),
                range,
                ..datagram.clone()
            }
        };
        (0..=u16::MAX).zip(datagram.range.clone().step_by(octets)).map(piece).collect()
    }
}

/// Returns whether two datagrams have the same length, and equal payloads as far as both were captured.
pub(super) fn agree(one: &Capture, number: usize, other: &Capture, other_number: usize) -> bool {
    let (first, second) = (&one.datagrams[number], &other.datagrams[other_number]);
    // Frames may be cut at either end, so only octets in both files are compared. The lengths as sent must still be equal.
    let octets = first.captured().min(second.captured());
    first.length == second.length && one.payload(first)[..octets] == other.payload(second)[..octets]
}

/// Returns a hash of octets. Of 10⁶ datagrams, two different ones have the same hash with probability 3·10⁻⁸. Payloads are compared before a match.
pub(super) fn hash(octets: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    octets.hash(&mut hasher);
    hasher.finish()
}
