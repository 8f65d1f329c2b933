//! Many links that decide at once what becomes of a packet, for drivers that keep the packets on the way themselves.

mod chains;
mod kind;

use alloc::vec::Vec;

use cohaptic_units::Instant;

use chains::ChainStates;
use kind::{Kind, Line, Remembered, Verdict};

use super::id::LinkId;
use crate::fates::fate::DropCause;
use crate::fates::stats::LinkStats;
use crate::line::direct::{Direct, Words};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::random::Stream;
use crate::stages::config::LinkConfig;
use crate::stages::queue::Load;

/// Links that know at once when a packet arrives: outages, loss, a tail-drop queue before a line of one rate, or one of any discipline that no packet waits for, delay
/// with jitter, and order. Each is a function from a packet to its arrival, with the memory that bursts, correlated delays and the line need. All links have one [`Load`].
///
/// It is what [`crate::Network`] compiles such links to, with the same random numbers at the same addresses and the same counters, without the queue of packets
/// on the way: a driver that looks at arrivals on a lattice of its own has a better one. Whether a packet arrives in time to be counted as delivered is
/// known when it is offered, since the driver says until when it will look.
///
/// Links are numbered from 0 as they are added. Those without memory take a cache line each, most others one and a half.
#[derive(Clone, Debug)]
pub struct DirectLinks {
    until: Instant,
    load: Load,
    links: Vec<LinkState>,
    /// What links of a kind have in common.
    kinds: Vec<(LinkConfig, Kind)>,
    /// What each link remembers, if any of a kind remembers anything.
    remembered: Vec<Remembered>,
    chained: ChainStates,
    others: Vec<Other>,
    /// When each link was offered its latest packet.
    #[cfg(debug_assertions)]
    latest_offers: Vec<Option<Instant>>,
}

/// Packets that were offered to neighbouring links at one instant: one bit, and one place, for each link.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Arrivals {
    /// The links whose packet arrives.
    pub arrive: u8,
    /// Those of them whose packet arrives before one that was sent earlier.
    pub overtake: u8,
    /// The number of each packet on its link, from 0.
    pub sequences: [u64; DirectLinks::AT_ONCE],
    /// When each arrives; of no meaning for one that does not.
    pub at: [Instant; DirectLinks::AT_ONCE],
}

/// A link: its counters, and where the rest of it is kept.
#[derive(Clone, Debug)]
struct LinkState {
    draws: Stream,
    offered: u64,
    latest: Instant,
    delivered: u64,
    delay_nanos: u128,
    lost: u64,
    memory: Memory,
}

/// Which kind of link it is.
#[derive(Clone, Copy, Debug)]
enum Memory {
    /// One of a kind that remembers nothing.
    Plain(u16),
    /// One of a kind that remembers what [`Remembered`] has.
    Remembering(u16),
    /// One of a kind that remembers what [`ChainStates`] has.
    Chained(u16),
    /// One of the others.
    Other(u32),
}

/// A link that is of no kind.
#[derive(Clone, Debug)]
struct Other {
    direct: Direct,
    line: Line,
    departure: Instant,
    outage: u64,
    found_full: u64,
}

impl DirectLinks {
    /// Number of links to which a packet is offered at once: a processor computes several at the same time.
    pub const AT_ONCE: usize = 8;

    /// No links, for packets of that load; those that arrive by `until` will count as delivered.
    #[must_use]
    pub const fn new(until: Instant, load: Load) -> Self {
        Self {
            until,
            load,
            links: Vec::new(),
            kinds: Vec::new(),
            remembered: Vec::new(),
            chained: ChainStates::new(),
            others: Vec::new(),
            #[cfg(debug_assertions)]
            latest_offers: Vec::new(),
        }
    }

    /// Whether such a link can be added: what becomes of a packet of that load is known as soon as it is offered, nothing is copied, marked or damaged.
    #[must_use]
    pub fn takes(model: &LinkModel, load: Load) -> bool {
        model.as_fixed().is_some_and(|config| config.is_direct_but_for_queue(load) && Line::new(config, load).is_some())
    }

