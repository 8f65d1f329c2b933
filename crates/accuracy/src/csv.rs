//! Rows as a file of comma-separated values (RFC 4180).

use std::fmt::Write as _;

use cohaptic_units::print::csv_field;

use crate::Row;

/// Header of the file, which ends with a line feed.
const HEADER: &str = "subject,case,method,setting,cost,cost_unit,error,error_unit,reference,note\n";

/// Returns the content of the file. Numbers read back to the same bits, and missing values are empty fields.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut text = HEADER.to_owned();
    for Row { subject, case, method, setting, cost, cost_unit, error, error_unit, reference, note } in rows {
        let number = |value: &Option<f64>| value.map(|value| format!("{value:e}")).unwrap_or_default();
        // Texts may contain commas and line breaks, so every field passes `csv_field`.
        let fields = [subject.name(), case, method, setting, &number(cost), cost_unit, &number(error), error_unit, reference, note].map(csv_field);
        // A write to a string does not fail.
        let _ = writeln!(text, "{}", fields.join(","));
    }
    text
}
