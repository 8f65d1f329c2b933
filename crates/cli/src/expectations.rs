//! Table of expectations and their outcomes, for the pages of `run` and `check`.

use cohaptic_answers::OutcomeDocument;
use cohaptic_picture::Gauge;
use cohaptic_picture::page::{Html, Mark, Table};

/// Returns the cells of a row: verdict, name of the expectation, expected range, measured value, and a bar of range and value.
pub(crate) fn cells(outcome: &OutcomeDocument) -> [Html; 5] {
    let OutcomeDocument { name, low, high, measured, passed, expected, found, .. } = outcome;
    let gauge = Gauge { low: *low, high: *high, measured: *measured, passed: *passed };
    let bar = if low.is_some() || high.is_some() { Html::gauge(&gauge) } else { Html::text("no number") };
    [verdict(*passed), name.as_str().into(), expected.as_str().into(), found.as_str().into(), bar]
}

/// Returns a verdict. Text and mark tell the result also without colours.
pub(crate) fn verdict(passed: bool) -> Html {
    if passed { Html::mark(Mark::Good, "✓ passed") } else { Html::mark(Mark::Bad, "✗ FAILED") }
}

/// Returns an empty table with the columns of [`cells`].
pub(crate) fn columns() -> Table {
    Table::new().column("verdict").column("expectation").column("expected").column("came out").column("limits and value")
}

/// Explanation of the bars, for the page with the table.
pub(crate) const BARS: &str = "All bars have one axis: the lower limit lies at the left mark and the upper limit at the right one, and grey is the expected range. The value that came out is a \
    disc where it passed and a cross where it failed; beyond the axis it is a triangle at the end. Where there is one limit, zero, or twice a lower limit, lies where the other mark would be.";
