//! Methods to draw a delay: tables as in other programs, inversion of the law, and the program's own draws.
#![expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "written for speed; every number here is small"
)]

use cohaptic_wan::Distribution;
use cohaptic_wan::law::Law;

/// Returns the compared laws with a delay of 24 ± 2 ms. Laws on a half-line begin at 20 ms.
///
/// # Panics
///
/// If a law is refused, which a test would show.
#[must_use]
pub fn laws() -> [(&'static str, Law); 4] {
    [
        ("normal", Distribution::Normal, 0.0),
        ("Pareto", Distribution::Pareto, 0.0),
        ("gamma", Distribution::Gamma, 20.0),
        ("lognormal", Distribution::LogNormal, 20.0),
    ]
    .map(|(name, distribution, floor)| (name, Law::new(&distribution, MEAN, SD, Some(floor)).expect("a law")))
}

/// Returns the laws that are compared in addition to [`laws`], with the same mean and deviation.
///
/// # Panics
///
/// If a law is refused, which a test would show.
#[must_use]
pub fn further_laws() -> [(&'static str, Law); 4] {
    [
        ("uniform", Distribution::Uniform, 0.0),
        ("Pareto-normal", Distribution::ParetoNormal, 0.0),
        ("Weibull", Distribution::Weibull, 20.0),
        // This low floor cuts off nothing.
        ("Laplace", Distribution::Laplace, -200.0),
    ]
    .map(|(name, distribution, floor)| (name, Law::new(&distribution, MEAN, SD, Some(floor)).expect("a law")))
}

/// Mean of all laws \[ms\].
pub const MEAN: f64 = 24.0;
/// Standard deviation of all laws \[ms\].
pub const SD: f64 = 2.0;

/// Returns the next uniform word (Steele, Lea & Flood 2014, `SplitMix64`).
#[inline]
pub fn next_word(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (*state ^ (*state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// Returns the middle of one of 2⁵² equal parts of (0, 1).
#[inline]
#[must_use]
pub fn unit(word: u64) -> f64 {
    // The half keeps out 0, where the quantile of some laws is infinite. 52 bits and the half are exact in `f64`: with 53 bits the last sum would be rounded
    // to 2⁵³, and the result to 1.
    ((word >> 12) as f64 + 0.5) * (1.0 / 4_503_599_627_370_496.0)
}

/// Table in the format of netem: 4096 entries of 16 bits, 8192·(F⁻¹(i/4096) − mean)/sd, of which a draw picks one at random.
#[derive(Clone, Debug)]
pub struct Netem(Vec<i16>);

impl Netem {
    /// Returns the table of a law. Deviations beyond four, which 16 bits cannot hold, are cut off.
    #[must_use]
    pub fn new(law: &Law) -> Self {
        let entry = |i: u16| (8192.0 * (law.quantile(f64::from(i) / 4096.0) - MEAN) / SD).round() as i16;
        Self((0..4096).map(entry).collect())
    }

    /// Returns a draw from a uniform word.
    #[inline]
    #[must_use]
    pub fn draw(&self, word: u64) -> f64 {
        // The kernel takes the remainder of a division by the size of the table, 4096: the lowest 12 bits.
        MEAN + SD / 8192.0 * f64::from(self.0[(word & 4095) as usize])
    }

    /// Returns the equally probable delays in ascending order.
    #[must_use]
    pub fn delays(&self) -> Vec<f64> {
        (0..self.0.len() as u64).map(|i| self.draw(i)).collect()
    }
}

/// Table of 65536 quantiles as `f64`.
#[derive(Clone, Debug)]
pub struct Fine(Vec<f64>);

impl Fine {
    /// Returns the table of a law: its quantiles in the middle of 65536 equal parts.
    #[must_use]
    pub fn new(law: &Law) -> Self {
        Self((0..65_536).map(|i| law.quantile((f64::from(i) + 0.5) / 65_536.0)).collect())
    }

    /// Returns a random entry, chosen by a uniform word.
    #[inline]
    #[must_use]
    pub fn step(&self, word: u64) -> f64 {
        self.0[(word >> 48) as usize]
    }

    /// Returns the linear interpolation between neighbouring entries at a random position.
    #[inline]
    #[must_use]
    pub fn interpolated(&self, word: u64) -> f64 {
        // Each cell needs an upper neighbour, so the position is a share of 65535 cells and not of 65536 entries.
        let position = unit(word) * 65_535.0;
        let cell = position as usize;
        self.0[cell] + (position - cell as f64) * (self.0[cell + 1] - self.0[cell])
    }

    /// Returns the quantiles in ascending order.
    #[must_use]
    pub fn delays(&self) -> &[f64] {
        &self.0
    }
}

/// Returns a draw of the law itself, with further words from the same generator.
#[inline]
pub fn draw(law: &Law, state: &mut u64) -> f64 {
    let word = next_word(state);
    law.draw(word, || next_word(state))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_number_is_neither_0_nor_1() {
        assert!(unit(0) > 0.0);
        assert!(unit(u64::MAX) < 1.0);
    }

    /// The extreme words choose positions in the first and in the last cell of the table.
    #[test]
    fn each_word_has_a_place_in_the_table() {
        let [(_, law), ..] = laws();
        let table = Fine::new(&law);
        let [first, last] = [0, u64::MAX].map(|word| table.interpolated(word));
        assert!((first - table.delays()[0]).abs() < 1e-9, "{first}");
        assert!((last - table.delays()[65_535]).abs() < 1e-9, "{last}");
    }
}
