//! `cohaptic stability point`.

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

/// The user asked for the end.
fn ended() -> Failure {
    Failure::Interrupted("the analysis was ended before its verdict".to_owned())
}

/// The same where the worst case is known already: it took its time, and is told.
fn ended_after(worst: Option<&SceneWorstCase>) -> Failure {
    let Some(worst) = worst else { return ended() };
    Failure::Interrupted(format!("the analysis was ended before its verdict; before that,{}", cohaptic_answers::point::worst_in_words(worst)))
}

/// Says whether the scene is stable.
pub(crate) fn point(arguments: &PointArguments) -> Result<ExitCode, Failure> {
    let path = &arguments.scene.scene;
    let scene = input::with(path, |text, file| Scene::parse(text, file, &arguments.scene.overrides.set))?;
    if arguments.certificate.is_some() && (arguments.every_number.is_some() == arguments.switching) {
        return Err(Failure::Input("--certificate is of one proof: expected --every-number or --switching".to_owned()));
    }
    // What they refuse is refused before a second moment is followed.
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
        // The answer itself covers it.
        judgement.analysis.notes.iter_mut().for_each(|note| *note = note.replace(CHANGES_LEFT_OUT, "changing between them is judged apart, below"));
    }
    // Last of all: what it has found when the user ends it is told with all else.
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

/// The verdict alone; links that leave something to chance count as if they did not, and a note says so.
fn nominal(scene: &Scene, mut analysis: Analysis, place: &str) -> Judgement {
    if has_chance(scene) {
        analysis.notes.push(format!("the verdict is nominal, with every delay its mean and nothing lost: the second moment is not followed {place}"));
    }
    Judgement::nominal(scene, analysis)
}

/// The verdict if each peer hears only its neighbours.
fn on_graph(scene: &Scene, graph: &str, path: &Path, most_memory: u64) -> Result<Judgement, Failure> {
    let refused = |message: String| Failure::Input(format!("{}: --graph {graph}: {message}", input::named(path).display()));
    if scene.topology.is_some() {
        return Err(refused("the scene has a graph of its own: expected no --graph, or a scene without [topology]".to_owned()));
    }
    let graph = match graph {
        "complete" => Graph::Complete,
        "ring" => Graph::Ring { neighbours: 2 },
        "star" => Graph::Star,
        file => weights(Path::new(file))?,
    };
    let watch = AnalysisWatch::new(most_memory);
    let found = analyse_on_watched(scene, &graph, &watch);
    watch.clear();
    let is_stopped = |error: &GraphError| matches!(error, GraphError::Analysis(AnalysisError::Stopped));
    let analysis = found.map_err(|error| if is_stopped(&error) { ended() } else { refused(error.to_string()) })?;
    Ok(nominal(scene, analysis, "on a graph"))
}

/// A file of weights: one line a peer, numbers between commas.
fn weights(file: &Path) -> Result<Graph, Failure> {
    let text = file::read_text(file)?;
    let rows = read_weights(&text).map_err(|fault| {
        let line = text[..fault.span.start].matches('\n').count() + 1;
        Failure::Input(format!("{}:{line}: {}", file.display(), fault.message))
    })?;
    let columns = rows.first().map_or(0, Vec::len);
    if let Some(row) = rows.iter().position(|row| row.len() != columns) {
        let found = rows[row].len();
        return Err(Failure::Input(format!("{}: row {} has {found} weights and the first has {columns}", file.display(), row + 1)));
    }
    Ok(Graph::Weighted(Matrix::from_fn(rows.len(), columns, |row, column| rows[row][column])))
}
