//! Rows as a file of comma-separated values (RFC 4180).

use std::fmt::Write as _;

use crate::Row;

const HEADER: &str = "subject,case,method,setting,cost,cost_unit,error,error_unit,reference,note\n";

/// The file. Numbers read back the same; what there is not is empty.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut text = HEADER.to_owned();
    for Row { subject, case, method, setting, cost, cost_unit, error, error_unit, reference, note } in rows {
        let number = |value: &Option<f64>| value.map(|value| format!("{value:e}")).unwrap_or_default();
        let fields = [subject.name(), case, method, setting, &number(cost), cost_unit, &number(error), error_unit, reference, note].map(field);
        let _ = writeln!(text, "{}", fields.join(","));
    }
    text
}

/// A field, quoted where it must be.
fn field(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}
