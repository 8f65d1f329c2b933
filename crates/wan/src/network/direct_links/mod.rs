//! Many links with packets of immediately certain fate. The driver keeps the packets on the way itself.

mod chains;
mod kind;
mod kinds;
mod losses;
mod switching;
mod together;

use alloc::vec::Vec;

use cohaptic_units::Instant;

use chains::ChainStates;
use kind::{Line, Remembered};
use kinds::Kinds;
use losses::Verdict;
use switching::Switching;
use together::{States, eight_from};

use super::id::LinkId;
use crate::fates::fate::DropCause;
use crate::fates::stats::LinkStats;
use crate::laws::delay::Law;
use crate::line::direct::{Direct, Words};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::random::Stream;
use crate::stages::queue::Load;

/// Links with the arrival of a packet known at its offer. Possible parts are outages, loss, a tail-drop queue before a transmitter of constant rate, a queue of
/// any discipline without waiting packets, delay with jitter, and order. Each link is a function from a packet to its arrival, with the state for bursts of
/// loss, correlated delays and the transmitter. All links have one [`Load`]. A modulator may change these parts where no packet waits in any state.
///
/// Random numbers, their addresses and the counters are equal to [`crate::Network`] with the same links. The queue of packets on the way is left to the driver:
/// a driver with arrivals on a lattice can use a simpler queue. The driver gives the end of its interest, so a packet is counted as delivered or not at its
/// offer.
///
/// Links are numbered from 0 in the order of addition. A link without state takes one cache line. A chain of delays takes 16 bytes besides, and most links with
/// other state take 40 bytes besides.
#[derive(Clone, Debug)]
pub struct DirectLinks {
    /// End of the run. Packets with a later arrival do not count as delivered.
    until: Instant,
    load: Load,
    /// Number of links.
    count: usize,
    /// State of each link, indexed by link. The arrays here and below are padded, so that there are eight entries from any link on.
    links: Vec<LinkState>,
    /// Kinds of links, and the data shared by the links of one model. Indexed by the number in [`Memory`].
    kinds: Vec<Kinds>,
    /// State of links in [`Memory::Remembering`], indexed by link. Empty if no link needs such state.
    remembered: Vec<Remembered>,
    /// State of links in [`Memory::Chained`] and [`Memory::Delayed`], indexed by link.
    chained: ChainStates,
    /// Links of no kind, indexed by the number in [`Memory::Other`].
    others: Vec<Other>,
    /// Instant of the latest packet offered to each link, indexed by link; `None` before the first packet. Resized at the first offer after an addition of
    /// links.
    #[cfg(debug_assertions)]
    latest_offers: Vec<Option<Instant>>,
}

/// Fates of packets offered to neighbouring links at one instant: one bit and one array entry for each link, from the first link on.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Arrivals {
    /// Bits of the links with an arriving packet.
    pub arrive: u8,
    /// Bits of the links with a packet arriving before an earlier packet. A subset of `arrive`.
    pub overtake: u8,
    /// `true` for each packet that waits, for the order of packets: the packet arrives together with an earlier packet. Links that are not computed together may
    /// have `false` for a packet that waits. Without meaning where the bit in `arrive` is clear.
    pub wait: [bool; DirectLinks::AT_ONCE],
    /// Number of each packet on its link, from 0.
    pub sequences: [u64; DirectLinks::AT_ONCE],
    /// Arrival of each packet. Without meaning where the bit in `arrive` is clear.
    pub at: [Instant; DirectLinks::AT_ONCE],
}

/// Counters of a link, and the place of the rest of the link.
#[derive(Clone, Debug)]
struct LinkState {
    draws: Stream,
    offered: u64,
    /// Latest arrival of a packet so far.
    latest: Instant,
    delivered: u64,
    /// Sum of the delays of delivered packets \[ns\].
    delay_nanos: u128,
    lost: u64,
    memory: Memory,
}

