//! Newest attitude of each sender, and means of their matrices and angular velocities.

use alloc::vec::Vec;

use super::{Attitude, Matrix3, Triple};

/// Newest attitudes of the senders, in the order of peers without the holder.
///
/// A matrix is computed once, at the arrival of the attitude. The means are stored until an attitude changes them.
#[derive(Clone, Debug)]
pub struct HeldAttitudes {
    held: Vec<HeldAttitude>,
    mean: HeldAttitude,
}

/// Matrix R, and angular velocity in world axes [rad/s].
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct HeldAttitude {
    pub(crate) matrix: Matrix3,
    pub(crate) rate: Triple,
}

impl HeldAttitude {
    const ZERO: Self = Self { matrix: [[0.0; 3]; 3], rate: [0.0; 3] };

    pub(crate) fn of(attitude: &Attitude) -> Self {
        Self { matrix: attitude.matrix(), rate: attitude.world_rate() }
    }

    /// Returns the twelve numbers `make(a, b)` for the numbers a of `self` and b of `other`.
    fn zip(&self, other: &Self, make: impl Fn(f64, f64) -> f64) -> Self {
        let triple = |a: &Triple, b: &Triple| core::array::from_fn(|i| make(a[i], b[i]));
        Self { matrix: core::array::from_fn(|row| triple(&self.matrix[row], &other.matrix[row])), rate: triple(&self.rate, &other.rate) }
    }

    /// Returns the point from `self` to `to` at the fraction `part` of the way; exactly `self` at 0.
    pub(crate) fn mix(&self, to: &Self, part: f64) -> Self {
        self.zip(to, |from, to| from + part * (to - from))
    }

    fn plus(&self, other: &Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl HeldAttitudes {
    /// Returns the initial attitudes of all other peers as held attitudes.
    #[must_use]
    pub fn new(initial: impl IntoIterator<Item = Attitude>) -> Self {
        let mut held = Self { held: initial.into_iter().map(|attitude| HeldAttitude::of(&attitude)).collect(), mean: HeldAttitude::ZERO };
        held.refresh();
        held
    }

    /// Holds the attitude of the other peer with index `place`. [`HeldAttitudes::refresh`] must be called before the next use of the means.
    ///
    /// # Panics
    ///
    /// If the index `place` is out of range.
    pub fn hold(&mut self, place: usize, attitude: &Attitude) {
        self.held[place] = HeldAttitude::of(attitude);
    }

    pub(crate) fn at(&self, place: usize) -> HeldAttitude {
        self.held[place]
    }

    pub(crate) fn replace(&mut self, place: usize, held: HeldAttitude) {
        self.held[place] = held;
    }

    /// Returns the mean M̄ of the attitude matrices and the mean rate w̄ [rad/s] of the other peers, as of the last [`HeldAttitudes::refresh`]; zero without
    /// other peers.
    #[must_use]
    pub const fn mean(&self) -> (&Matrix3, Triple) {
        (&self.mean.matrix, self.mean.rate)
    }

    /// Computes the means by four partial sums, added in pairs, as [`crate::Held::refresh`] does.
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub fn refresh(&mut self) {
        if self.held.is_empty() {
            return;
        }
        let mut sums = [HeldAttitude::ZERO; 4];
        let mut quads = self.held.chunks_exact(4);
        for quad in &mut quads {
            for (sum, held) in sums.iter_mut().zip(quad) {
                *sum = sum.plus(held);
            }
        }
        for (sum, held) in sums.iter_mut().zip(quads.remainder()) {
            *sum = sum.plus(held);
        }
        let [a, b, c, d] = sums;
        let count = self.held.len() as f64;
        self.mean = a.plus(&b).plus(&c.plus(&d)).zip(&HeldAttitude::ZERO, |sum, _| sum / count);
    }

    /// Like [`HeldAttitudes::refresh`], but sums differences from the holder's own attitude, so that senders held exactly at `own` exert no torque.
    #[expect(clippy::cast_precision_loss, reason = "the number of peers is far below 2^53")]
    pub(crate) fn refresh_around(&mut self, own: &HeldAttitude) {
        let count = self.held.len() as f64;
        // For a sender held exactly at `own` every difference is zero, without rounding.
        let differences = self.held.iter().map(|held| held.zip(own, |held, own| held - own));
        let sum = differences.fold(HeldAttitude::ZERO, |sum, difference| sum.plus(&difference));
        self.mean = own.zip(&sum, |own, sum| own + sum / count);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn turned(sigma: Triple) -> Attitude {
        let mut attitude = Attitude { rate: sigma, ..Attitude::REST };
        attitude.turn(sigma);
        attitude
    }

    #[test]
    fn the_mean_of_turns_to_and_fro_is_no_rotation() {
        let held = HeldAttitudes::new([turned([0.0, 0.0, 0.5]), turned([0.0, 0.0, -0.5])]);
        let (matrix, rate) = held.mean();
        // The mean of rotations by ±0.5 rad has the cosine on its diagonal, and is shorter than a rotation.
        assert!((matrix[0][0] - libm::cos(0.5)).abs() < 1e-15 && matrix[1][0].abs() < 1e-17);
        assert_eq!(rate, [0.0; 3]);
    }

    #[test]
    fn a_mean_around_oneself_of_oneself_is_oneself() {
        let own = HeldAttitude::of(&turned([0.3, -1.0, 0.2]));
        let mut held = HeldAttitudes::new([Attitude::REST; 7]);
        for place in 0..7 {
            held.replace(place, own);
        }
        held.refresh_around(&own);
        assert_eq!(held.mean, own);
    }
}
