//! What moves in a session, often enough for a screen: the peers, and some of the packets between them.

use std::time::Duration;

use cohaptic_harness::PacketRow;
use cohaptic_wan::Fate;

use super::status::PeerStatus;

/// Everything that moves, at one moment.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Since the session began, in logical time.
    pub elapsed: Duration,
    /// Each peer, in the order of the scene.
    pub peers: Vec<PeerStatus>,
    /// Packets that have ended since the last time: of each link one in 16, and all that were lost, up to 64 together.
    pub packets: Vec<EndedPacket>,
}

/// A packet that has arrived, or never will.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct EndedPacket {
    /// The sender's place in the scene.
    pub from: usize,
    /// The receiver's place in the scene.
    pub to: usize,
    /// From its sending to its end.
    pub after: Duration,
    /// Whether it was lost.
    pub is_lost: bool,
}

/// Of this number of packets one is shown: at 125 Hz eight a second.
const ONE_IN: u64 = 16;
/// No more packets are shown at once.
const MOST: usize = 64;

/// Collects packets to be shown.
#[derive(Debug, Default)]
pub(super) struct EndedPackets(Vec<EndedPacket>);

impl EndedPackets {
    pub(super) fn see(&mut self, row: &PacketRow) {
        let is_lost = match row.fate {
            Fate::Delivered(_) => false,
            Fate::Dropped(_) => true,
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