/// Place of the state of a link, and the index of its kinds in `kinds`.
#[derive(Clone, Copy, Debug)]
enum Memory {
    /// A link of these kinds, without state.
    Plain(u16),
    /// A link of these kinds, with its state in `remembered`.
    Remembering(u16),
    /// A link of this kind, with its state in `chained`.
    Chained(u16),
    /// A link of this kind, whose chain of delays is its only state, in `chained`.
    Delayed(u16),
    /// A link of no kind: the index in `others`.
    Other(u32),
}

/// A link of no kind, with separate stages and counters.
#[derive(Clone, Debug)]
struct Other {
    direct: Direct,
    line: OtherLine,
    /// Packets dropped in outages.
    outage: u64,
}

/// Transmitter of a link of no kind.
#[derive(Clone, Debug)]
enum OtherLine {
    /// A transmitter that does not change.
    Constant {
        line: Line,
        /// Instant at which the latest packet leaves the queue.
        departure: Instant,
        /// Packets without room in the queue.
        found_full: u64,
    },
    /// A transmitter that changes, with all other stages of the link, as a modulator says. No packet waits, so the queue is never full.
    Switching(Switching),
}

impl DirectLinks {
    /// Number of links offered a packet at once. The computations for these links do not depend on each other, so a processor can overlap them.
    pub const AT_ONCE: usize = 8;

    /// Makes an empty set of links for packets of this load. Packets with an arrival by `until` count as delivered.
    #[must_use]
    pub const fn new(until: Instant, load: Load) -> Self {
        Self {
            until,
            load,
            count: 0,
            links: Vec::new(),
            kinds: Vec::new(),
            remembered: Vec::new(),
            chained: ChainStates::new(),
            others: Vec::new(),
            #[cfg(debug_assertions)]
            latest_offers: Vec::new(),
        }
    }

    /// Returns whether a link of this model can be added. The fate of a packet of this load must be certain at its offer, and the link must not copy, mark or
    /// damage packets.
    #[must_use]
    pub fn takes(model: &LinkModel, load: Load) -> bool {
        match model {
            LinkModel::Modulated(modulated) => Switching::takes(modulated, load),
            LinkModel::Fixed(config) => config.is_direct_but_for_queue(load) && Line::new(config, load).is_some(),
            LinkModel::Replay(_) | LinkModel::Kernel(_) => false,
        }
    }

    /// Adds a link, and returns true. If [`takes`](DirectLinks::takes) refuses the model, because the link needs an engine, nothing is added and false is
    /// returned.
    ///
    /// # Panics
    ///
    /// With more than 2^32 links.
    #[must_use]
    pub fn add(&mut self, seed: u64, name: &LinkName, model: &LinkModel) -> bool {
        // A model in `kinds` was checked with its first link, and needs no second check.
        let known = self.kinds.iter().position(|kinds| kinds.are_of(seed, model));
        if known.is_none() && !Self::takes(model, self.load) {
            return false;
        }
        let draws = Stream::new(seed, name.as_str().as_bytes());
        let memory = match self.kinds(known, seed, model) {
            Some((place, kinds)) => {
                let (only, remember) = (kinds.only(), kinds.remember);
                let (has_chains, state) = only.map_or((false, Remembered::NOTHING), |kind| (kind.chains.is_some(), kind.beginning(draws)));
                let has_only_delays = only.is_some_and(|kind| kind.has_only_delays);
                // Chains come first: a kind with chains has state too, but keeps it in arrays for eight links at once.
                // Links added since the last link with state have no state. Their entries keep the index equal to the link's number.
                if has_chains {
                    self.chained.begin(self.count, state.state);
                    Memory::Chained(place)
                } else if has_only_delays {
                    self.chained.begin_delays(self.count);
                    Memory::Delayed(place)
                } else if remember {
                    self.remembered.resize(self.count + Self::AT_ONCE, Remembered::NOTHING);
                    self.remembered[self.count] = state;
                    Memory::Remembering(place)
                } else {
                    Memory::Plain(place)
                }
            }
            None => match self.of_no_kind(seed, name, model) {
                Some(other) => self.other(other),
                None => return false,
            },
        };
        let link = LinkState::new(draws, memory);
        self.links.resize(self.count + Self::AT_ONCE, link.clone());
        self.links[self.count] = link;
        self.count += 1;
        true
    }

