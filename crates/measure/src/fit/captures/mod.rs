//! Measurements from a pair of captures, made at the two ends of a link.
//!
//! UDP datagrams are read from both files. A datagram of the sender's file is matched with a datagram of the receiver's file of the same payload and the
//! same IP identification: the first with the first, the second with the second, and so on. The rest is then matched by payload alone, for paths that
//! rewrite identifications. Addresses and ports do not count, because paths may translate them. A sender's datagram without a match is lost.
//!
//! Payloads should therefore differ, for example by a sequence number. If one of several equal datagrams is lost, the wrong datagrams may be matched:
//! [`Matched::ambiguous`] counts such datagrams. The clocks of the two ends are not corrected: see [`Measurements::shifted`],
//! [`Measurements::without_skew`] and [`Measurements::steps`].
//!
//! | captures | treatment |
//! | --- | --- |
//! | A capture began later or ended earlier | Datagrams at the ends that the receiver's capture could not show are left out: [`Matched::left_out`]. |
//! | Frames are cut | Datagrams are matched by their length and by the octets in both files. |
//! | A packet is shown several times | The first view counts: [`Contents::seen_again`]. |
//! | A network card cuts or joins packets | Long datagrams are matched as their packets: [`Contents::super_packets`]. Of a long datagram with a cut frame, only the first packet is judged. |
//! | Frames without UDP | Frames are counted by name: [`Contents::kinds`]. Fragments are such frames, so a datagram cut by the path counts as lost. |
//! | The file ends within a block | All blocks before are read: [`Contents::cut_off`]. |
//!
//! # Formats
//!
//! pcap (both orders of octets, microseconds, nanoseconds and the "modified" form) and pcapng (several sections and interfaces, enhanced, simple and
//! obsolete packet blocks; a simple packet has no time and is only counted).
//!
//! Frames of Ethernet, IEEE 802.11 (also with radiotap), PPP, PPPoE, Cisco HDLC, Linux "cooked" captures, loopback and raw IP; tags of VLANs, labels of
//! MPLS, 802.2; IPv4, and IPv6 with extension headers. A frame check sequence announced by the file is removed from the frame.

mod contents;
mod doubled;
mod ends;
mod frame;
mod hidden;
mod matching;
mod open;
mod reader;
mod segments;
mod views;

use std::io::Read;

use cohaptic_units::print::Counted;

pub use self::contents::Contents;
use self::contents::{Capture, Datagram};
use self::matching::Pairs;
use super::table::Attoseconds;
use super::{Measurement, Measurements, MeasurementsError};

/// Result of matching two captures.
#[derive(Clone, PartialEq, Debug)]
pub struct Matched {
    /// Judged packets of the sender, in the order of sending. Times count from the first judged packet.
    pub measurements: Measurements,
    /// Packets of [`Matched::measurements`] without a counterpart, counted as lost.
    pub unmatched_sent: usize,
    /// Packets of the receiver without a counterpart: copies, or other traffic. Not part of the measurements.
    pub unmatched_arrived: usize,
    /// Packets of [`Matched::measurements`] with the payload and identification of another packet.
    pub ambiguous: usize,
    /// Packets of the sender before the first and after the last judged packet. The receiver's capture may not have run at their arrival, so such packets
    /// count neither as lost nor as delivered.
    pub left_out: [usize; 2],
    /// Frames of the sender's capture, by kind.
    pub sender: Contents,
    /// Frames of the receiver's capture, by kind.
    pub receiver: Contents,
}

/// End of the link at which a capture was made.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum End {
    /// Sender.
    Sender,
    /// Receiver.
    Receiver,
}

/// Error of reading and matching two captures.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureError {
    /// A file is no capture, or is damaged.
    #[error("the capture of the {}: {problem} after {}", end.name(), Counted(*frames, "frame"))]
    Unreadable {
        /// End of the file.
        end: End,
        /// Number of frames read before the fault.
        frames: usize,
        /// Fault of the file.
        problem: CaptureProblem,
    },
    /// A file has no wanted UDP datagrams.
    #[error("the capture of the {} {}", end.name(), without_datagrams(*port, contents))]
    NoDatagrams {
        /// End of the file.
        end: End,
        /// Wanted UDP port; `None` for all ports.
        port: Option<u16>,
        /// Frames of the file, by kind.
        contents: Box<Contents>,
    },
    /// No datagram of one file is in the other.
    #[error(
        "none of {} of the sender is among the {arrived} of the receiver: expected captures of the same packets, whose payload the path leaves as it is",
        Counted(*sent, "datagram")
    )]
    NoneMatched {
        /// Number of the sender's datagrams.
        sent: usize,
        /// Number of the receiver's datagrams.
        arrived: usize,
    },
    /// The times do not make valid measurements.
    #[error(transparent)]
    Measurements(#[from] MeasurementsError),
}

