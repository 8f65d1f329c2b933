//! One method at one setting.

use crate::{AccuracyError, Subject, Watch};

/// What one method cost at one setting, and how wrong it was.
#[derive(Clone, PartialEq, Debug)]
pub struct Row {
    /// What the method is for.
    pub subject: Subject,
    /// The work that all methods of a group did: rows with the same subject, case and error unit lie in one plot.
    pub case: String,
    /// The method, without its setting: the rows of one method are one line of a plot.
    pub method: String,
    /// The setting: a number of sub-steps, of runs, and so on; empty if the method has none.
    pub setting: String,
    /// What it cost, in [`Row::cost_unit`]; `None` if that cannot be told, and then the row has a reason.
    pub cost: Option<f64>,
    /// The unit of the cost, with what it is for one of: "ns a draw".
    pub cost_unit: &'static str,
    /// How wrong it was, in [`Row::error_unit`]; not negative. `None` if there is no such number: a method that diverged, or does not answer this.
    pub error: Option<f64>,
    /// What the error is of, and its unit: "position \[m\]".
    pub error_unit: &'static str,
    /// What the error is against: a formula, a computation with more digits, an exact law.
    pub reference: &'static str,
    /// What a reader should know of this row; empty if nothing.
    pub note: String,
}

impl Row {
    /// A row that has no error yet.
    pub(crate) fn of(subject: Subject, case: &str, method: &str, setting: String, (cost, cost_unit): (f64, &'static str)) -> Self {
        let (case, method) = (case.to_owned(), method.to_owned());
        Self { subject, case, method, setting, cost: Some(cost), cost_unit, error: None, error_unit: "", reference: "", note: String::new() }
    }
}

/// The rows so far, and the watcher.
pub(crate) struct RowSink<'a> {
    pub(crate) rows: Vec<Row>,
    pub(crate) watch: &'a dyn Watch,
}

impl RowSink<'_> {
    /// A row is done.
    pub(crate) fn push(&mut self, row: Row) -> Result<(), AccuracyError> {
        self.watch.row(&row);
        self.rows.push(row);
        self.check()
    }

    pub(crate) fn check(&self) -> Result<(), AccuracyError> {
        if self.watch.stops() { Err(AccuracyError::Stopped) } else { Ok(()) }
    }
}
