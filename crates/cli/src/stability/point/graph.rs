//! Peers on a graph.

use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{Graph, Judgement, Matrix, analyse_on};

use crate::failure::Failure;

/// The verdict if each peer hears only its neighbours. Links that leave something to chance count as if they did not.
pub(super) fn on(scene: &Scene, graph: &str, path: &Path) -> Result<Judgement, Failure> {
    let refused = |message: String| Failure::Input(format!("{}: --graph {graph}: {message}", path.display()));
    let graph = match graph {
        "complete" => Graph::Complete,
        "ring" => Graph::Ring,
        "star" => Graph::Star,
        file => weights(Path::new(file))?,
    };
    let analysis = analyse_on(scene, &graph).map_err(|error| refused(error.to_string()))?;
    Ok(Judgement { verdict: analysis.verdict(), analysis, mean_square: None })
}

/// A file of weights: one line a peer, numbers between commas.
fn weights(file: &Path) -> Result<Graph, Failure> {
    let text = cohaptic_scene::read_text(file).map_err(|error| Failure::File { verb: "read", path: file.to_path_buf(), error })?;
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
