//! Far ends of links on which laws hit packets. Here packets are delayed, copied, damaged, and held back after other packets.

use std::collections::BTreeMap;

use cohaptic_units::Instant;
use cohaptic_wan::{DropCause, Fate, Network, PacketEvent, PacketRecord, Path};

use super::parcel::Parcel;
use crate::hit::Verdict;

/// Event at the far end of a link. Copies are numbered as by the links of a network without access lines: 0, 1, 2.
pub(super) type Out<A> = PacketEvent<Box<Parcel<A>>, Path>;

/// Packets that were hit and have not arrived.
#[derive(Clone)]
pub(super) struct Exits<A> {
    /// Packets inside their links or copied here, by path and sequence number.
    hit: BTreeMap<(Path, u64), Hit>,
    /// Packets with a scheduled arrival, sorted like the events of a network, so that a replay of the fates has the same order at each instant.
    late: BTreeMap<Key, Out<A>>,
    /// Packets that wait for further arrivals on the path, each with the number of missing arrivals.
    behind: BTreeMap<Path, Vec<(u32, Out<A>)>>,
}

/// Instant of arrival, path, sequence number, and number of the copy.
type Key = (Instant, Path, u64, u8);

/// State of a packet that was hit.
#[derive(Clone, Debug)]
enum Hit {
    /// The packet has not come out of its link.
    Inside {
        verdict: Verdict,
        /// Highest number of a copy that the link has made of the packet so far.
        copies: u8,
    },
    /// The packet was copied here, and the copy has this number.
    Copied(u8),
}

impl<A> Default for Exits<A> {
    fn default() -> Self {
        Self { hit: BTreeMap::new(), late: BTreeMap::new(), behind: BTreeMap::new() }
    }
}

impl<A: Clone> Exits<A> {
    /// Notes a hit packet as the packet enters the link.
    pub(super) fn expect(&mut self, path: Path, number: u64, verdict: Verdict) {
        self.hit.insert((path, number), Hit::Inside { verdict, copies: 0 });
    }

    /// Returns the instant of the next arrival of a delayed packet.
    pub(super) fn next(&self) -> Option<Instant> {
        self.late.first_key_value().map(|((at, ..), _)| *at)
    }

    /// Returns the next event that is due at `now`, of the links or of the packets kept here.
    pub(super) fn poll_with(&mut self, network: &mut Network<Box<Parcel<A>>>, now: Instant) -> Option<Out<A>> {
        while let Some(event) = network.poll_event() {
            let out = self.take(counted(event));
            if out.is_some() {
                return out;
            }
        }
        // All due arrivals of the links are in `late` now, so that the first entry is the earliest arrival.
        self.late.first_entry().filter(|first| first.key().0 <= now).map(|first| first.remove())
    }

    /// Returns sequence number and number of missing arrivals of each waiting packet of `path`.
    pub(super) fn waiting(&self, path: Path) -> impl Iterator<Item = (u64, u32)> {
        self.behind.get(&path).into_iter().flatten().map(|(left, out)| (out.sequence, *left))
    }

