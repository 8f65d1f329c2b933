//! Certificates: numbers for checking a proof without the program behind the proof.
//!
//! A certificate names the states of each part of a scene. For each box, or for each span of numbers of peers, a certificate has the coordinates V, the weights
//! d and the circle of [`super::discs`]. A reader with the scene can derive its matrices and check inequality (1) of [`super::discs`], as
//! `crates/stability/tests/reference/check_certificate.py` does.

use std::fmt::Write as _;

use cohaptic_peer::{Exchange, Gains};
use cohaptic_scene::{Scene, TopologyKind};
use cohaptic_stability::frames::{eigenvectors, weights_of};
use cohaptic_stability::{Family, Matrix};

use super::corners::{Common, Point, States, states};
use super::discs::{FreeCircle, Witness};
use super::error::ProofError;
use super::guarantee::{Guarantee, Proven};
use super::halving::Ranges;
use super::steps::FrameState;

/// Box of keys, and the numbers for a check of the verdict on the box.
#[derive(Clone, Debug)]
pub struct BoxCertificate {
    /// Least and greatest value of each key. If the verdict holds for several numbers N of peers, the least and the greatest value of 1/(N − 1) follow.
    pub ranges: Vec<[f64; 2]>,
    /// Verdict on every scene in the box.
    pub guarantee: Guarantee,
    /// Parts of the motion: for a stable box all parts but loose devices, for an unstable box one growing part, and for an undecided box no part.
    pub parts: Vec<PartCertificate>,
}

impl BoxCertificate {
    pub(super) fn new(ranges: Vec<[f64; 2]>, proven: Proven, parts: Vec<(Proven, PartCertificate)>) -> Self {
        Self { ranges, guarantee: proven.into(), parts: needed(Some(proven), parts) }
    }
}

/// Refuses a certificate of a scene with features that the checker of certificates does not derive.
pub(super) fn refuse_certificate(scene: &Scene) -> Result<(), ProofError> {
    if scene.peers.iter().any(|peer| peer.exchange != Exchange::EACH_TICK) {
        return Err(ProofError::NoCertificate { what: "a device that exchanges late or not at each tick" });
    }
    Ok(())
}

/// Returns the number of boxes of an answer with a verdict in the answer and without a verdict in the certificate, because the certificate's bounds of frames
/// are wider. Certificate and answer are in the same order, and an undecided box of the certificate is a whole box of the answer.
pub(super) fn uncertified(certificate: &[BoxCertificate], answer: impl Iterator<Item = (Ranges, Guarantee)>) -> usize {
    // Both lists are in the same order, so one pass with a peek at the next undecided box of the certificate is enough.
    let mut open = certificate.iter().filter(|one| one.guarantee == Guarantee::Undecided).peekable();
    let is_open = |(ranges, guarantee): &(Ranges, Guarantee)| {
        open.next_if(|one| one.ranges.starts_with(ranges)).is_some() && *guarantee != Guarantee::Undecided
    };
    answer.filter(is_open).count()
}

/// Span of numbers of equal peers, and the numbers for a check of the verdict on the span.
#[derive(Clone, Debug)]
pub struct NumberCertificate {
    /// Least number of peers.
    pub from: u64,
    /// Greatest number of peers; `None`: the span has no end.
    pub to: Option<u64>,
    /// Verdict on every number of the span.
    pub guarantee: Guarantee,
    /// Parts of the motion, chosen as in [`BoxCertificate`]; empty for verdicts in the mean square.
    pub parts: Vec<PartCertificate>,
    /// Second moments for verdicts in the mean square: one per motion for a stable span, one growing moment for an unstable span, otherwise no moment.
    pub moments: Vec<MomentCertificate>,
}

/// Second moment Y of equal peers. A reader can check that γ·Y − L(Y) is positive definite for all numbers of a span.
#[derive(Clone, Debug)]
pub struct MomentCertificate {
    /// Factor γ: 1 for a stable span, above 1 for an unstable span.
    pub factor: f64,
    /// Time by which velocities are multiplied \[s\].
    pub time: f64,
    /// Gains K and B of a sample as the one number (K·x + B·v)/(K + B/time); `None`: a sample is a position and a velocity.
    pub heard: Option<Gains>,
    /// Number of samples of earlier frames among the states.
    pub depth: usize,
    /// Blocks of Y: of the mean over the peers, of the differences from the mean and, for more than two peers, of held samples with zero sums. Each
    /// block is written row by row, in digits as in [`PartCertificate`].
    pub blocks: Vec<String>,
}

/// Averaging matrix of a topology, and approximate eigenvectors for an enclosure of its eigenvalues.
#[derive(Clone, PartialEq, Debug)]
pub struct TopologyCertificate {
    /// Weights between peers, one row per peer, if the scene reads its topology as a graph from a file; `None` for a topology with a name.
    pub weights: Option<Vec<Vec<f64>>>,
    /// Approximate eigenvectors, column by column, without the eigenvector of equal entries; in digits as in [`PartCertificate`].
    pub eigenvectors: String,
}

