//! What kinds of JSON documents there are. Each says of which kind and version it is, before all else.

use serde::Serialize;

/// A kind of JSON document.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum DocumentSchema {
    Run,
    Check,
    Explain,
    Campaign,
    StabilityPoint,
    StabilityMap,
    StabilityBoundary,
    Admittance,
    Live,
    Relay,
    Router,
    FalconProbe,
    FalconHome,
    FalconWatch,
    FalconSimulate,
    Link,
    Fit,
    Paper,
    Accuracy,
    Error,
}

impl DocumentSchema {
    /// Its name, which never changes, and its version, which counts up where a key vanishes or changes its meaning; new keys do not change it.
    const fn name_and_version(self) -> (&'static str, u32) {
        match self {
            Self::Run => ("cohaptic/run", 1),
            Self::Check => ("cohaptic/check", 1),
            Self::Explain => ("cohaptic/explain", 1),
            Self::Campaign => ("cohaptic/campaign", 1),
            Self::StabilityPoint => ("cohaptic/stability-point", 1),
            Self::StabilityMap => ("cohaptic/stability-map", 1),
            Self::StabilityBoundary => ("cohaptic/stability-boundary", 1),
            Self::Admittance => ("cohaptic/admittance", 1),
            Self::Live => ("cohaptic/live", 1),
            Self::Relay => ("cohaptic/relay", 1),
            Self::Router => ("cohaptic/router", 1),
            Self::FalconProbe => ("cohaptic/falcon-probe", 1),
            Self::FalconHome => ("cohaptic/falcon-home", 1),
            Self::FalconWatch => ("cohaptic/falcon-watch", 1),
            Self::FalconSimulate => ("cohaptic/falcon-simulate", 1),
            Self::Link => ("cohaptic/link", 1),
            Self::Fit => ("cohaptic/fit", 1),
            Self::Paper => ("cohaptic/paper", 1),
            Self::Accuracy => ("cohaptic/accuracy", 1),
            Self::Error => ("cohaptic/error", 1),
        }
    }

    /// The document with its kind and version in front.
    pub(crate) const fn of<D: Serialize>(self, document: &D) -> Versioned<'_, D> {
        let (schema, version) = self.name_and_version();
        Versioned { schema, version, document }
    }
}

/// A document that says of which kind and version it is.
#[derive(Serialize)]
pub(crate) struct Versioned<'a, D: Serialize> {
    schema: &'static str,
    version: u32,
    #[serde(flatten)]
    document: &'a D,
}
