//! What the paper claims, and what came out.

mod experiments;
mod many;
mod performance;
mod regions;
mod stiffness;

use crate::case::Case;
use crate::experiment::{StabilityTest, Travel};
use crate::figures::admittance::Responses;
use crate::region::Atlas;
use crate::watch::Watch;
use crate::{Options, PaperError};

/// A claim of the paper with what came out.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Claim {
    /// A short name.
    pub id: &'static str,
    /// What the paper says.
    pub claim: &'static str,
    /// The paper's figure for it, or where it stands.
    pub paper: &'static str,
    /// What was computed.
    pub ours: String,
    /// Whether it holds.
    pub verdict: Verdict,
    /// The scene that shows it, as a file: the smallest one found in which the claim fails.
    pub scene: Option<String>,
    /// What to do with that scene, and what comes out.
    pub how: Option<String>,
}

/// Whether a claim holds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Verdict {
    /// In everything that was looked at.
    Holds,
    /// Only there.
    HoldsWhere(String),
    /// Not there.
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

    /// With the smallest scene in which something else happens.
    fn with_scene(self, case: &Case, how: String) -> Self {
        Self { scene: Some(case.text()), how: Some(how), ..self }
    }
}

/// All claims, in the order of the paper.
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
    claims.extend(many::claims()?);
    watch.one_more();
    Ok(claims)
}
