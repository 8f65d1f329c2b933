//! A line along one key: stretches proven stable or proven unstable, and undecided stretches between with every crossing.

use cohaptic_stability::{Family, Watch};

use super::certificate::BoxCertificate;
use super::certificate::uncertified;
use super::error::ProofError;
use super::followed::{Followed, certify};
use super::guarantee::Guarantee;
use super::halving::{Halved, Halving, KnownPieces, NothingKnown};

/// Range of values of a key, and the verdict on all scenes with a value in the range.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProvenStretch {
    /// The least value.
    pub low: f64,
    /// The greatest value.
    pub high: f64,
    /// The verdict. A boundary of stability lies anywhere in a stretch with [`Guarantee::Undecided`], and in no other stretch.
    pub guarantee: Guarantee,
}

/// Range of a key, covered by stretches.
#[derive(Clone, PartialEq, Debug)]
pub struct ProvenLine {
    /// Stretches in ascending order. Neighbours meet at their ends and have different verdicts.
    pub stretches: Vec<ProvenStretch>,
    /// Number of stretches looked at, stretches halved afterwards included.
    pub attempts: usize,
    /// Stretches as decided, before neighbours with the same verdict were joined.
    pieces: Vec<ProvenStretch>,
    /// `true` if the watch let the proof run to its end. Otherwise the remaining stretches are undecided too.
    pub is_whole: bool,
}

/// Number of stretches after which undecided stretches are no longer halved. If an eigenvalue stays at the unit circle, no stretch is ever decided.
const MOST_WAITING: usize = 1 << 16;

/// Returns the halving of a line down to stretches of the length `tolerance`, in the unit of the key.
pub(super) const fn halving(tolerance: f64) -> Halving {
    Halving { times: u32::MAX, tolerance: Some(tolerance), most: MOST_WAITING - 1, whole: None }
}

impl ProvenLine {
    /// Decides a family with one key over the range of the key. Undecided stretches are halved down to the length `tolerance`, in the unit of the
    /// key, or no floating-point number lies within. The key of a delay of links is divided where a sample comes into force at another tick, and nowhere
    /// else. The result does not depend on the number of threads. A stretch is an operation of the watch. The watch may end the proof.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if the family does not have exactly one key, if the key sets anything but gains, masses, dampings or a delay, and for scenes without
    /// any possible proof.
    pub fn prove(family: &Family, tolerance: f64, watch: &dyn Watch) -> Result<Self, ProofError> {
        Self::prove_with(family, tolerance, &NothingKnown, watch)
    }

    /// Decides a family like [`ProvenLine::prove`] and with the same result, but takes the verdicts of known stretches from `pieces` and stores new verdicts
    /// there.
    ///
    /// # Errors
    ///
    /// [`ProofError`] for the same reasons as [`ProvenLine::prove`].
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
        // Pieces come in the order of their sizes. Sorted by value, neighbours can be joined.
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

    /// Returns the pieces of the line with the numbers for a check of the verdicts. Each piece is decided once more, and is undecided here if the
    /// wider bounds of the checker decide nothing.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if the watch ends the certification, and for the reasons of [`ProvenLine::prove`] if `family` is not the proven family.
    pub fn certify(&self, family: &Family, watch: &dyn Watch) -> Result<Vec<BoxCertificate>, ProofError> {
        certify(family, None, self.pieces.iter().map(|ProvenStretch { low, high, .. }| vec![[*low, *high]]).collect(), watch)
    }

    /// Returns the number of pieces with a verdict here and without a verdict in the certificate.
    #[must_use]
    pub fn uncertified(&self, certificate: &[BoxCertificate]) -> usize {
        uncertified(certificate, self.pieces.iter().map(|piece| (vec![[piece.low, piece.high]], piece.guarantee)))
    }
}
