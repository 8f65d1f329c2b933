//! The watcher of the work.

use crate::Row;

/// Observer of a measurement, who sees each row as it is measured and may end the work.
pub trait Watch {
    /// Takes a finished row.
    fn row(&self, row: &Row);

    /// Returns whether the measurement is to end early.
    fn stops(&self) -> bool;
}

/// A watcher that ignores the rows and never ends the work.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn row(&self, _row: &Row) {}

    fn stops(&self) -> bool {
        false
    }
}
