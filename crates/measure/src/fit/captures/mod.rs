//! Measurements from a pair of captures, one of each end.
//!
//! Both files are read for UDP datagrams (pcap or pcapng; Ethernet, raw IP, Linux "cooked" and loopback frames; IPv4 and IPv6). A datagram of the
//! sender's file is matched with one of the receiver's that has the same payload and the same IP identification, the first with the first, the second
//! with the second, and so on; the rest is then matched by payload alone, for paths that rewrite identifications. Addresses and ports do not
//! count: they may be translated. A datagram of the sender that has no match is lost.
//!
//! So payloads should differ, by a sequence number say; where several datagrams are equal and one of them is lost, the wrong ones may be matched:
//! [`Matched::ambiguous`] counts them. Both files must hold as much of each datagram, or payloads look different. The clocks of the two ends are taken as
//! they are: see [`Measurements::shifted`] and [`Measurements::without_skew`].

mod frame;
mod reader;

use std::collections::{BTreeMap, VecDeque};
use std::io::Read;

use cohaptic_units::print::Counted;

use self::frame::Datagram;
use super::table::Attoseconds;
use super::{Measurement, Measurements, MeasurementsError};

/// What two captures say together.
#[derive(Clone, PartialEq, Debug)]
pub struct Matched {
    /// The packets of the sender, in the order of sending; times from the first.
    pub measurements: Measurements,
    /// Datagrams that only the sender has: counted as lost.
    pub unmatched_sent: usize,
    /// Datagrams that only the receiver has: copies, or other traffic. They are left out.
    pub unmatched_arrived: usize,
    /// Datagrams of the sender that equal another in payload and identification.
    pub ambiguous: usize,
}

/// Which of the two files.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// That of the sender.
    Sender,
    /// That of the receiver.
    Receiver,
}

/// Why two captures are not read.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum CaptureError {
    /// A file is no capture, or damaged.
    #[error("the capture of the {}: {problem} after {}", end.name(), Counted(*frames, "frame"))]
    Unreadable {
        /// Which file.
        end: End,
        /// How many frames were read before.
        frames: usize,
        /// The fault.
        problem: CaptureProblem,
    },
    /// A file has no UDP datagrams that were asked for.
    #[error("the capture of the {} has no UDP datagrams{} in {}: expected those of the link", end.name(), port.map(|port| format!(" to port {port}")).unwrap_or_default(), Counted(*frames, "frame"))]
    NoDatagrams {
        /// Which file.
        end: End,
        /// How many frames it has.
        frames: usize,
        /// The port that was asked for.
        port: Option<u16>,
    },
    /// The times make no measurements.
    #[error(transparent)]
    Measurements(#[from] MeasurementsError),
}

/// The fault of a capture.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum CaptureProblem {
    /// It does not begin as a capture does.
    #[error("found no pcap or pcapng header, expected one of the two formats")]
    Format,
    /// A block contradicts the format.
    #[error("found a malformed block")]
    Malformed,
    /// The file ends within a block.
    #[error("the file ends within a block")]
    CutOff,
    /// The file cannot be read.
    #[error("the file cannot be read")]
    Io,
    /// The resolution of timestamps makes no sense, or a frame names an interface that was not described.
    #[error("found a timestamp without a meaning")]
    Timestamp,
}

impl End {
    const fn name(self) -> &'static str {
        match self {
            Self::Sender => "sender",
            Self::Receiver => "receiver",
        }
    }
}

/// Whether a file that begins like this is a capture: pcap of either byte order, with microseconds or nanoseconds, or pcapng.
#[must_use]
pub fn is_capture(beginning: &[u8]) -> bool {
    const PCAPNG: [u8; 4] = [0x0A, 0x0D, 0x0D, 0x0A];
    const PCAP: [[u8; 4]; 2] = [[0xA1, 0xB2, 0xC3, 0xD4], [0xA1, 0xB2, 0x3C, 0x4D]];
    let Some(&[a, b, c, d]) = beginning.first_chunk() else { return false };
    [a, b, c, d] == PCAPNG || PCAP.contains(&[a, b, c, d]) || PCAP.contains(&[d, c, b, a])
}

