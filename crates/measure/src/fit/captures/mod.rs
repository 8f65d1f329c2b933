//! Measurements from a pair of captures, one of each end.
//!
//! UDP datagrams are read from both files. A datagram of the sender's file is matched with one of the receiver's that has the same payload and the same IP
//! identification, the first with the first, the second with the second, and so on; the rest is then matched by payload alone, for paths that rewrite
//! identifications. Addresses and ports do not count: they may be translated. A datagram of the sender that has no match is lost.
//!
//! So payloads should differ, by a sequence number say; where several datagrams are equal and one of them is lost, the wrong ones may be matched:
//! [`Matched::ambiguous`] counts them. The clocks of the two ends are taken as they are: see [`Measurements::shifted`], [`Measurements::without_skew`]
//! and [`Measurements::steps`].
//!
//! | captures | treatment |
//! | --- | --- |
//! | One was begun later, or ended earlier | Datagrams at either end that the receiver's capture could not show are left out: [`Matched::left_out`]. |
//! | Frames are cut | Datagrams are matched by their length and the octets that both files hold. |
//! | A packet is shown several times | The first view counts: [`Contents::seen_again`]. |
//! | A network card cuts or joins packets | Long datagrams are matched as the packets that they hold: [`Contents::super_packets`]. Of a long datagram whose frame was cut, only the first packet is judged. |
//! | Frames hold something else | They are counted by name: [`Contents::kinds`]. Fragments are such frames, so that a datagram that the path cut counts as lost. |
//! | The file ends within a block | It is read up to there: [`Contents::cut_off`]. |
//!
//! # Formats
//!
//! pcap (both orders of octets, microseconds, nanoseconds and the "modified" form) and pcapng (several sections and interfaces, enhanced, simple and
//! obsolete packet blocks; a simple packet has no time and is only counted).
//!
//! Frames of Ethernet, IEEE 802.11 (also with radiotap), PPP, PPPoE, Cisco HDLC, Linux "cooked" captures, loopback and raw IP; tags of VLANs, labels of
//! MPLS, 802.2; IPv4, and IPv6 with extension headers. A frame check sequence that the file tells of is no part of a frame.

mod contents;
mod ends;
mod frame;
mod hidden;
mod matching;
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

/// What two captures say together.
#[derive(Clone, PartialEq, Debug)]
pub struct Matched {
    /// The packets of the sender that are judged, in the order of sending; times from the first of them.
    pub measurements: Measurements,
    /// Packets of [`Matched::measurements`] that only the sender has: counted as lost.
    pub unmatched_sent: usize,
    /// Packets that only the receiver has: copies, or other traffic. They are left out.
    pub unmatched_arrived: usize,
    /// Packets of [`Matched::measurements`] that equal another one in payload and identification.
    pub ambiguous: usize,
    /// Packets of the sender before the first and after the last one that is judged. The capture of the receiver may not have run when they arrived, so
    /// that they are neither lost nor delivered.
    pub left_out: [usize; 2],
    /// Frames of the sender's capture, by kind.
    pub sender: Contents,
    /// Frames of the receiver's capture, by kind.
    pub receiver: Contents,
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
    #[error("the capture of the {} {}", end.name(), without_datagrams(*port, contents))]
    NoDatagrams {
        /// Which file.
        end: End,
        /// The port that was asked for.
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
        /// Datagrams of the sender.
        sent: usize,
        /// Datagrams of the receiver.
        arrived: usize,
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
    /// The file ends before the first block or frame.
    #[error("the file ends within its header")]
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

fn without_datagrams(port: Option<u16>, contents: &Contents) -> String {
    let wanted = port.map_or_else(String::new, |port| format!(" to port {port}"));
    let cut = if contents.cut_off { ", then the file ends within a block" } else { "" };
    if contents.frames == 0 {
        return format!("holds no frame{cut}: expected UDP datagrams{wanted} of the link");
    }
    format!("has no UDP datagrams{wanted} that can be read: expected those of the link, found {contents}{cut}")
}

/// Returns whether a file that begins like this is a capture: pcap of either order of octets, with microseconds or nanoseconds, also in its "modified" form, or
/// pcapng.
#[must_use]
pub fn is_capture(beginning: &[u8]) -> bool {
    reader::is_capture(beginning)
}

/// Reads the captures of both ends. `port`: only datagrams to that UDP port count, which keeps other traffic from being taken for losses.
///
/// Takes as much memory as the payloads of both captures and some hundred octets for each datagram.
///
/// # Errors
///
/// [`CaptureError`] if a file cannot be read or has no such datagrams, or if no datagram of one file is in the other.
pub fn between(sender: impl Read, receiver: impl Read, port: Option<u16>) -> Result<Matched, CaptureError> {
    let mut sent = Capture::read(End::Sender, sender, port)?;
    let mut arrived = Capture::read(End::Receiver, receiver, port)?;
    let mut pairs = Pairs::of(&sent, &arrived);
    if segments::split(&mut sent, &mut arrived, &pairs) {
        pairs = Pairs::of(&sent, &arrived);
    }
    let doubled = views::merge_doubled(&mut sent, &pairs);
    if doubled > 0 {
        sent.contents.seen_again += doubled;
        pairs = Pairs::of(&sent, &arrived);
    }
    hidden::pair(&mut sent, &mut arrived, &mut pairs);
    matched(sent, arrived, &pairs)
}

fn matched(mut sent: Capture, arrived: Capture, pairs: &Pairs) -> Result<Matched, CaptureError> {
    let none_matched = || CaptureError::NoneMatched { sent: sent.datagrams.len(), arrived: arrived.datagrams.len() };
    let judged = ends::judged(&sent, &arrived, pairs).ok_or_else(none_matched)?;
    let instant = |datagram: &Datagram| Attoseconds::from_nanos(datagram.nanos);
    // Nanoseconds of 64 bits are far below what attoseconds of 128 bits hold.
    let since = |later: &Datagram, earlier: &Datagram| instant(later).zip(instant(earlier)).and_then(|(later, earlier)| later.seconds_since(earlier));
    let own = |range: std::ops::Range<usize>| range.filter(|number| !pairs.is_again[*number] && !pairs.is_hidden[*number]);
    let first = &sent.datagrams[own(judged.clone()).next().unwrap_or(judged.start)];
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
