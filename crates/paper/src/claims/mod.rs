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
use crate::table::Table;
use crate::{Options, PaperError};

/// A claim of the paper with the computed result.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Claim {
    /// Short name, unique among the claims.
    pub id: &'static str,
    /// The claim in words.
    pub claim: &'static str,
    /// The claim for somebody who does not know the symbols, as a part of a sentence.
    pub short: &'static str,
    /// Part of the paper with the claim.
    pub topic: Topic,
    /// `true` for a statement of this program, not made by the paper.
    pub is_own: bool,
    /// Place in the paper: a figure, an equation or a section.
    pub paper: &'static str,
    /// Sentence of the paper at `paper`.
    pub says: &'static str,
    /// Computed result in words.
    pub ours: String,
    /// Computed numbers, beside the paper's numbers where the paper prints numbers.
    pub tables: Vec<Table>,
    /// Names of the figures with the result.
    pub figures: &'static [&'static str],
    /// Verdict on the claim.
    pub verdict: Verdict,
    /// Reason of a difference from the paper, as far as the reason is known; empty if the result does not differ.
    pub why: &'static str,
    /// Scene file with the result: the smallest counterexample found, if the claim fails in a scene.
    pub scene: String,
    /// Result of `commands`, in words.
    pub how: String,
    /// Commands for the scene, each a line. The scene is in a file with the name of the claim, such as `any-number.toml`.
    pub commands: String,
}

/// Part of the paper.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Topic {
    /// Section 2: stiffness of the coordination.
    Stiffness,
    /// Section 3: stability regions.
    Regions,
    /// Section 4: admittance.
    Feel,
    /// Section 5: experiments.
    Experiments,
    /// Not in the paper.
    Beyond,
}

impl Topic {
    /// Returns a heading.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Stiffness => "How stiffly the copies are held together (Section 2)",
            Self::Regions => "Which gains are stable (Section 3, Figures 3 and 4)",
            Self::Feel => "What a hand feels (Section 4, Figure 5)",
            Self::Experiments => "The experiments (Section 5, Figures 7 and 8)",
            Self::Beyond => "Beyond the paper",
        }
    }
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
    /// Returns a claim that holds, with nothing said about it yet.
    const fn blank(id: &'static str, topic: Topic) -> Self {
        Self {
            id,
            claim: "",
            short: "",
            topic,
            is_own: false,
            paper: "",
            says: "",
            ours: String::new(),
            tables: Vec::new(),
            figures: &[],
            verdict: Verdict::Holds,
            why: "",
            scene: String::new(),
            how: String::new(),
            commands: String::new(),
        }
    }

    /// Adds the scene with the result. `commands` are the arguments of `cohaptic`, in which `FILE` stands for the scene's file.
    fn shown_by(self, scene: String, how: impl Into<String>, commands: &[&str]) -> Self {
        let file = format!("{}.toml", self.id);
        let commands: Vec<String> = commands.iter().map(|command| format!("cohaptic {}", command.replace("FILE", &file))).collect();
        Self { scene, how: how.into(), commands: commands.join("\n"), ..self }
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
    // The page begins a heading where the topic changes, so the claims of a topic stay together.
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

/// Arguments that run a scene with PD in place of AP.
const WITH_PD: &str = "--set coordination.strategy=proportional-derivative";

/// Computes the claim beyond the paper: the cost of an analysis does not grow with the number of peers.
fn many_peers() -> Result<Vec<Claim>, PaperError> {
    let mut rows: Vec<Vec<String>> = PEERS.iter().map(|peers| vec![peers.to_string()]).collect();
    let mut largest = Vec::new();
    let mut same = true;
    for scaled in [false, true] {
        for strategy in Strategy::BOTH {
            let mut sizes = Vec::new();
            for (row, peers) in rows.iter_mut().zip(PEERS) {
                // With one peer touching, all untouched peers are alike, and the analysis can use the symmetry.
                let case = Case { touching: 1, scaled, ..Case::paper(strategy, peers) };
                let analysis = analyse(&case.scene()?, Method::Reduced)?;
                // The cost is set by the largest block, and must be the same for all numbers of peers.
                sizes.push(analysis.modes.iter().flat_map(|mode| &mode.parts).map(|part| part.size).max().unwrap_or(0));
                row.push(short(analysis.radius.value));
                // The number of states does not depend on strategy and gains, so it is a column of its own.
                if !scaled && strategy == Strategy::Ap {
                    row.insert(1, analysis.dimension.to_string());
                }
            }
            // Blocks of AP and PD, and of plain and scaled gains, may differ in size. Only the number of peers must not matter.
            same &= sizes.iter().all(|size| *size == sizes[0]);
            largest.extend(sizes);
        }
    }
    let largest = largest.iter().max().copied().unwrap_or(0);
    let ours = format!(
        "The analysis splits a scene of equal users into blocks. The largest has at most {largest} states, for {} users as for {}, whatever the scene has in all.",
        PEERS[0],
        PEERS[PEERS.len() - 1]
    );
    let table = Table::new("Spectral radius over 8 ms, one user touching, 8 ms one way", &["N", "states", "AP", "PD", "AP", "PD"])
        .grouped([("", 2), ("gains as they are", 2), ("gains scaled with N", 2)])
        .all(rows);
    let claim = Claim {
        claim: "Stability of any number of equal peers is known at the cost of a few",
        short: "the stability of any number of equal users is known at the cost of a few",
        is_own: true,
        paper: "beyond the paper",
        says: "The paper analyses up to five users, and eight in its figures; an arbitrary number is its future work.",
        ours,
        tables: vec![table],
        verdict: if same { Verdict::Holds } else { Verdict::FailsAt("a block that grows with N".to_owned()) },
        ..Claim::blank("any-number", Topic::Beyond)
    };
    let scene = Case { touching: 1, ..Case::paper(Strategy::Ap, 3) }.text();
    Ok(vec![claim.shown_by(scene, "A thousand users, judged in a moment.", &["stability point FILE --set scene.count=1000"])])
}

/// Writes a spectral radius in few characters.
fn short(radius: f64) -> String {
    // Four decimals tell nothing about a radius far above 1.
    if radius < 1000.0 { format!("{radius:.4}") } else { format!("{radius:.1e}") }
}