    /// Adds a link, and says whether it could be added: one that they do not [take](DirectLinks::takes) needs an engine, and is left out.
    ///
    /// # Panics
    ///
    /// With more than 2^32 links.
    #[must_use]
    pub fn add(&mut self, seed: u64, name: &LinkName, model: &LinkModel) -> bool {
        let Some(config) = model.as_fixed() else { return false };
        // A kind that is known was asked for before: to ask of each link took a third of the time of adding it.
        let known = self.kinds.iter().position(|(other, _)| other == config);
        if known.is_none() && !Self::takes(model, self.load) {
            return false;
        }
        let draws = Stream::new(seed, name.as_str().as_bytes());
        let memory = match self.kind(known, config) {
            Some((place, kind)) if kind.chains.is_some() => {
                let state = kind.initial_state(draws);
                self.chained.begin(self.links.len(), state);
                Memory::Chained(place)
            }
            Some((place, kind)) if kind.remembers() => {
                let beginning = kind.beginning(draws);
                self.remembered.resize(self.links.len(), Remembered::NOTHING);
                self.remembered.push(beginning);
                Memory::Remembering(place)
            }
            Some((place, _)) => Memory::Plain(place),
            None => {
                let line = Line::new(config, self.load).expect("such a link is taken");
                let direct = Direct::new(seed, name, config);
                self.others.push(Other { direct, line, departure: Instant::ZERO, outage: 0, found_full: 0 });
                Memory::Other(u32::try_from(self.others.len() - 1).expect("fewer than 2^32 links fit into memory"))
            }
        };
        self.links.push(LinkState { draws, offered: 0, latest: Instant::ZERO, delivered: 0, delay_nanos: 0, lost: 0, memory });
        true
    }

    /// Offers a packet to each of `count` links from `first` on, at most [`DirectLinks::AT_ONCE`], but for those whose bit is set in `excluded`, and writes into
    /// `arrivals` what becomes of them. Instants must not go back.
    ///
    /// # Panics
    ///
    /// If there are no such links; with debug assertions also if a packet comes earlier than the [`Load`] says.
    #[inline(always)]
    pub fn offer(&mut self, now: Instant, first: LinkId, count: usize, excluded: u8, arrivals: &mut Arrivals) {
        if self.are_chains() {
            self.offer_as::<true>(now, first, count, excluded, arrivals);
        } else {
            self.offer_as::<false>(now, first, count, excluded, arrivals);
        }
    }

    /// Whether the links are all of one kind, in which delays follow those before.
    #[must_use]
    pub fn are_chains(&self) -> bool {
        matches!(&self.kinds[..], [(_, Kind { chains: Some(_), .. })] if self.others.is_empty())
    }

    /// [`DirectLinks::offer`], for a driver that asked before a loop [which links they are](DirectLinks::are_chains). Both in one loop take two instructions more for a packet of links with jitter and loss.
    ///
    /// # Panics
    ///
    /// As [`DirectLinks::offer`].
    #[inline(always)]
    pub fn offer_as<const CHAINS: bool>(&mut self, now: Instant, first: LinkId, count: usize, excluded: u8, arrivals: &mut Arrivals) {
        (arrivals.arrive, arrivals.overtake) = (0, 0);
        let first = first.index();
        #[cfg(debug_assertions)]
        (0..count).filter(|place| excluded >> place & 1 == 0).for_each(|place| self.assert_load(now, first + place));
        let (links, span) = (&mut self.links[first..first + count], (now, self.until));
        // Drawing for eight links what two need takes longer than one by one.
        let are_few = count == Self::AT_ONCE && excluded.count_zeros() <= 2;
        match &mut self.kinds[..] {
            _ if are_few => self.offer_one_by_one(now, first, count, excluded, arrivals),
            [(_, Kind { chains: Some(chains), .. })] if CHAINS && self.others.is_empty() => {
                chains.offer((links, &mut self.chained, first), span, excluded, arrivals);
            }
            [(_, Kind { chains: Some(_), .. })] => self.offer_one_by_one(now, first, count, excluded, arrivals),
            _ if CHAINS => self.offer_one_by_one(now, first, count, excluded, arrivals),
            [(_, kind)] if self.others.is_empty() && self.remembered.is_empty() => alike::<false>(kind, (links, &mut []), span, excluded, arrivals),
            [(_, kind)] if self.others.is_empty() => {
                alike::<true>(kind, (links, &mut self.remembered[first..first + count]), span, excluded, arrivals);
            }
            _ => self.offer_one_by_one(now, first, count, excluded, arrivals),
        }
    }

    #[inline(never)]
    fn offer_one_by_one(&mut self, now: Instant, first: usize, count: usize, excluded: u8, arrivals: &mut Arrivals) {
        for place in (0..count).filter(|place| excluded >> place & 1 == 0) {
            let link = LinkId::new(first + place);
            arrivals.sequences[place] = self.offered(link);
            if let Some((at, overtakes)) = self.offer_alone(now, link) {
                arrivals.at[place] = at;
                arrivals.arrive |= 1 << place;
                arrivals.overtake |= u8::from(overtakes) << place;
            }
        }
    }

