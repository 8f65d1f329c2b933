//! Empirical law: a law given by measured delays, or by quantiles.

use alloc::vec::Vec;
use core::fmt;

use super::tail::Tail;

/// Law given by its quantiles at 0, 1/(n − 1), …, 1, with linear interpolation in between.
///
/// For a sample the law is the piecewise linear quantile function through the order statistics (Hyndman & Fan 1996, definition 7). [`mean`](Self::mean) and
/// [`sd`](Self::sd) are moments of the interpolated law. A [`Law`](super::Law) with exactly these moments has the values unchanged; a law with different
/// moments has the values shifted and stretched.
#[derive(Clone, PartialEq, Debug)]
pub struct Empirical {
    knots: Vec<f64>,
    mean: f64,
    sd: f64,
}

/// Reason for the refusal of values as a law.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum EmpiricalError {
    /// There are fewer than two values, or more than [`Empirical::MOST`].
    Count {
        /// Number of values.
        found: usize,
    },
    /// A value is NaN or infinite, or its square could overflow.
    NotANumber {
        /// Index of the value, from zero.
        index: usize,
        /// Refused value.
        found: f64,
    },
    /// All values are equal, without a deviation to stretch.
    Constant {
        /// Common value.
        value: f64,
    },
}

impl fmt::Display for EmpiricalError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count { found } => write!(f, "an empirical law has {found} values: expected 2 to {}", Empirical::MOST),
            Self::NotANumber { index, found } => {
                write!(f, "value {} of an empirical law is {found}: expected a number of size below 1e150", index + 1)
            }
            Self::Constant { value } => write!(f, "all values of an empirical law are {value}: expected two different ones"),
        }
    }
}

impl core::error::Error for EmpiricalError {}

impl Empirical {
    /// Largest number of values.
    pub const MOST: usize = 1 << 20;

    /// Returns the law through the given values, in any order: delays, or quantiles at equal steps of probability.
    ///
    /// # Errors
    ///
    /// [`EmpiricalError`] if there are too few or too many values, a value is not a number, or all values are equal.
    pub fn new(mut values: Vec<f64>) -> Result<Self, EmpiricalError> {
        if !(2..=Self::MOST).contains(&values.len()) {
            return Err(EmpiricalError::Count { found: values.len() });
        }
        // Squares of numbers below 10^150 stay finite, also as a sum of 2^20 squares.
        if let Some((index, &found)) = values.iter().enumerate().find(|(_, value)| value.is_nan() || value.abs() >= 1e150) {
            return Err(EmpiricalError::NotANumber { index, found });
        }
        values.sort_by(f64::total_cmp);
        let (mean, sd) = moments(&values);
        if sd == 0.0 {
            return Err(EmpiricalError::Constant { value: values[0] });
        }
        Ok(Self { knots: values, mean, sd })
    }

    /// Returns the mean of the interpolated law.
    #[must_use]
    pub const fn mean(&self) -> f64 {
        self.mean
    }

    /// Returns the standard deviation of the interpolated law.
    #[must_use]
    pub const fn sd(&self) -> f64 {
        self.sd
    }

    /// Returns the values in ascending order.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Returns the interpolated value at a place of the law.
    pub(super) fn at(&self, place: Tail) -> f64 {
        // Cells are counted from the end of the given probability, so both tails keep their digits.
        let last = self.knots.len() - 1;
        match place {
            Tail::Below(p) => {
                let (cell, part) = split(p, last);
                self.knots[cell] + part * (self.knots[cell + 1] - self.knots[cell])
            }
            Tail::Above(q) => {
                let (cell, part) = split(q, last);
                self.knots[last - cell] - part * (self.knots[last - cell] - self.knots[last - cell - 1])
            }
        }
    }

    /// Returns the probabilities of at most x and of more than x.
    pub(super) fn tails(&self, x: f64) -> (f64, f64) {
        let upper = self.knots.partition_point(|&knot| knot <= x);
        let last = self.knots.len() - 1;
        // Below the first and above the last value one of both neighbours is missing.
        let (Some(&left), Some(&right)) = (upper.checked_sub(1).and_then(|i| self.knots.get(i)), self.knots.get(upper)) else {
            return if upper == 0 { (0.0, 1.0) } else { (1.0, 0.0) };
        };
        // `left` is at most x and `right` is above x, so the difference is above zero.
        let part = (x - left) / (right - left);
        ((real(upper - 1) + part) / real(last), (real(last - upper) + (1.0 - part)) / real(last))
    }
}

/// Returns the cell of the probability `p` among `cells` equal cells, and the position in the cell from 0 to 1.
fn split(p: f64, cells: usize) -> (usize, f64) {
    let position = p * real(cells);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a position is neither negative nor above 2^20; a NaN becomes 0")]
    let cell = (position as usize).min(cells - 1);
    (cell, position - real(cell))
}

/// Returns mean and standard deviation of the law with uniform parts between neighbouring knots: each cell has the mean (a + b)/2 and the mean square (a² + ab
/// + b²)/3.
fn moments(knots: &[f64]) -> (f64, f64) {
    let cells = real(knots.len() - 1);
    // Differences from a value in the middle keep the digits of narrow laws.
    let middle = knots[knots.len() / 2];
    let average = |f: &dyn Fn(f64, f64) -> f64| knots.windows(2).map(|pair| f(pair[0], pair[1])).sum::<f64>() / cells;
    let mean = middle + average(&|a, b| 0.5 * ((a - middle) + (b - middle)));
    let square = |a: f64, b: f64| (a * a + a * b + b * b) / 3.0;
    (mean, libm::sqrt(average(&|a, b| square(a - mean, b - mean))))
}

#[expect(clippy::cast_precision_loss, reason = "there are at most 2^20 values")]
fn real(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_values_are_a_uniform_law() {
        let law = Empirical::new(vec![5.0, 1.0]).unwrap();
        assert_eq!((law.mean(), law.knots()), (3.0, &[1.0, 5.0][..]));
        assert!((law.sd() - 4.0 / libm::sqrt(12.0)).abs() < 1e-15);
        assert_eq!([Tail::Below(0.25), Tail::Above(0.25), Tail::Above(0.0)].map(|place| law.at(place)), [2.0, 4.0, 5.0]);
        assert_eq!([0.0, 1.0, 2.0, 5.0].map(|x| law.tails(x)), [(0.0, 1.0), (0.0, 1.0), (0.25, 0.75), (1.0, 0.0)]);
    }

    #[test]
    fn equal_values_are_a_jump_of_the_distribution() {
        let law = Empirical::new(vec![0.0, 2.0, 2.0, 4.0]).unwrap();
        assert_eq!(law.at(Tail::Above(0.5)), 2.0);
        assert_eq!(law.tails(2.0), (2.0 / 3.0, 1.0 / 3.0));
    }

    #[test]
    fn what_is_no_law_is_refused_with_the_reason() {
        let reason = |values: Vec<f64>| Empirical::new(values).unwrap_err().to_string();
        assert_eq!(reason(vec![1.0]), "an empirical law has 1 values: expected 2 to 1048576");
        assert_eq!(reason(vec![1.0, f64::NAN]), "value 2 of an empirical law is NaN: expected a number of size below 1e150");
        assert_eq!(reason(vec![2.0, 2.0]), "all values of an empirical law are 2: expected two different ones");
    }
}
