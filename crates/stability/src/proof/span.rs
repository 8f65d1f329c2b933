//! Matrices over a box: a mean, a slope along each number, and a radius for all else.
//!
//! With sᵢ ∈ [−1, 1] where in the box a number is, M(s) = M₀ + Σ sᵢ·Mᵢ + E, |E| ≤ R entry by entry (a Taylor model of the first order, Makino & Berz 2003). Products of the errors, of slopes
//! with each other and the rounding of all go into R, so that R is of the second order in the width of the box.

use super::steps::StepMatrix;
use crate::Matrix;
use crate::worst_case::rounding::{UNDERFLOW, UNIT, gamma, outward, real};

/// A matrix over a box.
#[derive(Clone, Debug)]
pub(super) struct StepSpan {
    pub(super) mean: Matrix,
    pub(super) slopes: Vec<Matrix>,
    pub(super) radius: Matrix,
}

impl StepSpan {
    /// A step between 2ⁿ corners, in the order of the bits of their places: multi-affine, so that it is the sum of its effects (Yates 1937), of which those of several numbers together
    /// go into the radius.
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
                // Each effect is within n roundings of the largest corner, and there are 2ⁿ.
                span.radius[(row, column)] = outward(radius + error + real(corners.len()) * gamma(numbers + 2) * largest);
            }
        }
        span
    }

    /// The same matrix all over a box of this number of numbers.
    pub(super) fn constant(mean: Matrix, numbers: usize) -> Self {
        let none = Matrix::zeros(mean.rows(), mean.columns());
        Self { slopes: vec![none.clone(); numbers], radius: none, mean }
    }

    /// With radii that are larger by a factor.
    pub(super) fn widened(mut self, by: f64) -> Self {
        self.radius = self.radius.scaled(by);
        self
    }

    /// Over a box with one more number, which changes nothing.
    pub(super) fn with_another_number(mut self) -> Self {
        self.slopes.push(Matrix::zeros(self.mean.rows(), self.mean.columns()));
        self
    }

    pub(super) fn transposed(&self) -> Self {
        Self { mean: self.mean.transposed(), slopes: self.slopes.iter().map(Matrix::transposed).collect(), radius: self.radius.transposed() }
    }

    /// The sum of two matrices over the same box.
    pub(super) fn plus(&self, other: &Self) -> Self {
        let sum = |one: &Matrix, other: &Matrix| plus(one, other);
        let slopes: Vec<Matrix> = self.slopes.iter().zip(&other.slopes).map(|(one, other)| sum(one, other)).collect();
        let (mean, radius) = (sum(&self.mean, &other.mean), sum(&self.radius, &other.radius));
        // Each sum rounds once.
        let rounded = |i: usize, j: usize| UNIT * (mean[(i, j)].abs() + slopes.iter().map(|slope| slope[(i, j)].abs()).sum::<f64>());
        let radius = Matrix::from_fn(mean.rows(), mean.columns(), |i, j| outward(radius[(i, j)] + rounded(i, j)));
        Self { mean, slopes, radius }
    }

    pub(super) fn negated(&self) -> Self {
        Self { mean: self.mean.scaled(-1.0), slopes: self.slopes.iter().map(|slope| slope.scaled(-1.0)).collect(), radius: self.radius.clone() }
    }

    /// T·M·Tᵀ.
    pub(super) fn through(&self, by: &Self) -> Self {
        by.times(self).times(&by.transposed())
    }

    /// The largest size that each entry can have.
    pub(super) fn largest(&self) -> Matrix {
        self.reach(|matrix, i, j| matrix[(i, j)].abs())
    }

    fn reach(&self, mean: impl Fn(&Matrix, usize, usize) -> f64) -> Matrix {
        let slopes = |i, j| self.slopes.iter().map(|slope| slope[(i, j)].abs()).sum::<f64>();
        Matrix::from_fn(self.mean.rows(), self.mean.columns(), |i, j| outward(mean(&self.mean, i, j) + slopes(i, j) + self.radius[(i, j)]))
    }

    /// This matrix times another over the same box.
    pub(super) fn times(&self, other: &Self) -> Self {
        let mut slopes = Vec::with_capacity(self.slopes.len());
        for (own, others) in self.slopes.iter().zip(&other.slopes) {
            slopes.push(plus(&own.times(&other.mean), &self.mean.times(others)));
        }
        // The effects of any two numbers, and whatever has an error: what of one is no mean with what of the other is none.
        let uneven = |span: &Self| span.reach(|_, _, _| 0.0);
        let (own, others) = (uneven(self), uneven(other));
        let sizes = absolute(&self.mean).times(&absolute(&other.mean));
        let by_mean = plus(&absolute(&self.mean).times(&other.radius), &self.radius.times(&absolute(&other.mean)));
        let by_both = own.times(&others);
        let inner = self.mean.columns();
        // Each product of sums of `inner` terms, and the sum of two, of mean and slopes.
        let share = gamma(2 * inner + 4) * real(1 + self.slopes.len());
        let whole = self.largest().times(&other.largest());
        let entry = |i: usize, j: usize| {
            outward(outward(by_mean[(i, j)] + by_both[(i, j)] + share * (sizes[(i, j)] + whole[(i, j)]))) + real(inner) * UNDERFLOW
        };
        Self { mean: self.mean.times(&other.mean), slopes, radius: Matrix::from_fn(self.mean.rows(), other.mean.columns(), entry) }
    }

    /// The product of all steps of a frame, the first at the right.
    pub(super) fn product(steps: &[Self]) -> Self {
        let mut frame = steps[0].clone();
        for step in &steps[1..] {
            frame = step.times(&frame);
        }
        frame
    }
}

fn plus(one: &Matrix, other: &Matrix) -> Matrix {
    Matrix::from_fn(one.rows(), one.columns(), |i, j| one[(i, j)] + other[(i, j)])
}

pub(super) fn absolute(of: &Matrix) -> Matrix {
    Matrix::from_fn(of.rows(), of.columns(), |i, j| of[(i, j)].abs())
}
