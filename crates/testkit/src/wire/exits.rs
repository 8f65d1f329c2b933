//! The far ends of links on which packets are hit: where they are delayed, copied, damaged and held back.

use std::collections::BTreeMap;

use cohaptic_units::Instant;
use cohaptic_wan::{DropCause, Fate, Network, PacketEvent, PacketRecord, Path};

use super::parcel::{Octets, Parcel};
use crate::hit::Verdict;

/// What comes out of a link. Its copies are counted as the links of a network without access lines count them: 0, 1, 2.
pub(super) type Out<A> = PacketEvent<Box<Parcel<A>>, Path>;

/// The packets that were hit and have not arrived.
#[derive(Clone)]
pub(super) struct Exits<A> {
    /// The packets that are in their links, by path and number.
    hit: BTreeMap<(Path, u64), Hit>,
    /// Those that are to arrive, in the order of a network among packets of one instant: so that a replay of the fates has the same order.
    late: BTreeMap<Key, Out<A>>,
    /// By path, those that wait for others, and for how many.
    behind: BTreeMap<Path, Vec<(u32, Out<A>)>>,
}

/// When a packet arrives, from where to where, its number, and that of its copy.
type Key = (Instant, Path, u64, u8);

#[derive(Clone, Debug)]
enum Hit {
    /// It has not come out.
    Inside {
        verdict: Verdict,
        /// The copies that the link has made of it so far.
        copies: u8,
    },
    /// It was copied here, and the copy has this number.
    Copied(u8),
}

impl<A> Default for Exits<A> {
    fn default() -> Self {
        Self { hit: BTreeMap::new(), late: BTreeMap::new(), behind: BTreeMap::new() }
    }
}

impl<A: Clone> Exits<A> {
    /// A packet that goes into its link is hit.
    pub(super) fn expect(&mut self, path: Path, number: u64, verdict: Verdict) {
        self.hit.insert((path, number), Hit::Inside { verdict, copies: 0 });
    }

    /// When the next one arrives that was made late.
    pub(super) fn next(&self) -> Option<Instant> {
        self.late.first_key_value().map(|((at, ..), _)| *at)
    }

    /// What comes out next by now, of the links and of what was kept here.
    pub(super) fn poll_with(&mut self, network: &mut Network<Box<Parcel<A>>>, now: Instant) -> Option<Out<A>> {
        while let Some(event) = network.poll_event() {
            let out = self.take(counted(event));
            if out.is_some() {
                return out;
            }
        }
        self.late.first_entry().filter(|first| first.key().0 <= now).map(|first| first.remove())
    }

    /// The packets of a path that wait for others which have not come.
    pub(super) fn waiting(&self, path: Path) -> impl Iterator<Item = (u64, u32)> {
        self.behind.get(&path).into_iter().flatten().map(|(left, out)| (out.sequence, *left))
    }

    /// Takes what comes out of a link, and gives it back if it is no arrival.
    fn take(&mut self, mut out: Out<A>) -> Option<Out<A>> {
        let key = (out.path, out.sequence);
        let verdict = match self.hit.get_mut(&key) {
            None => Verdict::Pass,
            Some(Hit::Copied(copy)) => {
                // One that the link makes later has the number behind.
                out.record.copy += u8::from(out.copy >= *copy);
                Verdict::Pass
            }
            Some(Hit::Inside { copies, .. }) if out.fate == Fate::Duplicated => {
                *copies = (*copies).max(out.copy);
                Verdict::Pass
            }
            Some(Hit::Inside { .. }) if out.copy > 0 => Verdict::Pass,
            Some(Hit::Inside { verdict, .. }) => *verdict,
        };
        let Fate::Delivered(at) = out.fate else { return Some(out) };
        match verdict {
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
                let second = PacketEvent { record: PacketRecord { copy, ..out.record }, ..out.clone() };
                let copied = PacketEvent { record: PacketRecord { fate: Fate::Duplicated, ..second.record }, ..out.clone() };
                self.arrives(out, at);
                self.arrives(second, at.saturating_add(by));
                return Some(copied);
            }
        }
        if verdict != Verdict::Pass {
            self.hit.remove(&key);
        }
        None
    }

    /// A packet is to arrive then.
    fn arrives(&mut self, mut out: Out<A>, at: Instant) {
        out.record.at = at;
        out.record.fate = Fate::Delivered(at);
        self.late.insert((at, out.path, out.sequence, out.copy), out);
    }

    /// Something of a path arrives: those who waited for it come behind, a nanosecond later, so that a replay has the same order.
    pub(super) fn arrived(&mut self, path: Path, at: Instant) {
        let Some(waiting) = self.behind.get_mut(&path) else { return };
        waiting.iter_mut().for_each(|(left, _)| *left -= 1);
        let (come, rest) = std::mem::take(waiting).into_iter().partition(|(left, _)| *left == 0);
        *waiting = rest;
        let come: Vec<(u32, Out<A>)> = come;
        come.into_iter().for_each(|(_, out)| self.arrives(out, at.saturating_add_nanos(1)));
    }

    /// Gives up those that wait for others: their end, as the record has it.
    pub(super) fn abandon(&mut self, now: Instant) -> impl Iterator<Item = Out<A>> {
        std::mem::take(&mut self.behind).into_values().flatten().map(move |(_, mut out)| {
            out.record.at = now.max(out.at);
            out.record.fate = Fate::Dropped(DropCause::Filter);
            out
        })
    }
}

/// Without access lines the only copy is that of the link, whose number in a network is 2.
#[inline]
pub(super) fn counted<A>(mut event: Out<A>) -> Out<A> {
    event.record.copy >>= 1;
    event
}

/// Flips a bit, unless there is none.
fn flip<A>(out: &mut Out<A>, bit: u64) {
    let bits = out.payload.bytes.len() as u64 * 8;
    let Some(bit) = bit.checked_rem(bits) else { return };
    // A copy of it may be on its way still, undamaged.
    let mut bytes = Vec::from(std::mem::take(&mut out.payload.bytes));
    if let Some(byte) = usize::try_from(bit / 8).ok().and_then(|place| bytes.get_mut(place)) {
        *byte ^= 1 << (bit % 8);
    }
    out.payload.bytes = Octets::Own(bytes);
    out.record.damaged = true;
}
