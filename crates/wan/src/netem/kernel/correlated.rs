//! The kernel's correlated random numbers, and the resulting delays.

use super::prng::{Prng, Unseeded};
use super::table::{TABLE_SCALE, Table};

/// A sequence of correlated random numbers: xₙ = (uₙ·(2³² − ρ′) + xₙ₋₁·ρ′) ≫ 32, with ρ′ = ρ + 1 and ρ the 32 bits of the correlation; xₙ = uₙ if ρ is 0.
///
/// The values are not uniform: the deviation shrinks by √((1−ρ)/(1+ρ)), and the tails vanish. For this reason correlated loss loses next to nothing.
#[derive(Clone, Debug)]
pub(super) struct Correlated {
    rho: u32,
    last: u32,
}

impl Correlated {
    /// Makes a sequence with the first value from `unseeded`.
    pub(super) fn new(rho: u32, unseeded: &mut Unseeded) -> Self {
        Self { rho, last: unseeded.next_u32() }
    }

    pub(super) fn next(&mut self, prng: &mut Prng) -> u32 {
        let drawn = prng.next_u32();
        if self.rho == 0 {
            return drawn;
        }
        let weight = u64::from(self.rho) + 1;
        let mixed = u64::from(drawn) * ((1 << 32) - weight) + u64::from(self.last) * weight;
        self.last = (mixed >> 32) as u32;
        self.last
    }

    /// Returns whether an event of this probability (in 1/2³²) happens. No number is drawn for probability 0.
    pub(super) fn happens(&mut self, probability: u32, prng: &mut Prng) -> bool {
        probability != 0 && probability >= self.next(prng)
    }
}

/// Returns a time around `mean` \[ns\] made from 32 random bits. The bits are not drawn if `sigma` is 0.
///
/// Without a table the time is uniform on mean ± sigma, apart from the bias of the remainder. With a table the time is mean + sigma·entry/8192, with the
/// remainder of sigma by 8192 multiplied and rounded separately, as in the kernel. The time may be below zero.
pub(super) fn distributed(mean: i64, sigma: i32, draw: impl FnOnce() -> u32, table: Option<&Table>) -> i64 {
    if sigma == 0 {
        return mean;
    }
    let random = draw();
    let Some(table) = table else {
        let width = sigma.unsigned_abs().wrapping_mul(2).max(1);
        return mean.wrapping_add(i64::from(random % width)).wrapping_sub(i64::from(sigma));
    };
    let entry = table.entry(random);
    let scale = i64::from(TABLE_SCALE);
    let product = i64::from(sigma % TABLE_SCALE) * entry;
    // The division below truncates, so half a step away from zero makes a rounding of halves away from zero.
    let rounded = if product >= 0 { product + scale / 2 } else { product - scale / 2 };
    (rounded / scale + i64::from(sigma / TABLE_SCALE) * entry).wrapping_add(mean)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An event happens if the draw is at most v, so that its probability is (v + 1)/2³², and 0 for v = 0.
    #[test]
    fn a_draw_on_the_bound_is_an_event_and_zero_draws_nothing() {
        let mut sequence = Correlated::new(0, &mut Unseeded::new(1));
        let bound = Prng::new(1).next_u32();
        assert!(sequence.happens(bound, &mut Prng::new(1)));
        assert!(!sequence.happens(bound - 1, &mut Prng::new(1)));
        let mut prng = Prng::new(1);
        assert!(!sequence.happens(0, &mut prng));
        assert_eq!(prng, Prng::new(1));
    }

    /// With ρ′ = 2³¹ + 1 the weights are nearly one half each. The expected value is computed by hand.
    #[test]
    fn a_correlated_number_is_a_running_mean() {
        let mut sequence = Correlated { rho: 1 << 31, last: 1000 };
        let drawn = u64::from(Prng::new(1).next_u32());
        let expected = (drawn * ((1 << 31) - 1) + 1000 * ((1 << 31) + 1)) >> 32;
        assert_eq!(u64::from(sequence.next(&mut Prng::new(1))), expected);
        assert_eq!(u64::from(sequence.last), expected);
    }
}
