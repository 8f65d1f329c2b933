//! Many links that decide at once what becomes of a packet, for drivers that keep what is on the way themselves.

use alloc::vec::Vec;

use cohaptic_units::{Instant, Probability};

use super::id::LinkId;
use crate::fates::fate::DropCause;
use crate::fates::stats::LinkStats;
use crate::line::direct::{Direct, Words};
use crate::line::model::LinkModel;
use crate::line::name::LinkName;
use crate::random::{PacketDraws, Stream};
use crate::stages::config::LinkConfig;
use crate::stages::delay::DelayStage;
use crate::stages::loss::Loss;
use crate::stages::order::Order;

/// Links in which nothing waits: a constant delay, or outages, loss, delay with jitter and order. Each is a function from a packet to its arrival, with the
/// memory that bursts and correlated delays need.
///
/// It is what [`crate::Network`] compiles such links to, with the same random numbers at the same addresses and the same counters, without the queue of what
/// is on the way: a driver that looks at arrivals on a lattice of its own has a better one. Whether a packet arrives in time to be counted as delivered is
/// known when it is offered, since the driver says until when it will look.
///
/// Links are numbered from 0 as they are added. Those without memory take a cache line each.
#[derive(Clone, Debug)]
pub struct DirectLinks {
    until: Instant,
    links: Vec<LinkState>,
    /// What links without memory have in common.
    kinds: Vec<(LinkConfig, Kind)>,
    with_memory: Vec<Remembering>,
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

/// A link.
#[derive(Clone, Debug)]
struct LinkState {
    draws: Stream,
    offered: u64,
    latest: Instant,
    delivered: u64,
    delay_nanos: u128,
    lost: u64,
    is: Is,
}

/// Which of the kinds without memory, or of the links that remember.
#[derive(Clone, Copy, Debug)]
enum Is {
    Plain(u16),
    Remembering(u32),
}

/// A kind of link whose packets have nothing to do with each other.
#[derive(Clone, Debug)]
struct Kind {
    is_random: bool,
    loss: Option<Probability>,
    delay: DelayStage,
}

/// A link that remembers.
#[derive(Clone, Debug)]
struct Remembering {
    direct: Direct,
    outage: u64,
}

impl DirectLinks {
    /// To so many links a packet is offered at once: a processor computes several at the same time.
    pub const AT_ONCE: usize = 8;

    /// No links; packets that arrive by `until` will count as delivered.
    #[must_use]
    pub const fn new(until: Instant) -> Self {
        Self { until, links: Vec::new(), kinds: Vec::new(), with_memory: Vec::new() }
    }

    /// Adds a link, and says whether it could be added: one that is not [direct](LinkModel::is_direct) needs an engine, and is left out.
    ///
    /// # Panics
    ///
    /// With more than 2^32 links.
    #[must_use]
    pub fn add(&mut self, seed: u64, name: &LinkName, model: &LinkModel) -> bool {
        let Some(config) = model.as_fixed().filter(|_| model.is_direct()) else { return false };
        let is = match self.kind(config) {
            Some(kind) => Is::Plain(kind),
            None => {
                self.with_memory.push(Remembering { direct: Direct::new(seed, name, config), outage: 0 });
                Is::Remembering(u32::try_from(self.with_memory.len() - 1).expect("fewer than 2^32 links fit into memory"))
            }
        };
        let draws = Stream::new(seed, name.as_str().as_bytes());
        self.links.push(LinkState { draws, offered: 0, latest: Instant::ZERO, delivered: 0, delay_nanos: 0, lost: 0, is });
        true
    }

    /// Offers a packet to each of `count` links from `first` on, at most [`DirectLinks::AT_ONCE`], but for those whose bit is set in `but`, and writes into
    /// `arrivals` what becomes of them. Instants must not go back.
    ///
    /// # Panics
    ///
    /// If there are no such links.
    #[inline(always)]
    pub fn offer(&mut self, now: Instant, first: LinkId, count: usize, but: u8, arrivals: &mut Arrivals) {
        (arrivals.arrive, arrivals.overtake) = (0, 0);
        let first = first.index();
        match &mut self.kinds[..] {
            [(_, kind)] if self.with_memory.is_empty() => alike(kind, &mut self.links[first..first + count], now, self.until, but, arrivals),
            _ => self.offer_one_by_one(now, first, count, but, arrivals),
        }
    }

