//! Many links that decide at once what becomes of a packet, for drivers that keep the packets on the way themselves.

mod chains;
mod kind;
mod offered_at;

use alloc::vec::Vec;

use cohaptic_units::{Bytes, Instant};

use chains::ChainStates;
use kind::{Kind, Remembered, Verdict};
pub use offered_at::OfferedAt;

use super::id::LinkId;
use crate::fates::fate::DropCause;
use crate::fates::stats::LinkStats;
use crate::line::direct::{Direct, Words};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::random::Stream;
use crate::stages::config::LinkConfig;
use crate::stages::queue::EqualPackets;

/// Links that know at once when a packet arrives: outages, loss, a tail-drop queue before a line of one rate, delay with jitter, and order. Each is a function
/// from a packet to its arrival, with the memory that bursts, correlated delays and the line need. All packets have one size.
///
/// It is what [`crate::Network`] compiles such links to, with the same random numbers at the same addresses and the same counters, without the queue of packets
/// on the way: a driver that looks at arrivals on a lattice of its own has a better one. Whether a packet arrives in time to be counted as delivered is
/// known when it is offered, since the driver says until when it will look.
///
/// Links are numbered from 0 as they are added. Those without memory take a cache line each, most others one and a half.
#[derive(Clone, Debug)]
pub struct DirectLinks {
    until: Instant,
    size: Bytes,
    links: Vec<LinkState>,
    /// What links of a kind have in common.
    kinds: Vec<(LinkConfig, Kind)>,
    /// What each link remembers, if any of a kind remembers anything.
    remembered: Vec<Remembered>,
    chained: ChainStates,
    others: Vec<Other>,
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
    queue: Option<EqualPackets>,
    departure: Instant,
    outage: u64,
    found_full: u64,
}

impl DirectLinks {
    /// Number of links to which a packet is offered at once: a processor computes several at the same time.
    pub const AT_ONCE: usize = 8;

    /// No links, for packets of that size; those that arrive by `until` will count as delivered.
    #[must_use]
    pub const fn new(until: Instant, size: Bytes) -> Self {
        Self { until, size, links: Vec::new(), kinds: Vec::new(), remembered: Vec::new(), chained: ChainStates::new(), others: Vec::new() }
    }