/// Fault of a capture.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CaptureProblem {
    /// The beginning of the file is not that of a capture.
    #[error("found no pcap or pcapng header, expected one of the two formats")]
    Format,
    /// A block violates the format.
    #[error("found a malformed block")]
    Malformed,
    /// The file ends before the first block or frame.
    #[error("the file ends within its header")]
    CutOff,
    /// The file cannot be read.
    #[error("the file cannot be read")]
    Io,
    /// The resolution of timestamps has no meaning, or a frame names an unknown interface.
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

fn without_datagrams(port: Option<u16>, contents: &Contents) -> String {
    let wanted = port.map_or_else(String::new, |port| format!(" to port {port}"));
    let cut = if contents.cut_off { ", then the file ends within a block" } else { "" };
    if contents.frames == 0 {
        return format!("holds no frame{cut}: expected UDP datagrams{wanted} of the link");
    }
    format!("has no UDP datagrams{wanted} that can be read: expected those of the link, found {contents}{cut}")
}

/// Returns whether a file with this beginning is a capture: pcap in both byte orders, with microseconds or nanoseconds, also in its "modified" form, or pcapng.
#[must_use]
pub fn is_capture(beginning: &[u8]) -> bool {
    reader::is_capture(beginning)
}

/// Reads and matches the captures of both ends. With a `port`, only datagrams to this UDP port are used, so that other traffic does not count as lost.
///
/// Needs memory for the payloads of both captures, and some hundred octets per datagram.
///
/// # Errors
///
/// [`CaptureError`] if a file cannot be read or has no wanted datagrams, or if no datagram of one file is in the other.
pub fn between(sender: impl Read, receiver: impl Read, port: Option<u16>) -> Result<Matched, CaptureError> {
    let sent = Capture::read(End::Sender, sender, port)?;
    let arrived = Capture::read(End::Receiver, receiver, port)?;
    paired(sent, arrived)
}

/// Finds the packets of one capture in the other.
fn paired(mut sent: Capture, mut arrived: Capture) -> Result<Matched, CaptureError> {
    let mut pairs = Pairs::of(&sent, &arrived);
    // Splitting and merging change the datagrams, so the matching begins again after each.
    if segments::split(&mut sent, &mut arrived, &pairs) {
        pairs = Pairs::of(&sent, &arrived);
    }
    let doubled = doubled::merge_doubled(&mut sent, &pairs);
    if doubled > 0 {
        sent.contents.seen_again += doubled;
        pairs = Pairs::of(&sent, &arrived);
    }
    // Cut datagrams come last, because only datagrams without any other explanation may be parts of a cut datagram.
    hidden::pair(&mut sent, &mut arrived, &mut pairs);
    matched(sent, arrived, &pairs)
}

/// Makes the measurements from matched captures.
fn matched(mut sent: Capture, arrived: Capture, pairs: &Pairs) -> Result<Matched, CaptureError> {
    let none_matched = || CaptureError::NoneMatched { sent: sent.datagrams.len(), arrived: arrived.datagrams.len() };
    let judged = ends::judged(&sent, &arrived, pairs).ok_or_else(none_matched)?;
    let instant = |datagram: &Datagram| Attoseconds::from_nanos(datagram.nanos);
    // Times of 64-bit nanoseconds are far inside the range of 128-bit attoseconds.
    let since = |later: &Datagram, earlier: &Datagram| instant(later).zip(instant(earlier)).and_then(|(later, earlier)| later.seconds_since(earlier));
    let own = |range: std::ops::Range<usize>| range.filter(|number| !pairs.is_again[*number] && !pairs.is_hidden[*number]);
    // The judged range holds a matched datagram, so the range is not empty and its start is a valid index.
    let first = &sent.datagrams[own(judged.clone()).next().unwrap_or(judged.start)];
    // A time out of range becomes NaN, and `Measurements::new` refuses NaN with the number of the packet.
    let packet = |number: usize| {
        let datagram = &sent.datagrams[number];
        let delay_s = pairs.arrival_of[number].map(|arrival| since(&arrived.datagrams[arrival], datagram).unwrap_or(f64::NAN));
        Measurement { sent_s: since(datagram, first).unwrap_or(f64::NAN), delay_s }
    };
    let packets: Vec<Measurement> = own(judged.clone()).map(packet).collect();
    let unmatched_sent = packets.iter().filter(|packet| packet.delay_s.is_none()).count();
    let left_out = [own(0..judged.start).count(), own(judged.end..sent.datagrams.len()).count()];
    sent.contents.seen_again += pairs.is_again.iter().filter(|is_again| **is_again).count();
    Ok(Matched {
        measurements: Measurements::new(packets)?,
        unmatched_sent,
        unmatched_arrived: pairs.taken.iter().filter(|taken| !**taken).count(),
        ambiguous: own(judged).filter(|number| pairs.is_ambiguous[*number]).count(),
        left_out,
        sender: sent.contents,
        receiver: arrived.contents,
    })
}

#[cfg(test)]
mod tests;
