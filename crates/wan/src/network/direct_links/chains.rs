//! Links with correlated delays, eight at a time. Each step is done for all eight links before the next step, so a processor can compute several links at once.
//! Most delays are computed with fewer terms of their series than in a single computation; the rest is left to a slower function.

use alloc::vec::Vec;

use cohaptic_units::{Instant, Probability};

use super::kind::Chain;
use super::losses::{Losses, Verdict};
use super::together::{Eight, eight_from};
use super::{Arrivals, DirectLinks, LinkState};
use crate::laws::delay::GammaCubics;
use crate::line::direct::Words;
use crate::random::PacketDraws;
use crate::stages::delay::CorrelatedDelays;
use crate::stages::loss::GilbertElliottState;

/// Links of a kind without state except the state of the losses and the normal number of the latest delay.
#[derive(Clone, Debug)]
pub(super) struct Chains {
    /// Threshold for leaving a state, indexed by state (good, bad): a link leaves the state if the upper 53 bits of the packet's loss word are below the
    /// threshold.
    leaves: [u64; 2],
    /// Threshold for a loss, indexed by the state before the packet: the packet is lost if the upper 53 bits of its loss word are below the threshold.
    loses: [u64; 2],
    delays: CorrelatedDelays,
    cubics: GammaCubics,
}

/// State of the chain of delays and of the chain of losses, indexed by link, for links without further state. Padded by seven links, so a load of eight links
/// starting at any link stays within the arrays.
#[derive(Clone, Debug)]
pub(super) struct ChainStates {
    /// Latest value of the chain of delays; NaN before the first packet.
    normals: Vec<f64>,
    /// Instant of the latest value of the chain of delays. Without meaning for links of a kind with [`Chains`], whose correlation does not depend on time.
    at: Vec<Instant>,
    /// One bit per link, set if the link's chain of losses is in the bad state.
    bad: Vec<u8>,
}

/// Returns the smallest whole number n such that an event of this probability happens if and only if the upper 53 bits of its random word are below n.
pub(super) fn threshold(probability: Probability) -> u64 {
    const TWO_POW_53: f64 = 9_007_199_254_740_992.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number from 0 to 2^53")]
    // `Probability::happens` compares the upper 53 bits as a fraction with the probability, so the bound is the next whole number.
    let threshold = libm::ceil(probability.get() * TWO_POW_53) as u64;
    threshold
}

pub(super) const fn is_below(word: u64, threshold: u64) -> bool {
    word >> 11 < threshold
}

impl Chains {
    /// Returns `None` if a loss needs more than one random word, if the correlation depends on time, or if the law of the delays cannot be computed for eight
    /// links at once.
    pub(super) fn new(losses: &Losses, delays: &CorrelatedDelays) -> Option<Self> {
        if delays.is_in_time() {
            return None;
        }
        let (leaves, loses) = match losses {
            Losses::None => ([Probability::ZERO; 2], [Probability::ZERO; 2]),
            Losses::Independent(probability) => ([Probability::ZERO; 2], [*probability; 2]),
            Losses::GilbertElliott(chain) => {
                // A loss with a probability strictly between 0 and 1 within a state would need a second word.
                let certain = [chain.k, chain.h].map(|gets_through| {
                    let all_or_none = [(Probability::ONE, Probability::ZERO), (Probability::ZERO, Probability::ONE)];
                    all_or_none.into_iter().find(|(passes, _)| *passes == gets_through).map(|(_, lost)| lost)
                });
                ([chain.p, chain.r], [certain[0]?, certain[1]?])
            }
            // The probabilities of a chain in time follow from the time between packets.
            Losses::InTime(_) => return None,
        };
        Some(Self { leaves: leaves.map(threshold), loses: loses.map(threshold), delays: delays.clone(), cubics: delays.cubics()? })
    }

    /// Computes the fate of a packet of the link `place`, and changes the link's state.
    pub(super) fn verdict(
        &self,
        now: Instant,
        states: &mut ChainStates,
        place: usize,
        [loss_word, jitter_word]: Words,
        packet: PacketDraws,
    ) -> Verdict {
        // Both thresholds belong to the state before the packet, also for the loss, although the state has changed by then.
        let state = usize::from(states.bad_from(place) & 1);
        states.change(place, u8::from(is_below(loss_word, self.leaves[state])));
        if is_below(loss_word, self.loses[state]) {
            return Verdict::Lost;
        }
        Verdict::Arrives(now.saturating_add_nanos(self.delays.next_nanos(&mut states.normals[place], jitter_word, packet)))
    }

