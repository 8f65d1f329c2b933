//! The worst case of a scene: a bounded number of samples lost in a row, delays anywhere in an interval, and nothing else known about the network.
//!
//! A step is one period of sending. What the network can do in it are the symbols of a pattern; each stands for the matrix of such a frame, made from the same
//! nodes and ticks as the nominal analysis. A receiver that is given nothing goes on with what it holds, so that the samples held are part of the state.
//!
//! Where all links lose together (an outage of something that all share), equal peers stay equal, and the scene falls into the parts of the nominal
//! analysis. In coordinates in which these parts are separate, every frame's matrix is block-diagonal, with one sequence of symbols for all blocks; so is
//! every product, and the norm of a block-diagonal matrix, with the largest of norms of its parts as the norm of the state, is the largest norm of
//! a block. The joint spectral radius, the limit of the largest norm of a product of k factors to the power of 1/k, is therefore the largest
//! of those of the blocks, and each is looked at by itself. Where each link loses on its own, peers do not stay equal, and the
//! scene is looked at as a whole: 2 kinds of frame for each link, 64 for three peers. Beyond, equal peers have a bound from above that does not depend on their
//! number ([`each`]), and others are refused.
//!
//! # An example
//!
//! Three peers on links of 24 ms, KT = 1000 N/m, at most two samples in a row lost by all links at once:
//!
//! ```
//! use cohaptic_scene::Scene;
//! use cohaptic_proofs::{Effort, Links, Patterns, WorstVerdict, worst_case};
//!
//! let text = r#"
//!     scene.duration = "1s"
//!     object.mass = 0.45
//!     peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
//!     peers = [{ name = "a" }, { name = "b" }, { name = "c" }]
//!     link.delay = "24ms"
//! "#;
//! let scene = Scene::parse(text, "example.toml".as_ref(), &[])?;
//! let patterns = Patterns { losses_in_a_row: 2, delay: None, links: Links::Together };
//! let found = worst_case(&scene, &patterns, &Effort::default())?;
//! println!("{:.4} to {:.4}: {}", found.lower, found.upper, found.worst().sequence);
//! # assert_eq!(found.verdict(), WorstVerdict::Stable);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! # What the bounds are bounds of
//!
//! The frames' matrices as computed; their own errors, [`WorstPart::rounding`], are of the order of 10⁻¹².
//!
//! Lost samples are said by the frame in which they would have arrived. If links differ in delay by frames, losing together means the samples that would
//! arrive in one frame, which were not sent in one.

mod channel;
mod composed;
mod each;
mod error;
mod frames;
mod part;
mod patterns;
mod prepared;
#[cfg(test)]
mod tests;
mod words;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{notes, pairs, pieces};
use cohaptic_stability::{Unwatched, Watch};
use rayon::prelude::*;

pub use self::error::SceneWorstCaseError;
pub use self::part::WorstPart;
pub use self::patterns::{Links, Patterns};

use self::part::of_combination;
use super::gripenberg::Effort;

/// What bounds say about the worst case.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum WorstVerdict {
    /// The upper bound is below 1: every disturbance dies out, whatever the network does within its pattern.
    Stable,
    /// 1 is between the bounds: more effort may tell.
    Undecided,
    /// The lower bound is above 1: with the pattern that attains it some disturbance grows.
    Unstable,
}

impl WorstVerdict {
    /// The word in JSON: `stable`, `undecided` or `unstable`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Undecided => "undecided",
            Self::Unstable => "unstable",
        }
    }
}

/// Bounds of the fastest growth of a scene under bounded patterns.
#[derive(Clone, PartialEq, Debug)]
pub struct SceneWorstCase {
    /// Under some pattern a disturbance grows by at least this factor a step.
    pub lower: f64,
    /// Under no pattern does one grow by more than this factor a step; infinite if numbers overflowed.
    pub upper: f64,
    /// The rate that quadratic certificates prove for all parts; `None` if none was found for some.
    pub certificate: Option<f64>,
    /// Which links share their fate.
    pub links: Links,
    /// How long a step is: the period of sending.
    pub step: Duration,
    /// The parts that do not mix, in every combination of contacts. At least one.
    pub parts: Vec<WorstPart>,
    /// Which of them has the largest lower bound.
    pub part: usize,
    /// The parts that are left out, in words.
    pub notes: Vec<String>,
}

