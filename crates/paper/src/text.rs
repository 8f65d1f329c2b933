//! Numbers as words.

/// A share as a percentage.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Shares as percentages, one after the other.
pub(crate) fn percents(shares: &[f64]) -> String {
    let all: Vec<String> = shares.iter().map(|share| format!("{:.1}", 100.0 * share)).collect();
    format!("{} %", all.join(", "))
}

/// A time [s], or that there is none.
pub(crate) fn seconds(time: Option<f64>) -> String {
    time.map_or_else(|| "not reached".to_owned(), |time| format!("{time:.3} s"))
}
