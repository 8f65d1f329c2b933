//! Packets of a run, in memory that is reused.

use std::net::SocketAddr;
use std::ops::Deref;
#[cfg(feature = "tcp")]
use std::sync::OnceLock;

use bytes::Bytes;
#[cfg(feature = "tcp")]
use cohaptic_tcp::{Payload, Segment};
use cohaptic_units::{Ecn, Instant};
use cohaptic_wan::{NodeId, Path};

#[cfg(feature = "tcp")]
use super::train::Followers;
use crate::trace::PacketName;

/// Packet: bytes, and the addresses that the sender writes on the packet. A parcel is boxed on its whole way, from the sender through the link and the buffer
/// of the receiving socket to the reading program, so that only a pointer is moved.
#[derive(Clone, Debug)]
pub(crate) struct Parcel<A> {
    pub(crate) addresses: A,
    pub(crate) bytes: Octets,
    /// ECN codepoint that the sender writes on the packet.
    pub(crate) ecn: Ecn,
    /// `true` if a law drops the packet before its link. Set for every packet of a run with laws.
    pub(crate) is_hit: bool,
    /// Memory that the buffer of the receiving socket counts for the packet \[byte\]. Set when the packet enters the buffer.
    pub(crate) memory: usize,
    /// Report of the link. Valid only for a parcel that its link has delivered.
    pub(crate) arrival: Arrival,
    /// Segments that travel with the segment of this parcel. Boxed, because most parcels travel alone.
    #[cfg(feature = "tcp")]
    pub(crate) followers: Option<Box<Followers>>,
}

/// Addresses of a packet, which determine the flow of the packet.
pub(crate) trait HasFlow {
    /// Returns the number of the packet's flow on a path between two hosts.
    fn flow(&self, path: Path) -> u32;

    /// Returns the form of the bytes of the packet.
    fn form(&self) -> Form;
}

/// Form of the bytes of a packet, for captures.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Form {
    /// IP packet with all headers.
    #[cfg(feature = "tcp")]
    Packet,
    /// Content of a datagram of UDP, from the first address to the second.
    Datagram([SocketAddr; 2]),
    /// Content of a packet without known headers.
    Content,
}

/// Report of a link about a delivered packet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arrival {
    /// Name of the packet. In a run that is not [watched](super::Wire::is_watched) nobody asks for the numbers of the name, and only the path is set.
    pub(crate) packet: PacketName,
    pub(crate) at: Instant,
    /// `true` if an active queue marked the packet.
    pub(crate) marked: bool,
    /// `true` if the path of the packet is cut, so that the packet is lost on arrival.
    pub(crate) is_cut: bool,
}

impl<A> Parcel<A> {
    pub(crate) const fn new(addresses: A, bytes: Octets, ecn: Ecn) -> Self {
        let packet = PacketName { path: Path { from: NodeId(0), to: NodeId(0) }, sequence: 0, copy: 0 };
        Self {
            addresses,
            bytes,
            ecn,
            is_hit: false,
            memory: 0,
            arrival: Arrival { packet, at: Instant::ZERO, marked: false, is_cut: false },
            #[cfg(feature = "tcp")]
            followers: None,
        }
    }
}

/// Content of a packet.
#[derive(Clone, Default, Debug)]
pub(crate) struct Octets {
    /// Number of octets. Kept beside the content, because the length of each datagram is asked for many times, and the answer depends on the kind of the content.
    len: usize,
    content: Content,
}

#[derive(Clone, Debug)]
enum Content {
    /// Content of a datagram sent by a socket. The memory goes back to [`Spare`] after the datagram was read.
    Own(Vec<u8>),
    /// Content of every other packet.
    Shared(Bytes),
    /// Segment between two connections of the run.
    #[cfg(feature = "tcp")]
    Segment(Box<Whole>),
}

impl Default for Content {
    fn default() -> Self {
        Self::Own(Vec::new())
    }
}

