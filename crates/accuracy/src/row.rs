//! Result of a method at a setting.

use crate::Subject;

/// Cost and error of a method at a setting.
#[derive(Clone, PartialEq, Debug)]
pub struct Row {
    /// Subject of the method.
    pub subject: Subject,
    /// Name of the work, the same for all methods of a group. Rows with the same subject, case, error unit and cost unit are one plot.
    pub case: String,
    /// Name of the method, without the setting. Rows of a method are a line of a plot.
    pub method: String,
    /// Setting, such as a number of sub-steps or of runs; empty for a method without settings.
    pub setting: String,
    /// Cost in [`Row::cost_unit`]; `None` for an unknown cost, explained by the note.
    pub cost: Option<f64>,
    /// Unit of the cost, with the work that is counted: "ns a draw".
    pub cost_unit: &'static str,
    /// Error in [`Row::error_unit`], not negative; `None` without such a number, as for a method that diverged or does not answer the question.
    pub error: Option<f64>,
    /// Quantity of the error and its unit: "position \[m\]".
    pub error_unit: &'static str,
    /// Reference of the error: a formula, a computation with more digits, or an exact law.
    pub reference: &'static str,
    /// Remark for readers; may be empty.
    pub note: String,
}

impl Row {
    /// Returns a row without an error.
    pub(crate) fn of(subject: Subject, case: &str, method: &str, setting: String, (cost, cost_unit): (f64, &'static str)) -> Self {
        let (case, method) = (case.to_owned(), method.to_owned());
        Self { subject, case, method, setting, cost: Some(cost), cost_unit, error: None, error_unit: "", reference: "", note: String::new() }
    }
}
