//! Peers on a graph.

use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Graph, GraphError, Judgement, Matrix, analyse_on_watched, has_chance};

use super::ended;
use crate::analysis_watch::AnalysisWatch;
use crate::failure::Failure;
use crate::file;

/// What the verdict leaves out where links leave something to chance.
const NOMINAL: &str = "the verdict is nominal, with every delay its mean and nothing lost: the second moment is not followed on a graph";

/// The verdict if each peer hears only its neighbours. Links that leave something to chance count as if they did not, and a note says so.
pub(super) fn on(scene: &Scene, graph: &str, path: &Path) -> Result<Judgement, Failure> {
    let refused = |message: String| Failure::Input(format!("{}: --graph {graph}: {message}", crate::input::named(path).display()));
    let graph = match graph {
        "complete" => Graph::Complete,
        "ring" => Graph::Ring,
        "star" => Graph::Star,
        file => weights(Path::new(file))?,
    };
    let watch = AnalysisWatch::new();
    let found = analyse_on_watched(scene, &graph, &watch);
    watch.clear();
    let mut analysis = found.map_err(|error| match error {
        GraphError::Analysis(AnalysisError::Stopped) => ended(),
        error @ (GraphError::Analysis(_)
        | GraphError::Unequal { .. }
        | GraphError::Weight { .. }
        | GraphError::Alone { .. }
        | GraphError::Irregular
        | GraphError::NotLinear) => refused(error.to_string()),
    })?;
    if has_chance(scene) {
        analysis.notes.push(NOMINAL.to_owned());
    }
    Ok(Judgement { verdict: analysis.verdict(), analysis, mean_square: None })
}

/// A file of weights: one line a peer, numbers between commas.
fn weights(file: &Path) -> Result<Graph, Failure> {
    let text = file::read_text(file)?;
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let entry = |entry: &str| {
            entry
                .trim()
                .parse()
                .map_err(|_| Failure::Input(format!("{}:{}: found {:?}, expected numbers between commas", file.display(), number + 1, entry.trim())))
        };
        rows.push(line.split(',').map(entry).collect::<Result<_, _>>()?);
    }
    let columns = rows.first().map_or(0, Vec::len);
    if let Some(row) = rows.iter().position(|row| row.len() != columns) {
        let found = rows[row].len();
        return Err(Failure::Input(format!("{}: row {} has {found} weights and the first has {columns}", file.display(), row + 1)));
    }
    Ok(Graph::Weighted(Matrix::from_fn(rows.len(), columns, |row, column| rows[row][column])))
}