/// Segment in its parsed form. The IP packet, with checksums, is written only for a reader of the octets: a record, a law or a damage.
#[cfg(feature = "tcp")]
#[derive(Clone, Debug)]
pub(crate) struct Whole {
    pub(crate) segment: Segment<'static>,
    packet: OnceLock<Bytes>,
}

#[cfg(feature = "tcp")]
impl Whole {
    fn packet(&self) -> &Bytes {
        // Written once, however many readers the packet has.
        self.packet.get_or_init(|| self.segment.to_packet().into())
    }
}

#[cfg(feature = "tcp")]
impl From<Segment<'static>> for Octets {
    fn from(segment: Segment<'static>) -> Self {
        Self { len: segment.packet_length(), content: Content::Segment(Box::new(Whole { segment, packet: OnceLock::new() })) }
    }
}

impl Deref for Octets {
    type Target = [u8];

    #[inline]
    fn deref(&self) -> &[u8] {
        match &self.content {
            Content::Own(octets) => octets,
            Content::Shared(octets) => octets,
            #[cfg(feature = "tcp")]
            Content::Segment(whole) => whole.packet(),
        }
    }
}

impl From<Bytes> for Octets {
    fn from(octets: Bytes) -> Self {
        Self { len: octets.len(), content: Content::Shared(octets) }
    }
}

impl From<Vec<u8>> for Octets {
    fn from(octets: Vec<u8>) -> Self {
        Self { len: octets.len(), content: Content::Own(octets) }
    }
}

impl From<Octets> for Bytes {
    fn from(octets: Octets) -> Self {
        match octets.content {
            Content::Own(octets) => octets.into(),
            Content::Shared(octets) => octets,
            #[cfg(feature = "tcp")]
            Content::Segment(whole) => whole.packet().clone(),
        }
    }
}

impl From<Octets> for Vec<u8> {
    fn from(octets: Octets) -> Self {
        match octets.content {
            Content::Own(octets) => octets,
            Content::Shared(octets) => octets.into(),
            #[cfg(feature = "tcp")]
            Content::Segment(whole) => whole.packet().to_vec(),
        }
    }
}

impl Octets {
    /// Returns the number of octets, without writing the packet of a segment.
    #[inline]
    pub(crate) const fn len(&self) -> usize {
        self.len
    }

    /// Returns the segment that the packet was sent as, or `None` if the packet has octets only.
    #[cfg(feature = "tcp")]
    pub(crate) const fn segment(&self) -> Option<&Segment<'static>> {
        match &self.content {
            Content::Segment(whole) => Some(&whole.segment),
            Content::Own(_) | Content::Shared(_) => None,
        }
    }

    /// Returns the segment that the packet was sent as, for changes of its header. The packet is written anew for the next reader.
    #[cfg(feature = "tcp")]
    pub(crate) fn segment_mut(&mut self) -> Option<&mut Segment<'static>> {
        match &mut self.content {
            Content::Segment(whole) => {
                whole.packet = OnceLock::new();
                Some(&mut whole.segment)
            }
            Content::Own(_) | Content::Shared(_) => None,
        }
    }

    /// Replaces the content with a copy of `bytes`. Content of the kind `Own` keeps and reuses its memory.
    #[inline]
    fn refill(&mut self, bytes: &[u8]) {
        match &mut self.content {
            // Packets of a flow often have one length. A copy of equal length needs no check of the capacity.
            Content::Own(octets) if octets.len() == bytes.len() => octets.copy_from_slice(bytes),
            Content::Own(_) | Content::Shared(_) => self.refill_anew(bytes),
            #[cfg(feature = "tcp")]
            Content::Segment(_) => self.refill_anew(bytes),
        }
    }

    #[inline(never)]
    fn refill_anew(&mut self, bytes: &[u8]) {
        self.len = bytes.len();
        if let Content::Own(octets) = &mut self.content {
            octets.clear();
            octets.extend_from_slice(bytes);
        } else {
            self.content = Content::Own(bytes.to_vec());
        }
    }
}

