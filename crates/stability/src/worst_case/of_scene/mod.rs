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
//! use cohaptic_stability::{Effort, Links, Patterns, WorstVerdict, worst_case};
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
mod prepared;
#[cfg(test)]
mod tests;
mod words;

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use cohaptic_scene::Scene;
use rayon::prelude::*;

pub use self::error::SceneWorstCaseError;

use self::channel::{Channel, Link};
use self::prepared::{Prepared, Search};
use super::gripenberg::Effort;
use crate::analysis::{Combination, notes, pairs};
use crate::network::NominalNetwork;
use crate::pieces::pieces;
use crate::{AnalysisError, Part, PartKind, Unwatched, Watch};

/// What the network may do.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Patterns {
    /// The most samples in a row that are lost on a link.
    pub losses_in_a_row: u32,
    /// Every sample takes any time between these two, which differ by less than the period of sending, whatever the scene's links do. `None`: the delays
    /// of the scene's links.
    pub delay: Option<(Duration, Duration)>,
    /// Which links share their fate.
    pub links: Links,
}

/// Which links share their fate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Links {
    /// In every frame all links lose the samples that are due, or none does, and all delay it alike: an outage of something that they share.
    Together,
    /// Each link in each direction on its own. For up to three peers, or any number of equal ones.
    Each,
}

impl Links {
    /// The word in JSON: `together` or `each`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Together => "together",
            Self::Each => "each",
        }
    }
}

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

/// The worst case of a part of a scene.
#[derive(Clone, PartialEq, Debug)]
pub struct WorstPart {
    /// What moves.
    pub kind: PartKind,
    /// Which contacts are closed, in words; empty for a linear scene.
    pub contacts: String,
    /// How many states it has, held samples and those on the way among them.
    pub dimension: usize,
    /// As for the whole.
    pub lower: f64,
    /// As for the whole.
    pub upper: f64,
    /// The rate of a quadratic certificate.
    pub certificate: Option<f64>,
    /// The pattern that attains the lower bound when repeated for ever, in words; empty if the lower bound is zero or nothing the network does matters.
    pub sequence: String,
    /// How many steps that pattern has.
    pub period: usize,
    /// How many products of matrices were looked at.
    pub products: u64,
    /// A bound of the errors of the frames' matrices, as the largest sum of sizes of a row.
    pub rounding: f64,
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
/// As for [`worst_case`], and [`AnalysisError::Stopped`] if the watch ends it.
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

impl Patterns {
    /// The least delays.
    fn network(&self, scene: &Scene) -> Result<NominalNetwork, SceneWorstCaseError> {
        let update = scene.coordination.update;
        match self.delay {
            None => Ok(NominalNetwork::of(scene)?),
            Some((least, most)) if least > most => Err(SceneWorstCaseError::Delays { least, most }),
            Some((least, most)) if most - least >= update => Err(SceneWorstCaseError::Overtaking { least, most, update }),
            Some((least, _)) => Ok(NominalNetwork::uniform(least)),
        }
    }

    /// Whether they leave the network anything to choose.
    fn choose(&self) -> bool {
        self.losses_in_a_row > 0 || !self.width().is_zero()
    }

    /// How far delays may differ.
    fn width(&self) -> Duration {
        self.delay.map_or(Duration::ZERO, |(least, most)| most.saturating_sub(least))
    }
}

/// The worst cases of the parts of a linear scene.
fn of_combination(
    scene: &Scene,
    network: &NominalNetwork,
    combination: &Combination,
    patterns: &Patterns,
    (effort, watch): (&Effort, &dyn Watch),
) -> Result<Vec<WorstPart>, SceneWorstCaseError> {
    let structure = prepared::structure(scene, network, &combination.contacts, patterns)?;
    let Prepared { channels, searches, devices } = Prepared::of(scene, network, &structure, patterns)?;
    let peer = |class: usize| scene.peers[structure.classes[class][0]].name.as_str();
    let name = |channel: &Channel| channel.links.first().map(|link: &Link| format!("{} to {}", peer(link.from), peer(link.to))).unwrap_or_default();
    let searched = |search: &Search| {
        let found = search.automaton.worst_case_watched(effort, watch).ok_or(AnalysisError::Stopped)?;
        let certificate = found.certificate.as_ref().map(super::Certificate::rate);
        Ok(WorstPart {
            kind: search.kind,
            contacts: combination.name(),
            dimension: search.automaton.size(),
            lower: found.lower,
            upper: certificate.map_or(found.upper, |rate| found.upper.min(rate)),
            certificate,
            sequence: words::sequence(&found.cycle, &channels, patterns.delay.map(|(least, _)| least), name),
            period: found.cycle.len(),
            products: found.products,
            rounding: search.rounding,
        })
    };
    let alone = |device: &Part| {
        let (lower, upper) = ((device.radius.value - device.radius.error).max(0.0), device.radius.value + device.radius.error);
        WorstPart {
            kind: device.kind,
            contacts: combination.name(),
            dimension: device.size,
            lower,
            upper,
            certificate: Some(upper),
            sequence: String::new(),
            period: 0,
            products: 0,
            rounding: device.radius.error,
        }
    };
    searches.par_iter().map(searched).chain(devices.par_iter().map(|device| Ok(alone(device)))).collect()
}
