//! Arrivals on a link with dependent losses. The link's chain knows the number of the held sample, and the state of the losses at the held sample.
//!
//! A chain of losses gives each sample a state. The probability of a loss follows from the sample's own state, and this state from the state of the sample
//! before. The delays of arriving samples are independent. Let b be the newest arrived sample, or the oldest sample still under way if the latter is newer, and
//! s the state of b. Then (b, s) is a Markov chain, even if samples overtake each other:
//!
//! - No sample after b has arrived. Given s, the states of the samples after b do not depend on the history of samples before b, because the chain
//!   of losses is a Markov chain. So the probabilities of the arrivals at a tick follow from the prior law of these samples, given no arrival of any of these
//!   samples.
//! - If b may still arrive, the hazard of b given s depends on nothing else either. In this model b may be taken in twice, but the second time changes nothing.
//!
//! The probabilities of a tick come from a recursion forwards and backwards over the samples after b, as in hidden Markov models (Baum & Petrie 1966). The
//! number of states of a link is the number of places of [`Hazards`] times the number of states of the chain of losses. The states do not record the losses
//! among the samples under way.

use super::arrivals::{Hazards, Outcome};
use super::law::LossChain;

/// Random link with a chain of losses.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bursts<'a, G> {
    pub(crate) hazards: &'a Hazards,
    pub(crate) chain: LossChain,
    /// Function from the number of a sample to the span from the sending of the sample before to the sending of the sample \[s\].
    pub(crate) gap: G,
}

/// Probabilities of a sample at a tick.
struct At {
    /// Probability of each state of the sample, given the state of the sample before: `moves[state before][state]`.
    moves: Vec<Vec<f64>>,
    /// Probability of no arrival by the tick before, indexed by the state of the sample.
    waiting: Vec<f64>,
    /// Probability of an arrival at the tick, indexed by the state of the sample.
    arriving: Vec<f64>,
}

impl At {
    /// Returns the probability of no arrival by the end of the tick, given the state of the sample.
    fn still_waiting(&self, state: usize) -> f64 {
        (self.waiting[state] - self.arriving[state]).max(0.0)
    }
}

impl<G: Fn(i64) -> f64> Bursts<'_, G> {
    /// Returns the number of states of the link. State `place * own + state`, with `own` the number of states of the chain of losses.
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

    /// Returns the outcomes of a tick from every reachable state of the link.
    pub(crate) fn outcomes(&self, tick: usize) -> Vec<Outcome> {
        let own = self.chain.states();
        let window = self.hazards.window(tick);
        // Samples after `newest` cannot have arrived. Such samples are left out, except up to `after`: the end of the tick may need the state of `after`.
        let last = window.newest.max(window.after);
        let samples: Vec<At> = (window.before..=last).map(|sample| self.at(sample, tick)).collect();
        let of = |sample: i64| &samples[usize::try_from(sample - window.before).unwrap_or(0)];
        // Probability of no later arrival by the end of the tick, indexed by sample and by the state of the sample. Computed backwards, because
        // each entry needs the entry of the next sample.
        let mut silent = vec![vec![1.0; own]; samples.len()];
        for place in (1..samples.len()).rev() {
            let next = &samples[place];
            let later = silent[place].clone();
            silent[place - 1] = (0..own).map(|from| (0..own).map(|to| next.moves[from][to] * next.still_waiting(to) * later[to]).sum()).collect();
        }
        let silent = |sample: i64| &silent[usize::try_from(sample - window.before).unwrap_or(0)];
        // Returns the states of the link at the end of the tick with their probabilities, if `held` is the newest arrived sample. `law` is the
        // probability of each state of `held`.
        let ends = |held: i64, law: &[f64]| -> Vec<(usize, f64)> {
            let mut law = law.to_vec();
            // A held sample older than `after` has no own place. The state of `after`, still under way, stands for the held sample.
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
            // First the outcomes without a newer sample. Only the oldest sample may be the base of a place without having arrived, so only `window.before`
            // may be taken in again, with its hazard given its state.
            let mut all: Vec<(usize, Option<i64>, f64)> = Vec::new();
            let taken = if base == window.before { of(base).arriving[state] / of(base).waiting[state].max(f64::MIN_POSITIVE) } else { 0.0 };
            for (to, probability) in ends(base, &certain) {
                all.extend([(to, Some(base), taken * probability), (to, None, (1.0 - taken) * probability)]);
            }
            // Then the outcomes in which `sample` is the newest arrival. `waiting` is indexed by the state of the sample before `sample`: the joint probability
            // of the state and of no arrival, before this tick, of any sample from `base + 1` up to the sample before `sample`.
            let mut waiting = certain;
            for sample in base + 1..=window.newest {
                let next = of(sample);
                let law: Vec<f64> = (0..own).map(|to| (0..own).map(|from| waiting[from] * next.moves[from][to]).sum()).collect();
                let arrives: Vec<f64> = law.iter().zip(&next.arriving).map(|(law, arriving)| law * arriving).collect();
                all.extend(ends(sample, &arrives).into_iter().map(|(to, probability)| (to, Some(sample), probability)));
                waiting = law.iter().zip(&next.waiting).map(|(law, waiting)| law * waiting).collect();
            }
            // The condition is no arrival of a sample after `base` before this tick. A state in which the condition has probability zero is unreachable and has
            // no outcome.
            let given: f64 = all.iter().map(|(.., probability)| probability).sum();
            let certain = all.into_iter().filter(|(.., probability)| *probability > 0.0);
            outcomes.extend(certain.map(|(to, take, probability)| Outcome { from, to, take, probability: probability / given }));
        }
        outcomes
    }
}
