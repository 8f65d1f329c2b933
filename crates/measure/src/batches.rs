//! Into how many batches a correlated series may be cut so that their means are nearly independent.
//!
//! The means of batches tell how certain the mean of a series is, whatever its law, as long as a batch is much longer than the memory of the series. The
//! memory is the integrated autocorrelation time τ = 1 + 2·Σ rₖ of the means of up to 240 fine batches, summed up to the first lag of 3τ or more (Sokal
//! 1997, "Monte Carlo methods in statistical mechanics", section 3). A batch is 4τ long or longer, so that neighbours of a series that forgets
//! exponentially, e^(−t/T), for which τ = 2T, are correlated by 7 % at most; what that takes off the variance of a mean of length L, the share T/L, is put back.

use statrs::distribution::{ContinuousCDF as _, StudentsT};

use crate::series::{count, mean};

/// More batches are never needed: Schmeiser (1982, Operations Research 30(3)) found 10 to 30 to be right for any length.
pub(crate) const MOST: usize = 30;
/// With fewer numbers than this in a batch, its mean is no summary of anything.
const LEAST_LENGTH: usize = 10;
/// Fine batches, of which the memory is measured.
const FINE: usize = 240;
/// How long a batch is at least \[τ\].
const LENGTH: f64 = 4.0;
/// How far autocorrelations are summed up \[τ\].
const WINDOW: f64 = 3.0;

/// Batches whose means are nearly independent.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Batches {
    /// How many.
    pub(crate) count: usize,
    /// What the variance of their means is to be multiplied by for what correlation is left.
    pub(crate) correction: f64,
}

/// Why a series has too few.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) enum TooFew {
    /// It is short.
    Short,
    /// It is short for its memory.
    LongMemory {
        /// Its integrated autocorrelation time, in shares of its length.
        memory: f64,
        /// The greatest memory that would do, likewise.
        allowed: f64,
    },
}

impl Batches {
    /// At least `least` and at most 30 for a series whose values deviate from their expectation by that. Deviations of up to `resolution` are rounding and
    /// no memory.
    pub(crate) fn of(deviations: &[f64], least: usize, resolution: f64) -> Result<Self, TooFew> {
        let most = (deviations.len() / LEAST_LENGTH).min(MOST);
        if most < least {
            return Err(TooFew::Short);
        }
        let length = deviations.len().div_ceil(FINE);
        let fine: Vec<f64> = deviations.chunks_exact(length).filter_map(mean).collect();
        let time = if fine.iter().all(|deviation| deviation.abs() <= resolution) { 1.0 } else { integrated_time(&fine) };
        // Nothing below `most` is too large for a `usize`.
        let count_of = (1..=most).rev().find(|&batches| count(batches) * LENGTH * time <= count(fine.len()));
        let Some(batches) = count_of.filter(|batches| *batches >= least) else {
            let share = 1.0 / count(fine.len());
            return Err(TooFew::LongMemory { memory: time * share, allowed: 1.0 / (LENGTH * count(least)) });
        };
        let left = if batches < MOST { (time - 1.0).max(0.0) / 2.0 * count(batches) / count(fine.len()) } else { 0.0 };
        Ok(Self { count: batches, correction: 1.0 / (1.0 - left) })
    }
}

/// 1 + 2·Σ rₖ, not below a half: what chance and negative correlation take off must not make batches shorter than they are for independent values.
fn integrated_time(deviations: &[f64]) -> f64 {
    let power: f64 = deviations.iter().map(|deviation| deviation * deviation).sum();
    let mut time = 1.0;
    for lag in 1..deviations.len() / 2 {
        time += 2.0 * deviations.iter().zip(&deviations[lag..]).map(|(one, other)| one * other).sum::<f64>() / power;
        if count(lag) >= WINDOW * time {
            break;
        }
    }
    time.max(0.5)
}

/// The quantile of Student's law with a number of degrees of freedom, at least one.
pub(crate) fn student(probability: f64, freedom: usize) -> f64 {
    // The scale and the degrees of freedom are positive, which is all that can be refused.
    StudentsT::new(0.0, 1.0, count(freedom.max(1))).map_or(f64::INFINITY, |law| law.inverse_cdf(probability))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_rng::autoregressive;

    #[test]
    fn a_longer_memory_makes_fewer_batches() {
        let of = |phi: f64| Batches::of(&autoregressive(1, phi, 24_000), 5, 0.0);
        assert_eq!(of(0.0), Ok(Batches { count: 30, correction: 1.0 }));
        // φ = 0.997: τ = (1 + φ)/(1 − φ) = 666 numbers, of which 24 000 are 36: 36/4 = 9 batches, if the memory were known. It is estimated with a
        // standard error of √(2·(2·3 + 1)/36) = 62 % at the most, so that all one can say is that there are fewer.
        assert!(of(0.997).map_or(0, |batches| batches.count) < 15);
        // φ = 0.9999 does not forget in 24 000.
        assert!(matches!(of(0.9999), Err(TooFew::LongMemory { memory, allowed }) if memory > allowed));
        assert_eq!(Batches::of(&[0.0; 40], 5, 0.0), Err(TooFew::Short));
        // Rounding that goes up and down in long waves is no memory.
        let waves: Vec<f64> = (0..2_400).map(|i| if i / 600 % 2 == 0 { 4e-10 } else { -4e-10 }).collect();
        assert_eq!(Batches::of(&waves, 5, 1e-9), Ok(Batches { count: 30, correction: 1.0 }));
    }

    #[test]
    fn student_quantiles_are_the_published_ones() {
        // Tables of Student's law: 28, 9 and 3 degrees of freedom.
        for (probability, freedom, published) in [(0.995, 28, 2.763), (0.975, 9, 2.262), (0.975, 29, 2.045), (0.9995, 3, 12.924)] {
            assert!((student(probability, freedom) - published).abs() < 5e-4, "{freedom}");
        }
    }
}