    /// How many packets were offered to a link.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    #[inline]
    pub fn offered(&self, link: LinkId) -> u64 {
        self.links[link.index()].offered
    }

    /// Offers a packet to one link, and gives when it arrives, if it does, and whether before one that was sent earlier. Instants must not go back.
    ///
    /// # Panics
    ///
    /// As [`DirectLinks::offer`].
    #[inline]
    pub fn offer_one(&mut self, now: Instant, link: LinkId) -> Option<(Instant, bool)> {
        #[cfg(debug_assertions)]
        self.assert_load(now, link.index());
        self.offer_alone(now, link)
    }

    /// A link is offered a packet, which must not come earlier than the load says.
    #[cfg(debug_assertions)]
    fn assert_load(&mut self, now: Instant, link: usize) {
        if self.latest_offers.len() < self.links.len() {
            self.latest_offers.resize(self.links.len(), None);
        }
        let (before, gap) = (self.latest_offers[link].replace(now), self.load.gap);
        let since = before.map_or(gap, |before| now - before);
        assert!(since >= gap, "link {link} was offered a packet {since:?} after the one before, and was to be offered none within {gap:?}");
    }

    #[inline]
    fn offer_alone(&mut self, now: Instant, link: LinkId) -> Option<(Instant, bool)> {
        let place = link.index();
        let link = &mut self.links[place];
        let (words, draws) = (link.words(&self.kinds), link.draws.packet(link.offered));
        let verdict = match link.memory {
            Memory::Plain(kind) => self.kinds[usize::from(kind)].1.fate(now, words, draws),
            Memory::Remembering(kind) => self.kinds[usize::from(kind)].1.verdict(now, &mut self.remembered[place], words, draws),
            Memory::Chained(kind) => match &self.kinds[usize::from(kind)].1.chains {
                Some(chains) => chains.verdict(now, &mut self.chained, place, words, draws),
                None => unreachable!("links of its kind have chains"),
            },
            Memory::Other(other) => self.others[other as usize].verdict(now, link.offered, words),
        };
        link.count(now, self.until, verdict)
    }

    /// Takes back that a packet is delivered: nobody will look when it arrives.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    pub fn forget(&mut self, link: LinkId, sent: Instant, arrival: Instant) {
        if arrival <= self.until {
            let link = &mut self.links[link.index()];
            link.delivered -= 1;
            link.delay_nanos -= u128::from(arrival.as_nanos() - sent.as_nanos());
        }
    }

    /// The counters of a link.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    pub fn stats(&self, link: LinkId) -> LinkStats {
        let LinkState { offered, delivered, delay_nanos, lost, memory, .. } = self.links[link.index()];
        let (outage, found_full) = match memory {
            Memory::Plain(_) | Memory::Chained(_) => (0, 0),
            Memory::Remembering(_) => (0, self.remembered[link.index()].found_full),
            Memory::Other(place) => (self.others[place as usize].outage, self.others[place as usize].found_full),
        };
        let dropped = [(DropCause::Outage, outage), (DropCause::Loss, lost), (DropCause::QueueFull, found_full)];
        LinkStats::counted(offered, delivered, delay_nanos, dropped)
    }

    /// The kind of a link and its place, which may be known, if it is of a kind and there are not too many.
    fn kind(&mut self, known: Option<usize>, config: &LinkConfig) -> Option<(u16, &Kind)> {
        let place = match known {
            Some(place) => place,
            // Looking a kind up takes longer the more there are.
            None if self.kinds.len() >= 64 => return None,
            None => {
                self.kinds.push((config.clone(), Kind::new(config, self.load)?));
                self.kinds.len() - 1
            }
        };
        Some((u16::try_from(place).ok()?, &self.kinds[place].1))
    }
}

impl Other {
    fn verdict(&mut self, now: Instant, number: u64, words: Words) -> Verdict {
        let Self { direct, line, departure, .. } = self;
        let fate = direct.offer_through(now, number, words, |now| match line {
            Line::Free(nanos) => Ok(now.saturating_add_nanos(*nanos)),
            Line::Queued(queue) => queue.offer(now, departure).ok_or(DropCause::QueueFull),
        });
        match fate {
            Ok(at) => Verdict::Arrives(at),
            Err(DropCause::Outage) => {
                self.outage += 1;
                Verdict::Dropped
            }
            Err(DropCause::QueueFull) => {
                self.found_full += 1;
                Verdict::Dropped
            }
            Err(_) => Verdict::Lost,
        }
    }
}

