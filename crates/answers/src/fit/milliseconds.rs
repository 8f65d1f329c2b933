//! Times in the text about a fit.

/// Returns a time [s] in milliseconds, with five decimals.
pub(super) fn milliseconds(seconds: f64) -> String {
    format!("{:.5} ms", seconds * 1e3)
}
