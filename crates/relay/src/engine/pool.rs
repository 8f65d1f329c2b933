//! Pool of datagrams: new datagrams get the memory of former datagrams.

use core::time::Duration;
use std::sync::Arc;

use cohaptic_realtime::udp::Ecn;

use super::clients::ClientId;

/// Datagram in flight. Copies made by a link share one `Packet`.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub(super) struct Packet {
    pub(super) bytes: Vec<u8>,
    pub(super) ecn: Option<Ecn>,
    /// The datagram's client, if clients share the link (proxy); `None` in a mesh.
    pub(super) client: Option<ClientId>,
    /// Time from the arrival of the datagram to the offer to the link.
    pub(super) late: Duration,
}

/// Idle datagrams. Allocations end when the pool holds as many datagrams as were ever in flight at once.
#[derive(Debug)]
pub(super) struct Pool {
    /// Datagrams with reusable memory. Each `Arc` has a single owner.
    idle: Vec<Arc<Packet>>,
    /// Capacity of the byte buffers in `idle` together \[bytes\].
    kept: usize,
    /// Bound on `kept`, so that the memory of a burst of long datagrams is returned to the system.
    most_kept: usize,
}

impl Pool {
    pub(super) const fn new(most_kept: usize) -> Self {
        Self { idle: Vec::new(), kept: 0, most_kept }
    }

    /// Returns a datagram with these contents, in the memory of an idle datagram if there is one.
    pub(super) fn take(&mut self, bytes: &[u8], ecn: Option<Ecn>, client: Option<ClientId>) -> Arc<Packet> {
        let mut packet = self.idle.pop().unwrap_or_default();
        self.kept -= packet.bytes.capacity();
        // Always succeeds: `put` keeps only datagrams with a single owner, and a new datagram has a single owner, too.
        if let Some(packet) = Arc::get_mut(&mut packet) {
            packet.bytes.clear();
            packet.bytes.extend_from_slice(bytes);
            (packet.ecn, packet.client, packet.late) = (ecn, client, Duration::ZERO);
            // No byte of the earlier datagram is left.
            debug_assert_eq!(packet.bytes, bytes);
        }
        packet
    }

    /// Takes the memory of a datagram back, unless a copy of the datagram is still in flight or the pool is full.
    // A datagram beyond the bound is dropped here, so that a burst does not hold memory for the rest of the run.
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
