//! Fits models of losses: independent losses, or losses in bursts.
//!
//! Input is the packets (instant of sending, whether lost); output is all applicable models, the best first.
//!
//! | model | parameters | estimate |
//! | --- | --- | --- |
//! | independent | 1 | the share lost |
//! | Gilbert–Elliott with h = 0, k = 1 | 2 | p = n₀₁/n₀, r = n₁₀/n₁ from counted transitions (greatest likelihood; Gilbert 1960 calls the lossy state bad) |
//! | Gilbert–Elliott in continuous time, h = 0, k = 1 | 2 | greatest likelihood with the true gaps: P(bad, bad) = π + (1 − π)·e^{−λΔ}; for packets that are not evenly spaced |
//! | general Gilbert–Elliott | 4 | Baum–Welch (see `hidden_markov`); only where packets are evenly spaced |
//!
//! The model of the least Bayesian criterion, k·ln n − 2·ln L, is chosen. The general model must be better by 10 ("very strong", Kass & Raftery 1995, JASA
//! 90(430)), because its likelihood is flat and a bad fit easily looks good.

use serde::Serialize;

use super::hidden_markov;
use super::search::maximise;
use crate::series::{count, share_error};

/// Model of losses.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LossModel {
    /// No packet was lost.
    None,
    /// Each packet is lost with the same probability, independently of other packets.
    Independent {
        /// Probability of a loss.
        probability: f64,
    },
    /// Gilbert–Elliott chain with a step per packet. Parameters as in [`cohaptic_wan::GilbertElliott`].
    GilbertElliott {
        /// Probability of the transition from good to bad, per packet.
        p: f64,
        /// Probability of the transition from bad to good, per packet.
        r: f64,
        /// Probability of no loss in the bad state.
        h: f64,
        /// Probability of no loss in the good state.
        k: f64,
    },
    /// Gilbert–Elliott chain in continuous time: no losses in the good state, only losses in the bad state.
    GilbertElliottInTime {
        /// Mean time in the good state \[s\].
        mean_good_s: f64,
        /// Mean time in the bad state \[s\].
        mean_bad_s: f64,
    },
}

/// A model fitted to the losses.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct LossFit {
    /// Fitted model.
    pub model: LossModel,
    /// Standard errors of the first and the second parameter; `None` for models without a closed form. For a share p of n packets, √(p(1−p)/n), or more if
    /// needed for 1.96 standard errors to reach the farther end of Wilson's interval, which matters for few losses. Zero for a missing second parameter.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub standard_errors: Option<[f64; 2]>,
    /// Share of packets lost by the model in the long run.
    pub mean_loss: f64,
    /// ln L of the losses.
    pub log_likelihood: f64,
    /// Bayesian criterion; the least value is best.
    pub bic: f64,
}

/// Advantage needed by the general model over the others.
const CLEARLY: f64 = 10.0;

/// Fits all applicable models, and returns the chosen model first. `packets` are (instant of sending \[s\], whether lost); at least one packet is not lost.
pub(super) fn fit_all(packets: &[(f64, bool)], evenly_spaced: bool) -> Vec<LossFit> {
    let lost: Vec<bool> = packets.iter().map(|packet| packet.1).collect();
    let n = count(lost.len());
    let losses = count(lost.iter().filter(|lost| **lost).count());
    let share = losses / n;
    let judged = |model, parameters: f64, mean_loss, log_likelihood: f64, standard_errors| LossFit {
        model,
        standard_errors,
        mean_loss,
        log_likelihood,
        bic: parameters * n.ln() - 2.0 * log_likelihood,
    };
    if losses == 0.0 {
        return vec![judged(LossModel::None, 0.0, 0.0, 0.0, None)];
    }
    let independent = log_share(losses, n) + log_share(n - losses, n);
    let mut fits = vec![judged(LossModel::Independent { probability: share }, 1.0, share, independent, Some([error_of_share(losses, n), 0.0]))];
    if evenly_spaced {
        if let Some((p, r, standard_errors, log_likelihood)) = simple_gilbert(&lost) {
            let model = LossModel::GilbertElliott { p, r, h: 0.0, k: 1.0 };
            let simple = judged(model, 2.0, p / (p + r), log_likelihood, Some(standard_errors));
            fits.push(simple);
            let general = hidden_markov::fit(&lost, p, r);
            let model = LossModel::GilbertElliott { p: general.p, r: general.r, h: general.h, k: general.k };
            let mean_loss = ((1.0 - general.k) * general.r + (1.0 - general.h) * general.p) / (general.p + general.r);
            fits.push(judged(model, 4.0, mean_loss, general.log_likelihood, None));
        }
    } else if let Some((share, rate, log_likelihood)) = in_time(packets, share) {
        let model = LossModel::GilbertElliottInTime { mean_good_s: 1.0 / (share * rate), mean_bad_s: 1.0 / ((1.0 - share) * rate) };
        fits.push(judged(model, 2.0, share, log_likelihood, None));
    }
    let handicap = |fit: &LossFit| match fit.model {
        LossModel::GilbertElliott { h, k, .. } if h > 0.0 || k < 1.0 => CLEARLY,
        LossModel::None | LossModel::Independent { .. } | LossModel::GilbertElliott { .. } | LossModel::GilbertElliottInTime { .. } => 0.0,
    };
    fits.sort_by(|one, other| (one.bic + handicap(one)).total_cmp(&(other.bic + handicap(other))));
    fits
}

