//! Reproduces the figures and claims of Rakhsha & Constantinescu (2015).
//!
//! Use this crate to compare the paper's figures and claims with the results of a changed model.
//!
//! [`reproduce`] computes stability regions, admittances and simulated experiments anew, and for each claim of the paper a [`Verdict`] based only on the
//! computed numbers. If a claim fails, the smallest counterexample found is added as a scene. [`page`] makes an HTML page of the results.
//!
//! The crate reads no clock, draws no random numbers and prints nothing: equal options give equal bytes. The impressions of the paper's test persons are
//! not reproduced. If the paper's printed parameters do not give its printed numbers, the claims say so.
//!
//! ```
//! # fn compiled() -> Result<(), cohaptic_paper::PaperError> {
//! use cohaptic_paper::{Options, Unwatched, Verdict, reproduce};
//!
//! let reproduction = reproduce(Options { quick: true, ..Options::default() }, &Unwatched)?;
//! let claim = reproduction.claims.iter().find(|claim| claim.id == "any-number").expect("it is a claim of the paper");
//! assert_eq!(claim.verdict, Verdict::Holds);
//! # Ok(())
//! # }
//! ```

mod case;
mod claims;
mod counter;
mod experiment;
mod figures;
pub mod page;
mod region;
mod table;

use cohaptic_picture::Size;
use cohaptic_scene::SceneError;
use cohaptic_stability::{AdmittanceError, AnalysisError, FamilyError, KeyRangeError, MapError};

pub use claims::{Claim, Topic, Verdict};
pub use figures::Figure;
pub use table::{FAILS, Table};

/// Resolution of the computation, and size of the drawings.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Options {
    /// `true` if to use coarser grids, for a result in some seconds instead of a minute.
    pub quick: bool,
    /// Size of the drawings.
    pub size: Size,
}

/// All results.
#[derive(Clone, PartialEq, Debug)]
pub struct Reproduction {
    /// Claims with the computed results, in the order of the paper.
    pub claims: Vec<Claim>,
    /// Figures, in the order of the paper.
    pub figures: Vec<Figure>,
}

/// Returns the approximate number of calls of [`Watch::one_more`] in [`reproduce`].
#[must_use]
pub fn steps(options: Options) -> usize {
    region::Atlas::size(options) + 3
}

/// Computes all figures and claims.
///
/// # Errors
///
/// [`PaperError::Stopped`] if `watch` ends the work. Any other error is a fault of this crate: a scene of the paper that cannot be analysed.
pub fn reproduce(options: Options, watch: &dyn Watch) -> Result<Reproduction, PaperError> {
    let atlas = region::Atlas::fill(options, watch)?;
    let travels = experiment::travels(watch)?;
    let tests = experiment::stability_tests(watch)?;
    let responses = figures::admittance::Responses::compute(options, watch)?;
    let figures = figures::all(&atlas, &responses, &tests, &travels, options.size);
    let claims = claims::all(&atlas, &responses, &tests, &travels, options, watch)?;
    Ok(Reproduction { claims, figures })
}

/// Observer of the progress, able to end the work. Called from several threads.
pub trait Watch: Sync {
    /// Notes the end of a step; [`steps`] tells their number.
    fn one_more(&self);

    /// Returns whether the work must end early.
    fn stops(&self) -> bool;
}

/// A [`Watch`] that ignores the progress and never ends the work.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Unwatched;

impl Watch for Unwatched {
    fn one_more(&self) {}

    fn stops(&self) -> bool {
        false
    }
}

/// Error of [`reproduce`].
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PaperError {
    /// The watcher ended the work.
    #[error("given up before the end")]
    Stopped,
    /// A scene of the paper was refused.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A scene of the paper could not be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The admittance of a scene of the paper could not be computed.
    #[error(transparent)]
    Admittance(#[from] AdmittanceError),
    /// A stability region could not be computed.
    #[error(transparent)]
    Map(#[from] MapError),
    /// The scenes of a stability region could not be made.
    #[error(transparent)]
    Family(#[from] FamilyError),
    /// The gains of a stability region gave no range.
    #[error(transparent)]
    Range(#[from] KeyRangeError),
}
