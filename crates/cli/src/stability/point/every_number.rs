//! The verdict for every number of equal peers.

use std::fmt::Write as _;
use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, EveryNumber, NumberSpan, ProofError, prove_every_number};
use serde::Serialize;

use super::ended;
use crate::analysis_watch::Interruptible;
use crate::arguments::PointArguments;
use crate::document_schema::document;
use crate::failure::Failure;
use crate::stability::guarantee;
use crate::{input, output};

/// The proof, if it is asked for.
pub(super) fn of(scene: &Scene, arguments: &PointArguments, path: &Path) -> Result<Option<EveryNumber>, Failure> {
    let Some((from, to)) = arguments.every_number else { return Ok(None) };
    prove_every_number(scene, from, to, &Interruptible).map(Some).map_err(|error| {
        if matches!(error, ProofError::Analysis(AnalysisError::Stopped)) {
            return ended();
        }
        let option = format!("{}: --every-number", output::path(input::named(path)));
        guarantee::failure(error, &option, path, |error| Failure::Input(format!("{option}: {error}")))
    })
}

/// The part of the JSON document.
pub(super) fn document(scene: &Scene, every: &EveryNumber) -> impl Serialize + use<> {
    let spans = every.spans.iter().map(|span| document! { from: span.from, to: span.to, verdict: span.guarantee.word() });
    document! {
        // The first of the equal peers of which there are more and more.
        peer: scene.peers[every.growing].name.clone(),
        // `to` is `null` where there is no end.
        spans: spans.collect::<Vec<_>>(),
        // What has no limit as N grows; `null` if everything has one, or the numbers end.
        without_limit: every.without_limit.clone(),
        certificates: every.attempts,
    }
}

/// The lines below the verdict.
pub(super) fn words(scene: &Scene, every: &EveryNumber) -> String {
    let mut text = format!("\n  every number N of peers, of which more and more are equal to {}, proven:\n", scene.peers[every.growing].name);
    for NumberSpan { from, to, guarantee } in &every.spans {
        let numbers = match to {
            None => format!("N >= {from}"),
            Some(to) if to == from => format!("N = {from}"),
            Some(to) => format!("{from} <= N <= {to}"),
        };
        // Writing to a string does not fail.
        let _ = writeln!(text, "    {:<10}for {numbers}", guarantee.word());
    }
    if let Some(what) = &every.without_limit {
        let _ = writeln!(
            text,
            "  note: as N grows, {what}: numbers were followed to {}, and beyond as multiples of that",
            cohaptic_stability::MOST_FOLLOWED
        );
    }
    text
}
