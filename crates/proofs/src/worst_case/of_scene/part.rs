//! The worst case of each part of a linear scene.

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Combination, NominalNetwork};
use cohaptic_stability::{AnalysisError, Part, PartKind, Watch};
use rayon::prelude::*;

use super::channel::{Channel, Link};
use super::error::SceneWorstCaseError;
use super::patterns::Patterns;
use super::prepared::{self, Prepared, Search};
use super::words;
use crate::worst_case::gripenberg::Effort;
use crate::worst_case::verified::Certificate;

/// The worst case of a part of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct WorstPart {
    /// Kind of the part: the moving bodies.
    pub kind: PartKind,
    /// Closed contacts, in words; empty for a linear scene.
    pub contacts: String,
    /// Number of states of the part, including held samples and samples on the way.
    pub dimension: usize,
    /// Lower bound of the growth per step.
    pub lower: f64,
    /// Upper bound of the growth per step; infinite if numbers overflowed.
    pub upper: f64,
    /// Upper bound of the growth per step by a quadratic certificate; `None` without a certificate.
    pub certificate: Option<f64>,
    /// Pattern of the lower bound, attained by endless repetition, in words; empty if the lower bound is zero or the part does not depend on the network.
    pub sequence: String,
    /// Number of steps of `sequence`.
    pub period: usize,
    /// Number of products of matrices computed in the search.
    pub products: u64,
    /// Upper bound of the errors of the frames' matrices, as the largest sum of absolute errors over a row.
    pub rounding: f64,
}

/// Returns the worst cases of the parts of a scene in one combination of contacts.
pub(super) fn of_combination(
    scene: &Scene,
    network: &NominalNetwork,
    combination: &Combination,
    patterns: &Patterns,
    (effort, watch): (&Effort, &dyn Watch),
) -> Result<Vec<WorstPart>, SceneWorstCaseError> {
    let structure = prepared::structure(scene, network, &combination.contacts, patterns)?;
    let Prepared { channels, searches, devices } = Prepared::of(scene, network, &structure, patterns)?;
    let peer = |class: usize| scene.peers[structure.classes[class][0]].name.as_str();
    let name = |channel: &Channel| channel.links.first().map(|link: &Link| format!("{} to {}", peer(link.from), peer(link.to))).unwrap_or_default();
    let searched = |search: &Search| {
        let found = search.automaton.worst_case_watched(effort, watch).ok_or(AnalysisError::Stopped)?;
        // The search and the certificate bound the growth independently, so the smaller bound holds.
        let certificate = found.certificate.as_ref().map(Certificate::rate);
        Ok(WorstPart {
            kind: search.kind,
            contacts: combination.name(),
            dimension: search.automaton.size(),
            lower: found.lower,
            upper: certificate.map_or(found.upper, |rate| found.upper.min(rate)),
            certificate,
            sequence: words::sequence(&found.cycle, &channels, patterns.delay.map(|(least, _)| least), name),
            period: found.cycle.len(),
            products: found.products,
            rounding: search.rounding,
        })
    };
    let alone = |device: &Part| {
        let (lower, upper) = ((device.radius.value - device.radius.error).max(0.0), device.radius.value + device.radius.error);
        WorstPart {
            kind: device.kind,
            contacts: combination.name(),
            dimension: device.size,
            lower,
            upper,
            certificate: Some(upper),
            sequence: String::new(),
            period: 0,
            products: 0,
            rounding: device.radius.error,
        }
    };
    searches.par_iter().map(searched).chain(devices.par_iter().map(|device| Ok(alone(device)))).collect()
}