    #[inline(never)]
    fn offer_one_by_one(&mut self, now: Instant, first: usize, count: usize, but: u8, arrivals: &mut Arrivals) {
        for place in (0..count).filter(|place| but >> place & 1 == 0) {
            let words = self.links[first + place].words(&self.kinds);
            arrivals.sequences[place] = self.links[first + place].offered;
            if let Some((at, overtakes)) = self.offer_one(now, first + place, words) {
                arrivals.at[place] = at;
                arrivals.arrive |= 1 << place;
                arrivals.overtake |= u8::from(overtakes) << place;
            }
        }
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
        let LinkState { offered, delivered, delay_nanos, lost, is, .. } = self.links[link.index()];
        let outage = match is {
            Is::Plain(_) => 0,
            Is::Remembering(place) => self.with_memory[place as usize].outage,
        };
        LinkStats::counted(offered, delivered, delay_nanos, [(DropCause::Outage, outage), (DropCause::Loss, lost)])
    }

    /// The kind of a link whose packets have nothing to do with each other, if it is such a link and there are not too many kinds.
    fn kind(&mut self, config: &LinkConfig) -> Option<u16> {
        let loss = match &config.loss {
            Loss::None => None,
            Loss::Independent(probability) => Some(*probability),
            Loss::Correlated(_) | Loss::GilbertElliott(_) | Loss::GilbertElliottInTime(_) | Loss::FourState(_) | Loss::Pattern(_) => return None,
        };
        let delay = DelayStage::new(&config.delay);
        if !config.outages.is_empty() || config.order != Order::AllowReordering || delay.remembers() {
            return None;
        }
        if let Some(place) = self.kinds.iter().position(|(other, _)| other == config) {
            return u16::try_from(place).ok();
        }
        // Looking a kind up takes longer the more there are.
        if self.kinds.len() >= 64 {
            return None;
        }
        self.kinds.push((config.clone(), Kind { is_random: config.is_random(), loss, delay }));
        u16::try_from(self.kinds.len() - 1).ok()
    }

