//! Test of independent delays: the rank correlations of neighbours and of packets farther apart.
//!
//! Input is the delays in the order of sending, with gaps for lost packets, or the innovations that a correlation time leaves of them; output is an
//! [`Independence`]. Ranks serve in place of delays, so that the test does not depend on the law, and one absurd delay moves nothing. With the correlation rₖ of
//! the ranks over the nₖ pairs of arrived packets that are k packets apart,
//!
//! ```text
//! r₁ ± 1/√n₁          Q = Σ nₖ·rₖ² over the lags k = 1 … K, of χ² with K degrees of freedom for independent delays
//! ```
//!
//! (Ljung & Box 1978, Biometrika 65(2), with ranks as in Dufour & Roy 1986, Communications in Statistics 15(10)). Unlike the [correlation time], the test needs no
//! model of the memory, and so also sees a memory that no single correlation time describes.
//!
//! [correlation time]: super::CorrelationFit

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::law::normal_quantile;
use crate::series::{correlation_of_pairs, count};

/// Result of the test of independent delays.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Independence {
    /// Rank correlation (Spearman's) of neighbouring packets that both arrived.
    pub neighbours: f64,
    /// Standard error of `neighbours` for independent delays: 1/√(number of pairs).
    pub neighbours_se: f64,
    /// Number K of lags of the statistic, each from 1 packet apart on with a pair of arrived packets.
    pub lags: usize,
    /// The statistic Q.
    pub statistic: f64,
    /// Probability of a larger Q for independent delays.
    pub p_value: f64,
}

/// Largest number of lags.
const LAGS: usize = 20;
/// Level of each of the two parts of the test. Independent delays are called dependent at most once in a hundred measurements.
const LEVEL: f64 = 0.005;

impl Independence {
    /// Returns whether the delays may be independent: neither neighbours nor the statistic of all lags say otherwise.
    #[must_use]
    pub fn holds(&self) -> bool {
        self.neighbours.abs() <= normal_quantile(1.0 - LEVEL / 2.0) * self.neighbours_se && self.p_value >= LEVEL
    }
}

/// Tests delays in the order of sending, `None` for a lost packet. Returns `None` if no two neighbours arrived, or if all delays are equal.
pub(super) fn test(delays: &[Option<f64>]) -> Option<Independence> {
    let ranks = ranks(delays)?;
    // A quarter of the packets at most: the law of Q needs many more pairs than lags.
    let lags = LAGS.min(ranks.len() / 4).max(1);
    let (neighbours, pairs) = correlation_of_pairs(&ranks, 1.0, 1)?;
    let found = (1..=lags).filter_map(|lag| correlation_of_pairs(&ranks, 1.0, lag));
    // Lags without a pair, as where every second packet is lost, are no terms of the sum.
    let (terms, statistic) = found.fold((0, 0.0), |(terms, sum), (r, pairs)| (terms + 1, sum + pairs * r * r));
    let law = ChiSquared::new(count(terms)).ok()?;
    Some(Independence { neighbours, neighbours_se: 1.0 / pairs.sqrt(), lags: terms, statistic, p_value: law.sf(statistic) })
}

/// Returns the ranks with mean zero and variance one, equal values with the mean of their ranks. `None` if all values are equal.
fn ranks(values: &[Option<f64>]) -> Option<Vec<Option<f64>>> {
    let mut order: Vec<(f64, usize)> = values.iter().zip(0..).filter_map(|(value, place)| Some(((*value)?, place))).collect();
    order.sort_by(|one, other| one.0.total_cmp(&other.0));
    let middle = count(order.len()) / 2.0;
    let mut ranks = vec![None; values.len()];
    let (mut before, mut squares) = (0, 0.0);
    for equal in order.chunk_by(|one, other| one.0.total_cmp(&other.0).is_eq()) {
        // Ranks run from before + ½ to before + m − ½, with the mean before + m/2, so that the mean of all ranks is n/2.
        let rank = count(before) + count(equal.len()) / 2.0 - middle;
        equal.iter().for_each(|&(_, place)| ranks[place] = Some(rank));
        before += equal.len();
        squares += rank * rank * count(equal.len());
    }
    let sd = (squares / count(order.len())).sqrt();
    (sd > 0.0).then(|| ranks.into_iter().map(|rank| Some(rank? / sd)).collect())
}

#[cfg(test)]
mod tests {
    use rand_distr::{Distribution, StandardNormal};

    use super::*;
    use crate::tests::TestRng;

