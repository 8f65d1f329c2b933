//! The figures and claims of Rakhsha & Constantinescu (2015) again.
//!
//! You need it if you compare the figures and claims of the paper with those of a changed model.
//!
//! [`reproduce`] computes everything anew: stability regions, admittances and simulated experiments, and for each claim of the paper a [`Verdict`] that
//! rests on those numbers alone. Where a claim fails, the smallest scene found in which it fails is given with it. [`page`] makes one page of it.
//!
//! Nothing here reads a clock, draws a random number or prints: the same options give the same bytes. What the paper's experiments felt like to people is
//! not reproduced; where its printed parameters do not give its printed numbers, the claims say so.
//! ```
//! use cohaptic_paper::{Options, Unwatched, Verdict, reproduce};
//!
//! let reproduction = reproduce(Options { quick: true, ..Options::default() }, &Unwatched)?;
//! let claim = reproduction.claims.iter().find(|claim| claim.id == "any-number").expect("it is a claim of the paper");
//! assert_eq!(claim.verdict, Verdict::Holds);
//! # Ok::<(), cohaptic_paper::PaperError>(())
//! ```

mod case;
mod claims;
mod counter;
mod experiment;
mod figures;
pub mod page;
mod region;

use cohaptic_picture::Size;
use cohaptic_scene::SceneError;
use cohaptic_stability::{AdmittanceError, AnalysisError, FamilyError, KeyRangeError, MapError};

pub use claims::{Claim, Verdict};
pub use figures::{Figure, Table};

/// How closely everything is looked at, and how large it is drawn.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Options {
    /// Coarser grids, in some seconds instead of a minute.
    pub quick: bool,
    /// The size of the drawings.
    pub size: Size,
}

/// The paper again.
#[derive(Clone, PartialEq, Debug)]
pub struct Reproduction {
    /// What the paper claims and what came out, in the order of the paper.
    pub claims: Vec<Claim>,
    /// The figures, in the order of the paper.
    pub figures: Vec<Figure>,
}

/// How many steps [`Watch::one_more`] is called for, about.
#[must_use]
pub fn steps(options: Options) -> usize {
    region::Atlas::size(options) + 3
}

/// Computes all figures and claims.
///
/// # Errors
///
/// [`PaperError::Stopped`] if `watch` asks for it; another one if a scene of the paper cannot be analysed, which would be a fault of this crate.
pub fn reproduce(options: Options, watch: &dyn Watch) -> Result<Reproduction, PaperError> {
    let atlas = region::Atlas::fill(options, watch)?;
    let travels = experiment::travels(watch)?;
    let tests = experiment::stability_tests(watch)?;
    let responses = figures::admittance::Responses::compute(options, watch)?;
    let figures = figures::all(&atlas, &responses, &tests, &travels, options.size);
    let claims = claims::all(&atlas, &responses, &tests, &travels, options, watch)?;
    Ok(Reproduction { claims, figures })
}

/// Sees how far the work is, and may end it.
pub trait Watch: Sync {
    /// One of the [`crate::steps`] is done.
    fn one_more(&self);

    /// Whether the work is to be given up.
    fn stops(&self) -> bool;
}

/// Nobody watches.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn one_more(&self) {}

    fn stops(&self) -> bool {
        false
    }
}

/// Why there is no reproduction.
#[derive(Debug, thiserror::Error)]
pub enum PaperError {
    /// The watcher asked for an end.
    #[error("given up before the end")]
    Stopped,
    /// A scene of the paper is refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene of the paper cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// A scene of the paper has no admittance.
    #[error(transparent)]
    Admittance(#[from] AdmittanceError),
    /// A stability region cannot be computed.
    #[error(transparent)]
    Map(#[from] MapError),
    /// A stability region cannot be computed.
    #[error(transparent)]
    Family(#[from] FamilyError),
    /// The gains of a stability region make no range.
    #[error(transparent)]
    Range(#[from] KeyRangeError),
}