    /// When the next packet of a link arrives, and whether it overtakes.
    fn offer_one(&mut self, now: Instant, link: usize, words: Words) -> Option<(Instant, bool)> {
        let link = &mut self.links[link];
        let sequence = link.offered;
        let fate = match link.is {
            Is::Plain(kind) => self.kinds[usize::from(kind)].1.fate(now, words, link.draws.packet(sequence)),
            Is::Remembering(place) => {
                let Remembering { direct, outage } = &mut self.with_memory[place as usize];
                match direct.offer(now, sequence, words) {
                    Ok(at) => Some(at),
                    Err(DropCause::Outage) => {
                        *outage += 1;
                        link.offered += 1;
                        return None;
                    }
                    Err(_) => None,
                }
            }
        };
        let overtakes = link.count(now, self.until, fate);
        fate.map(|at| (at, overtakes))
    }
}

/// Offers a packet to neighbouring links of one kind: each step for all of them before the next.
#[inline(always)]
fn alike(kind: &mut Kind, links: &mut [LinkState], now: Instant, until: Instant, but: u8, arrivals: &mut Arrivals) {
    let mut words = [[0; 2]; DirectLinks::AT_ONCE];
    let Arrivals { sequences, at, .. } = arrivals;
    for (link, (words, sequence)) in links.iter().zip(words.iter_mut().zip(sequences)) {
        *sequence = link.offered;
        if kind.is_random {
            *words = link.draws.packet(link.offered).loss_and_jitter();
        }
    }
    let (mut bit, mut arrive, mut overtake) = (1, 0, 0);
    for (link, (words, at)) in links.iter_mut().zip(words.into_iter().zip(at)) {
        if but & bit == 0 {
            let fate = kind.fate(now, words, link.draws.packet(link.offered));
            let overtakes = link.count(now, until, fate);
            if let Some(arrival) = fate {
                *at = arrival;
                arrive |= bit;
                overtake |= if overtakes { bit } else { 0 };
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

impl Kind {
    /// When a packet arrives; `None` if it is lost.
    #[inline(always)]
    fn fate(&mut self, now: Instant, [loss_word, jitter_word]: Words, packet: PacketDraws) -> Option<Instant> {
        if self.loss.is_some_and(|loss| loss.happens(loss_word)) {
            return None;
        }
        Some(now.saturating_add_nanos(self.delay.draw_nanos(now, jitter_word, packet)))
    }
}

impl LinkState {
    /// Counts a packet, and says whether it overtakes; `fate` is when it arrives, or `None` if it is lost.
    #[inline(always)]
    fn count(&mut self, now: Instant, until: Instant, fate: Option<Instant>) -> bool {
        self.offered += 1;
        let Some(at) = fate else {
            self.lost += 1;
            return false;
        };
        if at <= until {
            self.delivered += 1;
            self.delay_nanos += u128::from(at.as_nanos() - now.as_nanos());
        }
        let overtakes = at < self.latest;
        self.latest = self.latest.max(at);
        overtakes
    }

    /// The first random words of the next packet; zeros if it needs none.
    #[inline(always)]
    fn words(&self, kinds: &[(LinkConfig, Kind)]) -> Words {
        match self.is {
            Is::Plain(kind) if !kinds[usize::from(kind)].1.is_random => [0; 2],
            Is::Plain(_) | Is::Remembering(_) => self.draws.packet(self.offered).loss_and_jitter(),
        }
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_units::Bytes;

    use super::*;
    use crate::link::Link;
    use crate::netem::Netem;
    use crate::packet::PacketInfo;

    fn model(words: &str) -> LinkModel {
        Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap().into()
    }

    const DIRECT: [&str; 7] = [
        "delay 5ms",
        "delay 24ms 9ms loss 10%",
        "delay 24ms 9ms 50% distribution pareto",
        "loss gemodel 5% 20%",
        "delay 3ms 2ms distribution normal",
        "loss 50%",
        "delay 20ms 5ms distribution normal",
    ];

    #[test]
    fn they_decide_what_whole_links_decide() {
        compare(&DIRECT);
        for words in DIRECT {
            compare(&[words; 8]);
        }
    }

    /// All links at once against each as a [`Link`]: the same packets at the same instants, the same counters at the end.
    fn compare(direct: &[&str]) {
        let until = Instant::from_nanos(500 * 8_000_000);
        let mut links = DirectLinks::new(until);
        let name = |place: usize| LinkName::between("a", &format!("b{place}"));
        assert!(direct.iter().enumerate().all(|(place, words)| links.add(7, &name(place), &model(words))));
        let mut whole: Vec<Link<u64>> = direct.iter().enumerate().map(|(place, words)| Link::new(7, &name(place), model(words))).collect();
        let mut arrivals: Vec<Vec<(Instant, u64)>> = vec![Vec::new(); direct.len()];
        for number in 0..500_u64 {
            let now = Instant::from_nanos(number * 8_000_000);
            // Every third packet is not offered to the second link.
            let but = if number % 3 == 0 { 0b10 } else { 0 };
            for (place, link) in whole.iter_mut().enumerate().filter(|(place, _)| but >> place & 1 == 0) {
                link.handle_packet(now, PacketInfo::from(Bytes::new(64)), 0).unwrap_or_else(|error| panic!("{place}: {error}"));
            }
            let mut offered = Arrivals::NONE;
            links.offer(now, LinkId(0), direct.len(), but, &mut offered);
            for place in offered.places() {
                let so_far = &mut arrivals[place];
                assert_eq!(offered.overtakes(place), so_far.iter().any(|(at, _)| *at > offered.at[place]));
                so_far.push((offered.at[place], offered.sequences[place]));
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
            assert_eq!(delivered, *arrivals, "{}", direct[place]);
            assert_eq!(links.stats(LinkId::new(place)), link.stats(), "{}", direct[place]);
        }
    }

    #[test]
    fn what_is_forgotten_is_on_the_way_for_ever() {
        // One that would have arrived at the very last instant.
        let mut links = DirectLinks::new(Instant::from_nanos(5_000_000));
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
        let mut links = DirectLinks::new(Instant::MAX);
        for words in ["rate 1mbit", "duplicate 1%", "delay 10ms limit 5", "corrupt 1%"] {
            assert!(!links.add(1, &LinkName::between("a", "b"), &model(words)), "{words}");
        }
        assert!(links.links.is_empty());
    }

    #[test]
    fn a_link_without_memory_takes_a_cache_line() {
        assert_eq!(size_of::<LinkState>(), 64);
    }
}
