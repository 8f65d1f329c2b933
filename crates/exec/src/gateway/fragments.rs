//! Datagrams in fragments from the program inside, put together again.

use core::net::IpAddr;
use core::time::Duration;
use std::collections::BTreeMap;

use cohaptic_router::{Content, Fragment, Packet};
use cohaptic_units::Instant;

/// Time for which fragments wait for missing fragments (RFC 8200, section 4.5, asks for 60 s; Linux has 30 s).
const PATIENCE: Duration = Duration::from_secs(30);

/// Largest number of packets in wait for fragments. A further packet takes the place of the packet with the longest wait.
const MOST: usize = 64;

/// Packets with at least one arrived fragment.
#[derive(Debug, Default)]
pub(super) struct Fragments {
    waiting: BTreeMap<Key, Parts>,
}

/// Sender, receiver, protocol and identification.
type Key = (IpAddr, IpAddr, u8, u32);

#[derive(Debug)]
struct Parts {
    since: Instant,
    /// Data by its place in the packet.
    parts: BTreeMap<usize, Vec<u8>>,
    /// Length of the packet, once its last fragment has arrived.
    length: Option<usize>,
}

impl Fragments {
    /// Takes a fragment. Returns the packet if no fragment is missing any more.
    pub(super) fn take(&mut self, now: Instant, packet: &Packet) -> Option<Packet> {
        let Content::Ip { headers, .. } = packet.content() else { return None };
        let Fragment { identification, protocol, offset, is_last, data } = packet.fragment()?;
        self.waiting.retain(|_, parts| now.saturating_duration_since(parts.since) < PATIENCE);
        let key = (headers.source, headers.destination, protocol.0, identification);
        if !self.waiting.contains_key(&key)
            && self.waiting.len() >= MOST
            && let Some(oldest) = self.waiting.iter().min_by_key(|(_, parts)| parts.since).map(|(key, _)| *key)
        {
            self.waiting.remove(&oldest);
        }
        let parts = self.waiting.entry(key).or_insert_with(|| Parts { since: now, parts: BTreeMap::new(), length: None });
        parts.parts.insert(offset, data.to_vec());
        if is_last {
            parts.length = Some(offset + data.len());
        }
        let segment = parts.whole()?;
        self.waiting.remove(&key);
        Packet::around_segment(headers.source, headers.destination, protocol, &segment)
    }
}

impl Parts {
    /// Returns the data of the packet, or `None` while a part is missing. Overlapping parts never make a whole (RFC 5722).
    fn whole(&self) -> Option<Vec<u8>> {
        let length = self.length?;
        let mut whole = Vec::with_capacity(length);
        for (offset, data) in &self.parts {
            if *offset != whole.len() {
                return None;
            }
            whole.extend(data);
        }
        (whole.len() == length).then_some(whole)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fragments_make_a_whole_in_any_order_and_not_without_one() {
        let data = vec![7; 4000];
        let whole = Packet::datagram("10.0.2.15:1".parse().unwrap(), "10.0.2.2:2".parse().unwrap(), &data).unwrap();
        let parts = whole.cut(1500, 9);
        let at = |seconds: u64| Instant::from_nanos(seconds * 1_000_000_000);
        for order in [[0, 1, 2], [2, 0, 1], [1, 2, 0]] {
            let mut fragments = Fragments::default();
            let taken = order.map(|place| fragments.take(at(1), &parts[place]));
            assert!(taken[0].is_none() && taken[1].is_none());
            assert_eq!(taken[2].as_ref().unwrap().datagram_data(), Some(data.as_slice()));
            assert!(fragments.waiting.is_empty());
        }
        // A repeated fragment, and a late fragment.
        let mut fragments = Fragments::default();
        for (seconds, place) in [(0, 0), (1, 1), (1, 1), (31, 2)] {
            assert!(fragments.take(at(seconds), &parts[place]).is_none());
        }
        assert!(fragments.take(at(31), &parts[0]).is_none());
        assert!(fragments.take(at(31), &parts[1]).is_some());
    }

    #[test]
    fn the_packets_that_wait_have_a_bound() {
        let mut fragments = Fragments::default();
        for identification in 0..200 {
            let whole = Packet::datagram("10.0.2.15:1".parse().unwrap(), "10.0.2.2:2".parse().unwrap(), &[7; 2000]).unwrap();
            assert!(fragments.take(Instant::from_nanos(identification.into()), &whole.cut(1500, identification)[0]).is_none());
        }
        assert_eq!(fragments.waiting.len(), MOST);
    }
}
