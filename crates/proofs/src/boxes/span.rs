//! Matrices over a box: a mean, a slope along each number, and a radius for everything of higher order.
//!
//! Let sᵢ ∈ [−1, 1] be the place of number i in the box. Then M(s) = M₀ + Σ sᵢ·Mᵢ + E with |E| ≤ R entry by entry (a Taylor model of the first order, Makino &
//! Berz 2003). Products of errors, products of two slopes and all roundings go into R, so R is of the second order in the width of the box.

use std::borrow::Cow;
use std::collections::BTreeMap;

use cohaptic_stability::Matrix;
use cohaptic_stability::numerics::{UNDERFLOW, UNIT, gamma, outward, real};

use super::steps::StepMatrix;

/// Matrix over a box: mean M₀, slopes Mᵢ indexed by number of the box, and radius R.
#[derive(Clone, Debug)]
pub(super) struct StepSpan {
    pub(super) mean: Matrix,
    pub(super) slopes: Vec<Matrix>,
    pub(super) radius: Matrix,
}

impl StepSpan {
    /// Encloses a multi-affine step by its values at 2ⁿ corners: bit b of the place of a corner is 1 if number b is at its upper end. A multi-affine
    /// function is the sum of its effects (Yates 1937). The effects of single numbers become slopes, and the effects of several numbers together go into the
    /// radius.
    pub(super) fn of<'a>(corners: impl Iterator<Item = &'a StepMatrix>) -> Self {
        let corners: Vec<&StepMatrix> = corners.collect();
        let (rows, columns) = (corners[0].matrix.rows(), corners[0].matrix.columns());
        let numbers = corners.len().trailing_zeros() as usize;
        let share = 1.0 / real(corners.len());
        let error = corners.iter().map(|corner| corner.error).fold(0.0, f64::max);
        let mut span =
            Self { mean: Matrix::zeros(rows, columns), slopes: vec![Matrix::zeros(rows, columns); numbers], radius: Matrix::zeros(rows, columns) };
        let mut effects = vec![0.0; corners.len()];
        for row in 0..rows {
            for column in 0..columns {
                effects.iter_mut().zip(&corners).for_each(|(effect, corner)| *effect = corner.matrix[(row, column)]);
                let largest = effects.iter().fold(0.0, |largest: f64, entry| largest.max(entry.abs()));
                // Yates's scheme: one pass of sums and differences per number turns the values at the corners into effects.
                for number in 0..numbers {
                    for place in (0..corners.len()).filter(|place| place >> number & 1 == 0) {
                        let (low, high) = (effects[place], effects[place | 1 << number]);
                        (effects[place], effects[place | 1 << number]) = (low + high, high - low);
                    }
                }
                span.mean[(row, column)] = share * effects[0];
                let mut radius = 0.0;
                for (place, effect) in effects.iter().enumerate().skip(1) {
                    if place.is_power_of_two() {
                        span.slopes[place.trailing_zeros() as usize][(row, column)] = share * effect;
                    } else {
                        radius += share * effect.abs();
                    }
                }
                // Each of the 2ⁿ effects is off by at most n roundings of the largest corner, before the division by 2ⁿ.
                span.radius[(row, column)] = outward(radius + error + real(corners.len()) * gamma(numbers + 2) * largest);
            }
        }
        span
    }

    /// Returns a constant matrix over a box with the given number of numbers.
    pub(super) fn constant(mean: Matrix, numbers: usize) -> Self {
        let none = Matrix::zeros(mean.rows(), mean.columns());
        Self { slopes: vec![none.clone(); numbers], radius: none, mean }
    }

    /// Returns the matrix with its radius multiplied by a factor.
    pub(super) fn widened(mut self, by: f64) -> Self {
        self.radius = self.radius.scaled(by);
        self
    }

    /// Returns the matrix over a box with a further number without an effect on the matrix.
    pub(super) fn with_another_number(mut self) -> Self {
        self.slopes.push(Matrix::zeros(self.mean.rows(), self.mean.columns()));
        self
    }

    pub(super) fn transposed(&self) -> Self {
        Self { mean: self.mean.transposed(), slopes: self.slopes.iter().map(Matrix::transposed).collect(), radius: self.radius.transposed() }
    }

    /// Returns the sum of two matrices over the same box.
    pub(super) fn plus(&self, other: &Self) -> Self {
        let sum = |one: &Matrix, other: &Matrix| plus(one, other);
        let slopes: Vec<Matrix> = self.slopes.iter().zip(&other.slopes).map(|(one, other)| sum(one, other)).collect();
        let (mean, radius) = (sum(&self.mean, &other.mean), sum(&self.radius, &other.radius));
        // Each entry of the mean and of a slope is one sum, which rounds once.
        let rounded = |i: usize, j: usize| UNIT * (mean[(i, j)].abs() + slopes.iter().map(|slope| slope[(i, j)].abs()).sum::<f64>());
        let radius = Matrix::from_fn(mean.rows(), mean.columns(), |i, j| outward(radius[(i, j)] + rounded(i, j)));
        Self { mean, slopes, radius }
    }

    pub(super) fn negated(&self) -> Self {
        Self { mean: self.mean.scaled(-1.0), slopes: self.slopes.iter().map(|slope| slope.scaled(-1.0)).collect(), radius: self.radius.clone() }
    }

    /// Returns T·M·Tᵀ with M this matrix and T the matrix `by`, over the same box.
    pub(super) fn through(&self, by: &Self) -> Self {
        // (T·(T·M)ᵀ)ᵀ = T·M·Tᵀ, so one function for products is enough.
        by.times(&by.times(self).transposed()).transposed()
    }

    /// Returns a bound of the size of each entry over the whole box.
    pub(super) fn largest(&self) -> Matrix {
        self.reach(|matrix, i, j| matrix[(i, j)].abs())
    }

    fn reach(&self, mean: impl Fn(&Matrix, usize, usize) -> f64) -> Matrix {
        let slopes = |i, j| self.slopes.iter().map(|slope| slope[(i, j)].abs()).sum::<f64>();
        Matrix::from_fn(self.mean.rows(), self.mean.columns(), |i, j| outward(mean(&self.mean, i, j) + slopes(i, j) + self.radius[(i, j)]))
    }

    /// Returns this matrix times another matrix over the same box. A step leaves most of the state unchanged, so most entries of this matrix are zero all over
    /// the box but for the least radius of all entries. Such entries are skipped; the least radius is counted once per column.
    ///
    /// If an entry of `other` is not finite, every radius of the product is not finite either, so a skipped zero hides no overflow.
    pub(super) fn times(&self, other: &Self) -> Self {
        let (rows, columns, inner) = (self.mean.rows(), other.mean.columns(), self.mean.columns());
        // The part of each entry beside the mean: its slopes and its radius. Products of two such parts are of the second order and go into the radius.
        let uneven = |span: &Self| span.reach(|_, _, _| 0.0);
        let (own, others) = (uneven(self), uneven(other));
        let sizes = absolute(&other.mean);
        // Roundings of the mean and of the slopes, sums of `inner` or of twice `inner` products: a share of |M|·|M'| and of the product of the
        // largest sizes.
        let share = gamma(2 * inner + 4) * real(1 + self.slopes.len());
        let weighted = |one: &Matrix, by: f64| Matrix::from_fn(inner, columns, |i, j| one[(i, j)] + share * (by * sizes[(i, j)] + others[(i, j)]));
        let (beside_mean, beside_uneven) = (weighted(&other.radius, 2.0), weighted(&others, 1.0));
        let least = |of: &Matrix| of.entries().iter().copied().reduce(f64::min).unwrap_or(0.0);
        let (least_radius, least_uneven) = (least(&self.radius), least(&own));
        let sum = |of: &Matrix, column: usize| (0..inner).map(|row| of[(row, column)]).sum::<f64>();
        let of_least: Vec<f64> = (0..columns).map(|column| least_radius * sum(&sizes, column) + least_uneven * sum(&beside_uneven, column)).collect();
        let mut product = Self {
            mean: Matrix::zeros(rows, columns),
            slopes: vec![Matrix::zeros(rows, columns); self.slopes.len()],
            radius: Matrix::from_fn(rows, columns, |_, column| of_least[column]),
        };
        // The radius of the product is |M|·R' + R·|M'| + U·U', with U the slopes and the radius together.
        for row in 0..rows {
            for place in 0..inner {
                let (mean, radius, uneven) = (self.mean[(row, place)], self.radius[(row, place)] - least_radius, own[(row, place)] - least_uneven);
                add(product.mean.row_mut(row), mean, other.mean.row(place));
                for (slope, (own, others)) in product.slopes.iter_mut().zip(self.slopes.iter().zip(&other.slopes)) {
                    add(slope.row_mut(row), own[(row, place)], other.mean.row(place));
                    add(slope.row_mut(row), mean, others.row(place));
                }
                let target = product.radius.row_mut(row);
                add(target, mean.abs(), beside_mean.row(place));
                add(target, radius, sizes.row(place));
                add(target, uneven, beside_uneven.row(place));
            }
        }
        // The radius itself is three sums of `inner` nonnegative terms, each with a few roundings. `UNDERFLOW` covers products below the normal range.
        let rounded = if other.is_finite() { 1.0 + gamma(4 * inner + 32) } else { f64::INFINITY };
        for entry in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
            product.radius[entry] = outward(product.radius[entry] * rounded) + real(inner) * UNDERFLOW;
        }
        product
    }

    fn is_finite(&self) -> bool {
        self.mean.is_finite() && self.radius.is_finite() && self.slopes.iter().all(Matrix::is_finite)
    }
}

