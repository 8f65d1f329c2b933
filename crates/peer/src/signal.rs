//! Signals of a hand: a force or a wanted motion as a function of time.

use alloc::sync::Arc;
use alloc::vec::Vec;

use cohaptic_units::{Hertz, Instant, RadPerSec};

/// A function of time with up to three components; components beyond the scene's axes are zero.
///
/// The unit depends on the use: N for a force, m for a wanted motion.
#[derive(Clone, PartialEq, Debug)]
pub enum Signal {
    /// A constant value.
    Constant([f64; 3]),
    /// amplitude·sin(2π·frequency·t + phase).
    Sine {
        /// Amplitude of each component.
        amplitude: [f64; 3],
        /// Frequency of all components.
        frequency: Hertz,
        /// Phase \[rad\] of all components.
        phase: f64,
    },
    /// Measured rows with linear interpolation.
    Table(Arc<Table>),
}

impl Signal {
    /// Returns the value at `t`.
    #[must_use]
    pub fn value<const A: usize>(&self, t: Instant) -> [f64; A] {
        match self {
            Self::Constant(value) => take(value),
            Self::Sine { amplitude, frequency, phase } => {
                let sine = libm::sin(RadPerSec::from(*frequency).0 * t.as_secs_f64() + phase);
                take(&amplitude.map(|a| a * sine))
            }
            Self::Table(table) => take(&table.value(t)),
        }
    }

    /// Returns the derivative with respect to time at `t` \[per s\]; for a table, the slope of the segment that begins at or before `t`.
    #[must_use]
    pub fn slope<const A: usize>(&self, t: Instant) -> [f64; A] {
        match self {
            Self::Constant(_) => [0.0; A],
            Self::Sine { amplitude, frequency, phase } => {
                let omega = RadPerSec::from(*frequency).0;
                let cosine = omega * libm::cos(omega * t.as_secs_f64() + phase);
                take(&amplitude.map(|a| a * cosine))
            }
            Self::Table(table) => take(&table.slope(t)),
        }
    }

    /// Returns whether the signal is a constant.
    #[must_use]
    pub const fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

/// Returns the first A of three components.
fn take<const A: usize>(value: &[f64; 3]) -> [f64; A] {
    core::array::from_fn(|axis| value.get(axis).copied().unwrap_or(0.0))
}

/// Rows (t, value) in order of time, with linear interpolation. Before the first row and after the last row, the value is constant.
#[derive(Clone, PartialEq, Debug)]
pub struct Table {
    rows: Vec<(Instant, [f64; 3])>,
}

/// Reason for the refusal of rows.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum TableError {
    /// The list of rows is empty.
    #[error("there is no row")]
    Empty,
    /// A row is not later than its predecessor.
    #[error("row {row} at {at} is not later than the row before it, at {before}")]
    NotLater {
        /// Index of the row, from 0.
        row: usize,
        /// Time of the row.
        at: Instant,
        /// Time of its predecessor.
        before: Instant,
    },
    /// A value is infinite or NaN.
    #[error("row {row} holds {value}, which is not a finite number")]
    NotFinite {
        /// Index of the row, from 0.
        row: usize,
        /// The value that is not finite.
        value: f64,
    },
}

impl Table {
    /// Checks the rows and returns the table.
    ///
    /// # Errors
    ///
    /// [`TableError`] for an empty list, for rows that are not in strictly increasing order of time, and for values that are not finite.
    pub fn new(rows: Vec<(Instant, [f64; 3])>) -> Result<Self, TableError> {
        if rows.is_empty() {
            return Err(TableError::Empty);
        }
        for (row, (at, values)) in rows.iter().enumerate() {
            if let Some(value) = values.iter().copied().find(|value| !value.is_finite()) {
                return Err(TableError::NotFinite { row, value });
            }
            // Equal times are refused too: the slope between two rows divides by their distance.
            if let Some(before) = row.checked_sub(1).map(|previous| rows[previous].0)
                && *at <= before
            {
                return Err(TableError::NotLater { row, at: *at, before });
            }
        }
        Ok(Self { rows })
    }

    fn value(&self, t: Instant) -> [f64; 3] {
        match self.segment(t) {
            Ok(((t0, v0), (t1, v1))) => {
                // A segment lasts at least 1 ns, because rows are strictly increasing.
                let share = (t - t0).as_secs_f64() / (t1 - t0).as_secs_f64();
                core::array::from_fn(|axis| v0[axis] + share * (v1[axis] - v0[axis]))
            }
            Err(value) => value,
        }
    }

    fn slope(&self, t: Instant) -> [f64; 3] {
        match self.segment(t) {
            Ok(((t0, v0), (t1, v1))) => core::array::from_fn(|axis| (v1[axis] - v0[axis]) / (t1 - t0).as_secs_f64()),
            Err(_) => [0.0; 3],
        }
    }

    /// Returns the two rows around `t`, or the constant value outside of all rows.
    #[expect(clippy::type_complexity, reason = "two neighbouring rows, used twice, above")]
    fn segment(&self, t: Instant) -> Result<((Instant, [f64; 3]), (Instant, [f64; 3])), [f64; 3]> {
        // `next` is the first row after `t`, so its predecessor is at or before `t`.
        let next = self.rows.partition_point(|(at, _)| *at <= t);
        match (next.checked_sub(1).map(|previous| self.rows[previous]), self.rows.get(next)) {
            (Some(previous), Some(next)) => Ok((previous, *next)),
            (Some((_, last)), None) => Err(last),
            (None, Some((_, first))) => Err(*first),
            (None, None) => Err([0.0; 3]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(millis: u64) -> Instant {
        Instant::from_nanos(millis * 1_000_000)
    }

    #[test]
    fn a_table_is_linear_between_rows_and_constant_outside() {
        let table = Signal::Table(Arc::new(Table::new(vec![(at(100), [1.0, 0.0, 0.0]), (at(300), [2.0, -4.0, 0.0])]).unwrap()));
        assert_eq!(table.value::<2>(at(0)), [1.0, 0.0]);
        assert_eq!(table.value::<2>(at(100)), [1.0, 0.0]);
        assert_eq!(table.value::<2>(at(200)), [1.5, -2.0]);
        assert_eq!(table.value::<2>(at(300)), [2.0, -4.0]);
        assert_eq!(table.value::<2>(at(999)), [2.0, -4.0]);
        assert_eq!(table.slope::<1>(at(100)), [5.0]);
        assert_eq!(table.slope::<1>(at(300)), [0.0]);
    }

    #[test]
    fn a_table_that_is_none_is_refused() {
        assert_eq!(Table::new(vec![]), Err(TableError::Empty));
        assert!(matches!(Table::new(vec![(at(1), [0.0; 3]), (at(1), [0.0; 3])]), Err(TableError::NotLater { row: 1, .. })));
        assert!(matches!(Table::new(vec![(at(1), [f64::NAN, 0.0, 0.0])]), Err(TableError::NotFinite { row: 0, .. })));
    }

    #[test]
    fn a_sine_and_its_slope_are_a_quarter_period_apart() {
        let sine = Signal::Sine { amplitude: [2.0, 0.0, 0.0], frequency: Hertz(0.5), phase: 0.0 };
        // sin(π/2) = 1 and cos(π/2) = 0 at t = 0.5 s; the slope at 0 is 2·π.
        assert!((sine.value::<1>(at(500))[0] - 2.0).abs() < 1e-15);
        assert!((sine.slope::<1>(at(0))[0] - 2.0 * core::f64::consts::PI).abs() < 1e-15);
    }
}