/// Parcels of packets that were read, kept with their memory for later packets.
#[derive(Debug)]
pub(crate) struct Spare<A> {
    parcels: Vec<Box<Parcel<A>>>,
    /// Empty lists of followers.
    #[cfg(feature = "tcp")]
    #[expect(clippy::vec_box, reason = "a list moves from parcel to parcel in its box")]
    followers: Vec<Box<Followers>>,
}

impl<A> Default for Spare<A> {
    fn default() -> Self {
        Self {
            parcels: Vec::new(),
            #[cfg(feature = "tcp")]
            followers: Vec::new(),
        }
    }
}

impl<A: Default> Spare<A> {
    /// Largest number of parcels kept.
    const MOST: usize = 512;
    /// Largest capacity of the content of a kept parcel \[bytes\]. With [`MOST`](Self::MOST) this limits the kept memory to a megabyte.
    const LONGEST: usize = 2048;
    /// Largest number of kept lists of followers. A list is in use for each train on its way.
    #[cfg(feature = "tcp")]
    const MOST_LISTS: usize = 64;

    /// Returns a parcel with a copy of `bytes`.
    #[inline(always)]
    pub(crate) fn copied(&mut self, addresses: A, bytes: &[u8], ecn: Ecn) -> Box<Parcel<A>> {
        // The addresses are stored directly, and passed to no further call: each address is written only once.
        let mut parcel = self.parcels.pop().unwrap_or_else(empty);
        (parcel.addresses, parcel.ecn) = (addresses, ecn);
        parcel.bytes.refill(bytes);
        parcel
    }

    /// Returns a parcel with `segment`.
    #[cfg(feature = "tcp")]
    pub(crate) fn wrapped(&mut self, addresses: A, segment: Segment<'static>) -> Box<Parcel<A>> {
        let mut parcel = self.parcels.pop().unwrap_or_else(empty);
        (parcel.addresses, parcel.ecn) = (addresses, segment.ecn);
        let Octets { len, content } = &mut parcel.bytes;
        match content {
            // A parcel that carried a segment before has a box for a segment already. The assignments reuse this memory.
            Content::Segment(whole) => {
                *len = segment.packet_length();
                **whole = Whole { segment, packet: OnceLock::new() };
            }
            Content::Own(_) | Content::Shared(_) => parcel.bytes = segment.into(),
        }
        parcel
    }

    /// Lets `segment` follow the segments of `parcel`.
    #[cfg(feature = "tcp")]
    pub(crate) fn append(&mut self, parcel: &mut Parcel<A>, segment: Segment<'static>) {
        let spare = &mut self.followers;
        parcel.followers.get_or_insert_with(|| spare.pop().unwrap_or_default()).flight.push(segment);
    }

    /// Takes back a list whose segments were handled or taken out. Drops the list if enough are kept, or if the list is long.
    #[cfg(feature = "tcp")]
    pub(crate) fn put_followers(&mut self, mut followers: Box<Followers>) {
        followers.clear();
        if self.followers.len() < Self::MOST_LISTS && followers.is_short() {
            self.followers.push(followers);
        }
    }

    /// Takes back a read parcel. Drops the parcel if enough are kept, and the content if shared or too long.
    #[inline(always)]
    pub(crate) fn put(&mut self, parcel: Box<Parcel<A>>) {
        // A burst must not occupy memory for the rest of the run.
        if matches!(&parcel.bytes.content, Content::Own(octets) if octets.capacity() <= Self::LONGEST) && self.parcels.len() < Self::MOST {
            self.parcels.push(parcel);
        } else {
            self.put_other(parcel);
        }
    }