/// Reads the captures of both ends. `port`: only datagrams to that UDP port count, which keeps other traffic from being taken for losses.
///
/// # Errors
///
/// [`CaptureError`] if a file cannot be read or has no such datagrams.
pub fn between(sender: impl Read + Send, receiver: impl Read + Send, port: Option<u16>) -> Result<Matched, CaptureError> {
    let sent = datagrams(End::Sender, sender, port)?;
    let arrived = datagrams(End::Receiver, receiver, port)?;
    Ok(matched(&sent, &arrived)?)
}

/// The datagrams of one file, in the order of their times.
fn datagrams(end: End, from: impl Read + Send, port: Option<u16>) -> Result<Vec<Datagram>, CaptureError> {
    let mut frames = 0;
    let mut datagrams = Vec::new();
    reader::for_each_frame(from, |frame| {
        frames += 1;
        datagrams.extend(frame::datagram(&frame).filter(|datagram| port.is_none_or(|port| datagram.destination_port == port)));
    })
    .map_err(|problem| CaptureError::Unreadable { end, frames, problem })?;
    if datagrams.is_empty() {
        return Err(CaptureError::NoDatagrams { end, frames, port });
    }
    datagrams.sort_by_key(|datagram| datagram.nanos);
    Ok(datagrams)
}

fn matched(sent: &[Datagram], arrived: &[Datagram]) -> Result<Matched, MeasurementsError> {
    let mut arrival_of: Vec<Option<usize>> = vec![None; sent.len()];
    let mut taken = vec![false; arrived.len()];
    let ambiguous = pair(sent, arrived, &mut arrival_of, &mut taken, |datagram| (datagram.payload, datagram.identification));
    pair(sent, arrived, &mut arrival_of, &mut taken, |datagram| datagram.payload);
    let instant = |datagram: &Datagram| Attoseconds::from_nanos(datagram.nanos);
    // Nanoseconds of 64 bits are far below what attoseconds of 128 bits hold.
    let since = |later: &Datagram, earlier: &Datagram| instant(later).zip(instant(earlier)).and_then(|(later, earlier)| later.seconds_since(earlier));
    let packets = sent.iter().zip(&arrival_of).map(|(datagram, arrival)| Measurement {
        sent_s: since(datagram, &sent[0]).unwrap_or(f64::NAN),
        delay_s: arrival.map(|place| since(&arrived[place], datagram).unwrap_or(f64::NAN)),
    });
    Ok(Matched {
        measurements: Measurements::new(packets.collect())?,
        unmatched_sent: arrival_of.iter().filter(|arrival| arrival.is_none()).count(),
        unmatched_arrived: taken.iter().filter(|taken| !**taken).count(),
        ambiguous,
    })
}

/// Pairs datagrams that are not paired yet by equal keys, in the order of occurrence; gives the number of the sender's datagrams whose key is not the only one.
fn pair<K: Ord>(
    sent: &[Datagram],
    arrived: &[Datagram],
    arrival_of: &mut [Option<usize>],
    taken: &mut [bool],
    key: impl Fn(&Datagram) -> K,
) -> usize {
    let mut waiting: BTreeMap<K, (VecDeque<usize>, usize)> = BTreeMap::new();
    for (place, datagram) in sent.iter().enumerate().filter(|(place, _)| arrival_of[*place].is_none()) {
        let (places, times) = waiting.entry(key(datagram)).or_default();
        places.push_back(place);
        *times += 1;
    }
    for (place, datagram) in arrived.iter().enumerate() {
        if !taken[place]
            && let Some(first) = waiting.get_mut(&key(datagram)).and_then(|(places, _)| places.pop_front())
        {
            arrival_of[first] = Some(place);
            taken[place] = true;
        }
    }
    waiting.values().filter(|(_, times)| *times > 1).map(|(_, times)| times).sum()
}

#[cfg(test)]
mod tests;
