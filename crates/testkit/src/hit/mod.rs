//! Packets that are hit: which one, and how.
//!
//! A law is asked about every packet that is offered to a link, and says a [`Verdict`]. It is a closure ([`Testbed::on_packet`](crate::Testbed::on_packet)), words
//! ([`Testbed::hit`](crate::Testbed::hit), lines of [link files](crate::LinkFile)), or a [`PacketLaw`] of one's own.
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
//! The verdict falls when the packet is offered. One that is to be dropped goes no further: its fate is [`DropCause::Filter`](cohaptic_wan::DropCause::Filter). All others
//! pass the link first, which may lose them, and are delayed, copied, damaged or held where they come out. So the link draws the same for every other packet, whatever is
//! hit: to hit one packet more or less changes nothing else, which is why sets of hits shrink (`strategies::any_hits`, feature `strategies`). Copies that a link makes of a packet are not
//! hit. Where several laws are for one path, all are asked, and the first verdict other than [`Verdict::Pass`] is the packet's.
//!
//! The fates of a [`Record`](crate::Record) have what hits did, so that its `links.txt` does it again without the laws; only damaged bits are not replayed. The trace has
//! each hit ([`Happening::Hit`](crate::Happening::Hit)), [`Bed::hits`](crate::Bed::hits) their number, and a test that fails names the laws that hit nothing.
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
//! | `delay` *time* | lets it arrive later by this time |
//! | `duplicate` \[*time*\] | lets it arrive twice, the second time later by this time; at once if it is not said |
//! | `corrupt` | flips one bit, drawn from the seed. A UDP socket gets the damaged datagram: its checksum is not emulated here |
//! | `behind` *k* | lets it arrive a nanosecond behind the *k*-th of the packets that arrive after it; never if they do not come |
//!
//! | which | is |
//! | --- | --- |
//! | `packet` *n*, `packets` *n* *n*-*n* … | those of these numbers on their path, from 0, as traces and fate logs count them |
//! | `first` *kind*, `2nd` *kind*, … | the n-th of a kind |
//! | `every` *kind* | all of a kind |
//!
//! Kinds are `packet`, `segment` (of TCP, with data), `SYN`, `FIN` and `RST` (TCP with this flag, whatever else is set), and `retransmission`: a segment of TCP of which
//! something was sent before, or another packet with the same bytes as one before. Packets of TCP, and the words for them, need the feature `tcp`. `with` and a text in quotes, or bytes as `0x` and two digits each, narrows them to packets
//! in whose bytes it stands.

mod hits;
mod law;
mod laws;
mod packet;
mod seen;
mod words;

use std::time::Duration;

#[cfg(feature = "tcp")]
pub use cohaptic_tcp::{Flags, Segment};
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

/// The fate that a law wants for a packet.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default)]
#[non_exhaustive]
pub enum Verdict {
    /// What its link does to it.
    #[default]
    Pass,
    /// It is lost before its link.
    Drop,
    /// It arrives later by this.
    Delay(Duration),
    /// It arrives twice, the second time later by this.
    Duplicate(Duration),
    /// This bit is flipped; 0 is the lowest bit of the first byte. Bits are counted on from the beginning beyond the end.
    Corrupt(u64),
    /// It arrives a nanosecond behind the last of this number of packets of its path that arrive after it; if fewer come, it does not arrive.
    Behind(u32),
}

/// A law that says what becomes of packets, one by one, in the order in which they are offered to their link.
///
/// Every run begins with a clone of the law, so that one that counts begins anew. It must not ask the test bed anything, which is busy meanwhile; the packet has the time.
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
    /// The fate of this packet.
    ///
    /// `draws` are random numbers of this packet and this law: they depend on the seed, the path, the number of the packet, and the place of the law among those of the
    /// path, and on nothing else, so that what other packets draw changes none of them.
    fn judge(&mut self, packet: &SentPacket<'_>, draws: &mut Draws) -> Verdict;
}
