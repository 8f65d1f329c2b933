//! A whole region of two keys: boxes of which each is proven stable or proven unstable, and a rest that is not decided.

use cohaptic_stability::{Family, Watch};

use super::certificate::BoxCertificate;
use super::certificate::uncertified;
use super::error::ProofError;
use super::followed::{Followed, certify};
use super::guarantee::Guarantee;
use super::halving::{Halved, Halving};
use super::known::{KnownPieces, NothingKnown};

/// A box of two keys, and the verdict on all scenes in it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProvenBox {
    /// From which value of the first key to which.
    pub x: [f64; 2],
    /// From which value of the second key to which.
    pub y: [f64; 2],
    /// The verdict on each.
    pub guarantee: Guarantee,
}

/// A region that is covered by boxes.
#[derive(Clone, PartialEq, Debug)]
pub struct ProvenRegion {
    /// They meet at edges alone: larger ones first, then by y and x.
    pub boxes: Vec<ProvenBox>,
    /// How many boxes were looked at.
    pub attempts: usize,
    /// Whether nobody ended the proof; if somebody did, boxes that were not looked at are undecided too.
    pub is_whole: bool,
    /// For which numbers of peers its verdicts hold.
    every: Option<(u64, Option<u64>)>,
}

/// How finely a region is divided at most: each range into two to the power of this.
pub const MOST_HALVINGS: u32 = 16;
/// More boxes than this are not kept waiting, and stay undecided: where an eigenvalue stays at the unit circle, none is ever decided.
const MOST_WAITING: usize = 1 << 21;

/// How a region is halved.
pub(super) fn halving(halvings: u32) -> Halving {
    Halving { times: halvings.min(MOST_HALVINGS), tolerance: None, most: MOST_WAITING / 4, whole: None }
}

impl ProvenRegion {
    /// Decides a family with two keys over their ranges: boxes that are not decided are divided into four, up to `halvings` times. A key that is a delay of links is divided where a sample comes into force at another tick, and nowhere else.
    /// With `every` a verdict holds for every number of peers from the first to the second, or without end, of the largest class of equal ones. What comes out does not depend on the number of threads.
    /// A box is an operation of the watch, which may end the proof.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if there are not two keys that each do nothing but set gains, masses and dampings, or delays for one of them, and for scenes of which nothing can be proven.
    pub fn prove(family: &Family, halvings: u32, every: Option<(u64, Option<u64>)>, watch: &dyn Watch) -> Result<Self, ProofError> {
        Self::prove_with(family, halvings, every, &NothingKnown, watch)
    }

    /// [`ProvenRegion::prove`], where boxes that are known are not decided again: what comes out is the same.
    ///
    /// # Errors
    ///
    /// Those of [`ProvenRegion::prove`].
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

    /// The boxes with all by which they can be checked. Each is decided once more.
    ///
    /// # Errors
    ///
    /// As [`ProvenRegion::prove`], of the family that was proven, and if the watch ends it.
    pub fn certify(&self, family: &Family, watch: &dyn Watch) -> Result<Vec<BoxCertificate>, ProofError> {
        certify(family, self.every, self.boxes.iter().map(|ProvenBox { x, y, .. }| vec![*x, *y]).collect(), watch)
    }

    /// How many boxes have a verdict of which a certificate says nothing.
    #[must_use]
    pub fn uncertified(&self, certificate: &[BoxCertificate]) -> usize {
        uncertified(certificate, self.boxes.iter().map(|one| (vec![one.x, one.y], one.guarantee)))
    }

    /// How many boxes without an area have that verdict: those of a single delay, such as none at all, of which no share tells.
    #[must_use]
    pub fn lines(&self, guarantee: Guarantee) -> usize {
        let is_line = |one: &&ProvenBox| one.x[0] >= one.x[1] || one.y[0] >= one.y[1];
        self.boxes.iter().filter(is_line).filter(|one| one.guarantee == guarantee).count()
    }

    /// The share of the area of the ranges with that verdict. A single delay, such as none at all, has no area: see [`ProvenRegion::lines`].
    #[must_use]
    pub fn share(&self, guarantee: Guarantee) -> f64 {
        let area = |boxes: &mut dyn Iterator<Item = &ProvenBox>| boxes.map(|one| (one.x[1] - one.x[0]) * (one.y[1] - one.y[0])).sum::<f64>();
        // A sum of nothing is −0.
        area(&mut self.boxes.iter().filter(|one| one.guarantee == guarantee)) / area(&mut self.boxes.iter()) + 0.0
    }
}