/// Largest number of steps of a frame multiplied in order. The order takes fewer operations than halves: a step is sparse, a product of steps is not.
const SHORT: usize = 32;

/// Steps of a frame over a box.
#[derive(Clone, Debug)]
pub(super) struct FrameSpan {
    /// Matrix of each kind of step.
    pub(super) kinds: Vec<StepSpan>,
    /// Place in `kinds` of each step, in the order of the frame.
    pub(super) order: Vec<usize>,
}

impl FrameSpan {
    /// Returns the frame of steps of different kinds.
    pub(super) fn of(steps: Vec<StepSpan>) -> Self {
        Self { order: (0..steps.len()).collect(), kinds: steps }
    }

    /// Returns the product of all steps, with the first step at the right. A long frame is multiplied in pairs of neighbours, then in pairs of these products,
    /// and so on. The error of a step then passes through a logarithmic number of products. In order the error would be multiplied by the sizes of the entries
    /// of all later steps, and their product grows without end. Equal pairs are multiplied once.
    pub(super) fn product(&self) -> StepSpan {
        if self.order.len() <= SHORT {
            return self.product_in_order();
        }
        let mut order = self.order.clone();
        let mut spans: Vec<Cow<'_, StepSpan>> = self.kinds.iter().map(Cow::Borrowed).collect();
        while order.len() > 1 {
            let mut known = BTreeMap::new();
            // `spans` grows by each new product; `order` holds places in `spans`, so equal pairs of places are equal pairs of matrices.
            let joined = order.chunks(2).map(|pair| match *pair {
                [first, second] => *known.entry((first, second)).or_insert_with(|| {
                    let product = spans[second].times(&spans[first]);
                    spans.push(Cow::Owned(product));
                    spans.len() - 1
                }),
                _ => pair[0],
            });
            order = joined.collect();
        }
        spans.swap_remove(order[0]).into_owned()
    }

