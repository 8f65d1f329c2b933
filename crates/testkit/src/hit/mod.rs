//! Hits on single packets: the choice of packets, and their fates.
//!
//! A law is asked about every packet that is offered to a link, and returns a [`Verdict`]. A law is a closure
//! ([`Testbed::on_packet`](crate::Testbed::on_packet)), words ([`Testbed::hit`](crate::Testbed::hit), lines of [link files](crate::LinkFile)), or an
//! implementation of [`PacketLaw`].
//!
//! ```
//! use std::time::Duration;
//! use cohaptic_testkit::{Testbed, hit::Verdict, time};
//!
//! let came = |bed: Testbed| {
//!     bed.run(|bed| async move {
//!         let (from, to) = (bed.host("a").bind("0.0.0.0:1").unwrap(), bed.host("b").bind("0.0.0.0:1").unwrap());
//!         for byte in 0..4 {
//!             from.send_to(&[byte], "b:1").await.unwrap();
//!             time::sleep(Duration::from_millis(1)).await;
//!         }
//!         time::sleep(Duration::from_secs(1)).await;
//!         let mut came = [0; 8];
//!         (0..8).map_while(|place| to.try_recv(&mut came[place..=place]).ok().map(|_| came[place])).collect::<Vec<u8>>()
//!     })
//! };
//! let bed = Testbed::new(["a", "b"]).links("delay 10ms");
//! assert_eq!(came(bed.clone().hit("a", "b", "drop packet 2; behind 1 packet 0")), [1, 0, 3]);
//! assert_eq!(came(bed.on_packet("a", "b", |packet| if packet.bytes == [3] { Verdict::Drop } else { Verdict::Pass })), [0, 1, 2]);
//! ```
//!
//! # What happens to a packet that is hit
//!
//! The law decides when the packet is sent. A packet to be dropped goes no further than to its link, with the fate
//! [`DropCause::Filter`](cohaptic_wan::DropCause::Filter). Before, the packet passes the uplink of its host (`Testbed::access`), because other
//! packets wait behind the packet there. Every other packet passes the link first, which may lose the packet, and is delayed, copied, damaged or held at the
//! far end. So the link draws the same random numbers for every other packet, whatever is hit. A further hit changes nothing else, and therefore sets of hits
//! can shrink (`strategies::any_hits`, feature `strategies`). Copies that a link makes of a packet are not hit. If a path has several laws, all laws are asked,
//! and the first verdict other than
//! [`Verdict::Pass`] counts.
//!
//! The fates of a [`Record`](crate::Record) contain the effects of hits, so that its `links.txt` repeats the run without the laws; only damaged bits are not
//! replayed. The trace contains each hit ([`Happening::Hit`](crate::Happening::Hit)), [`Bed::hits`](crate::Bed::hits) returns the number of hits, and a failing
//! test names the laws that have hit nothing.
//!
//! # Words
//!
//! ```text
//! drop first SYN
//! drop every retransmission; delay 30ms packets 3 8 12-15
//! corrupt 2nd packet with "GET /"; behind 3 packet 7; duplicate 5ms 10th segment with 0x1603
//! ```
//!
//! | action | does |
//! | --- | --- |
//! | `drop` | loses the packet |
//! | `delay` *time* | lets the packet arrive later by this time |
//! | `duplicate` \[*time*\] | lets the packet arrive twice, the second time later by this time; without a time, at once |
//! | `corrupt` | flips one bit, drawn from the seed. A UDP socket gets the damaged datagram: the checksum of UDP is not emulated here |
//! | `behind` *k* | lets the packet arrive a nanosecond after the *k*-th later arrival on the path; never without *k* later arrivals |
//!
//! | which | is |
//! | --- | --- |
//! | `packet` *n*, `packets` *n* *n*-*n* … | packets by number on the path, counted from 0 as in traces and fate logs |
//! | `first` *kind*, `2nd` *kind*, … | the n-th of a kind |
//! | `every` *kind* | all of a kind |
//!
//! Kinds are `packet`, `segment` (of TCP, with data), `SYN`, `FIN` and `RST` (TCP with this flag, whatever else is set), and `retransmission`: a segment of TCP
//! some of whose data was sent before, or another packet with the same bytes as an earlier packet. Packets of TCP, and the words for such packets, need the
//! feature `tcp`. `with` and a text in quotes, or bytes as `0x` and two digits each, restricts a kind to packets that contain these bytes.

mod hits;
mod law;
mod laws;
mod packet;
mod seen;
mod words;

use std::time::Duration;

pub use cohaptic_wan::random::Draws;
pub use hits::Hits;
pub(crate) use hits::PathHit;
pub(crate) use law::WordsLaw;
pub(crate) use laws::Laws;
pub use packet::SentPacket;
pub(crate) use seen::Seen;
pub(crate) use words::Hit;
pub(crate) use words::parse;
#[cfg(feature = "strategies")]
pub(crate) use words::{Action, Which, push_number};

/// Fate that a law wants for a packet.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[non_exhaustive]
pub enum Verdict {
    /// The law does not change the packet.
    #[default]
    Pass,
    /// The packet is lost before its link.
    Drop,
    /// The packet arrives later by this time.
    Delay(Duration),
    /// The packet arrives twice, the second time later by this time.
    Duplicate(Duration),
    /// The bit of this index is flipped. Bit 0 is the lowest bit of the first byte. The index is taken modulo the number of bits.
    Corrupt(u64),
    /// The packet arrives a nanosecond after the last of this number of later arrivals on its path. If fewer packets arrive, the packet does not arrive.
    Behind(u32),
}

/// Law that decides the fate of packets, one by one, in the order in which the packets are offered to their link.
///
/// Every run begins with a clone of the law, so that a law with a counter starts anew. A law must not call the test bed, which is busy at that moment; the
/// packet contains the time.
///
/// ```
/// use cohaptic_testkit::Testbed;
/// use cohaptic_testkit::hit::{Draws, PacketLaw, SentPacket, Verdict};
///
/// /// Drops a part of all packets that are longer than 1000 bytes.
/// #[derive(Clone)]
/// struct LongOnes(f64);
///
/// impl PacketLaw for LongOnes {
///     fn judge(&mut self, packet: &SentPacket<'_>, draws: &mut Draws) -> Verdict {
///         if packet.bytes.len() > 1000 && draws.next_unit() < self.0 { Verdict::Drop } else { Verdict::Pass }
///     }
/// }
///
/// let bed = Testbed::new(["a", "b"]).law("a", "b", LongOnes(0.25));
/// ```
pub trait PacketLaw {
    /// Returns the fate of a packet.
    ///
    /// `draws` are random numbers of this packet and this law. The numbers depend on the seed, the path, the number of the packet, and the index of the law
    /// among the laws of the path only, so draws for other packets change nothing here.
    fn judge(&mut self, packet: &SentPacket<'_>, draws: &mut Draws) -> Verdict;
}