    /// Returns a link of no kind; `None` if the model needs an engine.
    fn of_no_kind(&self, seed: u64, name: &LinkName, model: &LinkModel) -> Option<(Direct, OtherLine)> {
        match model {
            LinkModel::Fixed(config) => {
                let line = Line::new(config, self.load)?;
                Some((Direct::new(seed, name, config), OtherLine::Constant { line, departure: Instant::ZERO, found_full: 0 }))
            }
            LinkModel::Modulated(modulated) => {
                let (switching, direct) = Switching::new(seed, name, modulated, self.load)?;
                Some((direct, OtherLine::Switching(switching)))
            }
            LinkModel::Replay(_) | LinkModel::Kernel(_) => None,
        }
    }

    /// Adds a link of no kind, and returns its place.
    fn other(&mut self, (direct, line): (Direct, OtherLine)) -> Memory {
        self.others.push(Other { direct, line, outage: 0 });
        Memory::Other(u32::try_from(self.others.len() - 1).expect("fewer than 2^32 links fit into memory"))
    }

    /// Offers a packet to each of `count` links from `first` on, at most [`DirectLinks::AT_ONCE`] links, and writes the fates of the packets into `arrivals`.
    /// Links with their bit set in `excluded` are left out. Instants must not go back, of a link and of all links with one modulator.
    ///
    /// # Panics
    ///
    /// If a link is missing. With debug assertions, also if a packet comes earlier than the [`Load`] allows, or than another packet of its modulator.
    #[inline(always)]
    pub fn offer(&mut self, now: Instant, first: LinkId, count: usize, excluded: u8, arrivals: &mut Arrivals) {
        // The type parameter keeps the rarer code out of the loop: see `offer_as`.
        if self.are_chains() {
            self.offer_as::<true>(now, first, count, excluded, arrivals);
        } else {
            self.offer_as::<false>(now, first, count, excluded, arrivals);
        }
    }

    /// Returns whether all links are of one kind, and this kind has correlated delays and no state but the chains of delays and of losses.
    #[must_use]
    pub fn are_chains(&self) -> bool {
        matches!(&self.kinds[..], [kinds] if self.others.is_empty() && kinds.only().is_some_and(|kind| kind.chains.is_some()))
    }

    /// Returns whether all links are of one model that keeps the order of packets at all times, so that no packet overtakes another.
    #[must_use]
    pub fn keep_order(&self) -> bool {
        matches!(&self.kinds[..], [kinds] if self.others.is_empty() && kinds.keep_order())
    }

