//! Rows as their readers meet them: files that read back, well-formed documents, and an orderly end.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]
#![allow(clippy::float_cmp, reason = "what is written is what was measured, to the bit")]

mod analysis;
mod documents;
mod network;
mod plots;
mod program;
mod real_time;
mod rows;
mod watching;

use cohaptic_accuracy::{Row, Subject};

/// Returns a row of made-up numbers.
pub(crate) fn row(method: &str, cost: Option<f64>, error: Option<f64>) -> Row {
    Row {
        subject: Subject::Motion,
        case: "a case".to_owned(),
        method: method.to_owned(),
        setting: "4 steps".to_owned(),
        cost,
        cost_unit: "ns a tick",
        error,
        error_unit: "position [m]",
        reference: "a formula",
        note: String::new(),
    }
}