impl TopologyCertificate {
    /// Returns the certificate of the topology of a family; `None` if every peer sends to every other peer.
    ///
    /// # Errors
    ///
    /// [`ProofError::NoCertificate`] for weights without finite eigenvectors, and if a scene of the family is refused.
    pub fn of(family: &Family) -> Result<Option<Self>, ProofError> {
        let lows: Vec<f64> = family.keys().iter().map(|key| key.low).collect();
        let scene = family.scene(&lows)?;
        let Some(topology) = &scene.topology else { return Ok(None) };
        let weights = weights_of(topology);
        let vectors = eigenvectors(&weights).ok_or(ProofError::NoCertificate { what: "a [topology] of such weights" })?;
        let rows = || (0..weights.rows()).map(|row| weights.row(row).to_vec()).collect();
        let columns = (0..vectors.columns()).flat_map(|column| (0..vectors.rows()).map(move |row| (row, column)));
        Ok(Some(Self { weights: (topology.kind() == TopologyKind::Graph).then(rows), eigenvectors: digits(columns.map(|place| vectors[place])) }))
    }
}

/// Target for the certified parts of a scene and their verdicts; `None` if no certificate is asked for.
pub(super) type Certified<'a> = Option<&'a mut Vec<(Proven, PartCertificate)>>;

/// Returns the parts behind a verdict: all parts for a stable verdict, the first unstable part for an unstable verdict, otherwise no part.
pub(super) fn needed(verdict: Option<Proven>, mut parts: Vec<(Proven, PartCertificate)>) -> Vec<PartCertificate> {
    // One growing part makes the scene grow, whatever the other parts do.
    if verdict != Some(Proven::Stable) {
        parts.retain(|(of, _)| Some(*of) == verdict);
        parts.truncate(1);
    }
    parts.into_iter().map(|(_, part)| part).collect()
}

impl MomentCertificate {
    pub(super) fn new(factor: f64, time: f64, heard: Option<Gains>, depth: usize, blocks: &[&Matrix]) -> Self {
        let rows = |block: &Matrix| digits((0..block.rows()).flat_map(|row| block.row(row).to_vec()));
        Self { factor, time, heard, depth, blocks: blocks.iter().map(|block| rows(block)).collect() }
    }
}

/// Part of the motion of a scene over a box: the averages of the classes of equal peers, or the differences between the members of one class.
#[derive(Clone, PartialEq, Debug)]
pub struct PartCertificate {
    /// Members of each class, as places in the scene, indexed by class.
    pub members: Vec<Vec<usize>>,
    /// `true` if the part is the differences between the members of a class.
    pub is_difference: bool,
    /// Interval of the part's eigenvalues of the averaging matrix. `None` without a topology and for the part of the eigenvalue 1.
    pub eigenvalues: Option<[f64; 2]>,
    /// States in the order of the rows of the coordinates. Positions are counted from the first copy if nothing ties the scene to ground. Velocities are
    /// multiplied by `time`.
    pub states: Vec<FrameState>,
    /// Gains K and B if a sample is the single number (K·x + B·v)/(K + B/time); `None` if a sample is a position and a velocity.
    pub heard: Option<Gains>,
    /// Time by which velocities are multiplied \[s\].
    pub time: f64,
    /// Compliance by which forces are multiplied \[m/N\], with a server or waves; otherwise `None`.
    pub compliance: Option<f64>,
    /// Coordinates V, column by column, with real and imaginary part of each entry. Each number is written as the sixteen hexadecimal digits of its IEEE 754
    /// representation.
    pub coordinates: String,
    /// Weights d, in digits as in `coordinates`.
    pub weights: String,
    /// Circle without an eigenvalue of any matrix of the box.
    pub circle: FreeCircle,
}

impl PartCertificate {
    pub(super) fn new(members: Vec<Vec<usize>>, is_difference: bool, states: States, time: f64, witness: &Witness) -> Self {
        let v = &witness.coordinates;
        let entries = (0..v.columns()).flat_map(|column| (0..v.rows()).map(move |row| v[(row, column)]));
        let coordinates = digits(entries.flat_map(|entry| [entry.re, entry.im]));
        let weights = digits(witness.weights.iter().copied());
        let (states, heard, circle) = (states.names, states.heard, witness.circle);
        Self { members, is_difference, eigenvalues: None, states, heard, time, compliance: None, coordinates, weights, circle }
    }
}

/// Source of the names of the states of a frame.
pub(super) enum Named {
    /// Points from which the frame was computed.
    AtPoints(Vec<Point>),
    /// Known names of the states, and the compliance by which forces are multiplied \[m/N\].
    Known(States, f64),
}

impl Named {
    /// Returns the certificate of a part with these states.
    pub(super) fn certificate(
        self,
        members: Vec<Vec<usize>>,
        is_difference: bool,
        common: Common<'_>,
        witness: &Witness,
    ) -> Result<PartCertificate, ProofError> {
        let (states, compliance) = match self {
            Self::AtPoints(points) => (states(&points, common)?, None),
            Self::Known(states, compliance) => (states, Some(compliance)),
        };
        Ok(PartCertificate { compliance, ..PartCertificate::new(members, is_difference, states, common.time, witness) })
    }
}

/// Writes each number as sixteen hexadecimal digits of its IEEE 754 representation, without separators.
pub(crate) fn digits(numbers: impl Iterator<Item = f64>) -> String {
    let mut text = String::new();
    for number in numbers {
        // Writing to a string does not fail.
        let _ = write!(text, "{:016x}", number.to_bits());
    }
    text
}