    /// Makes delays with a sum of two memories through a skewed law: the share `of_slow` of the variance changes every `every` packets, the rest at each packet. A
    /// tenth of the packets is lost.
    fn delays(seed: u64, of_slow: f64, every: usize, packets: usize) -> Vec<Option<f64>> {
        let mut rng = TestRng::new(seed);
        let mut slow: f64 = 0.0;
        let delay = |place: usize| {
            if place.is_multiple_of(every) {
                slow = StandardNormal.sample(&mut rng);
            }
            let fast: f64 = StandardNormal.sample(&mut rng);
            let z = of_slow.sqrt() * slow + (1.0 - of_slow).sqrt() * fast;
            (rng.unit() > 0.1).then(|| 0.02 + 0.004 * z.exp())
        };
        (0..packets).map(delay).collect()
    }

    /// Each part of the test refuses 2 of 400 measurements with independent delays on average. 8 and more refusals of one part have probability 0.001.
    #[test]
    fn independent_delays_pass_but_for_one_in_a_hundred() {
        let found: Vec<Independence> = (0..400).map(|seed| test(&delays(seed, 0.0, 1, 600)).unwrap()).collect();
        let by_neighbours = found.iter().filter(|test| test.neighbours.abs() > 2.807 * test.neighbours_se).count();
        let by_all = found.iter().filter(|test| test.p_value < 0.005).count();
        assert!(by_neighbours < 8 && by_all < 8, "{by_neighbours}, {by_all}");
        assert!(found.iter().filter(|test| !test.holds()).count() <= by_neighbours + by_all);
        // The p-value is uniform: the mean of 400 lies within 3.29 standard errors, 1/√(12·400), of one half.
        let mean = found.iter().map(|test| test.p_value).sum::<f64>() / 400.0;
        assert!((mean - 0.5).abs() < 3.29 / 4800_f64.sqrt(), "{mean}");
    }

    /// Delays of a slow and of a fast part have the correlation of the slow part: that of its scores is its share s, and that of ranks (6/π)·asin(s/2) (Pearson
    /// 1907), here 0.483, less the hundredth of the pairs over a change.
    #[test]
    fn a_slow_part_below_fast_noise_is_seen() {
        let found = test(&delays(7, 0.5, 100, 20_000)).unwrap();
        let expected = 6.0 / std::f64::consts::PI * 0.25_f64.asin() * 0.99;
        // 200 independent values of the slow part: the product of two ranks has a standard deviation of about one, so the error is at most 1/√200.
        assert!((found.neighbours - expected).abs() < 3.29 / 200_f64.sqrt(), "{found:?}, expected {expected}");
        assert!(!found.holds() && found.p_value < 1e-12 && found.lags == 20, "{found:?}");
    }

    /// A memory of two packets apart alone: neighbours are independent, and the statistic of all lags sees the rest.
    #[test]
    fn a_memory_that_skips_neighbours_is_seen() {
        let [one, other] = [11, 12].map(|seed| delays(seed, 0.8, 50, 4000));
        let found = test(&one.iter().zip(&other).flat_map(|(one, other)| [*one, *other]).collect::<Vec<_>>()).unwrap();
        assert!(found.neighbours.abs() < 0.3 && found.p_value < 1e-12, "{found:?}");
    }

    #[test]
    fn too_little_is_no_test() {
        assert_eq!(test(&[Some(1.0), None, Some(2.0), None]), None);
        assert_eq!(test(&[Some(1.0); 9]), None);
        assert_eq!(test(&[None, None]), None);
        // Ranks 1, 2, 3 are −√1.5, 0, √1.5: both products of neighbours are zero.
        let found = test(&[Some(1.0), Some(5.0), Some(9.0)]).unwrap();
        assert_eq!((found.neighbours, found.lags), (0.0, 1));
    }

    /// Ranks of 1, 1, 4, 1 are 2, 2, 4, 2: less their mean −½, −½, 3/2, −½, with the variance ¾. The lost packet leaves two pairs of neighbours with the products
    /// ¼ and −¾, so that r₁ is −⅓ and Q is 2/9. The probability of a larger square of a normal number is erfc(√(Q/2)) = erfc(⅓).
    #[test]
    fn equal_delays_share_their_mean_rank_and_a_lost_packet_leaves_no_pair() {
        let found = test(&[Some(1.0), Some(1.0), None, Some(4.0), Some(1.0)]).unwrap();
        assert!((found.neighbours + 1.0 / 3.0).abs() < 1e-15 && (found.statistic - 2.0 / 9.0).abs() < 1e-15, "{found:?}");
        assert!((found.neighbours_se - 0.5_f64.sqrt()).abs() < 1e-15 && (found.p_value - 0.6373518882339371).abs() < 1e-12, "{found:?}");
    }
}
