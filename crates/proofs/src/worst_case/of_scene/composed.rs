//! Composed rows: rows of a frame with each heard sample replaced by the row of the sample, with a bound of the error.
//!
//! Let r be a row of a frame as computed, (s, b) its coefficients of states and of samples heard, and let the exact one differ from it by δ, ‖δ‖ <= E, in sums
//! of the sizes of entries. Let H_k be the computed row heard as sample k, the exact one H_k + η_k, ‖η_k‖ <= ε_k. The exact composition is Σ (s +
//! δ_s)·unit + Σ (b_k + δ_k)·(H_k + η_k). So
//!
//! ```text
//! ‖exact − computed‖ <= E·max(1, max_k (‖H_k‖ + ε_k)) + Σ |b_k|·ε_k + γ·(‖s‖ + Σ |b_k|·‖H_k‖)
//! ```
//!
//! The first two are by the triangle inequality, δ's entries each at a row of at most that size. Each entry is a sum of one term of s and a product for each k,
//! in any order: γ for as many operations (Higham 2002, Section 3.1), and a smallest number for each underflowing product.
//!
//! The combination heard by a receiver, H = w·S + e − c/(N − 1), has w·S rounded once and w itself once: 3·u·|w|·‖S‖ is more. The other entries of H stand
//! alone, and 1/(N − 1) rounds once.

use cohaptic_stability::numerics::{UNDERFLOW, UNIT, gamma, outward, real};

/// A row, and an upper bound of the sum of the absolute errors of its entries.
#[derive(Clone, Debug)]
pub(super) struct Composed {
    pub(super) entries: Vec<f64>,
    pub(super) error: f64,
}

fn size(row: &[f64]) -> f64 {
    row.iter().map(|entry| entry.abs()).sum()
}

impl Composed {
    /// Returns a row without error.
    pub(super) const fn exact(entries: Vec<f64>) -> Self {
        Self { entries, error: 0.0 }
    }

    /// Returns the composition of a row of a frame with an error of at most `frame_error`. The row has the coefficients of `states` states, then of the samples
    /// heard. `heard` has the rows of these samples over `unknowns` unknowns; `None` is a sample not heard yet and adds nothing.
    pub(super) fn of(row: &[f64], states: usize, heard: &[Option<&Self>], unknowns: usize, frame_error: f64) -> Self {
        let mut entries = row[..states].to_vec();
        entries.resize(unknowns, 0.0);
        let (mut all, mut carried, mut largest) = (size(&row[..states]), 0.0, 1.0_f64);
        for (by, heard) in row[states..].iter().zip(heard) {
            let Some(heard) = heard else { continue };
            entries.iter_mut().zip(&heard.entries).for_each(|(entry, heard)| *entry += by * heard);
            let size = size(&heard.entries);
            all += by.abs() * size;
            carried += by.abs() * heard.error;
            largest = largest.max(size + heard.error);
        }
        let operations = 2 * (heard.len() + 1);
        // The last factor covers the rounding of the sums of sizes, each of up to `unknowns` numbers.
        let error = (frame_error * largest + carried + gamma(operations) * all) * (1.0 + 2.0 * gamma(unknowns + heard.len() + 2));
        Self { entries, error: outward(error) + real(unknowns * operations) * UNDERFLOW }
    }

    /// Returns the row of the sample heard by a receiver: this row times `weight`, plus 1 at the place `own` of the deviation, plus the weight of `others` at
    /// its place. Both weights were rounded once, and the error covers this rounding.
    pub(super) fn heard(&self, weight: f64, own: usize, others: Option<(usize, f64)>) -> Self {
        let mut entries: Vec<f64> = self.entries.iter().map(|entry| weight * entry).collect();
        entries[own] += 1.0;
        // w·S is rounded once and w once before, hence 3·u of the size: see the module head.
        let mut error = weight.abs() * (self.error + 3.0 * UNIT * (size(&self.entries) + self.error)) + real(entries.len()) * UNDERFLOW;
        if let Some((place, by)) = others {
            entries[place] += by;
            error += UNIT * by.abs();
        }
        Self { error: outward(error * (1.0 + gamma(entries.len()))), entries }
    }

