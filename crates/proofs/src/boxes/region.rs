//! A region of two keys: boxes proven stable or proven unstable, and undecided boxes.

use cohaptic_stability::{Family, Watch};

use super::certificate::BoxCertificate;
use super::certificate::uncertified;
use super::error::ProofError;
use super::followed::{Followed, certify};
use super::guarantee::Guarantee;
use super::halving::{Halved, Halving, KnownPieces, NothingKnown};

/// Box of values of two keys, and the verdict on all scenes in the box.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProvenBox {
    /// Least and greatest value of the first key.
    pub x: [f64; 2],
    /// Least and greatest value of the second key.
    pub y: [f64; 2],
    /// Verdict on every scene in the box.
    pub guarantee: Guarantee,
}

/// Region of two keys, covered by boxes.
#[derive(Clone, PartialEq, Debug)]
pub struct ProvenRegion {
    /// Boxes. Two boxes overlap at edges only. Larger boxes come first; boxes of one size are ordered by y and then by x.
    pub boxes: Vec<ProvenBox>,
    /// Number of boxes looked at, boxes divided afterwards included.
    pub attempts: usize,
    /// `true` if the watch let the proof run to its end. Otherwise the remaining boxes are undecided too.
    pub is_whole: bool,
    /// First and last number of peers of the verdicts (`None` as the last: without end); `None`: the number of the scene.
    every: Option<(u64, Option<u64>)>,
}

/// Largest number of halvings: the range of each key is divided into at most two to the power of this number of parts.
pub const MOST_HALVINGS: u32 = 16;
/// Largest number of boxes waiting for a decision; boxes beyond stay undecided. If an eigenvalue stays at the unit circle, no box is ever decided.
const MOST_WAITING: usize = 1 << 21;

/// Returns the halving of a region, with at most `halvings` and [`MOST_HALVINGS`] halvings of each key.
pub(super) fn halving(halvings: u32) -> Halving {
    Halving { times: halvings.min(MOST_HALVINGS), tolerance: None, most: MOST_WAITING / 4, whole: None }
}

impl ProvenRegion {
    /// Decides a family with two keys over the ranges of both. Undecided boxes are divided into four, up to `halvings` times. The key of a delay of links is
    /// divided where a sample comes into force at another tick, and nowhere else. With `every` a verdict holds for every number of peers from the first to the
    /// second number, or without end, where the largest class of equal peers grows. The result does not depend on the number of threads. A box is an operation
    /// of the watch. The watch may end the proof.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if the family does not have exactly two keys, if a key sets anything but gains, masses and dampings (one key may set a delay instead),
    /// and for scenes without any possible proof.
    pub fn prove(family: &Family, halvings: u32, every: Option<(u64, Option<u64>)>, watch: &dyn Watch) -> Result<Self, ProofError> {
        Self::prove_with(family, halvings, every, &NothingKnown, watch)
    }

    /// Decides a family like [`ProvenRegion::prove`] and with the same result, but takes the verdicts of known boxes from `pieces` and stores new verdicts
    /// there.
    ///
    /// # Errors
    ///
    /// [`ProofError`] for the same reasons as [`ProvenRegion::prove`].
    pub fn prove_with(
        family: &Family,
        halvings: u32,
        every: Option<(u64, Option<u64>)>,
        pieces: &dyn KnownPieces,
        watch: &dyn Watch,
    ) -> Result<Self, ProofError> {
        if family.keys().len() != 2 {
            return Err(ProofError::Keys);
        }
        let followed = Followed::new(family, every)?;
        let halving = halving(halvings).but_for(followed.delay());
        let Halved { pieces, attempts, is_whole } =
            halving.of(followed.beginnings(), 0, &|ranges| followed.look(ranges, pieces, watch).map(Some), watch)?;
        let boxes = pieces.into_iter().map(|(ranges, guarantee)| ProvenBox { x: ranges[0], y: ranges[1], guarantee }).collect();
        Ok(Self { boxes, attempts, is_whole, every })
    }

    /// Returns the boxes with the numbers for a check of the verdicts. Each box is decided once more, and is undecided here if the wider bounds of
    /// the checker decide nothing.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if the watch ends the certification, and for the reasons of [`ProvenRegion::prove`] if `family` is not the proven family.
    pub fn certify(&self, family: &Family, watch: &dyn Watch) -> Result<Vec<BoxCertificate>, ProofError> {
        certify(family, self.every, self.boxes.iter().map(|ProvenBox { x, y, .. }| vec![*x, *y]).collect(), watch)
    }

    /// Returns the number of boxes with a verdict here and without a verdict in the certificate.
    #[must_use]
    pub fn uncertified(&self, certificate: &[BoxCertificate]) -> usize {
        uncertified(certificate, self.boxes.iter().map(|one| (vec![one.x, one.y], one.guarantee)))
    }

    /// Returns the number of boxes without an area and with the verdict. Such boxes belong to a single value of a delay, such as zero, and no share of the
    /// area counts them.
    #[must_use]
    pub fn lines(&self, guarantee: Guarantee) -> usize {
        let is_line = |one: &&ProvenBox| one.x[0] >= one.x[1] || one.y[0] >= one.y[1];
        self.boxes.iter().filter(is_line).filter(|one| one.guarantee == guarantee).count()
    }

    /// Returns the share of the verdict in the area of the region, from 0 to 1. A single value of a delay has no area: see [`ProvenRegion::lines`].
    #[must_use]
    pub fn share(&self, guarantee: Guarantee) -> f64 {
        let area = |boxes: &mut dyn Iterator<Item = &ProvenBox>| boxes.map(|one| (one.x[1] - one.x[0]) * (one.y[1] - one.y[0])).sum::<f64>();
        // The sum of no terms is −0.0, and its sign would be printed.
        area(&mut self.boxes.iter().filter(|one| one.guarantee == guarantee)) / area(&mut self.boxes.iter()) + 0.0
    }
}
