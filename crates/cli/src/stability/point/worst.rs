//! The worst case under bounded patterns.

use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Effort, Links, Patterns, SceneWorstCase, SceneWorstCaseError, worst_case_watched};
use serde::Serialize;

use super::ended;
use crate::analysis_watch::AnalysisWatch;
use crate::arguments::{LinksName, PointArguments};
use crate::failure::Failure;

/// The worst case, if it is asked for.
pub(super) fn of(scene: &Scene, arguments: &PointArguments, path: &Path) -> Result<Option<SceneWorstCase>, Failure> {
    if arguments.losses_in_a_row.is_none() && arguments.delay_within.is_none() {
        return Ok(None);
    }
    if !(arguments.accuracy > 0.0 && arguments.accuracy.is_finite()) {
        return Err(Failure::Input(format!("--accuracy {}: expected a number above 0", arguments.accuracy)));
    }
    let links = match arguments.links {
        LinksName::Together => Links::Together,
        LinksName::Each => Links::Each,
    };
    let patterns = Patterns { losses_in_a_row: arguments.losses_in_a_row.unwrap_or(0), delay: arguments.delay_within, links };
    let effort = Effort { accuracy: arguments.accuracy, products: arguments.products };
    let watch = AnalysisWatch::new();
    let found = worst_case_watched(scene, &patterns, &effort, &watch);
    watch.clear();
    found.map(Some).map_err(|error| match error {
        SceneWorstCaseError::Analysis(AnalysisError::Stopped) => ended(),
        error @ (SceneWorstCaseError::Analysis(_)
        | SceneWorstCaseError::Automaton(_)
        | SceneWorstCaseError::Delays { .. }
        | SceneWorstCaseError::Overtaking { .. }
        | SceneWorstCaseError::Frame { .. }
        | SceneWorstCaseError::Pattern { .. }
        | SceneWorstCaseError::TooMany { .. }
        | SceneWorstCaseError::TooLarge { .. }) => Failure::Input(format!("{}: {error}", crate::input::named(path).display())),
    })
}

#[derive(Serialize)]
pub(super) struct WorstDocument<'a> {
    verdict: &'static str,
    lower: f64,
    upper: f64,
    /// The rate that quadratic certificates prove.
    certificate: Option<f64>,
    links: &'static str,
    step_s: f64,
    /// The pattern that attains the lower bound.
    sequence: &'a str,
    period: usize,
    dimension: usize,
    products: u64,
    notes: &'a [String],
}

impl<'a> WorstDocument<'a> {
    pub(super) fn new(worst: &'a SceneWorstCase) -> Self {
        let part = worst.worst();
        Self {
            verdict: worst.verdict().word(),
            lower: worst.lower,
            upper: worst.upper,
            certificate: worst.certificate,
            links: match worst.links {
                Links::Together => "together",
                Links::Each => "each",
            },
            step_s: worst.step.as_secs_f64(),
            sequence: &part.sequence,
            period: part.period,
            dimension: part.dimension,
            products: worst.products(),
            notes: &worst.notes,
        }
    }
}