    /// Handles an event of a link. Returns the event if it is no arrival; an arrival is kept here until it is due.
    fn take(&mut self, mut out: Out<A>) -> Option<Out<A>> {
        let key = (out.path, out.sequence);
        let verdict = match self.hit.get_mut(&key) {
            None => Verdict::Pass,
            Some(Hit::Copied(copy)) => {
                // The copy made here has taken the number, so a later copy of the link gets the next number.
                out.record.copy += u8::from(out.copy >= *copy);
                Verdict::Pass
            }
            Some(Hit::Inside { copies, .. }) if out.fate == Fate::Duplicated => {
                *copies = (*copies).max(out.copy);
                Verdict::Pass
            }
            // The verdict concerns the packet itself. Copies made by the link pass.
            Some(Hit::Inside { .. }) if out.copy > 0 => Verdict::Pass,
            Some(Hit::Inside { verdict, .. }) => *verdict,
        };
        let Fate::Delivered(at) = out.fate else { return Some(out) };
        match verdict {
            // No packet with `Drop` comes out of its link: the filter of the path has dropped the packet. `Behind(0)` waits for nothing.
            Verdict::Pass | Verdict::Drop | Verdict::Behind(0) => self.arrives(out, at),
            Verdict::Delay(by) => self.arrives(out, at.saturating_add(by)),
            Verdict::Behind(count) => self.behind.entry(out.path).or_default().push((count, out)),
            Verdict::Corrupt(bit) => {
                flip(&mut out, bit);
                self.arrives(out, at);
            }
            Verdict::Duplicate(by) => {
                let copy = match self.hit.remove(&key) {
                    Some(Hit::Inside { copies, .. }) => copies + 1,
                    Some(Hit::Copied(_)) | None => 1,
                };
                self.hit.insert(key, Hit::Copied(copy));
                // A record has the copying before both arrivals, as for a copy that a link makes.
                let second = PacketEvent { record: PacketRecord { copy, ..out.record }, ..out.clone() };
                let copied = PacketEvent { record: PacketRecord { fate: Fate::Duplicated, ..second.record }, ..out.clone() };
                self.arrives(out, at);
                self.arrives(second, at.saturating_add(by));
                return Some(copied);
            }
        }
        // The verdict is carried out. Without the removal the map would grow with every hit packet.
        if verdict != Verdict::Pass {
            self.hit.remove(&key);
        }
        None
    }

    /// Schedules the arrival of a packet at the instant `at`.
    fn arrives(&mut self, mut out: Out<A>, at: Instant) {
        out.record.at = at;
        out.record.fate = Fate::Delivered(at);
        self.late.insert((at, out.path, out.sequence, out.copy), out);
    }

    /// Counts an arrival on a path. Packets that have waited for this arrival arrive a nanosecond later: at the same instant a replay could have another order.
    pub(super) fn arrived(&mut self, path: Path, at: Instant) {
        let Some(waiting) = self.behind.get_mut(&path) else { return };
        // Packets whose count reaches zero leave `behind` below, so that no count is zero here.
        waiting.iter_mut().for_each(|(left, _)| *left -= 1);
        let (come, rest) = std::mem::take(waiting).into_iter().partition(|(left, _)| *left == 0);
        *waiting = rest;
        let come: Vec<(u32, Out<A>)> = come;
        come.into_iter().for_each(|(_, out)| self.arrives(out, at.saturating_add_nanos(1)));
    }

    /// Drops the packets that still wait for further arrivals, and returns the end of each packet for the record.
    pub(super) fn abandon(&mut self, now: Instant) -> impl Iterator<Item = Out<A>> {
        std::mem::take(&mut self.behind).into_values().flatten().map(move |(_, mut out)| {
            out.record.at = now.max(out.at);
            out.record.fate = Fate::Dropped(DropCause::Filter);
            out
        })
    }
}

/// Renumbers a copy. Without access lines only the link copies packets, and the network gives this copy the number 2.
#[inline]
pub(super) fn counted<A>(mut event: Out<A>) -> Out<A> {
    event.record.copy >>= 1;
    event
}

/// Flips the bit `bit` of the content, modulo the number of bits. Does nothing to an empty packet.
fn flip<A>(out: &mut Out<A>, bit: u64) {
    let bits = out.payload.bytes.len() as u64 * 8;
    let Some(bit) = bit.checked_rem(bits) else { return };
    // A copy with the same memory may still be under way, undamaged.
    let mut bytes = Vec::from(std::mem::take(&mut out.payload.bytes));
    if let Some(byte) = usize::try_from(bit / 8).ok().and_then(|place| bytes.get_mut(place)) {
        *byte ^= 1 << (bit % 8);
    }
    out.payload.bytes = bytes.into();
    out.record.damaged = true;
}
