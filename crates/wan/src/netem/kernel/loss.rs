//! The kernel's loss models.

use super::correlated::Correlated;
use super::prng::{Prng, Unseeded};
use crate::netem::{GemodelSpec, LossSpec, Percent, StateSpec};

/// A loss model and its current state.
#[derive(Clone, Debug)]
pub(super) enum LossModel {
    Random { probability: u32, sequence: Correlated },
    FourState { chain: FourState, state: State },
    GilbertElliott { chain: GilbertElliott, bad: bool },
}

/// State of the four-state chain: the fate of the packet of the chain's latest move.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum State {
    /// State 1.
    ReceivedInGap,
    /// State 2.
    ReceivedInBurst,
    /// State 3.
    LostInBurst,
    /// State 4.
    LostAlone,
}

/// Probabilities of the four-state chain, in 1/2³².
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct FourState {
    pub(super) p13: u32,
    pub(super) p31: u32,
    pub(super) p32: u32,
    pub(super) p23: u32,
    pub(super) p14: u32,
}

impl FourState {
    pub(super) fn new(said: &StateSpec) -> Self {
        let or_zero = |percent: Option<Percent>| percent.map_or(0, Percent::as_u32);
        Self {
            p13: said.p13.as_u32(),
            p31: said.p31.map_or_else(|| said.p13.complement_as_u32(), Percent::as_u32),
            p32: or_zero(said.p32),
            p23: said.p23.map_or(u32::MAX, Percent::as_u32),
            p14: or_zero(said.p14),
        }
    }

    /// Moves the chain by one packet, and returns whether the packet is lost: whether the new state is a loss, except at bounds.
    ///
    /// A draw equal to a bound belongs to neither side: the state stays, and the packet passes, in state 3 too. Sums of probabilities wrap around at 2³²:
    /// two probabilities with the sum 1, both rounded up, switch each other off.
    fn loses(&self, state: &mut State, random: u32) -> bool {
        let next = match *state {
            State::ReceivedInGap => {
                let both = self.p13.wrapping_add(self.p14);
                if random < self.p14 {
                    Some(State::LostAlone)
                } else if random > self.p14 && random < both {
                    Some(State::LostInBurst)
                } else {
                    Some(State::ReceivedInGap)
                }
            }
            State::ReceivedInBurst if random < self.p23 => Some(State::LostInBurst),
            State::ReceivedInBurst => Some(State::ReceivedInBurst),
            State::LostInBurst => {
                let both = self.p31.wrapping_add(self.p32);
                if random < self.p32 {
                    Some(State::ReceivedInBurst)
                } else if random > self.p32 && random < both {
                    Some(State::ReceivedInGap)
                } else if random > both {
                    Some(State::LostInBurst)
                } else {
                    None
                }
            }
            // A single loss is followed by a reception, whatever the draw.
            State::LostAlone => Some(State::ReceivedInGap),
        };
        let Some(next) = next else { return false };
        *state = next;
        matches!(next, State::LostInBurst | State::LostAlone)
    }
}

/// Probabilities of the Gilbert–Elliott chain, in 1/2³².
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct GilbertElliott {
    pub(super) p: u32,
    pub(super) r: u32,
    /// Probability that a packet passes in the bad state.
    pub(super) h: u32,
    /// Probability that a packet is lost in the good state, 1 − k.
    pub(super) k1: u32,
}

impl GilbertElliott {
    pub(super) fn new(said: &GemodelSpec) -> Self {
        Self {
            p: said.p.as_u32(),
            r: said.r.map_or_else(|| said.p.complement_as_u32(), Percent::as_u32),
            // The words give the share lost in the bad state, and the kernel holds the share received.
            h: said.loss_in_bad.map_or(0, |loss| u32::MAX - loss.as_u32()),
            k1: said.loss_in_good.map_or(0, Percent::as_u32),
        }
    }

    /// Decides about a packet by two draws: one for the transition, then one for the loss, with the probability of the state before the transition.
    fn loses(&self, bad: &mut bool, prng: &mut Prng) -> bool {
        let (transition, loss) = (prng.next_u32(), prng.next_u32());
        if *bad {
            *bad = transition >= self.r;
            loss > self.h
        } else {
            *bad = transition < self.p;
            loss < self.k1
        }
    }
}

