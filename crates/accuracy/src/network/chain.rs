//! Theory of averages over a Markov chain: their long-run variance, and so the expected error for a number of packets.

/// A Markov chain of loss: transitions between states per packet, and the states in which packets are lost.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct LossChain {
    /// Transition probabilities per packet, from the state of the row to the state of the column.
    pub(super) transitions: Vec<Vec<f64>>,
    /// Long-run fraction of packets in each state.
    pub(super) stationary: Vec<f64>,
    /// `true` if packets are lost, for each state.
    pub(super) lost: Vec<bool>,
}

/// Expected averages over packets, and the variance of the averages of one run.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Expected {
    /// Fraction of lost packets.
    pub(super) mean: f64,
    /// Mean number of consecutive losses.
    pub(super) run: f64,
    /// Asymptotic variance of the fraction lost per packet, relative to the squared fraction. For n packets, this number is divided by n.
    pub(super) mean_variance: f64,
    /// Asymptotic variance of the mean run of losses per packet, relative to the squared mean.
    pub(super) run_variance: f64,
}

impl LossChain {
    /// Returns a chain of two states, of which the second is loss. Arguments are the probabilities of a loss after a received packet and after a lost packet.
    pub(super) fn of_two(after_received: f64, after_lost: f64) -> Self {
        let lost = after_received / (1.0 - after_lost + after_received);
        Self {
            transitions: vec![vec![1.0 - after_received, after_received], vec![1.0 - after_lost, after_lost]],
            stationary: vec![1.0 - lost, lost],
            lost: vec![false, true],
        }
    }

    /// Computes the averages and their variances. The number of losses L and the number of their beginnings S are sums along the chain of pairs of successive
    /// states. The fraction lost is L/n and the mean run L/S. To first order the relative error of the mean run is the error of L/ℓ − S/s, divided by n, with
    /// the fractions ℓ and s.
    pub(super) fn expected(&self) -> Expected {
        let states = self.stationary.len();
        let pairs: Vec<(usize, usize)> = (0..states).flat_map(|from| (0..states).map(move |to| (from, to))).collect();
        let weights: Vec<f64> = pairs.iter().map(|(from, to)| self.stationary[*from] * self.transitions[*from][*to]).collect();
        let over = |of: &dyn Fn(usize, usize) -> bool| pairs.iter().map(|(from, to)| f64::from(u8::from(of(*from, *to)))).collect::<Vec<f64>>();
        let losses = over(&|_, to| self.lost[to]);
        // A run of losses begins with a lost packet after a received packet.
        let begins = over(&|from, to| self.lost[to] && !self.lost[from]);
        let average = |values: &[f64]| values.iter().zip(&weights).map(|(value, weight)| value * weight).sum::<f64>();
        let (mean, share) = (average(&losses), average(&begins));
        // First-order expansion of L/S around the fractions ℓ and s.
        let ratio: Vec<f64> = losses.iter().zip(&begins).map(|(loss, begin)| loss / mean - begin / share).collect();
        let scaled: Vec<f64> = losses.iter().map(|loss| loss / mean).collect();
        let variance = |values: &[f64]| self.long_run_variance(&pairs, &weights, values, average(values));
        Expected { mean, run: mean / share, mean_variance: variance(&scaled), run_variance: variance(&ratio) }
    }

    /// Returns Var + 2·Σ covariances at lags 1, 2, …, summed until the terms are negligible.
    fn long_run_variance(&self, pairs: &[(usize, usize)], weights: &[f64], values: &[f64], mean: f64) -> f64 {
        let centred: Vec<f64> = values.iter().map(|value| value - mean).collect();
        let covariance = |ahead: &[f64]| centred.iter().zip(ahead).zip(weights).map(|((value, ahead), weight)| value * ahead * weight).sum::<f64>();
        let variance = covariance(&centred);
        let (mut sum, mut ahead) = (variance, centred.clone());
        for _ in 0..100_000 {
            // `ahead` becomes the expected value one packet later, for each pair of states.
            ahead = pairs
                .iter()
                .map(|(_, now)| {
                    pairs.iter().zip(&ahead).filter(|((from, _), _)| from == now).map(|((_, to), value)| self.transitions[*now][*to] * value).sum()
                })
                .collect();
            let term = 2.0 * covariance(&ahead);
            sum += term;
            // The chain forgets its state exponentially, so later covariances are below rounding.
            if ahead.iter().all(|value| value.abs() < 1e-14) {
                break;
            }
        }
        sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For independent losses the relative variance of the mean is (1 − p)/p. Runs of losses are geometric with mean 1/(1 − p). There are n·p·(1 − p) runs,
    /// each with relative variance p, which gives p/(p·(1 − p)) = 1/(1 − p).
    #[test]
    fn independent_losses_have_the_variances_of_binomial_and_geometric_laws() {
        let p = 0.05;
        let expected = LossChain::of_two(p, p).expected();
        assert!((expected.mean - p).abs() < 1e-15 && (expected.run - 1.0 / (1.0 - p)).abs() < 1e-14);
        assert!((expected.mean_variance - (1.0 - p) / p).abs() < 1e-11);
        assert!((expected.run_variance - 1.0 / (1.0 - p)).abs() < 1e-11);
    }

    /// With autocorrelation ρ at lag one, the variance of the mean is the variance of independent losses times (1 + ρ)/(1 − ρ).
    #[test]
    fn correlated_losses_have_bartletts_variance() {
        let (p, rho) = (0.1, 0.6);
        let expected = LossChain::of_two(p * (1.0 - rho), p + rho * (1.0 - p)).expected();
        assert!((expected.mean - p).abs() < 1e-15);
        assert!((expected.run - 1.0 / ((1.0 - rho) * (1.0 - p))).abs() < 1e-12);
        assert!((expected.mean_variance - (1.0 - p) / p * (1.0 + rho) / (1.0 - rho)).abs() < 1e-10);
    }
}
