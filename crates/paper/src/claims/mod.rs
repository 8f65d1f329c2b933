//! Claims of the paper, each with the computed result.

mod experiments;
mod performance;
mod regions;
mod stiffness;

use cohaptic_stability::{Method, analyse};

use crate::Watch;
use crate::case::{Case, Strategy};
use crate::experiment::{StabilityTest, Travel};
use crate::figures::admittance::Responses;
use crate::region::Atlas;
use crate::{Options, PaperError};

/// A claim of the paper with the computed result.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Claim {
    /// Short name, unique among the claims.
    pub id: &'static str,
    /// The claim in words.
    pub claim: &'static str,
    /// Place in the paper: a figure, an equation or a section.
    pub paper: &'static str,
    /// Computed result in words.
    pub ours: String,
    /// Whether the claim holds.
    pub verdict: Verdict,
    /// Scene file of the smallest counterexample found; `None` if the claim holds or no scene shows the failure.
    pub scene: Option<String>,
    /// How to run `scene`, and the result; present if `scene` is.
    pub how: Option<String>,
}

/// Verdict on a claim.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// The claim holds in all cases computed.
    Holds,
    /// The claim holds only in the described cases.
    HoldsWhere(String),
    /// The claim fails in the described case.
    FailsAt(String),
}

impl std::fmt::Display for Verdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Holds => f.write_str("holds"),
            Self::HoldsWhere(region) => write!(f, "holds where {region}"),
            Self::FailsAt(place) => write!(f, "fails at {place}"),
        }
    }
}

impl Claim {
    const fn new(id: &'static str, claim: &'static str, paper: &'static str, ours: String, verdict: Verdict) -> Self {
        Self { id, claim, paper, ours, verdict, scene: None, how: None }
    }

    /// Adds the smallest counterexample.
    fn with_scene(self, case: &Case, how: String) -> Self {
        Self { scene: Some(case.text()), how: Some(how), ..self }
    }
}

/// Computes all claims, in the order of the paper.
pub(crate) fn all(
    atlas: &Atlas,
    responses: &Responses,
    tests: &[StabilityTest],
    travels: &[Travel],
    options: Options,
    watch: &dyn Watch,
) -> Result<Vec<Claim>, PaperError> {
    let mut claims = stiffness::claims(watch)?;
    claims.extend(regions::claims(atlas, watch)?);
    claims.extend(performance::claims(responses, options, watch)?);
    claims.extend(experiments::claims(tests, travels));
    claims.extend(many_peers()?);
    watch.one_more();
    Ok(claims)
}

/// Numbers of peers in [`many_peers`].
const PEERS: [usize; 4] = [3, 5, 50, 1000];

/// Computes the claim beyond the paper: the cost of an analysis does not grow with the number of peers.
fn many_peers() -> Result<Vec<Claim>, PaperError> {
    let mut lines = Vec::new();
    let mut same = true;
    for strategy in Strategy::BOTH {
        for scaled in [false, true] {
            let mut radii = Vec::new();
            let mut sizes = Vec::new();
            for peers in PEERS {
                let case = Case { touching: 1, scaled, ..Case::paper(strategy, peers) };
                let analysis = analyse(&case.scene()?, Method::Reduced)?;
                // The cost is set by the largest block, and must be the same for all numbers of peers.
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

/// Writes a spectral radius in few characters.
fn short(radius: f64) -> String {
    if radius < 1000.0 { format!("{radius:.4}") } else { format!("{radius:.1e}") }
}