    /// Returns the same product, bounded step by step as by the checker of certificates.
    pub(super) fn product_in_order(&self) -> StepSpan {
        let mut steps = self.order.iter().map(|kind| &self.kinds[*kind]);
        let first = steps.next().expect("a frame has a step").clone();
        steps.fold(first, |frame, step| step.times(&frame))
    }
}

/// Adds `factor` times a row to a row. A factor of zero adds nothing, even if the row is not finite.
fn add(sum: &mut [f64], factor: f64, row: &[f64]) {
    if factor != 0.0 {
        sum.iter_mut().zip(row).for_each(|(sum, entry)| *sum += factor * entry);
    }
}

fn plus(one: &Matrix, other: &Matrix) -> Matrix {
    Matrix::from_fn(one.rows(), one.columns(), |i, j| one[(i, j)] + other[(i, j)])
}

pub(super) fn absolute(of: &Matrix) -> Matrix {
    Matrix::from_fn(of.rows(), of.columns(), |i, j| of[(i, j)].abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(mean: &[[f64; 2]; 2], slope: &[[f64; 2]; 2], radius: f64) -> StepSpan {
        let of = |entries: &[[f64; 2]; 2]| Matrix::from_fn(2, 2, |i, j| entries[i][j]);
        StepSpan { mean: of(mean), slopes: vec![of(slope)], radius: Matrix::from_fn(2, 2, |_, _| radius) }
    }

    /// A product with a number that has overflowed has no finite radius, even if the factor is zero.
    #[test]
    fn no_zero_hides_an_overflow() {
        let none = [[0.0; 2]; 2];
        for radius in [0.0, 1e-15] {
            let left = span(&[[1.0, 0.0], [0.5, 0.0]], &none, radius);
            for bad in [f64::INFINITY, f64::NAN] {
                let of = [span(&[[1.0, 0.0], [0.0, bad]], &none, 1e-15), span(&[[1.0, 0.0], [0.0, 1.0]], &[[0.0, 0.0], [bad, 0.0]], 1e-15)];
                for right in of {
                    let product = left.times(&right);
                    assert!(product.radius.entries().iter().all(|entry| !entry.is_finite()), "{product:?}");
                    assert!(super::super::discs::decide(&product).is_none() && super::super::discs::decide(&left.times(&product)).is_none());
                }
                // Only zeros are skipped in the left matrix.
                let product = span(&[[bad, 0.0], [0.0, 1.0]], &none, radius).times(&left);
                assert!(!product.mean.is_finite() && !product.radius.is_finite(), "{product:?}");
            }
        }
    }

    /// The product of a long frame by halves encloses the exact products, with a radius far below that of the product in order.
    #[test]
    fn a_frame_by_halves_holds_all_of_its_products() {
        let turn = |angle: f64| [[angle.cos(), -angle.sin()], [angle.sin(), angle.cos()]];
        let kinds = [turn(0.7), [[1.0, 0.25], [0.0, 1.0]], [[1.0, -0.25], [0.5, 0.75]]];
        let slopes = [[[0.0, 1e-6], [0.0, 0.0]], [[0.0, 0.0], [2e-6, 0.0]], [[1e-6, 0.0], [0.0, -1e-6]]];
        let order: Vec<usize> = (0..101).map(|step| if step % 10 == 7 { 1 + step / 10 % 2 } else { 0 }).collect();
        let frame = FrameSpan { kinds: (0..3).map(|kind| span(&kinds[kind], &slopes[kind], 1e-12)).collect(), order: order.clone() };
        let (halves, in_order) = (frame.product(), frame.product_in_order());
        assert!(halves.radius.largest() < 1e-6 && in_order.radius.largest() > 1e3 * halves.radius.largest(), "{halves:?} {in_order:?}");
        for at in [-1.0, -0.4, 0.0, 0.9, 1.0] {
            let of = |kind: usize| Matrix::from_fn(2, 2, |i, j| kinds[kind][i][j] + at * slopes[kind][i][j] + if i == j { 1e-12 } else { -1e-12 });
            let exact = order.iter().fold(Matrix::identity(2), |product, kind| of(*kind).times(&product));
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let off = exact[(i, j)] - halves.mean[(i, j)] - at * halves.slopes[0][(i, j)];
                assert!(off.abs() <= halves.radius[(i, j)], "{at} {i} {j}: {off} {halves:?}");
            }
        }
    }

    /// A skipped entry counts by the least radius, and entries with a larger radius or with a slope count in full.
    #[test]
    fn entries_that_are_passed_over_count_by_the_least_radius() {
        let right = span(&[[1.0, 2.0], [3.0, 4.0]], &[[0.0, 0.5], [0.25, 0.0]], 0.125);
        let none = [[0.0; 2]; 2];
        // |M|·R' + R·|M'| + U·U', with U the slope and the radius together.
        let product = span(&none, &none, 0.5).times(&right);
        for (i, j, expected) in [(0, 0, 0.5 * 4.0 + 0.5 * (0.125 + 0.375)), (1, 1, 0.5 * 6.0 + 0.5 * (0.625 + 0.125))] {
            assert!((product.radius[(i, j)] / expected - 1.0).abs() < 1e-12 && product.radius[(i, j)] >= expected, "{product:?}");
        }
        let mut wide = span(&none, &[[0.0, 0.0], [0.0, 1.0]], 0.5);
        wide.radius[(0, 1)] = 1.5;
        let product = wide.times(&right);
        for (i, j, expected) in [
            (0, 0, 0.5 + 4.5 + 0.5 * 0.125 + 1.5 * 0.375),
            (1, 1, 0.5 * 6.0 + 0.5 * 0.625 + 1.5 * 0.125),
            (1, 0, 0.5 * 4.0 + 0.5 * 0.125 + 1.5 * 0.375),
        ] {
            assert!((product.radius[(i, j)] / expected - 1.0).abs() < 1e-12 && product.radius[(i, j)] >= expected, "{i} {j} {expected} {product:?}");
        }
        assert_eq!(product.slopes[0].row(1), [3.0, 4.0]);
    }
}
