//! Certificates: the numbers by which anybody can check a proof without the program that found it.
//!
//! A certificate names the states of each part of a scene, and for each box of it, or for each span of numbers of peers, the coordinates V, the weights d and
//! the circle of [`super::discs`]. A reader with the scene can write down its matrices and check inequality (1) there;
//! `crates/stability/tests/reference/check_certificate.py` does.

use std::fmt::Write as _;

use cohaptic_peer::Gains;
use cohaptic_scene::TopologyKind;
use cohaptic_stability::frames::{eigenvectors, weights_of};
use cohaptic_stability::{Family, Matrix};

use super::corners::{Common, Point, States, states};
use super::discs::{FreeCircle, Witness};
use super::error::ProofError;
use super::guarantee::{Guarantee, Proven};
use super::halving::Ranges;
use super::steps::FrameState;

/// A box of keys, and the numbers by which its verdict can be checked.
#[derive(Clone, Debug)]
pub struct BoxCertificate {
    /// From which value of each key to which; and between which ends 1/(N − 1) is, where it holds for every number N of peers between them.
    pub ranges: Vec<[f64; 2]>,
    /// The verdict on each scene within.
    pub guarantee: Guarantee,
    /// Of a stable box all parts of the motion but devices that touch nothing; of an unstable one the part that grows; else none.
    pub parts: Vec<PartCertificate>,
}

impl BoxCertificate {
    pub(super) fn new(ranges: Vec<[f64; 2]>, proven: Proven, parts: Vec<(Proven, PartCertificate)>) -> Self {
        Self { ranges, guarantee: proven.into(), parts: needed(Some(proven), parts) }
    }
}

/// How many boxes of an answer have a verdict and are open in its certificate, which bounds frames more widely. Both are in the same order; an open box of a
/// certificate is a whole one of the answer.
pub(super) fn uncertified(certificate: &[BoxCertificate], answer: impl Iterator<Item = (Ranges, Guarantee)>) -> usize {
    let mut open = certificate.iter().filter(|one| one.guarantee == Guarantee::Undecided).peekable();
    let is_open = |(ranges, guarantee): &(Ranges, Guarantee)| {
        open.next_if(|one| one.ranges.starts_with(ranges)).is_some() && *guarantee != Guarantee::Undecided
    };
    answer.filter(is_open).count()
}

/// Numbers of equal peers, and the numbers by which the verdict on them can be checked.
#[derive(Clone, Debug)]
pub struct NumberCertificate {
    /// The least.
    pub from: u64,
    /// The greatest; `None`: all beyond.
    pub to: Option<u64>,
    /// The verdict on each.
    pub guarantee: Guarantee,
    /// As those of [`BoxCertificate`]; empty in the mean square.
    pub parts: Vec<PartCertificate>,
    /// In the mean square, of a stable span one for each motion; of an unstable one that which grows; else none.
    pub moments: Vec<MomentCertificate>,
}

/// A second moment Y of equal peers by which (γ·Y − L(Y)) can be checked to be positive definite for all numbers of a span.
#[derive(Clone, Debug)]
pub struct MomentCertificate {
    /// γ.
    pub factor: f64,
    /// What velocities are multiplied by \[s\].
    pub time: f64,
    /// The gains K and B by which a sample is the one number (K·x + B·v)/(K + B/time).
    pub heard: Option<Gains>,
    /// How many samples of frames before take part.
    pub depth: usize,
    /// Y of the mean over the peers, of the differences from it, and, but for two peers, of samples of which all sums are zero: row by row, in digits as those
    /// of [`PartCertificate`].
    pub blocks: Vec<String>,
}

/// The averaging matrix of a topology, and by what its eigenvalues can be enclosed.
#[derive(Clone, PartialEq, Debug)]
pub struct TopologyCertificate {
    /// The weights between peers, a row a peer, where the scene reads them from a file.
    pub weights: Option<Vec<Vec<f64>>>,
    /// Nearly its eigenvectors, column by column, but for that of equal entries; in digits as those of [`PartCertificate`].
    pub eigenvectors: String,
}

impl TopologyCertificate {
    /// That of the topology of a family; `None` if everybody sends to everybody.
    ///
    /// # Errors
    ///
    /// [`ProofError::NoCertificate`] for weights whose eigenvectors are not found, and if a scene of the family is refused.
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

/// Parts of a scene with their verdicts, where they are asked for.
pub(super) type Certified<'a> = Option<&'a mut Vec<(Proven, PartCertificate)>>;

/// The parts that a verdict needs: all, or one that grows.
pub(super) fn needed(verdict: Option<Proven>, mut parts: Vec<(Proven, PartCertificate)>) -> Vec<PartCertificate> {
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

/// A part of the motion of a scene over a box: the averages of its classes of equal peers, or how the members of one of them differ.
#[derive(Clone, PartialEq, Debug)]
pub struct PartCertificate {
    /// The members of each class, by their places in the scene.
    pub members: Vec<Vec<usize>>,
    /// Whether it is how the members of a class differ.
    pub is_difference: bool,
    /// Of a part of a topology but that of 1, between which ends the eigenvalues of the averaging matrix are that it stands for.
    pub eigenvalues: Option<[f64; 2]>,
    /// The states, in the order of rows of the coordinates. Positions are counted from the first copy where nothing ties the scene to ground, and velocities
    /// multiplied by `time`.
    pub states: Vec<FrameState>,
    /// The gains K and B by which a sample is the one number (K·x + B·v)/(K + B/time); `None`: its position and its velocity.
    pub heard: Option<Gains>,
    /// What velocities are multiplied by \[s\].
    pub time: f64,
    /// With a server or waves, what forces are multiplied by \[m/N\].
    pub compliance: Option<f64>,
    /// V, column by column, real and imaginary part of each entry, each as sixteen hexadecimal digits of its IEEE 754 representation.
    pub coordinates: String,
    /// d, in such digits too.
    pub weights: String,
    /// The circle on which there is no eigenvalue.
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

/// By what the states of a frame get their names.
pub(super) enum Named {
    /// The points that it was computed from.
    AtPoints(Vec<Point>),
    /// They have them, with what forces are multiplied by.
    Known(States, f64),
}

impl Named {
    /// The certificate of a part with those states.
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

/// Each number as sixteen hexadecimal digits of its IEEE 754 representation.
pub(crate) fn digits(numbers: impl Iterator<Item = f64>) -> String {
    let mut text = String::new();
    for number in numbers {
        // Writing to a string does not fail.
        let _ = write!(text, "{:016x}", number.to_bits());
    }
    text
}
