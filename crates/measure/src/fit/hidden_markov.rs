//! The general Gilbert–Elliott model: a hidden Markov chain of two states, fitted by Baum–Welch (Baum, Petrie, Soules & Weiss 1970; scaled as in Rabiner
//! 1989, Proceedings of the IEEE 77(2), section V.A).
//!
//! Input is the fates of packets in the order of sending; output is the four parameters. The state before the transition decides the loss of a packet, as
//! in [`cohaptic_wan::GilbertElliott`]. The first state has the stationary law of the chain.

/// A fitted chain.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct HiddenMarkov {
    /// Probability of the transition from good to bad, per packet.
    pub(super) p: f64,
    /// Probability of the transition from bad to good, per packet.
    pub(super) r: f64,
    /// Probability of no loss in the bad state, at most `k`.
    pub(super) h: f64,
    /// Probability of no loss in the good state.
    pub(super) k: f64,
    /// ln L of the chain.
    pub(super) log_likelihood: f64,
}

/// Largest number of rounds. The likelihood has flat ridges, on which more rounds change only the last digits.
const ROUNDS: usize = 400;
/// Gain of ln L in a round at which the climb ends.
const SETTLED: f64 = 1e-5;

/// Fits a chain from two starts: near the simple chain with the given p and r, and near a chain with half of both. Returns the more likely result.
pub(super) fn fit(lost: &[bool], p: f64, r: f64) -> HiddenMarkov {
    let within = |value: f64| value.clamp(1e-6, 0.9);
    let starts = [[within(p), within(r), 0.1, 0.999], [within(p / 2.0), within(r / 2.0), 0.5, 0.99]];
    let [one, other] = starts.map(|start| climb(lost, start));
    if one.log_likelihood >= other.log_likelihood { one } else { other }
}

/// Improves a chain by rounds of Baum–Welch.
fn climb(lost: &[bool], start: [f64; 4]) -> HiddenMarkov {
    let mut chain = start;
    let mut before = f64::NEG_INFINITY;
    let mut room = Vec::new();
    for _ in 0..ROUNDS {
        let (log_likelihood, next) = round(lost, chain, &mut room);
        if log_likelihood - before < SETTLED {
            break;
        }
        before = log_likelihood;
        chain = next;
    }
    let [p, r, h, k] = chain;
    let log_likelihood = log_likelihood(lost, chain);
    // The two states are interchangeable. The state with more losses is called bad.
    if h <= k { HiddenMarkov { p, r, h, k, log_likelihood } } else { HiddenMarkov { p: r, r: p, h: k, k: h, log_likelihood } }
}

/// Returns ln L of the chain p, r, h, k.
pub(super) fn log_likelihood(lost: &[bool], chain: [f64; 4]) -> f64 {
    forward(lost, chain, |_, _| {})
}

/// Runs the forward recursion and returns ln L. Calls `each` for every packet, with the probabilities of good and bad given all packets up to this one, and
/// with the scale.
fn forward(lost: &[bool], [p, r, h, k]: [f64; 4], mut each: impl FnMut([f64; 2], f64)) -> f64 {
    let mut state = [r / (p + r), p / (p + r)];
    let mut log_likelihood = 0.0;
    for &lost in lost {
        let [through_good, through_bad] = [k, h];
        let seen = if lost { [1.0 - through_good, 1.0 - through_bad] } else { [through_good, through_bad] };
        let joint = [state[0] * seen[0], state[1] * seen[1]];
        // The lower bound lets an impossible observation cost a very small likelihood instead of dividing by zero.
        let scale = (joint[0] + joint[1]).max(f64::MIN_POSITIVE);
        let given = [joint[0] / scale, joint[1] / scale];
        log_likelihood += scale.ln();
        each(given, scale);
        state = [given[0] * (1.0 - p) + given[1] * r, given[0] * p + given[1] * (1.0 - r)];
    }
    log_likelihood
}