    /// Returns this row less `by` times the row `other`.
    pub(super) fn less(&self, other: &Self, by: f64) -> Self {
        let entries: Vec<f64> = self.entries.iter().zip(&other.entries).map(|(entry, other)| entry - by * other).collect();
        // Each entry has two roundings: of a product and of a difference.
        let rounded = gamma(2) * (size(&self.entries) + by.abs() * size(&other.entries));
        let error = (self.error + by.abs() * other.error + rounded) * (1.0 + gamma(entries.len() + 4));
        Self { error: outward(error) + real(entries.len()) * UNDERFLOW, entries }
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    /// 2⁵², in which entries are whole; 2⁻⁶⁰ is the unit of errors.
    const GRID: f64 = 4_503_599_627_370_496.0;

    #[expect(clippy::cast_precision_loss, reason = "below 2^53")]
    fn entry(number: i64) -> f64 {
        number as f64 / GRID
    }

    fn exact(number: i64, error: i64) -> i128 {
        (i128::from(number) << 8) + i128::from(error)
    }

    const STATES: usize = 3;
    const HEARD: usize = 4;
    const UNKNOWNS: usize = 6;

    properties! {
        /// Against the exact composition of exact rows, in integers.
        #[test]
        fn compositions_are_within_their_bounds(
            row in prop::collection::vec((-(1_i64 << 53)..1 << 53, -3_i64..4), STATES + HEARD),
            heard in prop::collection::vec(prop::collection::vec((-(1_i64 << 53)..1 << 53, -3_i64..4), UNKNOWNS), HEARD),
        ) {
            let unit = 1.0 / (256.0 * GRID);
            #[expect(clippy::cast_precision_loss, reason = "some tens")]
            let sum = |row: &[(i64, i64)]| row.iter().map(|(_, error)| error.abs()).sum::<i64>() as f64 * unit;
            let of = |row: &[(i64, i64)]| row.iter().map(|(number, _)| entry(*number)).collect::<Vec<f64>>();
            let rows: Vec<Composed> = heard.iter().map(|row| Composed { entries: of(row), error: sum(row) }).collect();
            let found = Composed::of(&of(&row), STATES, &rows.iter().map(Some).collect::<Vec<_>>(), UNKNOWNS, sum(&row));
            // In units of 2^-120.
            let mut off = 0.0;
            for place in 0..UNKNOWNS {
                let state = if place < STATES { exact(row[place].0, row[place].1) << 60 } else { 0 };
                let products: i128 = (0..HEARD).map(|k| exact(row[STATES + k].0, row[STATES + k].1) * exact(heard[k][place].0, heard[k][place].1)).sum();
                // The computed entry is a multiple of 2^-104 at most sums of numbers below 2^4: a whole number of units.
                #[expect(clippy::cast_possible_truncation, reason = "whole numbers below 2^127")]
                let computed = (found.entries[place] * 2_f64.powi(120)) as i128;
                #[expect(clippy::cast_precision_loss, reason = "an error, of which the first digits count")]
                let difference = (state + products - computed).abs() as f64;
                off += difference * 2_f64.powi(-120);
            }
            prop_assert!(off <= found.error, "{off} {}", found.error);
            // And the bound is none of the size of the row itself.
            prop_assert!(found.error <= 1e-12, "{}", found.error);
        }
    }

    #[test]
    fn what_is_heard_and_what_is_moved_are_within_their_bounds() {
        let sample = Composed::exact(vec![1.0, 0.0, 0.0]);
        let heard = sample.heard(-1.0 / 49.0, 1, Some((2, -1.0 / 49.0)));
        // −1/49 is off by less than a unit of its own.
        assert!(heard.error >= UNIT / 49.0 && heard.error < 1e-16 && heard.entries[1].to_bits() == 1.0_f64.to_bits());
        let moved = sample.less(&heard, 0.1);
        assert!(moved.error >= 0.1 * heard.error && moved.error < 1e-15);
    }
}
