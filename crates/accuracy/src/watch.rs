//! The watcher of the work, and the rows that the watcher sees.

use crate::{AccuracyError, Row};

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

/// Rows of a running measurement, and the watcher.
pub(crate) struct RowSink<'a> {
    pub(crate) rows: Vec<Row>,
    pub(crate) watch: &'a dyn Watch,
}

impl RowSink<'_> {
    /// Adds a row and shows it to the watcher. An error ends the measurement if the watcher asks for the end.
    pub(crate) fn push(&mut self, row: Row) -> Result<(), AccuracyError> {
        // The watcher sees the row before the measurement can end.
        self.watch.row(&row);
        self.rows.push(row);
        self.check()
    }

    /// Returns [`AccuracyError::Stopped`] if the watcher asks for the end.
    pub(crate) fn check(&self) -> Result<(), AccuracyError> {
        if self.watch.stops() { Err(AccuracyError::Stopped) } else { Ok(()) }
    }
}
