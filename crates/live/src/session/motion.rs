//! Motion of a session for a display: states of the peers, and a selection of the packets between the peers.

use std::time::Duration;

use cohaptic_harness::PacketRow;
use cohaptic_harness::task::TaskView;
use cohaptic_wan::Fate;

use super::status::PeerStatus;

/// States of all peers at an instant, and packets that ended since the previous instant.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Logical time since the beginning of the session.
    pub elapsed: Duration,
    /// Peers in the order of the scene.
    pub peers: Vec<PeerStatus>,
    /// The task; `None` for a scene without a task.
    pub task: Option<TaskView>,
    /// Packets that ended since the previous [`Motion`]: every 16th packet of each link and every lost packet, at most 64 packets in total.
    pub packets: Vec<EndedPacket>,
}

/// Delivered or lost packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct EndedPacket {
    /// Sender, as index of a peer in the scene.
    pub from: usize,
    /// Receiver, as index of a peer in the scene.
    pub to: usize,
    /// Time from the offer of the packet to the link until its delivery or loss.
    pub after: Duration,
    /// `true` if the packet was lost.
    pub is_lost: bool,
}

/// Delivered packets per shown packet. At 125 Hz, eight packets a second are shown for each link.
const ONE_IN: u64 = 16;
/// Largest number of packets in a [`Motion`]. Bounds the memory and the work if a link loses everything.
const MOST: usize = 64;

/// Packets to be shown with the next [`Motion`].
#[derive(Debug, Default)]
pub(super) struct EndedPackets(Vec<EndedPacket>);

impl EndedPackets {
    pub(super) fn see(&mut self, row: &PacketRow) {
        let is_lost = match row.fate {
            Fate::Delivered(_) => false,
            Fate::Dropped(_) => true,
            // Not final: packet and copy each get a later row.
            Fate::Duplicated => return,
        };
        if self.0.len() < MOST && (is_lost || row.sequence.is_multiple_of(ONE_IN)) {
            let (from, to) = (row.path.from.index(), row.path.to.index());
            self.0.push(EndedPacket { from, to, after: row.at.saturating_duration_since(row.offered), is_lost });
        }
    }

    pub(super) fn take(&mut self) -> Vec<EndedPacket> {
        std::mem::take(&mut self.0)
    }
}
