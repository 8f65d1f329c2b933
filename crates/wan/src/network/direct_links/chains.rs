//! Links whose delays follow those before, eight at a time: each step for all of them before the next, in registers as far as it is the same for all.
//!
//! Most delays come by fewer terms of their series than one alone would need.

use alloc::vec::Vec;

use cohaptic_units::{Instant, Probability};

use super::kind::{Losses, Verdict};
use super::{Arrivals, DirectLinks, LinkState};
use crate::laws::delay::GammaCubics;
use crate::line::direct::Words;
use crate::random::PacketDraws;
use crate::stages::delay::CorrelatedDelays;
use crate::stages::loss::GilbertElliottState;

/// What links of a kind do that remember the state of their losses and the normal number behind their latest delay, and no more.
#[derive(Clone, Debug)]
pub(super) struct Chains {
    /// In each state below which number the word of a packet, without its lowest 11 bits, makes its link leave that state.
    leaves: [u64; 2],
    /// In each state below which number it says that the packet is lost.
    loses: [u64; 2],
    delays: CorrelatedDelays,
    cubics: GammaCubics,
}

/// What such links remember, by link; behind the last are some that are none, so that eight can be looked at from any.
#[derive(Clone, Debug)]
pub(super) struct ChainStates {
    /// The latest value of the chain of delays, NaN before the first packet.
    normals: Vec<f64>,
    /// A bit for each link that is bad.
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
        Some(Self { leaves: leaves.map(threshold), loses: loses.map(threshold), delays: delays.clone(), cubics: delays.cubics()? })
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
        let state = usize::from(states.bad_from(place) & 1);
        states.change(place, u8::from(is_below(loss_word, self.leaves[state])));
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
        states.change(first, leave & !excluded);
        let Some(normals) = states.normals_from(first) else { return };
        let following = self.delays.following(normals, &jitter_words);
        let nanos = self.cubics.nanos(&following);
        let (mut bit, mut arrive, mut overtake, mut slow) = (1_u8, 0, 0, 0);
        for place in 0..links.len().min(DirectLinks::AT_ONCE) {
            let link = &mut links[place];
            if excluded & bit == 0 {
                link.offered += 1;
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

    /// Those packets arrive after delays that take longer. Not in the loop over all, which would look up all that it knows after each call.
    #[cold]
    #[inline(never)]
    fn offer_slowly(
        &self,
        (links, normals): (&mut [LinkState], &mut [f64; DirectLinks::AT_ONCE]),
        (now, until): (Instant, Instant),
        slow: u8,
        arrivals: &mut Arrivals,
    ) {
        for (place, link) in links.iter_mut().enumerate().filter(|(place, _)| slow >> place & 1 == 1) {
            let packet = link.draws.packet(arrivals.sequences[place]);
            let [_, word] = packet.loss_and_jitter();
            let at = now.saturating_add_nanos(self.delays.draw_nanos(&mut normals[place], word, packet));
            arrivals.at[place] = at;
            arrivals.arrive |= 1 << place;
            arrivals.overtake |= u8::from(link.count_arrival(now, until, at)) << place;
        }
    }
}

impl ChainStates {
    pub(super) const fn new() -> Self {
        Self { normals: Vec::new(), bad: Vec::new() }
    }

    /// The state in which the link in that place begins, which is behind all others.
    pub(super) fn begin(&mut self, place: usize, state: GilbertElliottState) {
        self.normals.resize(place + DirectLinks::AT_ONCE, f64::NAN);
        self.bad.resize(place / 8 + 2, 0);
        self.change(place, u8::from(state == GilbertElliottState::Bad));
    }

    /// The latest values of eight chains.
    #[inline(always)]
    fn normals_from(&mut self, first: usize) -> Option<&mut [f64; DirectLinks::AT_ONCE]> {
        self.normals.get_mut(first..)?.first_chunk_mut()
    }

    /// Which of eight links are bad.
    #[inline(always)]
    fn bad_from(&self, first: usize) -> u8 {
        let [low, _] = (u16::from_le_bytes([self.bad[first / 8], self.bad[first / 8 + 1]]) >> (first % 8)).to_le_bytes();
        low
    }

    /// Those of eight links change their states.
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
