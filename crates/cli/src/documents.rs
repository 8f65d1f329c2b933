//! Parts of JSON documents that several commands share.

use std::time::Duration;

pub(crate) use cohaptic_answers::{access_line, link, link_quantiles, link_totals, measures_of, peer, peer_links, rotation};
#[cfg(target_os = "linux")]
use cohaptic_realtime::LatenessSummary;
use serde::Serialize;

use crate::document_schema::document;

/// Returns the quantiles of a lateness \[µs\].
#[cfg(target_os = "linux")]
pub(crate) fn lateness(summary: &LatenessSummary) -> impl Serialize + use<> {
    let LatenessSummary { count, p50, p99, p999, max, sum: _ } = *summary;
    document! { count: count, p50: micros(p50), p99: micros(p99), p999: micros(p999), max: micros(max) }
}

/// Converts a span to microseconds.
pub(crate) fn micros(span: Duration) -> f64 {
    span.as_secs_f64() * 1e6
}
