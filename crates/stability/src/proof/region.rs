//! A whole region of two keys: boxes of which each is proven stable or proven unstable, and a rest that is not decided.

use rayon::prelude::*;

use super::followed::{Followed, certify};
use super::{BoxCertificate, Guarantee, ProofError};
use crate::worst_case::rounding::real;
use crate::{Family, Watch};

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

impl ProvenRegion {
    /// Decides a family with two keys over their ranges: boxes that are not decided are divided into four, up to `halvings` times. A key that is a delay of links is divided where a sample comes into force at another tick, and nowhere else.
    /// With `every` a verdict holds for every number of peers from the first to the second, or without end, of the largest class of equal ones. What comes out does not depend on the number of threads.
    /// A box is an operation of the watch, which may end the proof.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if there are not two keys that each do nothing but set gains, masses and dampings, or delays for one of them, and for scenes of which nothing can be proven.
    pub fn prove(family: &Family, halvings: u32, every: Option<(u64, Option<u64>)>, watch: &dyn Watch) -> Result<Self, ProofError> {
        if family.keys().len() != 2 {
            return Err(ProofError::Keys);
        }
        let followed = Followed::new(family, every)?;
        let mut waiting: Vec<([f64; 2], [f64; 2])> = followed.beginnings().into_iter().map(|ranges| (ranges[0], ranges[1])).collect();
        let (mut boxes, mut attempts, mut is_whole) = (Vec::new(), 0, true);
        for halved in 0..=halvings.min(MOST_HALVINGS) {
            watch.expects(real(waiting.len()));
            let found = waiting.par_iter().map(|(x, y)| {
                if watch.stops() {
                    return Ok(None);
                }
                let proven = followed.decide(&[*x, *y])?;
                watch.done(1.0);
                Ok::<_, ProofError>(proven)
            });
            let found = found.collect::<Result<Vec<_>, _>>()?;
            attempts += found.len();
            is_whole = is_whole && !watch.stops();
            let is_last = !is_whole || halved >= halvings.min(MOST_HALVINGS) || 4 * found.len() > MOST_WAITING;
            let mut next = Vec::new();
            for ((x, y), proven) in waiting.into_iter().zip(found) {
                match proven {
                    None if !is_last => {
                        let halves = |key: usize, [low, high]: [f64; 2]| {
                            if followed.is_divided(key) { vec![[low, low.midpoint(high)], [low.midpoint(high), high]] } else { vec![[low, high]] }
                        };
                        next.extend(halves(1, y).into_iter().flat_map(|y| halves(0, x).into_iter().map(move |x| (x, y))));
                    }
                    proven => boxes.push(ProvenBox { x, y, guarantee: proven.map_or(Guarantee::Undecided, Guarantee::from) }),
                }
            }
            waiting = next;
        }
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

    /// The share of the area of the ranges with that verdict. A single delay, such as none at all, has no area.
    #[must_use]
    pub fn share(&self, guarantee: Guarantee) -> f64 {
        let area = |boxes: &mut dyn Iterator<Item = &ProvenBox>| boxes.map(|one| (one.x[1] - one.x[0]) * (one.y[1] - one.y[0])).sum::<f64>();
        // A sum of nothing is −0.
        area(&mut self.boxes.iter().filter(|one| one.guarantee == guarantee)) / area(&mut self.boxes.iter()) + 0.0
    }
}