    /// Offers packets like [`DirectLinks::offer`], for a driver with a call of [`are_chains`](DirectLinks::are_chains) before a loop: `CHAINS` is the answer.
    /// Each of the two loops then contains the code of one kind of links only. With a wrong value the answers are the same, and slower to compute.
    ///
    /// # Panics
    ///
    /// Like [`DirectLinks::offer`].
    #[inline(always)]
    pub fn offer_as<const CHAINS: bool>(&mut self, now: Instant, first: LinkId, count: usize, excluded: u8, arrivals: &mut Arrivals) {
        (arrivals.arrive, arrivals.overtake, arrivals.wait) = (0, 0, [false; Self::AT_ONCE]);
        let first = first.index();
        assert!(first + count <= self.count, "of {} links, links {first} to {} are missing", self.count, first + count);
        // The links after the last one of these are left out, too.
        let [beyond, _] = (u16::from(u8::MAX) << count).to_le_bytes();
        let excluded = excluded | beyond;
        #[cfg(debug_assertions)]
        (0..count).filter(|place| excluded >> place & 1 == 0).for_each(|place| self.assert_load(now, first + place));
        // With at most two links left, the joint draw for eight links would cost more than single offers.
        let are_few = excluded.count_zeros() <= 2;
        let kind = match &mut self.kinds[..] {
            [kinds] if !are_few && self.others.is_empty() => kinds.at(now),
            _ => None,
        };
        let (Some(kind), Some(links)) = (kind, eight_from(&mut self.links, first)) else {
            return self.offer_one_by_one(now, first, excluded, arrivals);
        };
        let span = (now, self.until);
        // Inlined into the driver's loop, which may be compiled for wider registers than a function of its own.
        match &kind.chains {
            Some(chains) if CHAINS => chains.offer((links, &mut self.chained, first), span, excluded, arrivals),
            // A wrong value of `CHAINS` is slow, but gives the same answers.
            Some(_) => self.offer_one_by_one(now, first, excluded, arrivals),
            None if CHAINS => self.offer_one_by_one(now, first, excluded, arrivals),
            None if !kind.remembers => States::Nothing.offer(kind, links, span, excluded, arrivals),
            None if kind.has_only_delays => match self.chained.delays_from(first) {
                Some((latest, at)) => States::Delays(latest, at).offer(kind, links, span, excluded, arrivals),
                None => unreachable!("each link of the kind has a chain of delays"),
            },
            None => match eight_from(&mut self.remembered, first) {
                Some(remembered) => States::All(remembered).offer(kind, links, span, excluded, arrivals),
                None => unreachable!("each link of the kind has state"),
            },
        }
    }

    #[inline(never)]
    fn offer_one_by_one(&mut self, now: Instant, first: usize, excluded: u8, arrivals: &mut Arrivals) {
        for place in (0..Self::AT_ONCE).filter(|place| excluded >> place & 1 == 0) {
            let link = LinkId::new(first + place);
            arrivals.sequences[place] = self.offered(link);
            if let Some((at, overtakes)) = self.offer_alone(now, link) {
                arrivals.at[place] = at;
                arrivals.arrive |= 1 << place;
                arrivals.overtake |= u8::from(overtakes) << place;
            }
        }
    }

    /// Returns the state of a link.
    #[inline]
    fn link(&self, link: LinkId) -> &LinkState {
        &self.links[..self.count][link.index()]
    }

    /// Returns the number of packets offered to a link.
    ///
    /// # Panics
    ///
    /// If the link is missing.
    #[must_use]
    #[inline]
    pub fn offered(&self, link: LinkId) -> u64 {
        self.link(link).offered
    }

    /// Offers a packet to a single link, and returns the packet's arrival and whether the packet overtakes an earlier packet. Returns `None` if the
    /// packet does not arrive. Instants must not go back.
    ///
    /// # Panics
    ///
    /// Like [`DirectLinks::offer`].
    #[inline]
    pub fn offer_one(&mut self, now: Instant, link: LinkId) -> Option<(Instant, bool)> {
        #[cfg(debug_assertions)]
        self.assert_load(now, link.index());
        self.offer_alone(now, link)
    }

    /// Checks the instant `now` of a packet offered to `link` against the load.
    #[cfg(debug_assertions)]
    fn assert_load(&mut self, now: Instant, link: usize) {
        if self.latest_offers.len() < self.count {
            self.latest_offers.resize(self.count, None);
        }
        let (before, gap) = (self.latest_offers[link].replace(now), self.load.gap);
        // The first packet of a link has no gap before it, and passes the check.
        let since = before.map_or(gap, |before| now - before);
        assert!(since >= gap, "link {link} was offered a packet {since:?} after the one before, and was to be offered none within {gap:?}");
    }

