//! Arrivals on a link whose losses depend on each other: which sample is held, and the state of the losses at that sample.
//!
//! A chain gives each sample a state: the probability of its loss follows from its own state, and its state from that of the sample before. A sample that is
//! not lost takes a time of its own. Let b be the newest sample that has arrived, or the oldest one that may arrive yet if that is newer, and s the state of
//! b. Then (b, s) is a Markov chain, whatever overtakes what:
//!
//! - None of the samples after b has arrived. Given s, their states depend on nothing that happened to samples before b, because the chain of losses is a
//!   Markov chain. So the probabilities of what they do at a tick are those of their prior law, given that none of them has arrived.
//! - Where b may arrive yet, its hazard given s depends on nothing else either. That it may be taken in twice changes nothing.
//!
//! The probabilities of a tick come from a recursion forwards and backwards over the samples after b, as in hidden Markov models (Baum & Petrie 1966). A link
//! has as many states as the places of [`Hazards`] times those of its chain of losses: no memory of which samples under way are lost.

use super::arrivals::{Hazards, Outcome};
use super::law::LossChain;

/// A link with a chain of losses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bursts<'a, G> {
    pub(crate) hazards: &'a Hazards,
    pub(crate) chain: LossChain,
    /// The span between a sample and the sample before it \[s\].
    pub(crate) gap: G,
}

/// A sample at a tick: the states that it may come into, and what it does in each.
struct At {
    /// The probability of its state, in columns, after each state of the sample before, in rows.
    moves: Vec<Vec<f64>>,
    /// The probability that it has not arrived by the tick before, by its state.
    waiting: Vec<f64>,
    /// The probability that it arrives at the tick, by its state.
    arriving: Vec<f64>,
}

impl At {
    /// The probability that the sample has not arrived by the end of the tick, in a state.
    fn still_waiting(&self, state: usize) -> f64 {
        (self.waiting[state] - self.arriving[state]).max(0.0)
    }
}

impl<G: Fn(i64) -> f64> Bursts<'_, G> {
    /// Number of states of the link.
    pub(crate) fn states(&self) -> usize {
        self.hazards.places * self.chain.states()
    }

    fn at(&self, sample: i64, tick: usize) -> At {
        let states = self.chain.states();
        let (before, now) = self.hazards.arrived(sample, tick);
        let kept = |state: usize| 1.0 - self.chain.lost(state);
        At {
            moves: self.chain.moves((self.gap)(sample)),
            waiting: (0..states).map(|state| 1.0 - kept(state) * before).collect(),
            arriving: (0..states).map(|state| kept(state) * (now - before)).collect(),
        }
    }

    /// Returns what may happen at a tick, from every state that can be reached.
    pub(crate) fn outcomes(&self, tick: usize) -> Vec<Outcome> {
        let own = self.chain.states();
        let window = self.hazards.window(tick);
        // Samples beyond the newest wait for certain; the oldest of the next tick may be one of them.
        let last = window.newest.max(window.after);
        let samples: Vec<At> = (window.before..=last).map(|sample| self.at(sample, tick)).collect();
        let of = |sample: i64| &samples[usize::try_from(sample - window.before).unwrap_or(0)];
        // For each sample, the probability that no later one has arrived by the end of the tick, by its state.
        let mut silent = vec![vec![1.0; own]; samples.len()];
        for place in (1..samples.len()).rev() {
            let next = &samples[place];
            let later = silent[place].clone();
            silent[place - 1] = (0..own).map(|from| (0..own).map(|to| next.moves[from][to] * next.still_waiting(to) * later[to]).sum()).collect();
        }
        let silent = |sample: i64| &silent[usize::try_from(sample - window.before).unwrap_or(0)];
        // The state of the link when the newest sample is `held`, in each of its states with that probability, and no later one has arrived.
        let ends = |held: i64, law: &[f64]| -> Vec<(usize, f64)> {
            let mut law = law.to_vec();
            // A sample before the oldest that may arrive yet has no place: the state of the oldest stands for it.
            for sample in held + 1..=window.after {
                let next = of(sample);
                law = (0..own).map(|to| (0..own).map(|from| law[from] * next.moves[from][to]).sum::<f64>() * next.still_waiting(to)).collect();
            }
            let sample = held.max(window.after);
            let place = usize::try_from(sample - window.after).unwrap_or(0);
            (0..own).map(|state| (place * own + state, law[state] * silent(sample)[state])).filter(|(_, probability)| *probability > 0.0).collect()
        };
        let mut outcomes = Vec::new();
        for (base, state) in (0..window.places).flat_map(|place| (0..own).map(move |state| (place, state))) {
            let (from, base) = (base * own + state, window.before + i64::try_from(base).unwrap_or(i64::MAX));
            let certain: Vec<f64> = (0..own).map(|other| f64::from(u8::from(other == state))).collect();
            // States to which no newer sample comes; and, if that may be, states to which the oldest sample comes.
            let mut all: Vec<(usize, Option<i64>, f64)> = Vec::new();
            let taken = if base == window.before { of(base).arriving[state] / of(base).waiting[state].max(f64::MIN_POSITIVE) } else { 0.0 };
            for (to, probability) in ends(base, &certain) {
                all.extend([(to, Some(base), taken * probability), (to, None, (1.0 - taken) * probability)]);
            }
            let mut waiting = certain;
            for sample in base + 1..=window.newest {
                let next = of(sample);
                let law: Vec<f64> = (0..own).map(|to| (0..own).map(|from| waiting[from] * next.moves[from][to]).sum()).collect();
                let arrives: Vec<f64> = law.iter().zip(&next.arriving).map(|(law, arriving)| law * arriving).collect();
                all.extend(ends(sample, &arrives).into_iter().map(|(to, probability)| (to, Some(sample), probability)));
                waiting = law.iter().zip(&next.waiting).map(|(law, waiting)| law * waiting).collect();
            }
            // Given that none after `base` had arrived. A state in which one of them must have has no outcome.
            let given: f64 = all.iter().map(|(.., probability)| probability).sum();
            let certain = all.into_iter().filter(|(.., probability)| *probability > 0.0);
            outcomes.extend(certain.map(|(to, take, probability)| Outcome { from, to, take, probability: probability / given }));
        }
        outcomes
    }
}
