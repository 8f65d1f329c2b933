//! The watcher of the work.

use crate::Row;

/// Sees each row as it is measured, and may end the work.
pub trait Watch {
    /// A row is done.
    fn row(&self, row: &Row);

    /// Whether the work is to be given up.
    fn stops(&self) -> bool;
}

/// Nobody watches.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn row(&self, _row: &Row) {}

    fn stops(&self) -> bool {
        false
    }
}