    #[inline]
    fn offer_alone(&mut self, now: Instant, link: LinkId) -> Option<(Instant, bool)> {
        let place = link.index();
        let link = &mut self.links[..self.count][place];
        let (words, draws) = (link.words(&self.kinds), link.draws.packet(link.offered));
        let verdict = match link.memory {
            Memory::Plain(kinds) => {
                let mut nothing = Remembered::NOTHING;
                let (verdict, keeps_order) = self.kinds[usize::from(kinds)].verdict(now, &mut nothing, words, draws);
                verdict.map(|at| link.in_order(keeps_order, at))
            }
            Memory::Remembering(kinds) => {
                let (verdict, keeps_order) = self.kinds[usize::from(kinds)].verdict(now, &mut self.remembered[place], words, draws);
                verdict.map(|at| link.in_order(keeps_order, at))
            }
            Memory::Delayed(kinds) => match self.kinds[usize::from(kinds)].at(now) {
                Some(kind) => {
                    let verdict = kind.fate(kind.leaves(now), Some(self.chained.delay(place)), words, || draws, Law::UNKNOWN);
                    verdict.map(|at| link.in_order(kind.keeps_order, at))
                }
                None => unreachable!("its kind has no modulator"),
            },
            Memory::Chained(kinds) => match self.kinds[usize::from(kinds)].only().and_then(|kind| kind.chains.as_ref()) {
                Some(chains) => chains.verdict(now, &mut self.chained, place, words, draws),
                None => unreachable!("links of its kind have chains"),
            },
            Memory::Other(other) => self.others[other as usize].verdict(now, link.offered, words),
        };
        link.count(now, self.until, verdict)
    }

    /// Takes back the count of a delivered packet, for a driver that will not see the arrival.
    ///
    /// # Panics
    ///
    /// If the link is missing.
    pub fn forget(&mut self, link: LinkId, sent: Instant, arrival: Instant) {
        // A later arrival was never counted.
        if arrival <= self.until {
            let link = &mut self.links[..self.count][link.index()];
            link.delivered -= 1;
            link.delay_nanos -= u128::from(arrival.as_nanos() - sent.as_nanos());
        }
    }

    /// Returns the counters of a link.
    ///
    /// # Panics
    ///
    /// If the link is missing.
    #[must_use]
    pub fn stats(&self, link: LinkId) -> LinkStats {
        let LinkState { offered, delivered, delay_nanos, lost, memory, .. } = *self.link(link);
        let (outage, found_full) = match memory {
            // A kind without queue drops no packet for want of room, and no kind has outages.
            Memory::Plain(_) | Memory::Chained(_) | Memory::Delayed(_) => (0, 0),
            Memory::Remembering(_) => (0, self.remembered[link.index()].found_full),
            Memory::Other(place) => {
                let Other { line, outage, .. } = &self.others[place as usize];
                let found_full = if let OtherLine::Constant { found_full, .. } = line { *found_full } else { 0 };
                (*outage, found_full)
            }
        };
        let dropped = [(DropCause::Outage, outage), (DropCause::Loss, lost), (DropCause::QueueFull, found_full)];
        LinkStats::counted(offered, delivered, delay_nanos, dropped)
    }

    /// Returns the kinds of a model and their index. `known` is the index if the model has kinds already; else the kinds are added. Returns `None` if
    /// [`Remembered`] has too little state for the model, or if there are too many kinds.
    fn kinds(&mut self, known: Option<usize>, seed: u64, model: &LinkModel) -> Option<(u16, &Kinds)> {
        let place = match known {
            Some(place) => place,
            // The list is searched from its beginning for each added link, so its length is limited.
            None if self.kinds.len() >= 64 => return None,
            None => {
                self.kinds.push(Kinds::new(seed, model, self.load)?);
                self.kinds.len() - 1
            }
        };
        Some((u16::try_from(place).ok()?, &self.kinds[place]))
    }
}

