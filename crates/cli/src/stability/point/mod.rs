//! `cohaptic stability point`: judges the stability of a scene.
//!
//! `every_number`, `switching` and `worst` add the proofs of the options.

mod every_number;
mod switching;
mod worst;

use std::path::Path;
use std::process::ExitCode;

use cohaptic_answers::notes;
use cohaptic_proofs::SceneWorstCase;
use cohaptic_scene::{Scene, read_weights};
use cohaptic_stability::{
    Analysis, AnalysisError, CHANGES_LEFT_OUT, Graph, GraphError, Judgement, Limits, Matrix, analyse_loaded, analyse_on_watched, analyse_spinning,
    has_chance, judge_watched,
};

use crate::analysis_watch::AnalysisWatch;
use crate::arguments::{PointArguments, RestName};
use crate::document_schema::DocumentSchema;
use crate::failure::{Failure, not_analysed};
use crate::stability::guarantee;
use crate::{file, input, output};

/// Returns the failure of an interrupted analysis.
fn ended() -> Failure {
    Failure::Interrupted("the analysis was stopped before its verdict".to_owned())
}

/// Like [`ended`], but the message includes the worst case if the worst case was known before the interruption.
fn ended_after(worst: Option<&SceneWorstCase>) -> Failure {
    let Some(worst) = worst else { return ended() };
    Failure::Interrupted(format!("the analysis was stopped before its verdict; before that,{}", cohaptic_answers::point::worst_in_words(worst)))
}

/// Judges the scene, runs the proofs of the options, and writes the answer.
pub(crate) fn point(arguments: &PointArguments) -> Result<ExitCode, Failure> {
    let path = &arguments.scene.scene;
    let scene = input::with(path, |text, file| Scene::parse(text, file, &arguments.scene.overrides.set))?;
    if arguments.certificate.is_some() && (arguments.every_number.is_some() == arguments.switching) {
        return Err(Failure::Input("--certificate is of one proof: expected --every-number or --switching".to_owned()));
    }
    // These three may refuse the scene, and so run before the analysis of the second moment, which may take long.
    let asked = every_number::asked(&scene, arguments, path)?;
    let switching = switching::of(&scene, arguments, path)?;
    let worst = worst::of(&scene, arguments, path)?;
    let mut judgement = match &arguments.graph {
        Some(graph) => on_graph(&scene, graph, path, arguments.memory)?,
        None => {
            let watch = AnalysisWatch::new(arguments.memory);
            let judged = match arguments.about {
                RestName::Unloaded => judge_watched(&scene, arguments.method.into(), &Limits { watch: &watch, ..Limits::of_unknowns(usize::MAX) }),
                RestName::Loaded => analyse_loaded(&scene, arguments.method.into(), &watch).map(|analysis| nominal(&scene, analysis, "about a load")),
                RestName::Spinning => analyse_spinning(&scene, &watch).map(|analysis| nominal(&scene, analysis, "about a spin")),
            };
            watch.clear();
            judged.map_err(|error| if error == AnalysisError::Stopped { ended_after(worst.as_ref()) } else { not_analysed(path, &error) })?
        }
    };
    if switching.is_some() {
        // The note says that changes of contacts are left out, but this answer covers the changes.
        judgement.analysis.notes.iter_mut().for_each(|note| *note = note.replace(CHANGES_LEFT_OUT, "changing between them is judged apart, below"));
    }
    // This proof runs last: if the user interrupts the proof, the answer still has the verdicts so far and all results above.
    let every = every_number::of(asked.as_ref(), &scene, arguments, path)?;
    let more = || {
        let every = every.as_ref().map(|every| every_number::words(&scene, every));
        let switching = switching.as_ref().map(|switching| switching::words(&switching.found, &notes(&judgement)));
        every.unwrap_or_default() + &switching.unwrap_or_default()
    };
    output::answer(
        arguments.scene.json,
        DocumentSchema::STABILITY_POINT,
        &cohaptic_answers::point::document(
            &scene,
            &judgement,
            worst.as_ref(),
            every.as_ref().map(|every| every_number::document(&scene, every)),
            switching.as_ref().map(switching::document),
        ),
        || cohaptic_answers::point::words(&scene, &judgement, worst.as_ref()) + &more(),
        every
            .iter()
            .filter_map(|every| every.certificate.as_ref())
            .map(|certificate| &certificate.file)
            .chain(switching.iter().filter_map(|switching| switching.file.as_ref())),
    )?;
    if every.is_some_and(|every| !every.every.is_whole) { Err(guarantee::ended()) } else { Ok(ExitCode::SUCCESS) }
}

/// Returns the judgement of an analysis without second moment. If the network has chance, a note says that the verdict is nominal.
fn nominal(scene: &Scene, mut analysis: Analysis, place: &str) -> Judgement {
    if has_chance(scene) {
        analysis.notes.push(format!("the verdict is nominal, with every delay at its mean and no losses: the second moment is not followed {place}"));
    }
    Judgement::nominal(scene, analysis)
}

/// Judges the scene if each peer receives samples only from its neighbours on `graph`: a named graph, or a file of weights.
fn on_graph(scene: &Scene, graph: &str, path: &Path, most_memory: u64) -> Result<Judgement, Failure> {
    let refused = |message: String| Failure::Input(format!("{}: --graph {graph}: {message}", input::named(path).display()));
    if scene.topology.is_some() {
        return Err(refused("the scene has a graph of its own: expected no --graph, or a scene without [topology]".to_owned()));
    }
    let graph = match graph {
        "complete" => Graph::Complete,
        "ring" => Graph::Ring { neighbours: 2 },
        "star" => Graph::Star,
        // Every other word is the path of a file.
        file => weights(Path::new(file))?,
    };
    let watch = AnalysisWatch::new(most_memory);
    let found = analyse_on_watched(scene, &graph, &watch);
    watch.clear();
    let is_stopped = |error: &GraphError| matches!(error, GraphError::Analysis(AnalysisError::Stopped));
    let analysis = found.map_err(|error| if is_stopped(&error) { ended() } else { refused(error.to_string()) })?;
    Ok(nominal(scene, analysis, "on a graph"))
}

/// Reads a file of weights: a line per peer, with numbers separated by commas.
fn weights(file: &Path) -> Result<Graph, Failure> {
    let text = file::read_text(file)?;
    let rows = read_weights(&text).map_err(|fault| {
        // The fault has a place in bytes. Lines count from 1.
        let line = text[..fault.span.start].matches('\n').count() + 1;
        Failure::Input(format!("{}:{line}: {}", file.display(), fault.message))
    })?;
    // The matrix reads every row at every column, so that all rows must be equally long.
    let columns = rows.first().map_or(0, Vec::len);
    if let Some(row) = rows.iter().position(|row| row.len() != columns) {
        let found = rows[row].len();
        return Err(Failure::Input(format!("{}: row {} has {found} weights and the first has {columns}", file.display(), row + 1)));
    }
    Ok(Graph::Weighted(Matrix::from_fn(rows.len(), columns, |row, column| rows[row][column])))
}
