//! Beyond the paper: many peers.

use cohaptic_stability::{Method, analyse};

use super::{Claim, Verdict};
use crate::PaperError;
use crate::case::{Case, Strategy};

const PEERS: [usize; 4] = [3, 5, 50, 1000];

pub(super) fn claims() -> Result<Vec<Claim>, PaperError> {
    let mut lines = Vec::new();
    let mut same = true;
    for strategy in Strategy::BOTH {
        for scaled in [false, true] {
            let mut radii = Vec::new();
            let mut sizes = Vec::new();
            for peers in PEERS {
                let case = Case { touching: 1, scaled, ..Case::paper(strategy, peers) };
                let analysis = analyse(&case.scene()?, Method::Reduced)?;
                let largest = analysis.modes.iter().flat_map(|mode| &mode.parts).map(|part| part.size).max().unwrap_or(0);
                sizes.push(largest);
                radii.push(format!("{} (N = {peers}, {} states)", short(analysis.radius.value), analysis.dimension));
            }
            same &= sizes.iter().all(|size| *size == sizes[0]);
            let gains = if scaled { "all gains scaled with N" } else { "gains as they are" };
            lines.push(format!("{}, {gains}: {}; the largest block has {} states", strategy.word(), radii.join(", "), sizes[0]));
        }
    }
    let ours = format!("Spectral radius, one touching, Td = Tn = 8 ms. {}.", lines.join(". "));
    let verdict = if same { Verdict::Holds } else { Verdict::FailsAt("a block that grows with N".to_owned()) };
    let claim = "Stability of any number of equal peers is known at the cost of a few";
    Ok(vec![Claim::new("any-number", claim, "beyond the paper: up to five users, “arbitrary N” is future work", ours, verdict)])
}

/// A radius, in few letters where it is large.
fn short(radius: f64) -> String {
    if radius < 1000.0 { format!("{radius:.4}") } else { format!("{radius:.1e}") }
}
