//! A line along one key: stretches of which each is proven stable or proven unstable, and between them stretches that hold every crossing.

use cohaptic_stability::{Family, Watch};

use super::certificate::BoxCertificate;
use super::certificate::uncertified;
use super::error::ProofError;
use super::followed::{Followed, certify};
use super::guarantee::Guarantee;
use super::halving::{Halved, Halving};
use super::known::{KnownPieces, NothingKnown};

/// Values of a key from one to another, and the verdict on all scenes with them.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProvenStretch {
    /// The least value.
    pub low: f64,
    /// The greatest value.
    pub high: f64,
    /// The verdict; where it is [`Guarantee::Undecided`], the boundary may be anywhere within, and it is nowhere else.
    pub guarantee: Guarantee,
}

/// A range of a key that is covered by stretches.
#[derive(Clone, PartialEq, Debug)]
pub struct ProvenLine {
    /// From the lowest value on; they meet at their ends, and neighbours differ.
    pub stretches: Vec<ProvenStretch>,
    /// How many stretches were looked at.
    pub attempts: usize,
    /// The stretches as they were decided, of which neighbours may agree.
    pieces: Vec<ProvenStretch>,
    /// Whether nobody ended the proof; if somebody did, stretches that were not looked at are undecided too.
    pub is_whole: bool,
}

/// More stretches than this are not kept waiting: where an eigenvalue stays at the unit circle, none is ever decided.
const MOST_WAITING: usize = 1 << 16;

/// How a line is halved.
pub(super) const fn halving(tolerance: f64) -> Halving {
    Halving { times: u32::MAX, tolerance: Some(tolerance), most: MOST_WAITING - 1, whole: None }
}

impl ProvenLine {
    /// Decides a family with one key over its range: stretches that are not decided are halved until they are no longer than `tolerance`, or have no number within; a delay of links is divided where a sample comes into force at another tick, and nowhere else. What comes out does not
    /// depend on the number of threads. A stretch is an operation of the watch, which may end the proof.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if there is not one key that does nothing but set gains, masses and dampings or a delay, and for scenes of which nothing can be proven.
    pub fn prove(family: &Family, tolerance: f64, watch: &dyn Watch) -> Result<Self, ProofError> {
        Self::prove_with(family, tolerance, &NothingKnown, watch)
    }

    /// [`ProvenLine::prove`], where stretches that are known are not decided again: what comes out is the same.
    ///
    /// # Errors
    ///
    /// Those of [`ProvenLine::prove`].
    pub fn prove_with(family: &Family, tolerance: f64, pieces: &dyn KnownPieces, watch: &dyn Watch) -> Result<Self, ProofError> {
        if family.keys().len() != 1 {
            return Err(ProofError::OneKey);
        }
        let followed = Followed::new(family, None)?;
        let halving = halving(tolerance).but_for(followed.delay());
        let Halved { pieces, attempts, is_whole } =
            halving.of(followed.beginnings(), 0, &|ranges| followed.look(ranges, pieces, watch).map(Some), watch)?;
        let stretch = |(ranges, guarantee): (Vec<[f64; 2]>, Guarantee)| ProvenStretch { low: ranges[0][0], high: ranges[0][1], guarantee };
        let mut found: Vec<ProvenStretch> = pieces.into_iter().map(stretch).collect();
        found.sort_by(|one, other| one.low.total_cmp(&other.low));
        let mut stretches: Vec<ProvenStretch> = Vec::new();
        for one in &found {
            match stretches.last_mut() {
                Some(last) if last.guarantee == one.guarantee => last.high = one.high,
                _ => stretches.push(*one),
            }
        }
        Ok(Self { stretches, attempts, is_whole, pieces: found })
    }

    /// The pieces of the line with all by which they can be checked. Each is decided once more.
    ///
    /// # Errors
    ///
    /// As [`ProvenLine::prove`], of the family that was proven, and if the watch ends it.
    pub fn certify(&self, family: &Family, watch: &dyn Watch) -> Result<Vec<BoxCertificate>, ProofError> {
        certify(family, None, self.pieces.iter().map(|ProvenStretch { low, high, .. }| vec![[*low, *high]]).collect(), watch)
    }

    /// How many pieces have a verdict of which a certificate says nothing.
    #[must_use]
    pub fn uncertified(&self, certificate: &[BoxCertificate]) -> usize {
        uncertified(certificate, self.pieces.iter().map(|piece| (vec![[piece.low, piece.high]], piece.guarantee)))
    }
}
