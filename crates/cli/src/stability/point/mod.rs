//! `cohaptic stability point`.

mod document;
mod graph;
mod words;
mod worst;

use std::process::ExitCode;

use cohaptic_scene::Scene;
use cohaptic_stability::{Analysis, judge};

use crate::arguments::PointArguments;
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, not_analysed};
use crate::{input, output};
use document::Document;

/// Says whether the scene is stable.
pub(crate) fn point(arguments: &PointArguments) -> Result<ExitCode, Failure> {
    let path = &arguments.scene.scene;
    let scene = input::with(path, |text, file| Scene::parse(text, file, &arguments.scene.overrides.set))?;
    let judgement = match &arguments.graph {
        Some(graph) => graph::on(&scene, graph, path)?,
        None => judge(&scene, arguments.method.into(), usize::MAX).map_err(|error| not_analysed(path, &error))?,
    };
    let worst = worst::of(&scene, arguments, path)?;
    if arguments.scene.json {
        output::json(DocumentSchema::StabilityPoint, &Document::new(&scene, &judgement, worst.as_ref()))?;
    } else {
        output::text(&words::describe(&scene, &judgement, worst.as_ref()))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// After how long the slowest disturbance is smaller, or larger, by a factor of e \[s\]: the frame over the logarithm of the radius. Below zero where it
/// grows; `None` where it does neither, and where it is gone within one frame.
fn time_constant(analysis: &Analysis) -> Option<f64> {
    let seconds = -analysis.frame.as_secs_f64() / analysis.radius.value.ln();
    (seconds.is_finite() && seconds != 0.0).then_some(seconds)
}

/// By which factor the slowest disturbance changes in a second.
fn per_second(analysis: &Analysis) -> f64 {
    analysis.radius.value.powf(1.0 / analysis.frame.as_secs_f64())
}
