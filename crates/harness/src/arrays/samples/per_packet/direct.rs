//! Sending samples over direct links, if all peers hear all other peers.

use std::ops::Range;

use cohaptic_units::Instant;
use cohaptic_wan::{Arrivals, DirectLinks, LinkId};
use pulp::NullaryFnOnce;

use super::super::Sample;
use super::super::in_flight::{InFlight, Latest, Packet};

/// Packets of a tick over direct links, if all peers hear all other peers.
///
/// Compiled for any processor and for processors with AVX2.
pub(super) struct DirectSending<'a, const A: usize, const L: usize> {
    /// Number of peers of the scene.
    pub(super) peers: usize,
    pub(super) receivers: Range<usize>,
    pub(super) links: &'a mut DirectLinks,
    pub(super) senders: &'a [usize],
    /// `true` if a peer of the scene is among `senders`, indexed by peer.
    pub(super) sends: &'a [bool],
    pub(super) sent: &'a [Sample<A, L>],
    pub(super) in_flight: &'a mut InFlight<A>,
    /// See [`PerPacket::latest`](super::PerPacket).
    pub(super) latest: &'a mut [Latest],
    /// Present tick and its instant.
    pub(super) at: (u64, Instant),
}

/// One type, and so one compiled function, for each way of sending: several ways in one function need more registers than the processor has.
pub(super) struct BySender<'a, const A: usize, const L: usize>(pub(super) DirectSending<'a, A, L>);
pub(super) struct ByChain<'a, const A: usize, const L: usize>(pub(super) DirectSending<'a, A, L>);
pub(super) struct ByLink<'a, const A: usize, const L: usize>(pub(super) DirectSending<'a, A, L>);
pub(super) struct InOrder<'a, const A: usize, const L: usize>(pub(super) DirectSending<'a, A, L>);

impl<const A: usize, const L: usize> NullaryFnOnce for BySender<'_, A, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.by_sender();
    }
}

impl<const A: usize, const L: usize> NullaryFnOnce for ByChain<'_, A, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.by_link::<true, false>();
    }
}

impl<const A: usize, const L: usize> NullaryFnOnce for ByLink<'_, A, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.by_link::<false, false>();
    }
}

impl<const A: usize, const L: usize> NullaryFnOnce for InOrder<'_, A, L> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.by_link::<false, true>();
    }
}

impl<const A: usize, const L: usize> DirectSending<'_, A, L> {
    /// Sends link by link, eight at a time and without a gap between the rows of receivers, so only the last eight can be incomplete. `CHAINS`: `true`
    /// if a delay of the links depends on earlier delays and nothing else does. `ORDER`: `true` if the links keep the order of packets.
    #[inline(always)]
    #[expect(clippy::cast_possible_truncation, reason = "the bits of eight links")]
    fn by_link<const CHAINS: bool, const ORDER: bool>(self) {
        let Self { peers, receivers, links, senders, sends, sent, in_flight, latest, at } = self;
        let (row, all_send) = (peers * L, senders.len() == peers);
        let count = receivers.len() * row;
        // Next link from a receiver to itself; receiver of the present link; end of the row of this receiver.
        let (mut own, mut receiver, mut end) = (receivers.start * L, 0, row);
        let mut arrivals = Arrivals::NONE;
        for first in (0..count).step_by(DirectLinks::AT_ONCE) {
            let mut but = 0_u8;
            // Links from a receiver to itself are excluded by their bits in `but`, one for each run.
            while own < first + DirectLinks::AT_ONCE {
                but |= (((1_u16 << L) - 1) << (own - first)) as u8;
                own += row + L;
            }
            while first >= end {
                (receiver, end) = (receiver + 1, end + row);
            }
            // A sender that does not send at this tick has its bits set too, one for each run of its links.
            let together = DirectLinks::AT_ONCE.min(count - first);
            if !all_send {
                for place in (0..together).filter(|place| !sends[(first + place + row - end) % row / L]) {
                    but |= 1 << place;
                }
            }
            links.offer_as::<CHAINS>(at.1, LinkId::new(first), together, but, &mut arrivals);
            for place in arrivals.places() {
                // With as many runs as links at once, all eight links are of one sender and one receiver.
                while const { L < DirectLinks::AT_ONCE } && first + place >= end {
                    (receiver, end) = (receiver + 1, end + row);
                }
                let (to, link) = ((receiver, receivers.start + receiver), first + place + row - end);
                let from = if const { L == DirectLinks::AT_ONCE } { ((first + row - end) / L, place) } else { (link / L, link % L) };
                let packet = packet(peers, to, from, sent, arrivals.at[place], arrivals.sequences[place]);
                if ORDER {
                    in_flight.push_in_order(at, packet, arrivals.waits(place), &mut latest[first + place]);
                } else {
                    in_flight.push(at, packet, arrivals.overtakes(place));
                }
            }
        }
    }

    /// Sends sender by sender, one link at a time, in a single run.
    #[inline(always)]
    fn by_sender(self) {
        let Self { peers, receivers, links, senders, sent, in_flight, latest, at, .. } = self;
        for sender in senders {
            for to in receivers.clone().enumerate().filter(|(_, peer)| peer != sender) {
                let link = LinkId::new(to.0 * peers + sender);
                // The sequence number is the number of packets offered before, so it is read before the packet is offered.
                let sequence = links.offered(link);
                if let Some((arrival, overtakes)) = links.offer_one(at.1, link) {
                    let packet = packet(peers, to, (*sender, 0), sent, arrival, sequence);
                    match latest.get_mut(link.index()) {
                        // Whether the packet waits is not known here, which costs memory only.
                        Some(latest) => in_flight.push_in_order(at, packet, false, latest),
                        None => in_flight.push(at, packet, overtakes),
                    }
                }
            }
        }
    }
}

/// Returns the packet from the peer `sender` of the scene to a receiver, the peer `peer` of the scene, in a run, if all peers hear all other peers.
#[inline(always)]
#[expect(clippy::cast_possible_truncation, reason = "peers are counted in 16 bits, what they hold in 32")]
fn packet<const A: usize, const L: usize>(
    peers: usize,
    (receiver, peer): (usize, usize),
    (sender, run): (usize, usize),
    sent: &[Sample<A, L>],
    arrival: Instant,
    sequence: u64,
) -> Packet<A> {
    let sample = &sent[sender];
    Packet {
        arrival,
        sequence,
        place: ((receiver * (peers - 1).next_multiple_of(4) + sender - usize::from(sender > peer)) * L + run) as u32,
        receiver: receiver as u16,
        stands_for: 0,
        position: std::array::from_fn(|axis| sample.position[axis][run]),
        velocity: std::array::from_fn(|axis| sample.velocity[axis][run]),
    }
}
