//! Links whose delays follow those before, eight at a time: each step for all of them before the next, in registers as far as it is the same for all.
//!
//! A packet of a link with correlated gamma delays and bursts of loss takes 60 instructions less than one by one.

use alloc::vec::Vec;

use cohaptic_units::{Instant, Probability};

use super::kind::{Losses, Verdict};
use super::{Arrivals, DirectLinks, LinkState, draw};
use crate::line::direct::Words;
use crate::random::PacketDraws;
use crate::stages::delay::{CorrelatedDelays, QuickDelays, whole};
use crate::stages::loss::GilbertElliottState;

/// What links of a kind do that remember the state of their losses and the normal number behind their latest delay, and no more.
#[derive(Clone, Debug)]
pub(super) struct Chains {
    /// In each state below which number the word of a packet, without its lowest 11 bits, makes its link leave that state.
    leaves: [u64; 2],
    /// In each state below which number it says that the packet is lost.
    loses: [u64; 2],
    delays: CorrelatedDelays,
}

/// What such links remember, by link; behind the last are some that are none, so that eight can be looked at from any.
#[derive(Clone, Debug)]
pub(super) struct ChainStates {
    /// The latest value of the chain of delays, NaN before the first packet.
    normals: Vec<f64>,
    /// 1 where the link is bad, else 0.
    bad: Vec<u8>,
}

/// The least whole number n such that an event of that probability happens if the upper 53 bits of its word are below n.
fn threshold(probability: Probability) -> u64 {
    const TWO_POW_53: f64 = 9_007_199_254_740_992.0;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number from 0 to 2^53")]
    let threshold = libm::ceil(probability.get() * TWO_POW_53) as u64;
    threshold
}

#[inline(always)]
const fn is_below(word: u64, threshold: u64) -> bool {
    word >> 11 < threshold
}

impl Chains {
    /// `None` if losses look at further words, or delays are of a law that does not come eight at a time.
    pub(super) fn new(losses: &Losses, delays: &CorrelatedDelays) -> Option<Self> {
        let (leaves, loses) = match losses {
            Losses::None => ([Probability::ZERO; 2], [Probability::ZERO; 2]),
            Losses::Independent(probability) => ([Probability::ZERO; 2], [*probability; 2]),
            Losses::GilbertElliott(chain) => {
                let certain = [chain.k, chain.h].map(|gets_through| {
                    let all_or_none = [(Probability::ONE, Probability::ZERO), (Probability::ZERO, Probability::ONE)];
                    all_or_none.into_iter().find(|(passes, _)| *passes == gets_through).map(|(_, lost)| lost)
                });
                ([chain.p, chain.r], [certain[0]?, certain[1]?])
            }
        };
        delays.come_quickly().then(|| Self { leaves: leaves.map(threshold), loses: loses.map(threshold), delays: delays.clone() })
    }

    /// What becomes of a packet of the link in that place.
    pub(super) fn verdict(
        &self,
        now: Instant,
        states: &mut ChainStates,
        place: usize,
        [loss_word, jitter_word]: Words,
        packet: PacketDraws,
    ) -> Verdict {
        let bad = &mut states.bad[place];
        let state = usize::from(*bad & 1);
        *bad ^= u8::from(is_below(loss_word, self.leaves[state]));
        if is_below(loss_word, self.loses[state]) {
            return Verdict::Lost;
        }
        Verdict::Arrives(now.saturating_add_nanos(self.delays.draw_nanos(&mut states.normals[place], jitter_word, packet)))
    }

    /// Offers a packet to neighbouring links, of which `first` is the first, but for those whose bit is set in `excluded`.
    #[inline(always)]
    pub(super) fn offer(
        &self,
        (links, states, first): (&mut [LinkState], &mut ChainStates, usize),
        (now, until): (Instant, Instant),
        excluded: u8,
        arrivals: &mut Arrivals,
    ) {
        let words = draw(true, links, &mut arrivals.sequences);
        let Some((normals, bad)) = states.from(first) else { return };
        // Those that are none keep their state too, which is that of a link that is yet to be added.
        #[expect(clippy::cast_possible_truncation, reason = "the bits of eight links")]
        let excluded = excluded | (0xff_u16 << links.len()) as u8;
        let mut lost = 0;
        for (place, [word, _]) in words.into_iter().enumerate() {
            let state = usize::from(bad[place] & 1);
            lost |= u8::from(is_below(word, self.loses[state])) << place;
            bad[place] ^= u8::from(is_below(word, self.leaves[state])) & !(excluded >> place & 1);
        }
        let mut jitter_words = [0; DirectLinks::AT_ONCE];
        for (jitter_word, [_, word]) in jitter_words.iter_mut().zip(&words) {
            *jitter_word = *word;
        }
        let QuickDelays { chain, nanos } = self.delays.quickly(normals, &jitter_words);
        let (mut bit, mut arrive, mut overtake) = (1, 0, 0);
        for (place, link) in links.iter_mut().enumerate() {
            if excluded & bit == 0 {
                let number = link.offered;
                link.offered += 1;
                if lost & bit == 0 {
                    let delay = match whole(nanos[place]) {
                        Some(delay) => {
                            normals[place] = chain[place];
                            delay
                        }
                        None => self.slowly(&mut normals[place], words[place][1], link.draws.packet(number)),
                    };
                    let at = now.saturating_add_nanos(delay);
                    arrivals.at[place] = at;
                    arrive |= bit;
                    overtake |= if link.count_arrival(now, until, at) { bit } else { 0 };
                } else {
                    link.lost += 1;
                }
            }
            bit = bit.wrapping_shl(1);
        }
        (arrivals.arrive, arrivals.overtake) = (arrive, overtake);
    }

    #[cold]
    #[inline(never)]
    fn slowly(&self, chain: &mut f64, word: u64, packet: PacketDraws) -> u64 {
        self.delays.draw_nanos(chain, word, packet)
    }
}

impl ChainStates {
    pub(super) const fn new() -> Self {
        Self { normals: Vec::new(), bad: Vec::new() }
    }

    /// The state in which the link in that place begins, which is behind all others.
    pub(super) fn begin(&mut self, place: usize, state: GilbertElliottState) {
        self.normals.resize(place + DirectLinks::AT_ONCE, f64::NAN);
        self.bad.resize(place + DirectLinks::AT_ONCE, 0);
        self.bad[place] = u8::from(state == GilbertElliottState::Bad);
    }

    /// Those of eight links.
    #[inline(always)]
    fn from(&mut self, first: usize) -> Option<(&mut [f64; DirectLinks::AT_ONCE], &mut [u8; DirectLinks::AT_ONCE])> {
        Some((self.normals.get_mut(first..)?.first_chunk_mut()?, self.bad.get_mut(first..)?.first_chunk_mut()?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At the words on either side of the threshold, and at both ends.
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