/// The first random words of the next packet of neighbouring links of one kind, if it is random, and the number of each.
#[inline(always)]
fn draw(is_random: bool, links: &[LinkState], sequences: &mut [u64; DirectLinks::AT_ONCE]) -> [Words; DirectLinks::AT_ONCE] {
    let mut words = [[0; 2]; DirectLinks::AT_ONCE];
    for (link, (words, sequence)) in links.iter().zip(words.iter_mut().zip(sequences)) {
        *sequence = link.offered;
        if is_random {
            *words = link.draws.packet(link.offered).loss_and_jitter();
        }
    }
    words
}

/// Offers a packet to neighbouring links of one kind, which remember something or nothing: each step for all of them before the next.
///
/// A closure for the verdict would be called for each packet: a seventh of the time of ten peers.
#[inline(always)]
fn alike<const REMEMBER: bool>(
    kind: &mut Kind,
    (links, remembered): (&mut [LinkState], &mut [Remembered]),
    (now, until): (Instant, Instant),
    excluded: u8,
    arrivals: &mut Arrivals,
) {
    let words = draw(kind.is_random, links, &mut arrivals.sequences);
    let (mut bit, mut arrive, mut overtake) = (1, 0, 0);
    for place in 0..links.len().min(DirectLinks::AT_ONCE) {
        let (link, words) = (&mut links[place], words[place]);
        if excluded & bit == 0 {
            let draws = link.draws.packet(link.offered);
            let verdict = if REMEMBER { kind.verdict(now, &mut remembered[place], words, draws) } else { kind.fate(now, words, draws) };
            link.offered += 1;
            match verdict {
                Verdict::Arrives(arrival) => {
                    arrivals.at[place] = arrival;
                    arrive |= bit;
                    overtake |= if link.count_arrival(now, until, arrival) { bit } else { 0 };
                }
                Verdict::Lost => link.lost += 1,
                Verdict::Dropped => {}
            }
        }
        bit = bit.wrapping_shl(1);
    }
    (arrivals.arrive, arrivals.overtake) = (arrive, overtake);
}

impl Arrivals {
    /// None yet.
    pub const NONE: Self = Self { arrive: 0, overtake: 0, sequences: [0; DirectLinks::AT_ONCE], at: [Instant::ZERO; DirectLinks::AT_ONCE] };

    /// The places of those that arrive, in order.
    #[inline(always)]
    pub fn places(&self) -> impl Iterator<Item = usize> + use<> {
        let mut left = self.arrive;
        core::iter::from_fn(move || {
            let place = (left != 0).then(|| left.trailing_zeros() as usize)?;
            left &= left - 1;
            Some(place)
        })
    }

    /// Whether the packet in that place overtakes.
    #[must_use]
    #[inline(always)]
    pub const fn overtakes(&self, place: usize) -> bool {
        self.overtake >> place & 1 == 1
    }
}

impl LinkState {
    /// Counts a packet, and gives when it arrives and whether it overtakes.
    #[inline(always)]
    fn count(&mut self, now: Instant, until: Instant, verdict: Verdict) -> Option<(Instant, bool)> {
        self.offered += 1;
        match verdict {
            Verdict::Arrives(at) => Some((at, self.count_arrival(now, until, at))),
            Verdict::Lost => {
                self.lost += 1;
                None
            }
            Verdict::Dropped => None,
        }
    }

    /// Counts the arrival of a packet, and says whether it overtakes.
    #[inline(always)]
    fn count_arrival(&mut self, now: Instant, until: Instant, at: Instant) -> bool {
        if at <= until {
            self.delivered += 1;
            self.delay_nanos += u128::from(at.as_nanos() - now.as_nanos());
        }
        let overtakes = at < self.latest;
        self.latest = if overtakes { self.latest } else { at };
        overtakes
    }

    /// The first random words of the next packet; zeros if it needs none.
    #[inline(always)]
    fn words(&self, kinds: &[(LinkConfig, Kind)]) -> Words {
        match self.memory {
            Memory::Plain(kind) | Memory::Remembering(kind) if !kinds[usize::from(kind)].1.is_random => [0; 2],
            Memory::Plain(_) | Memory::Remembering(_) | Memory::Chained(_) | Memory::Other(_) => self.draws.packet(self.offered).loss_and_jitter(),
        }
    }
}

#[cfg(test)]
mod tests;
