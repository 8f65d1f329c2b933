//! Numbers of a run as live control shows them.

use std::time::Duration;

use cohaptic_control::{LinkCounters, Quantiles};
use cohaptic_realtime::LatenessSummary;
use cohaptic_wan::{DropCause, LinkStats};

/// What a link did, without what only some commands know.
pub(crate) fn counters(stats: &LinkStats) -> LinkCounters {
    LinkCounters {
        offered: stats.offered(),
        duplicated: stats.duplicated(),
        delivered: stats.delivered(),
        dropped: DropCause::ALL.into_iter().map(|cause| (cause.name(), stats.dropped(cause))).collect(),
        marked: stats.marked(),
        damaged: stats.damaged(),
        in_flight: stats.in_flight(),
        mean_delay: stats.mean_delay(),
        ..LinkCounters::default()
    }
}

/// How late things were.
pub(crate) fn quantiles(summary: &LatenessSummary) -> Quantiles {
    let LatenessSummary { count, sum, p50, p99, p999, max } = *summary;
    Quantiles { count, sum, p50, p99, p999, max }
}

/// The quantiles of some spans, in any order.
pub(crate) fn quantiles_of(spans: &[Duration]) -> Quantiles {
    let mut sorted = spans.to_vec();
    sorted.sort_unstable();
    let at = |thousandths: usize| sorted.get((sorted.len() * thousandths).div_ceil(1000).saturating_sub(1)).copied().unwrap_or_default();
    Quantiles {
        count: sorted.len() as u64,
        sum: sorted.iter().sum(),
        p50: at(500),
        p99: at(990),
        p999: at(999),
        max: sorted.last().copied().unwrap_or_default(),
    }
}