/// Bounds that are no farther apart than by this factor count as one number.
const CLOSE: f64 = 1.01;

impl SceneWorstCase {
    /// What the bounds say.
    #[must_use]
    pub fn verdict(&self) -> WorstVerdict {
        if self.upper < 1.0 {
            WorstVerdict::Stable
        } else if self.lower > 1.0 {
            WorstVerdict::Unstable
        } else {
            WorstVerdict::Undecided
        }
    }

    /// Whether the bounds are more than 1 % apart: then they leave open how fast the worst case grows.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.upper > CLOSE * self.lower
    }

    /// The part with the largest lower bound.
    #[must_use]
    pub fn worst(&self) -> &WorstPart {
        &self.parts[self.part]
    }

    /// How many products of matrices were looked at, of all parts.
    #[must_use]
    pub fn products(&self) -> u64 {
        self.parts.iter().map(|part| part.products).sum()
    }
}

/// Bounds of how fast a disturbance of the scene can grow under those patterns, as it begins and with the strategy that it names.
///
/// The effort is spent on each part.
///
/// # Errors
///
/// [`SceneWorstCaseError`] if the scene has no frame of one sample each, if its links do more than delay, or if the patterns are too many.
pub fn worst_case(scene: &Scene, patterns: &Patterns, effort: &Effort) -> Result<SceneWorstCase, SceneWorstCaseError> {
    worst_case_watched(scene, patterns, effort, &Unwatched)
}

/// [`worst_case`], watched: it is asked before each product.
///
/// # Errors
///
/// As for [`worst_case`], and [`AnalysisError::Stopped`](cohaptic_stability::AnalysisError::Stopped) if the watch ends it.
pub fn worst_case_watched(scene: &Scene, patterns: &Patterns, effort: &Effort, watch: &dyn Watch) -> Result<SceneWorstCase, SceneWorstCaseError> {
    let pieces = pieces(scene, "the worst case")?;
    let network = patterns.network(scene)?;
    let mut combines = false;
    let is_open = AtomicBool::new(false);
    let found: Vec<Vec<WorstPart>> = pairs(&pieces, &mut combines)?
        .par_iter()
        .map(|(piece, combination)| {
            let found = of_combination(&piece.scene, &network, combination, patterns, (effort, watch));
            match found {
                Err(error @ (SceneWorstCaseError::TooMany { .. } | SceneWorstCaseError::TooLarge { .. })) if patterns.links == Links::Each => {
                    is_open.store(true, Ordering::Relaxed);
                    each::bounds(&piece.scene, &network, combination, patterns, (effort, watch))?.ok_or(error)
                }
                found => found,
            }
        })
        .collect::<Result<_, _>>()?;
    let parts: Vec<WorstPart> = found.into_iter().flatten().collect();
    let largest = |value: fn(&WorstPart) -> f64| parts.iter().map(value).fold(0.0, f64::max);
    let (lower, upper) = (largest(|part| part.lower), largest(|part| part.upper));
    let part = parts.iter().enumerate().fold(0, |worst, (place, part)| if part.lower > parts[worst].lower { place } else { worst });
    let certificate = parts.iter().try_fold(0.0_f64, |rate, part| part.certificate.map(|own| rate.max(own)));
    let mut said = network.notes.clone();
    if patterns.delay.is_some() {
        said.push("what the links of the scene do is replaced by the interval of delays".to_owned());
    }
    if is_open.into_inner() {
        said.push(
            "each link on its own: the lower bound is that of all links together, the upper one that of a norm for equal peers; radii between them stay open"
                .to_owned(),
        );
    }
    let notes = notes(&said, combines, scene);
    Ok(SceneWorstCase { lower, upper, certificate, links: patterns.links, step: scene.coordination.update, parts, part, notes })
}