    /// Offers a packet to each of these neighbouring links, from number `first` on. Links with their bit set in `excluded` are left out.
    #[inline(always)]
    pub(super) fn offer(
        &self,
        (links, states, first): (&mut Eight<LinkState>, &mut ChainStates, usize),
        (now, until): (Instant, Instant),
        excluded: u8,
        arrivals: &mut Arrivals,
    ) {
        let bad = states.bad_from(first);
        let (mut lost, mut leave) = (0, 0);
        let mut jitter_words = [0; DirectLinks::AT_ONCE];
        for (place, (link, (sequence, word))) in links.iter().zip(arrivals.sequences.iter_mut().zip(&mut jitter_words)).enumerate() {
            *sequence = link.offered;
            let [loss_word, jitter_word] = link.draws.packet(link.offered).loss_and_jitter();
            *word = jitter_word;
            let state = usize::from(bad >> place & 1);
            lost |= u8::from(is_below(loss_word, self.loses[state])) << place;
            leave |= u8::from(is_below(loss_word, self.leaves[state])) << place;
        }
        // Lost packets change the state too. Links in `excluded` got no packet and keep their state.
        states.change(first, leave & !excluded);
        // The padding makes the load valid for every existing link.
        let Some(normals) = eight_from(&mut states.normals, first) else { return };
        let following = self.delays.following(normals, &jitter_words);
        let nanos = self.cubics.nanos(&following);
        let (mut bit, mut arrive, mut overtake, mut slow) = (1_u8, 0, 0, 0);
        for place in 0..DirectLinks::AT_ONCE {
            let link = &mut links[place];
            if excluded & bit == 0 {
                link.offered += 1;
                // The chain of delays does not move for a lost packet, so `normals` is written for arriving packets only.
                if lost & bit != 0 {
                    link.lost += 1;
                } else if nanos[place] == GammaCubics::UNKNOWN {
                    slow |= bit;
                } else {
                    let at = now.saturating_add_nanos(nanos[place]);
                    normals[place] = following[place];
                    arrivals.at[place] = at;
                    arrive |= bit;
                    overtake |= if link.count_arrival(now, until, at) { bit } else { 0 };
                }
            }
            bit = bit.wrapping_shl(1);
        }
        (arrivals.arrive, arrivals.overtake) = (arrive, overtake);
        if slow != 0 {
            self.offer_slowly((links, normals), (now, until), slow, arrivals);
        }
    }

    /// Delivers the packets of the links in `slow`, with delays beyond `cubics`. A separate function, because a call within the loop over all links would force
    /// the loop's values out of registers.
    #[cold]
    fn offer_slowly(
        &self,
        (links, normals): (&mut Eight<LinkState>, &mut Eight<f64>),
        (now, until): (Instant, Instant),
        slow: u8,
        arrivals: &mut Arrivals,
    ) {
        for (place, link) in links.iter_mut().enumerate().filter(|(place, _)| slow >> place & 1 == 1) {
            // The number was noted before the count moved on.
            let packet = link.draws.packet(arrivals.sequences[place]);
            let [_, word] = packet.loss_and_jitter();
            let at = now.saturating_add_nanos(self.delays.next_nanos(&mut normals[place], word, packet));
            arrivals.at[place] = at;
            arrivals.arrive |= 1 << place;
            arrivals.overtake |= u8::from(link.count_arrival(now, until, at)) << place;
        }
    }
}

impl ChainStates {
    pub(super) const fn new() -> Self {
        Self { normals: Vec::new(), at: Vec::new(), bad: Vec::new() }
    }

    /// Sets the initial state of link `place`. The number must be higher than all numbers before.
    pub(super) fn begin(&mut self, place: usize, state: GilbertElliottState) {
        self.normals.resize(place + DirectLinks::AT_ONCE, f64::NAN);
        // `place / 8 + 2` bytes, so a load of two bytes from any link's byte stays within the array.
        self.bad.resize(place / 8 + 2, 0);
        // A new bit is 0, so a toggle sets the bit.
        self.change(place, u8::from(state == GilbertElliottState::Bad));
    }

    /// Begins the chain of delays of link `place`, which is its only state. The number must be higher than all numbers before.
    pub(super) fn begin_delays(&mut self, place: usize) {
        self.normals.resize(place + DirectLinks::AT_ONCE, f64::NAN);
        self.at.resize(place + DirectLinks::AT_ONCE, Instant::MAX);
    }

    /// Returns the chain of delays of link `place`, one of those that [`begin_delays`](Self::begin_delays) began.
    #[inline]
    pub(super) fn delay(&mut self, place: usize) -> Chain<'_> {
        Chain { latest: &mut self.normals[place], at: &mut self.at[place], next: f64::NAN }
    }

    /// Returns the latest values of the chains of eight links from `first` on, and the instants of these values.
    #[inline(always)]
    pub(super) fn delays_from(&mut self, first: usize) -> Option<(&mut Eight<f64>, &mut Eight<Instant>)> {
        Some((eight_from(&mut self.normals, first)?, eight_from(&mut self.at, first)?))
    }

    /// Returns one bit for each of eight links from `first` on, set if the link is in the bad state.
    #[inline(always)]
    fn bad_from(&self, first: usize) -> u8 {
        // Eight bits from any link on lie in two neighbouring bytes.
        let [low, _] = (u16::from_le_bytes([self.bad[first / 8], self.bad[first / 8 + 1]]) >> (first % 8)).to_le_bytes();
        low
    }

    /// Toggles the state of the links with their bit set in `which`, from `first` on.
    #[inline(always)]
    fn change(&mut self, first: usize, which: u8) {
        let [low, high] = (u16::from(which) << (first % 8)).to_le_bytes();
        self.bad[first / 8] ^= low;
        self.bad[first / 8 + 1] ^= high;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Words on either side of the threshold, and the smallest and largest words.
    #[test]
    fn a_threshold_says_what_happens() {
        for number in [0.0, f64::MIN_POSITIVE, 1e-20, 0.01, 0.3, 0.5, 1.0 - f64::EPSILON / 2.0, 1.0] {
            let probability = Probability::new(number).unwrap();
            let threshold = threshold(probability);
            for upper in [0, 1, threshold.saturating_sub(1), threshold, threshold + 1, (1 << 53) - 1] {
                for word in [upper << 11, upper << 11 | 0x7ff] {
                    assert_eq!(is_below(word, threshold), probability.happens(word), "{number}, {word}");
                }
            }
        }
    }
}