/// Runs a round of Baum–Welch. Returns ln L of `chain`, and the improved chain. `room` is a buffer, reused between rounds.
fn round(lost: &[bool], chain: [f64; 4], room: &mut Vec<([f64; 2], f64)>) -> (f64, [f64; 4]) {
    let [p, r, h, k] = chain;
    room.clear();
    let log_likelihood = forward(lost, chain, |given, scale| room.push((given, scale)));
    // Expected counts by state: packets, packets with a follower, packets not lost, and transitions to the other state.
    let (mut in_state, mut followed, mut through, mut moves) = ([0.0; 2], [0.0; 2], [0.0; 2], [0.0; 2]);
    let mut beta = [1.0; 2];
    for (i, &is_lost) in lost.iter().enumerate().rev() {
        let (given, _) = room[i];
        // Scaling makes forward and backward probabilities multiply to the posterior without division.
        let posterior = [given[0] * beta[0], given[1] * beta[1]];
        let is_last = i + 1 == lost.len();
        for s in 0..2 {
            in_state[s] += posterior[s];
            followed[s] += if is_last { 0.0 } else { posterior[s] };
            through[s] += if is_lost { 0.0 } else { posterior[s] };
        }
        let Some(previous) = i.checked_sub(1) else { break };
        let scale = room[i].1;
        let seen = if is_lost { [1.0 - k, 1.0 - h] } else { [k, h] };
        let ahead = [seen[0] * beta[0] / scale, seen[1] * beta[1] / scale];
        let before = room[previous].0;
        moves[0] += before[0] * p * ahead[1];
        moves[1] += before[1] * r * ahead[0];
        beta = [(1.0 - p) * ahead[0] + p * ahead[1], (1.0 - r) * ahead[1] + r * ahead[0]];
    }
    // The bounds keep parameters from 0 and 1: a parameter there could never change again, and the chain could lack a stationary law.
    let share = |part: f64, whole: f64, old: f64| if whole > 0.0 { (part / whole).clamp(1e-9, 1.0 - 1e-9) } else { old };
    let next =
        [share(moves[0], followed[0], p), share(moves[1], followed[1], r), share(through[1], in_state[1], h), share(through[0], in_state[0], k)];
    (log_likelihood, next)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::TestRng;

    /// Returns the likelihood by a sum over all sequences of states.
    fn brute_force(lost: &[bool], [p, r, h, k]: [f64; 4]) -> f64 {
        let sequences = 0..1_u32 << lost.len();
        let probability = |sequence: u32| {
            let bad = |i: usize| sequence >> i & 1 == 1;
            let first = if bad(0) { p / (p + r) } else { r / (p + r) };
            let moves = (1..lost.len()).map(|i| match (bad(i - 1), bad(i)) {
                (false, false) => 1.0 - p,
                (false, true) => p,
                (true, false) => r,
                (true, true) => 1.0 - r,
            });
            let seen = lost.iter().enumerate().map(|(i, lost)| {
                let through = if bad(i) { h } else { k };
                if *lost { 1.0 - through } else { through }
            });
            first * moves.product::<f64>() * seen.product::<f64>()
        };
        sequences.map(probability).sum::<f64>().ln()
    }

    #[test]
    fn the_likelihood_is_the_sum_over_all_sequences_of_states() {
        let lost = [false, true, true, false, false, false, true, false, true, true];
        let chain = [0.1, 0.3, 0.4, 0.95];
        assert!((log_likelihood(&lost, chain) - brute_force(&lost, chain)).abs() < 1e-12);
    }

    #[test]
    fn a_round_never_makes_the_data_less_likely() {
        // Baum's theorem holds for a given law of the first state. The stationary law changes with the chain, which lowers the likelihood at most by the
        // ratio of the two laws.
        let mut rng = TestRng::new(2);
        let lost: Vec<bool> = (0..500).map(|i| rng.unit() < if i % 50 < 10 { 0.6 } else { 0.02 }).collect();
        let mut chain = [0.2, 0.2, 0.4, 0.9];
        let mut before = f64::NEG_INFINITY;
        for _ in 0..50 {
            let (log_likelihood, next) = round(&lost, chain, &mut Vec::new());
            assert!(log_likelihood > before - 1e-9, "{log_likelihood} {before}");
            let first = |[p, r, ..]: [f64; 4]| [r / (p + r), p / (p + r)];
            let [was, is] = [first(chain), first(next)];
            before = log_likelihood + (is[0] / was[0]).min(is[1] / was[1]).ln();
            chain = next;
        }
    }
}
