//! `cohaptic stability point`.

mod document;
mod graph;
mod speed;
mod words;
mod worst;

use std::process::ExitCode;

use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Limits, judge_watched};

use crate::analysis_watch::AnalysisWatch;
use crate::arguments::PointArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, not_analysed};
use crate::{input, output};
use document::PointDocument;

/// The user asked for the end.
fn ended() -> Failure {
    Failure::Interrupted("the analysis was ended before its verdict".to_owned())
}

/// Says whether the scene is stable.
pub(crate) fn point(arguments: &PointArguments) -> Result<ExitCode, Failure> {
    let path = &arguments.scene.scene;
    let scene = input::with(path, |text, file| Scene::parse(text, file, &arguments.scene.overrides.set))?;
    let judgement = match &arguments.graph {
        Some(graph) => graph::on(&scene, graph, path)?,
        None => {
            let watch = AnalysisWatch::new();
            let judged = judge_watched(&scene, arguments.method.into(), &Limits { watch: &watch, ..Limits::of_unknowns(usize::MAX) });
            watch.clear();
            judged.map_err(|error| if error == AnalysisError::Stopped { ended() } else { not_analysed(path, &error) })?
        }
    };
    let worst = worst::of(&scene, arguments, path)?;
    output::answer(
        arguments.scene.json,
        DocumentSchema::STABILITY_POINT,
        &PointDocument::new(&scene, &judgement, worst.as_ref()),
        || words::describe(&scene, &judgement, worst.as_ref()),
        output::NO_FILES,
    )?;
    Ok(ExitCode::SUCCESS)
}