    /// Whether such a link can be added: what becomes of a packet of that size is known as soon as it is offered, nothing is copied, marked or damaged.
    #[must_use]
    pub fn takes(model: &LinkModel, size: Bytes) -> bool {
        model.as_fixed().is_some_and(|config| config.is_direct_but_for_queue() && kind::queue(config, size).is_some())
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
        if known.is_none() && !Self::takes(model, self.size) {
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
                let queue = kind::queue(config, self.size).flatten();
                let direct = Direct::new(seed, name, config);
                self.others.push(Other { direct, queue, departure: Instant::ZERO, outage: 0, found_full: 0 });
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
    /// If there are no such links.
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

    /// [`DirectLinks::offer`], at one instant or each packet at one of its own, for a driver that asked before a loop
    /// [which links they are](DirectLinks::are_chains). Both in one loop take two instructions more for a packet of links with jitter and loss.
    ///
    /// # Panics
    ///
    /// If there are no such links.
    #[inline(always)]
    pub fn offer_as<const CHAINS: bool>(&mut self, now: impl OfferedAt, first: LinkId, count: usize, excluded: u8, arrivals: &mut Arrivals) {
        (arrivals.arrive, arrivals.overtake) = (0, 0);
        let first = first.index();
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
    fn offer_one_by_one(&mut self, now: impl OfferedAt, first: usize, count: usize, excluded: u8, arrivals: &mut Arrivals) {
        for place in (0..count).filter(|place| excluded >> place & 1 == 0) {
            let link = LinkId::new(first + place);
            arrivals.sequences[place] = self.offered(link);
            if let Some((at, overtakes)) = self.offer_one(now.of(place), link) {
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
    /// If there is no such link.
    #[inline]
    pub fn offer_one(&mut self, now: Instant, link: LinkId) -> Option<(Instant, bool)> {
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
                self.kinds.push((config.clone(), Kind::new(config, self.size)?));
                self.kinds.len() - 1
            }
        };
        Some((u16::try_from(place).ok()?, &self.kinds[place].1))
    }
}

impl Other {
    fn verdict(&mut self, now: Instant, number: u64, words: Words) -> Verdict {
        let Self { direct, queue, departure, .. } = self;
        let fate = direct.offer_through(now, number, words, |now| match queue {
            None => Ok(now),
            Some(queue) => queue.offer(now, departure).ok_or(DropCause::QueueFull),
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
    (now, until): (impl OfferedAt, Instant),
    excluded: u8,
    arrivals: &mut Arrivals,
) {
    let words = draw(kind.is_random, links, &mut arrivals.sequences);
    let (mut bit, mut arrive, mut overtake) = (1, 0, 0);
    for place in 0..links.len().min(DirectLinks::AT_ONCE) {
        let (link, words) = (&mut links[place], words[place]);
        if excluded & bit == 0 {
            let (draws, now) = (link.draws.packet(link.offered), now.of(place));
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
mod tests {
    use core::time::Duration;

    use cohaptic_units::Rate;

    use super::*;
    use crate::laws::delay::Distribution;
    use crate::link::Link;
    use crate::netem::Netem;
    use crate::packet::PacketInfo;
    use crate::stages::config::Layout;
    use crate::stages::delay::{Correlation, Delay, Jitter};
    use crate::stages::queue::{Bottleneck, QueueLimit};

    fn model(words: &str) -> LinkModel {
        Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap().into()
    }

    /// Those words, with this queue before a line of 100 kbit/s: 5.12 ms for 64 bytes.
    fn queued(words: &str, limit: Option<QueueLimit>) -> LinkModel {
        let bottleneck = Bottleneck { limit, ..Bottleneck::at_rate(Rate::bits_per_sec(100_000).unwrap()) };
        let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
        LinkConfig { bottleneck: Some(bottleneck), layout: Layout::Physical, ..config }.into()
    }

    const DIRECT: [&str; 9] = [
        "delay 5ms",
        "delay 24ms 9ms loss 10%",
        "delay 24ms 9ms 50% distribution pareto",
        "loss gemodel 5% 20%",
        "delay 3ms 2ms distribution normal",
        "loss 50%",
        "delay 20ms 5ms distribution normal",
        "delay 24ms 4ms 50% loss gemodel 5% 20% 30% 2%",
        "delay 24ms 4ms 50%",
    ];

    #[test]
    fn they_decide_what_whole_links_decide() {
        let direct = DIRECT.map(model);
        compare(&direct[..8]);
        compare(&direct[1..]);
        for model in direct {
            compare(&[const { None }; 8].map(|_: Option<()>| model.clone()));
        }
    }

    /// Packets come every 8 ms, or every 4: the line is idle, or its queue fills.
    #[test]
    fn queues_decide_what_whole_links_decide() {
        let limits = [None, Some(QueueLimit::Packets(3)), Some(QueueLimit::Bytes(Bytes::new(200))), Some(QueueLimit::Time(Duration::from_millis(9)))];
        let words = ["delay 24ms", "delay 24ms 9ms loss 10%", "delay 24ms 4ms 50% loss gemodel 5% 20%", "delay 24ms 9ms loss state 5% 20%"];
        for limit in limits {
            let queued = words.map(|words| queued(words, limit));
            compare(&queued);
            for model in queued {
                compare(&[const { None }; 8].map(|_: Option<()>| model.clone()));
            }
        }
    }

    /// Correlated gamma delays: of shapes that four terms tell nearly everywhere, of one for which they do not, and over a floor; with losses in bursts, with
    /// independent ones and without. Eleven links are eight and three, or twice five and one.
    #[test]
    fn chains_decide_what_whole_links_decide() {
        let gamma = |sd: u64, floor: u64| Jitter {
            floor: Duration::from_millis(floor),
            correlation: Correlation::PerPacket(0.5),
            ..Jitter::new(Duration::from_millis(sd), Distribution::Gamma)
        };
        for (words, jitter) in [
            ("loss gemodel 20% 40%", gamma(6, 0)),
            ("loss gemodel 20% 40% 0% 0%", gamma(6, 20)),
            ("loss gemodel 20% 40% 100% 100%", gamma(90, 0)),
            ("loss gemodel 20% 40% 50% 10%", gamma(6, 0)),
            ("loss gemodel 20% 40%", gamma(20, 0)),
            ("loss 30%", gamma(6, 0)),
            ("", gamma(90, 10)),
        ] {
            let delay = Delay::with_jitter(Duration::from_millis(24), jitter).unwrap();
            let config = Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap();
            let model = LinkModel::from(LinkConfig { delay, ..config });
            compare(&[const { None }; 8].map(|_: Option<()>| model.clone()));
            compare(&[const { None }; 11].map(|_: Option<()>| model.clone()));
            compare(&[DIRECT.map(self::model).as_slice(), &[model.clone(), model]].concat());
        }
    }

    /// All links at once, in groups of eight and of five, packets at one instant and a microsecond apart, against each as a [`Link`]: the same packets at the same
    /// instants, the same counters at the end.
    fn compare(direct: &[LinkModel]) {
        [(DirectLinks::AT_ONCE, 0), (5, 0), (DirectLinks::AT_ONCE, 1000), (5, 1000)].into_iter().for_each(|groups| compare_in_groups(direct, groups));
    }

    fn compare_in_groups(direct: &[LinkModel], (together, apart): (usize, u64)) {
        let until = Instant::from_nanos(500 * 8_000_000);
        let mut links = DirectLinks::new(until, Bytes::new(64));
        let name = |place: usize| LinkName::between("a", &format!("b{place}"));
        assert!(direct.iter().enumerate().all(|(place, model)| links.add(7, &name(place), model)));
        let mut whole: Vec<Link<u64>> = direct.iter().enumerate().map(|(place, model)| Link::new(7, &name(place), model.clone())).collect();
        let mut arrivals: Vec<Vec<(Instant, u64)>> = vec![Vec::new(); direct.len()];
        for number in 0..500_u64 {
            // Every 8 ms at first, every 4 ms later.
            let now = Instant::from_nanos(number.min(250) * 8_000_000 + number.saturating_sub(250) * 4_000_000);
            // Every third packet is not offered to the second link.
            let excluded = if number % 3 == 0 { 0b10 } else { 0 };
            for (place, link) in whole.iter_mut().enumerate().filter(|(place, _)| u32::from(excluded) >> place & 1 == 0) {
                link.handle_packet(now.saturating_add_nanos(apart * place as u64), PacketInfo::from(Bytes::new(64)), 0)
                    .unwrap_or_else(|error| panic!("{place}: {error}"));
            }
            let mut offered = Arrivals::NONE;
            for first in (0..direct.len()).step_by(together) {
                let count = together.min(direct.len() - first);
                let (link, excluded) = (LinkId::new(first), if first == 0 { excluded } else { 0 });
                let instants = core::array::from_fn(|place| now.saturating_add_nanos(apart * (first + place) as u64));
                match links.are_chains() {
                    _ if apart == 0 => links.offer(now, link, count, excluded, &mut offered),
                    true => links.offer_as::<true>(&instants, link, count, excluded, &mut offered),
                    false => links.offer_as::<false>(&instants, link, count, excluded, &mut offered),
                }
                for place in offered.places() {
                    let so_far = &mut arrivals[first + place];
                    assert_eq!(offered.overtakes(place), so_far.iter().any(|(at, _)| *at > offered.at[place]));
                    so_far.push((offered.at[place], offered.sequences[place]));
                }
            }
        }
        for (place, link) in whole.iter_mut().enumerate() {
            link.handle_timeout(until).unwrap();
            let mut delivered = Vec::new();
            while let Some(event) = link.poll_event() {
                if let crate::fates::fate::Fate::Delivered(at) = event.fate {
                    delivered.push((at, event.sequence));
                }
            }
            let arrivals = &mut arrivals[place];
            arrivals.sort_unstable();
            arrivals.retain(|(at, _)| *at <= until);
            assert_eq!(delivered, *arrivals, "{}", direct[place].words());
            assert_eq!(links.stats(LinkId::new(place)), link.stats(), "{}", direct[place].words());
        }
    }

    #[test]
    fn what_is_forgotten_is_on_the_way_for_ever() {
        // One that would have arrived at the very last instant.
        let mut links = DirectLinks::new(Instant::from_nanos(5_000_000), Bytes::new(64));
        assert!(links.add(1, &LinkName::between("a", "b"), &model("delay 5ms")));
        let mut arrivals = Arrivals::NONE;
        links.offer(Instant::ZERO, LinkId(0), 1, 0, &mut arrivals);
        assert_eq!((arrivals.arrive, arrivals.overtake, arrivals.sequences[0]), (1, 0, 0));
        assert_eq!((links.stats(LinkId(0)).delivered(), links.stats(LinkId(0)).in_flight()), (1, 0));
        links.forget(LinkId(0), Instant::ZERO, arrivals.at[0]);
        assert_eq!((links.stats(LinkId(0)).delivered(), links.stats(LinkId(0)).in_flight(), links.stats(LinkId(0)).mean_delay()), (0, 1, None));
    }

    #[test]
    fn what_needs_an_engine_is_left_out() {
        let mut links = DirectLinks::new(Instant::MAX, Bytes::new(64));
        for words in ["rate 1mbit delay 5ms 1ms", "duplicate 1%", "delay 10ms limit 5", "corrupt 1%"] {
            assert!(!links.add(1, &LinkName::between("a", "b"), &model(words)), "{words}");
        }
        assert!(links.links.is_empty());
    }

    #[test]
    fn a_link_without_memory_takes_a_cache_line() {
        assert_eq!(size_of::<LinkState>(), 64);
    }
}