impl LossModel {
    /// Makes the model in its initial state: state 1 of the four-state chain, or the good state.
    pub(super) fn new(said: Option<&LossSpec>, unseeded: &mut Unseeded) -> Self {
        match said {
            // The sequence draws its first value even without a loss, so later sequences are the same with and without a random loss.
            None => Self::Random { probability: 0, sequence: Correlated::new(0, unseeded) },
            Some(LossSpec::Random(chance)) => Self::Random {
                probability: chance.percent.as_u32(),
                sequence: Correlated::new(chance.correlation.map_or(0, Percent::as_u32), unseeded),
            },
            Some(LossSpec::State(said)) => Self::FourState { chain: FourState::new(said), state: State::ReceivedInGap },
            Some(LossSpec::Gemodel(said)) => Self::GilbertElliott { chain: GilbertElliott::new(said), bad: false },
        }
    }

    /// Returns whether the next packet is lost.
    pub(super) fn loses(&mut self, prng: &mut Prng) -> bool {
        match self {
            Self::Random { probability, sequence } => sequence.happens(*probability, prng),
            Self::FourState { chain, state } => chain.loses(state, prng.next_u32()),
            Self::GilbertElliott { chain, bad } => chain.loses(bad, prng),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::netem::Netem;

    fn four_state(words: &str) -> FourState {
        match Netem::parse(words).unwrap().loss {
            Some(LossSpec::State(said)) => FourState::new(&said),
            other => panic!("{other:?}"),
        }
    }

    fn gilbert_elliott(words: &str) -> GilbertElliott {
        match Netem::parse(words).unwrap().loss {
            Some(LossSpec::Gemodel(said)) => GilbertElliott::new(&said),
            other => panic!("{other:?}"),
        }
    }

    /// Numbers recorded from the messages of tc of iproute2 6.1 to a kernel.
    #[test]
    fn chains_have_the_numbers_that_tc_sends() {
        let [p13, p31, p32, p23, p14] = [0x028f_5c29, 0x051e_b852, 0x07ae_147b, 0x0a3d_70a4, 0x0ccc_cccd];
        let said = FourState { p13, p31, p32, p23: p14.min(0x0a3d_70a4), p14 };
        assert_eq!(four_state("loss state 1% 2% 3% 4% 5%"), FourState { p23, ..said });
        assert_eq!(four_state("loss state 12.3%"), FourState { p13: 0x1f7c_ed91, p31: 0xe083_126e, p32: 0, p23: u32::MAX, p14: 0 });
        assert_eq!(four_state("loss state 10%").p31, 0xe666_6666);
        let said = GilbertElliott { p: 0x028f_5c29, r: 0x1999_999a, h: 0x4ccc_cccd, k1: 0x0041_8937 };
        assert_eq!(gilbert_elliott("loss gemodel 1% 10% 70% 0.1%"), said);
        assert_eq!(gilbert_elliott("loss gemodel 10%"), GilbertElliott { p: 0x1999_999a, r: 0xe666_6666, h: 0, k1: 0 });
        assert_eq!(gilbert_elliott("loss gemodel 1% 1% 10%").h, 0xe666_6665);
    }

    #[test]
    fn a_draw_on_a_bound_moves_nothing_and_loses_nothing() {
        let chain = FourState { p13: 10, p31: 10, p32: 10, p23: 10, p14: 10 };
        let mut state = State::LostInBurst;
        for random in [10, 20] {
            assert!(!chain.loses(&mut state, random));
            assert_eq!(state, State::LostInBurst);
        }
        assert!(chain.loses(&mut state, 21));
        let mut state = State::ReceivedInGap;
        assert!(!chain.loses(&mut state, 10) && chain.loses(&mut state, 9));
        assert_eq!(state, State::LostAlone);
    }

    /// The first draws of seed 1 are 0.064, 0.0044, 0.54 and 0.0022: transition, loss, transition, loss.
    #[test]
    fn the_transition_is_drawn_first_and_the_loss_with_the_state_before_it() {
        let (mut prng, mut bad) = (Prng::new(1), false);
        assert!(gilbert_elliott("loss gemodel 1% 60% 50% 1%").loses(&mut bad, &mut prng), "0.0044 loses at 1 %");
        assert!(!bad, "0.064 stays at 1 %");
        assert!(!gilbert_elliott("loss gemodel 60% 60% 100% 0%").loses(&mut bad, &mut prng), "nothing is lost in the good state");
        assert!(bad, "0.54 goes at 60 %");
        assert!(gilbert_elliott("loss gemodel 60% 100% 100% 0%").loses(&mut bad, &mut prng), "everything is lost in the bad state");
        assert!(!bad);
    }

    #[test]
    fn two_halves_that_round_up_switch_the_burst_off() {
        let chain = four_state("loss state 50% 50% 0% 100% 50%");
        assert_eq!(chain.p13.wrapping_add(chain.p14), 0);
        let mut prng = Prng::new(1);
        let mut state = State::ReceivedInGap;
        for _ in 0..10_000 {
            chain.loses(&mut state, prng.next_u32());
            assert_ne!(state, State::LostInBurst);
        }
    }
}
