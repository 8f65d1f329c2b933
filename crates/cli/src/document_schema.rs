//! Kinds of JSON documents, the macro for documents, and parts shared by several documents. Each document begins with its kind and version.

use std::time::Duration;

pub(crate) use cohaptic_answers::document;
use cohaptic_realtime::LatenessSummary;
use serde::Serialize;

/// Kind of a JSON document. The name never changes. The version increases when a key vanishes or changes its meaning, but not for new keys.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DocumentSchema {
    name: &'static str,
    version: u32,
}

impl DocumentSchema {
    pub(crate) const RUN: Self = Self { name: "cohaptic/run", version: 1 };
    pub(crate) const CHECK: Self = Self { name: "cohaptic/check", version: 1 };
    pub(crate) const EXPLAIN: Self = Self { name: "cohaptic/explain", version: 1 };
    pub(crate) const CAMPAIGN: Self = Self { name: "cohaptic/campaign", version: 1 };
    pub(crate) const SHARD: Self = Self { name: "cohaptic/shard", version: 1 };
    pub(crate) const STATUS: Self = Self { name: "cohaptic/status", version: 1 };
    pub(crate) const COMPARE: Self = Self { name: "cohaptic/compare", version: 1 };
    pub(crate) const STABILITY_POINT: Self = Self { name: "cohaptic/stability-point", version: 1 };
    pub(crate) const STABILITY_MAP: Self = Self { name: "cohaptic/stability-map", version: 1 };
    pub(crate) const STABILITY_BOUNDARY: Self = Self { name: "cohaptic/stability-boundary", version: 1 };
    pub(crate) const STABILITY_LINE: Self = Self { name: "cohaptic/stability-line", version: 1 };
    pub(crate) const STABILITY_REGION: Self = Self { name: "cohaptic/stability-region", version: 1 };
    pub(crate) const STABILITY_CERTIFICATE: Self = Self { name: "cohaptic/stability-certificate", version: 1 };
    pub(crate) const STABILITY_NUMBER_CERTIFICATE: Self = Self { name: "cohaptic/stability-number-certificate", version: 1 };
    pub(crate) const STABILITY_SWITCHING_CERTIFICATE: Self = Self { name: "cohaptic/stability-switching-certificate", version: 1 };
    pub(crate) const ADMITTANCE: Self = Self { name: "cohaptic/admittance", version: 1 };
    pub(crate) const LIVE: Self = Self { name: "cohaptic/live", version: 1 };
    pub(crate) const JOIN: Self = Self { name: "cohaptic/join", version: 1 };
    pub(crate) const RELAY: Self = Self { name: "cohaptic/relay", version: 1 };
    pub(crate) const RELAY_TCP: Self = Self { name: "cohaptic/relay-tcp", version: 1 };
    pub(crate) const ROUTER: Self = Self { name: "cohaptic/router", version: 1 };
    pub(crate) const EXEC: Self = Self { name: "cohaptic/exec", version: 1 };
    pub(crate) const EXEC_TRIALS: Self = Self { name: "cohaptic/exec-trials", version: 1 };
    pub(crate) const FALCON_PROBE: Self = Self { name: "cohaptic/falcon-probe", version: 1 };
    pub(crate) const FALCON_HOME: Self = Self { name: "cohaptic/falcon-home", version: 1 };
    pub(crate) const FALCON_WATCH: Self = Self { name: "cohaptic/falcon-watch", version: 1 };
    pub(crate) const FALCON_SIMULATE: Self = Self { name: "cohaptic/falcon-simulate", version: 1 };
    pub(crate) const INVERSE3_PROBE: Self = Self { name: "cohaptic/inverse3-probe", version: 1 };
    pub(crate) const INVERSE3_WATCH: Self = Self { name: "cohaptic/inverse3-watch", version: 1 };
    pub(crate) const INVERSE3_SIMULATE: Self = Self { name: "cohaptic/inverse3-simulate", version: 1 };
    pub(crate) const INVERSE3_SERVE: Self = Self { name: "cohaptic/inverse3-serve", version: 1 };
    pub(crate) const LINK: Self = Self { name: "cohaptic/link", version: 1 };
    pub(crate) const PROFILES: Self = Self { name: "cohaptic/profiles", version: 1 };
    pub(crate) const FIT: Self = Self { name: "cohaptic/fit", version: 1 };
    pub(crate) const STUDY_DRY_RUN: Self = Self { name: "cohaptic/study-dry-run", version: 1 };
    pub(crate) const STUDY_REPORT: Self = Self { name: "cohaptic/study-report", version: 1 };
    pub(crate) const STUDY_VERIFY: Self = Self { name: "cohaptic/study-verify", version: 1 };
    pub(crate) const PAPER: Self = Self { name: "cohaptic/paper", version: 1 };
    pub(crate) const ERROR: Self = Self { name: "cohaptic/error", version: 1 };

    /// Returns `document` with kind and version before all other keys.
    pub(crate) const fn of<D: Serialize>(self, document: &D) -> Versioned<'_, D> {
        Versioned { schema: self.name, version: self.version, document }
    }
}

/// Document after kind and version.
#[derive(Serialize)]
pub(crate) struct Versioned<'a, D: Serialize> {
    schema: &'static str,
    version: u32,
    #[serde(flatten)]
    document: &'a D,
}

/// Returns the quantiles of a lateness \[µs\].
pub(crate) fn lateness(summary: &LatenessSummary) -> impl Serialize + use<> {
    let LatenessSummary { count, p50, p99, p999, max, sum: _ } = *summary;
    document! { count: count, p50: micros(p50), p99: micros(p99), p999: micros(p999), max: micros(max) }
}

/// Converts a span to microseconds.
pub(crate) fn micros(span: Duration) -> f64 {
    span.as_secs_f64() * 1e6
}
