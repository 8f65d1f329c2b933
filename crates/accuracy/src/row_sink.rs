//! Where rows go as they are measured.

use crate::{AccuracyError, Row, Watch};

/// The rows so far, and the watcher.
pub(crate) struct RowSink<'a> {
    pub(crate) rows: Vec<Row>,
    pub(crate) watch: &'a dyn Watch,
}

impl RowSink<'_> {
    /// A row is done.
    ///
    /// # Errors
    ///
    /// [`AccuracyError::Stopped`] if the work is to be given up.
    pub(crate) fn push(&mut self, row: Row) -> Result<(), AccuracyError> {
        self.watch.row(&row);
        self.rows.push(row);
        self.check()
    }

    /// # Errors
    ///
    /// [`AccuracyError::Stopped`] if the work is to be given up.
    pub(crate) fn check(&self) -> Result<(), AccuracyError> {
        if self.watch.stops() { Err(AccuracyError::Stopped) } else { Ok(()) }
    }
}