impl Other {
    fn verdict(&mut self, now: Instant, number: u64, words: Words) -> Verdict {
        let Self { direct, line, .. } = self;
        // The queue stands between loss and delay, as in the general pipeline.
        let fate = match line {
            OtherLine::Constant { line, departure, found_full } => direct.offer_through(now, number, words, |now| match line {
                Line::Free(nanos) => Ok(now.saturating_add_nanos(*nanos)),
                Line::Queued(queue) => queue.offer(now, departure).ok_or_else(|| {
                    *found_full += 1;
                    DropCause::QueueFull
                }),
            }),
            OtherLine::Switching(switching) => {
                switching.pass(now, direct);
                match direct.dropped(now, number, words) {
                    Some(cause) => Err(cause),
                    None => {
                        let leaves = switching.departure(now, direct);
                        Ok(direct.arrival(leaves, number, words))
                    }
                }
            }
        };
        match fate {
            Ok(at) => Verdict::Arrives(at),
            Err(DropCause::Outage) => {
                self.outage += 1;
                Verdict::Dropped
            }
            Err(DropCause::QueueFull) => Verdict::Dropped,
            // The remaining cause is loss: a direct link has no further causes.
            Err(_) => Verdict::Lost,
        }
    }
}

impl Arrivals {
    /// No packet arrives.
    pub const NONE: Self = Self {
        arrive: 0,
        overtake: 0,
        wait: [false; DirectLinks::AT_ONCE],
        sequences: [0; DirectLinks::AT_ONCE],
        at: [Instant::ZERO; DirectLinks::AT_ONCE],
    };

    /// Returns the array indices of the arriving packets, in ascending order.
    #[inline(always)]
    pub fn places(&self) -> impl Iterator<Item = usize> + use<> {
        let mut left = self.arrive;
        core::iter::from_fn(move || {
            let place = (left != 0).then(|| left.trailing_zeros() as usize)?;
            // Clears the lowest set bit.
            left &= left - 1;
            Some(place)
        })
    }

    /// Returns whether the packet at this array index arrives before an earlier packet.
    #[must_use]
    pub const fn overtakes(&self, place: usize) -> bool {
        self.overtake >> place & 1 == 1
    }

    /// Returns whether the packet at this array index is known to wait, and so to arrive together with an earlier packet.
    #[must_use]
    pub const fn waits(&self, place: usize) -> bool {
        self.wait[place]
    }
}

impl LinkState {
    /// Returns a link that was offered no packet.
    const fn new(draws: Stream, memory: Memory) -> Self {
        Self { draws, offered: 0, latest: Instant::ZERO, delivered: 0, delay_nanos: 0, lost: 0, memory }
    }

    /// Counts a packet, and returns the packet's arrival and whether the packet overtakes. Returns `None` if the packet does not arrive.
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

    /// Returns the arrival of a packet, not before an earlier packet if `keeps_order` is set.
    #[inline(always)]
    fn in_order(&self, keeps_order: bool, at: Instant) -> Instant {
        if keeps_order { at.max(self.latest) } else { at }
    }

    /// Counts the arrival of a packet, and returns whether the packet overtakes an earlier packet.
    #[inline(always)]
    fn count_arrival(&mut self, now: Instant, until: Instant, at: Instant) -> bool {
        // An arrival after the end of the run stays in flight for the counters, but counts for the order of arrivals. There is no branch, because nobody can
        // predict such an arrival if delays are not short compared with the run.
        let is_counted = at <= until;
        self.delivered += u64::from(is_counted);
        self.delay_nanos += u128::from(core::hint::select_unpredictable(is_counted, at.as_nanos() - now.as_nanos(), 0));
        let overtakes = at < self.latest;
        self.latest = if overtakes { self.latest } else { at };
        overtakes
    }

    /// Returns the first random words of the next packet, or zeros if the link's kind is not random.
    #[inline(always)]
    fn words(&self, kinds: &[Kinds]) -> Words {
        match self.memory {
            Memory::Plain(place) | Memory::Remembering(place) if !kinds[usize::from(place)].are_random => [0; 2],
            Memory::Plain(_) | Memory::Remembering(_) | Memory::Chained(_) | Memory::Delayed(_) | Memory::Other(_) => {
                self.draws.packet(self.offered).loss_and_jitter()
            }
        }
    }
}

#[cfg(test)]
mod tests;
