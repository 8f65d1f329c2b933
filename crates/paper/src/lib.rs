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
mod error;
mod experiment;
mod figures;
pub mod page;
mod region;
mod text;
mod watch;

use cohaptic_picture::Size;

pub use claims::{Claim, Verdict};
pub use error::PaperError;
pub use figures::{Figure, Table};
pub use watch::{Unwatched, Watch};

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