/// Returns `happened`·ln(`happened`/`of`), and 0 for no events.
fn log_share(happened: f64, of: f64) -> f64 {
    if happened > 0.0 { happened * (happened / of).ln() } else { 0.0 }
}

/// Returns the standard error of a share; both arguments are counts.
fn error_of_share(happened: f64, of: f64) -> f64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "counts")]
    let [happened, of] = [happened as u64, of as u64];
    share_error(happened, of)
}

/// Returns p, r, their standard errors and ln L of the simple chain. The first packet counts with the long-run share of its state. Returns `None` if the
/// chain never left one of its states.
fn simple_gilbert(lost: &[bool]) -> Option<(f64, f64, [f64; 2], f64)> {
    let mut counts = [[0_usize; 2]; 2];
    for step in lost.windows(2) {
        counts[usize::from(step[0])][usize::from(step[1])] += 1;
    }
    let [[stays_good, turns_bad], [turns_good, stays_bad]] = counts.map(|row| row.map(count));
    let (good, bad) = (stays_good + turns_bad, turns_good + stays_bad);
    if turns_bad == 0.0 || turns_good == 0.0 {
        return None;
    }
    let (p, r) = (turns_bad / good, turns_good / bad);
    let first = if lost[0] { p / (p + r) } else { r / (p + r) };
    let log_likelihood =
        first.ln() + log_share(stays_good, good) + log_share(turns_bad, good) + log_share(turns_good, bad) + log_share(stays_bad, bad);
    Some((p, r, [error_of_share(turns_bad, good), error_of_share(turns_good, bad)], log_likelihood))
}

/// Returns the share π of bad time, the rate λ = 1/(mean good) + 1/(mean bad) of forgetting \[1/s\], and ln L. Returns `None` if the state never changed.
fn in_time(packets: &[(f64, bool)], share: f64) -> Option<(f64, f64, f64)> {
    // Equal steps are counted once, which is faster for measurements with few different gaps.
    let mut steps: Vec<(f64, bool, bool)> = packets.windows(2).map(|step| (step[1].0 - step[0].0, step[0].1, step[1].1)).collect();
    if !steps.iter().any(|step| step.1 != step.2 && step.0 > 0.0) {
        return None;
    }
    steps.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)).then(one.2.cmp(&other.2)));
    let steps: Vec<(f64, bool, bool, f64)> =
        steps.chunk_by(|one, other| one == other).map(|equal| (equal[0].0, equal[0].1, equal[0].2, count(equal.len()))).collect();
    let first_lost = packets.first()?.1;
    let log_likelihood = |share: f64, rate: f64| {
        let of_step = |&(gap, before, after, times): &(f64, bool, bool, f64)| {
            let to_same = if after { share } else { 1.0 - share };
            let forgotten = -(-rate * gap).exp_m1();
            let probability = if before == after { 1.0 - forgotten * (1.0 - to_same) } else { forgotten * to_same };
            // In this model two packets of the same instant cannot have different fates. A small probability keeps ln L finite.
            times * probability.max(1e-12).ln()
        };
        (if first_lost { share } else { 1.0 - share }).ln() + steps.iter().map(of_step).sum::<f64>()
    };
    let span = packets.last()?.0 - packets.first()?.0;
    let least_gap = steps.iter().map(|step| step.0).find(|gap| *gap > 0.0)?;
    let mut share = share;
    let mut log_rate = 0.0;
    // The two parameters are nearly uncorrelated, so maximising in turn converges in a few rounds.
    for _ in 0..4 {
        log_rate = maximise((0.1 / span).ln(), (20.0 / least_gap).ln(), 40, |log_rate| log_likelihood(share, log_rate.exp()));
        let logit = (share / (1.0 - share)).ln();
        let found = maximise(logit - 2.0, logit + 2.0, 8, |logit| log_likelihood(1.0 / (1.0 + (-logit).exp()), log_rate.exp()));
        share = 1.0 / (1.0 + (-found).exp());
    }
    Some((share, log_rate.exp(), log_likelihood(share, log_rate.exp())))
}

#[cfg(test)]
mod tests;
