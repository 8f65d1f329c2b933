//! Datagrams in memory that is used again.

use core::time::Duration;
use std::sync::Arc;

use cohaptic_realtime::udp::Ecn;

use super::clients::ClientId;

/// A datagram on its way. Copies that a link makes share it.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Packet {
    pub(super) bytes: Vec<u8>,
    pub(super) ecn: Option<Ecn>,
    /// Whose it is, where clients share a link.
    pub(super) client: Option<ClientId>,
    /// By how much it was offered later than it came.
    pub(super) late: Duration,
}

/// Memory for datagrams: what one has left, another takes. Once as many have been on their way as ever are, nothing is allocated any more.
#[derive(Debug)]
pub(super) struct Pool {
    idle: Vec<Arc<Packet>>,
    /// The bytes that idle ones keep.
    kept: usize,
    /// The most that idle ones keep together: a burst of long datagrams does not stay in memory.
    most_kept: usize,
}

impl Pool {
    pub(super) const fn new(most_kept: usize) -> Self {
        Self { idle: Vec::new(), kept: 0, most_kept }
    }

    pub(super) fn take(&mut self, bytes: &[u8], ecn: Option<Ecn>, client: Option<ClientId>) -> Arc<Packet> {
        let mut packet = self.idle.pop().unwrap_or_default();
        self.kept -= packet.bytes.capacity();
        if let Some(packet) = Arc::get_mut(&mut packet) {
            packet.bytes.clear();
            packet.bytes.extend_from_slice(bytes);
            (packet.ecn, packet.client, packet.late) = (ecn, client, Duration::ZERO);
            // Only what nobody else holds is idle.
            debug_assert_eq!(packet.bytes, bytes);
        }
        packet
    }

    /// Takes back a datagram, if no copy of it is left.
    pub(super) fn put(&mut self, mut packet: Arc<Packet>) {
        let capacity = packet.bytes.capacity();
        if self.kept + capacity <= self.most_kept && Arc::get_mut(&mut packet).is_some() {
            self.kept += capacity;
            self.idle.push(packet);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_leaves_another_takes_and_copies_are_left_alone() {
        let mut pool = Pool::new(1000);
        let first = pool.take(b"first", None, None);
        let copy = Arc::clone(&first);
        pool.put(first);
        assert_eq!((pool.idle.len(), pool.kept), (0, 0), "the copy is still on its way");
        let place = copy.bytes.as_ptr();
        pool.put(copy);
        let second = pool.take(b"two", Some(Ecn::Ect0), None);
        assert_eq!((second.bytes.as_slice(), second.ecn, second.bytes.as_ptr()), (&b"two"[..], Some(Ecn::Ect0), place));
        assert_eq!((pool.idle.len(), pool.kept), (0, 0));
    }

    #[test]
    fn no_more_is_kept_than_allowed() {
        let mut pool = Pool::new(150);
        let packets: Vec<_> = (0..10).map(|_| pool.take(&[0; 64], None, None)).collect();
        packets.into_iter().for_each(|packet| pool.put(packet));
        assert!(pool.kept <= 150 && pool.idle.len() == 2, "{} in {}", pool.kept, pool.idle.len());
    }
}
