//! The worst case of a scene, if nothing is known of the network but a largest number of samples lost in a row and an interval of delays.
//!
//! A step is one period of sending. The symbols of a pattern are the losses and delays that are possible in a step; each symbol stands for the matrix of a
//! frame, made from the same nodes and ticks as the nominal analysis. A receiver that gets no sample uses the sample that it holds, so the held samples are
//! part of the state.
//!
//! Where all links lose together (an outage of something that all share), equal peers stay equal, and the scene falls into the parts of the nominal
//! analysis. In coordinates in which these parts are separate, every frame's matrix is block-diagonal, with one sequence of symbols for all blocks; so is
//! every product, and the norm of a block-diagonal matrix, with the largest of norms of its parts as the norm of the state, is the largest norm of
//! a block. The joint spectral radius, the limit of the largest norm of a product of k factors to the power of 1/k, is therefore the largest joint spectral
//! radius of a block, and each block is searched by itself. Where each link loses on its own, peers do not stay equal, and the scene is searched as a whole:
//! with 2 kinds of frame for each link, 64 for three peers. For more equal peers there is an upper bound whose cost does not depend on their number ([`each`]);
//! more peers that differ are refused.
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
//! The bounds hold for the frames' matrices as computed. The errors of these matrices, [`WorstPart::rounding`], are of the order of 10⁻¹².
//!
//! A lost sample counts in the frame in which it would have arrived. If the delays of links differ by frames, links that lose together lose the samples that
//! would arrive in the same frame, which were sent in different frames.

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
use cohaptic_stability::frames::{notes, pairs, pieces, refuse_slow_devices};
use cohaptic_stability::{Unwatched, Watch};
use rayon::prelude::*;

pub use self::error::SceneWorstCaseError;
pub use self::part::WorstPart;
pub use self::patterns::{Links, Patterns};

use self::part::of_combination;
use super::gripenberg::Effort;

/// The verdict of the bounds on the worst case.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum WorstVerdict {
    /// The upper bound is below 1: every disturbance dies out under every allowed pattern.
    Stable,
    /// 1 lies between the bounds: more effort may decide.
    Undecided,
    /// The lower bound is above 1: some disturbance grows under the pattern that attains the lower bound.
    Unstable,
}

impl WorstVerdict {
    /// Returns the word in JSON: `stable`, `undecided` or `unstable`.
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
    /// Lower bound of the growth per step: under some pattern a disturbance grows by at least this factor.
    pub lower: f64,
    /// Upper bound of the growth per step under every pattern; infinite if numbers overflowed.
    pub upper: f64,
    /// Growth per step that quadratic certificates prove as an upper bound for all parts; `None` if some part has no certificate.
    pub certificate: Option<f64>,
    /// Links that lose and delay together.
    pub links: Links,
    /// Duration of a step: the period of sending.
    pub step: Duration,
    /// Parts that do not influence each other, in every combination of contacts. At least one.
    pub parts: Vec<WorstPart>,
    /// Index in `parts` of the part with the largest lower bound.
    pub part: usize,
    /// Assumptions of the bounds, and parts that are left out, in words.
    pub notes: Vec<String>,
}

/// Largest ratio of two bounds that count as one number.
const CLOSE: f64 = 1.01;

impl SceneWorstCase {
    /// Returns the verdict of the bounds.
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

    /// Returns whether the bounds are more than 1 % apart, so that the growth of the worst case stays open.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.upper > CLOSE * self.lower
    }

    /// Returns the part with the largest lower bound.
    #[must_use]
    pub fn worst(&self) -> &WorstPart {
        &self.parts[self.part]
    }

    /// Returns the number of products of matrices that the searches of all parts computed.
    #[must_use]
    pub fn products(&self) -> u64 {
        self.parts.iter().map(|part| part.products).sum()
    }
}

/// Returns bounds of the growth per step of a disturbance under every allowed pattern, for the scene with its settings at the start.
///
/// Each part has the whole effort.
///
/// # Errors
///
/// [`SceneWorstCaseError`] if the scene has no frame with one sample per node, if its links do more than delay, or if the pattern is too large.
pub fn worst_case(scene: &Scene, patterns: &Patterns, effort: &Effort) -> Result<SceneWorstCase, SceneWorstCaseError> {
    worst_case_watched(scene, patterns, effort, &Unwatched)
}

/// Returns the bounds of [`worst_case`], and asks the watch before each product.
///
/// # Errors
///
/// As for [`worst_case`], and [`AnalysisError::Stopped`](cohaptic_stability::AnalysisError::Stopped) if the watch ends the search.
pub fn worst_case_watched(scene: &Scene, patterns: &Patterns, effort: &Effort, watch: &dyn Watch) -> Result<SceneWorstCase, SceneWorstCaseError> {
    refuse_slow_devices(scene, "the worst case")?;
    let pieces = pieces(scene, "the worst case")?;
    let network = patterns.network(scene)?;
    let mut combines = false;
    let is_open = AtomicBool::new(false);
    let found: Vec<Vec<WorstPart>> = pairs(&pieces, &mut combines)?
        .par_iter()
        .map(|(piece, combination)| {
            let found = of_combination(&piece.scene, &network, combination, patterns, (effort, watch));
            // Too many independent links for an exact search: equal peers still have the bounds of `each`.
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
