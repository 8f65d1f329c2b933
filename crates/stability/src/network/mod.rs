//! When samples arrive if nothing is left to chance.

use std::sync::Arc;
use std::time::Duration;

/// How long the n-th sample of a sender takes on a link.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) enum LinkTiming {
    /// All the same.
    Constant(Duration),
    /// The pattern repeats with its length; `None`: that sample never arrives.
    Pattern(Arc<[Option<Duration>]>),
}

use cohaptic_scene::Scene;

use crate::AnalysisError;

#[derive(Clone, Debug)]
pub(crate) struct NominalNetwork {
    timings: Vec<Vec<LinkTiming>>,
    uniform: bool,
    pub(crate) notes: Vec<String>,
}

impl NominalNetwork {
    pub(crate) fn of(scene: &Scene) -> Result<Self, AnalysisError> {
        let n = scene.peers.len();
        let timings: Vec<Vec<LinkTiming>> = (0..n)
            .map(|from| {
                (0..n).map(|to| LinkTiming::Constant(if from == to { Duration::ZERO } else { scene.links.between(from, to).mean_delay() })).collect()
            })
            .collect();
        let first = timings[0][1].clone();
        let uniform = (0..n).all(|from| (0..n).all(|to| from == to || timings[from][to] == first));
        Ok(Self { timings, uniform, notes: Vec::new() })
    }
    pub(crate) fn timing(&self, from: usize, to: usize) -> &LinkTiming {
        &self.timings[from][to]
    }
    pub(crate) fn is_uniform(&self) -> bool {
        self.uniform
    }
}
