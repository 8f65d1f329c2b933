//! What a hand wants over time: a force or a motion, as a function of time.

use alloc::sync::Arc;
use alloc::vec::Vec;

use cohaptic_units::{Hertz, Instant, RadPerSec};

/// A function of time with up to three components; components beyond the scene's axes are zero.
///
/// The unit is that of its use: N for a force, m for a wanted motion.
#[derive(Clone, PartialEq, Debug)]
pub enum Signal {
    /// The same at all times.
    Constant([f64; 3]),
    /// amplitude·sin(2π·frequency·t + phase).
    Sine {
        /// Amplitude of each component.
        amplitude: [f64; 3],
        /// Frequency, the same for all.
        frequency: Hertz,
        /// Phase \[rad\], the same for all.
        phase: f64,
    },
    /// Measured rows, linear in between.
    Table(Arc<Table>),
}

impl Signal {
    /// The value at `t`.
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

    /// The derivative with respect to time at `t` \[per s\]; for a table, the slope of the segment that begins at or before `t`.
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

    /// Whether the signal is the same at all times.
    #[must_use]
    pub const fn is_constant(&self) -> bool {
        matches!(self, Self::Constant(_))
    }
}

/// The first A of three components.
fn take<const A: usize>(value: &[f64; 3]) -> [f64; A] {
    core::array::from_fn(|axis| value.get(axis).copied().unwrap_or(0.0))
}

/// Rows (t, value) in order of time. Linear between rows; before the first and after the last row, the value of that row.
#[derive(Clone, PartialEq, Debug)]
pub struct Table {
    rows: Vec<(Instant, [f64; 3])>,
}

/// Why rows are no table.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
pub enum TableError {
    /// There is no row.
    #[error("there is no row")]
    Empty,
    /// A row is not later than the one before it. Rows count from zero.
    #[error("row {row} at {at} is not later than the row before it, at {before}")]
    NotLater {
        /// Which row.
        row: usize,
        /// Its time.
        at: Instant,
        /// The time of the row before it.
        before: Instant,
    },
    /// A value is not finite.
    #[error("row {row} holds {value}, which is not a finite number")]
    NotFinite {
        /// Which row.
        row: usize,
        /// The value.
        value: f64,
    },
}

impl Table {
    /// Checks the rows.
    ///
    /// # Errors
    ///
    /// [`TableError`] if there are no rows, they are not in strictly increasing order of time, or a value is not finite.
    pub fn new(rows: Vec<(Instant, [f64; 3])>) -> Result<Self, TableError> {
        if rows.is_empty() {
            return Err(TableError::Empty);
        }
        for (row, (at, values)) in rows.iter().enumerate() {
            if let Some(value) = values.iter().copied().find(|value| !value.is_finite()) {
                return Err(TableError::NotFinite { row, value });
            }
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

    /// The rows around `t`, or the value that holds outside of them.
    #[expect(clippy::type_complexity, reason = "two neighbouring rows, used twice, above")]
    fn segment(&self, t: Instant) -> Result<((Instant, [f64; 3]), (Instant, [f64; 3])), [f64; 3]> {
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
