//! Links of one kind, eight at a time. All draws come before all fates, so that a processor can compute several links at once.

use cohaptic_units::Instant;

use super::kind::{Chain, Kind, Remembered};
use super::losses::Verdict;
use super::{Arrivals, DirectLinks, LinkState};
use crate::laws::delay::Law;

/// Entries of eight neighbouring links.
pub(super) type Eight<T> = [T; DirectLinks::AT_ONCE];

/// Returns the entries of eight links from `first` on.
#[inline(always)]
pub(super) fn eight_from<T>(entries: &mut [T], first: usize) -> Option<&mut Eight<T>> {
    entries.get_mut(first..)?.first_chunk_mut()
}

/// State of eight neighbouring links of one kind.
pub(super) enum States<'a> {
    /// The links have no state.
    Nothing,
    /// The links have no state but chains of delays: the latest value of each, and its instant.
    Delays(&'a mut Eight<f64>, &'a mut Eight<Instant>),
    /// Any state.
    All(&'a mut Eight<Remembered>),
}

impl States<'_> {
    /// Offers a packet to each of these links of one kind, but for those with their bit set in `excluded`.
    ///
    /// Inlined wherever it is called, with a variant that the compiler knows there, so that each caller contains the code of one variant.
    #[inline(always)]
    pub(super) fn offer(
        mut self,
        kind: &mut Kind,
        links: &mut Eight<LinkState>,
        (now, until): (Instant, Instant),
        excluded: u8,
        arrivals: &mut Arrivals,
    ) {
        // Copied before the draws, so that the copies are in the cache when they are read together.
        let chains = match &self {
            Self::Nothing => [f64::NAN; DirectLinks::AT_ONCE],
            Self::Delays(latest, at) => kind.values_of_chains(now, latest, at),
            Self::All(remembered) => kind.values_of_states(now, remembered),
        };
        // The first random words of the next packet of each link, or zeros if the kind is not random.
        let mut words = [[0; 2]; DirectLinks::AT_ONCE];
        for (link, (words, sequence)) in links.iter().zip(words.iter_mut().zip(&mut arrivals.sequences)) {
            *sequence = link.offered;
            if kind.is_random {
                *words = link.draws.packet(link.offered).loss_and_jitter();
            }
        }
        let (values, delays) = kind.delays_of_chains(&chains, &words);
        let leaves = kind.leaves(now);
        let (at, mut wait) = match &self {
            Self::Nothing | Self::Delays(..) => arrivals_of(links, leaves, kind.keeps_order, &delays),
            // With more state, a packet may leave the transmitter later than `leaves`.
            Self::All(_) => ([Law::UNKNOWN; DirectLinks::AT_ONCE], [false; DirectLinks::AT_ONCE]),
        };
        let (mut bit, mut arrive, mut overtake) = (1, 0, 0);
        for place in 0..DirectLinks::AT_ONCE {
            let (link, words) = (&mut links[place], words[place]);
            // An excluded link counts no packet, so its next packet has the same number and random words.
            if excluded & bit == 0 {
                // A closure, because only few packets need further draws, for which the parts of the address must be in memory.
                let (stream, number) = (link.draws, link.offered);
                let packet = move || stream.packet(number);
                let verdict = match &mut self {
                    Self::Nothing => kind.fate(leaves, None, words, packet, at[place]),
                    Self::Delays(latest, since) => kind.fate(
                        leaves,
                        Some(Chain { latest: &mut latest[place], at: &mut since[place], next: values[place] }),
                        words,
                        packet,
                        at[place],
                    ),
                    Self::All(remembered) => kind.verdict(now, &mut remembered[place], words, packet, (values[place], delays[place])),
                };
                link.offered += 1;
                match verdict {
                    Verdict::Arrives(wanted) => {
                        let is_in_order = at[place] != Law::UNKNOWN;
                        let arrival = if is_in_order { wanted } else { link.in_order(kind.keeps_order, wanted) };
                        arrivals.at[place] = arrival;
                        arrive |= bit;
                        if !is_in_order {
                            wait[place] = arrival > wanted;
                        }
                        overtake |= if link.count_arrival(now, until, arrival) { bit } else { 0 };
                    }
                    Verdict::Lost => link.lost += 1,
                    Verdict::Dropped => {}
                }
            }
            bit = bit.wrapping_shl(1);
        }
        (arrivals.arrive, arrivals.overtake, arrivals.wait) = (arrive, overtake, wait);
    }
}

/// Returns the arrivals \[ns\] of packets that leave the transmitters of these links at `leaves` and have these delays \[ns\], and whether each packet waits:
/// with `keeps_order`, no packet arrives before the latest packet of its link. An arrival is [`Law::UNKNOWN`] where the delay is.
///
/// Nobody can predict which packets wait. Of comparisons in the loop over links the compiler made branches, and here it makes none.
#[inline(always)]
fn arrivals_of(links: &Eight<LinkState>, leaves: Instant, keeps_order: bool, delays: &Eight<u64>) -> (Eight<u64>, Eight<bool>) {
    let (mut at, mut wait) = ([0; DirectLinks::AT_ONCE], [false; DirectLinks::AT_ONCE]);
    for (at, delay) in at.iter_mut().zip(delays) {
        // A delay that is not known is the longest of all, and so is its sum.
        *at = leaves.as_nanos().saturating_add(*delay);
    }
    if keeps_order {
        let mut latest = [0; DirectLinks::AT_ONCE];
        for (latest, link) in latest.iter_mut().zip(links) {
            *latest = link.latest.as_nanos();
        }
        for ((at, latest), wait) in at.iter_mut().zip(&latest).zip(&mut wait) {
            *wait = *latest > *at;
            *at = (*latest).max(*at);
        }
    }
    (at, wait)
}