    /// Like [`Spare::put`], for a parcel that is dropped, in whole or in part.
    #[inline(never)]
    fn put_other(&mut self, mut parcel: Box<Parcel<A>>) {
        if self.parcels.len() >= Self::MOST {
            return;
        }
        match &mut parcel.bytes.content {
            // The memory of the writer is not kept, only the box.
            #[cfg(feature = "tcp")]
            Content::Segment(whole) => (whole.segment.payload, whole.packet) = (Payload::default(), OnceLock::new()),
            Content::Own(_) | Content::Shared(_) => parcel.bytes = Octets::default(),
        }
        self.parcels.push(parcel);
    }
}

/// Returns a new parcel, all of whose fields the caller sets.
#[cold]
fn empty<A: Default>() -> Box<Parcel<A>> {
    Box::new(Parcel::new(A::default(), Octets::default(), Ecn::NotCapable))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parcel_of(bytes: Octets) -> Box<Parcel<u8>> {
        Box::new(Parcel::new(1, bytes, Ecn::NotCapable))
    }

    #[test]
    fn memory_that_was_read_is_used_again() {
        let mut spare = Spare::default();
        let parcel = spare.copied(1, b"longer than the next one", Ecn::Capable0);
        let places = (std::ptr::from_ref(&*parcel), parcel.bytes.as_ptr());
        spare.put(parcel);
        let next = spare.copied(2, b"next", Ecn::NotCapable);
        assert_eq!((&*next.bytes, next.ecn, next.addresses), (&b"next"[..], Ecn::NotCapable, 2));
        assert_eq!((std::ptr::from_ref(&*next), next.bytes.as_ptr()), places);
    }

    #[test]
    fn no_more_than_a_megabyte_is_kept() {
        let mut spare = Spare::default();
        for bytes in [Octets::from(Bytes::from_static(b"not ours")), Vec::with_capacity(Spare::<u8>::LONGEST + 1).into()] {
            spare.put(parcel_of(bytes));
            let Some(Content::Own(kept)) = spare.parcels.first().map(|parcel| &parcel.bytes.content) else { panic!("the box is kept") };
            assert_eq!(kept.capacity(), 0);
            let filled = spare.copied(1, b"ours", Ecn::NotCapable);
            assert_eq!(&*filled.bytes, b"ours");
        }
        for _ in 0..2 * Spare::<u8>::MOST {
            spare.put(parcel_of(Vec::with_capacity(1).into()));
        }
        assert_eq!(spare.parcels.len(), Spare::<u8>::MOST);
    }

    #[cfg(feature = "tcp")]
    #[test]
    fn the_packet_of_a_segment_is_written_when_somebody_looks() {
        use cohaptic_tcp::{Flags, Options};

        let segment = |octets: &[u8]| Segment {
            source: "10.0.0.1:1".parse().unwrap(),
            destination: "10.0.0.2:2".parse().unwrap(),
            sequence: 1,
            acknowledgement: 2,
            flags: Flags::ACK,
            window: 3,
            options: Options { timestamps: Some((4, 5)), ..Options::default() },
            ecn: Ecn::Capable0,
            ttl: 64,
            payload: octets.to_vec().into(),
        };
        let is_written = |parcel: &Parcel<u8>| matches!(&parcel.bytes.content, Content::Segment(whole) if whole.packet.get().is_some());
        let mut spare = Spare::default();
        for octets in [&b"first"[..], b"", b"longer than the first"] {
            let parcel = spare.wrapped(1, segment(octets));
            // 20 octets of each header, and 12 of timestamps.
            assert_eq!((parcel.bytes.len(), is_written(&parcel)), (52 + octets.len(), false));
            assert_eq!((Segment::parse(&parcel.bytes), parcel.bytes[..].len()), (Ok(segment(octets)), 52 + octets.len()));
            assert!(is_written(&parcel));
            spare.put(parcel);
            let Content::Segment(kept) = &spare.parcels[0].bytes.content else { panic!("the box is kept") };
            assert!(kept.segment.payload.is_empty() && kept.packet.get().is_none());
        }
        assert_eq!(&*spare.copied(1, b"a datagram", Ecn::NotCapable).bytes, b"a datagram");
    }
}
