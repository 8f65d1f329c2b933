//! A whole region of two keys: boxes of which each is proven stable or proven unstable, and a rest that is not decided.

use cohaptic_scene::Scene;
use rayon::prelude::*;

use super::corners::{Common, Point, steps};
use super::discs::decide;
use super::span::StepSpan;
use super::{Guarantee, ProofError, Proven};
use crate::analysis::pairs;
use crate::lifted::Node;
use crate::network::NominalNetwork;
use crate::parts::alone;
use crate::pieces::pieces;
use crate::structure::Structure;
use crate::timetable::Timetable;
use crate::{AnalysisError, Family, FamilyError, Matrix, Verdict, Watch};

/// A box of two keys, and what is known of all scenes in it.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct ProvenBox {
    /// From which value of the first key to which.
    pub x: [f64; 2],
    /// From which value of the second key to which.
    pub y: [f64; 2],
    /// What is known.
    pub guarantee: Guarantee,
}

/// A region that is covered by boxes.
#[derive(Clone, PartialEq, Debug)]
pub struct ProvenRegion {
    /// They meet at edges alone: larger ones first, then by y and x.
    pub boxes: Vec<ProvenBox>,
    /// How many boxes were looked at.
    pub attempts: usize,
}

/// How finely a region is divided at most: each range into two to the power of this.
pub const MOST_HALVINGS: u32 = 16;

impl ProvenRegion {
    /// Decides a family with two keys over their ranges: boxes that are not decided are divided into four, up to `halvings` times. What comes out does not depend on the number of threads.
    ///
    /// # Errors
    ///
    /// [`ProofError`] if there are not two keys that each do nothing but set gains, masses and dampings; for scenes of which nothing can be proven; and if the watch ends it.
    pub fn prove(family: &Family, halvings: u32, watch: &dyn Watch) -> Result<Self, ProofError> {
        let [x, y] = family.keys() else { return Err(ProofError::Keys) };
        if let Some(place) = family.learned().iter().position(|learned| !learned) {
            return Err(ProofError::Key { key: family.keys()[place].key.clone() });
        }
        let followed = Followed::new(family)?;
        let mut waiting = vec![([x.low, x.high], [y.low, y.high])];
        let (mut boxes, mut attempts) = (Vec::new(), 0);
        for halved in 0..=halvings.min(MOST_HALVINGS) {
            let found = waiting.par_iter().map(|(x, y)| {
                if watch.stops() {
                    return Err(ProofError::Analysis(AnalysisError::Stopped));
                }
                followed.decide(*x, *y)
            });
            let found = found.collect::<Result<Vec<_>, _>>()?;
            attempts += found.len();
            let mut next = Vec::new();
            for ((x, y), proven) in waiting.into_iter().zip(found) {
                match proven {
                    None if halved < halvings.min(MOST_HALVINGS) => {
                        let halves = |[low, high]: [f64; 2]| [[low, low.midpoint(high)], [low.midpoint(high), high]];
                        next.extend(halves(y).into_iter().flat_map(|y| halves(x).map(|x| (x, y))));
                    }
                    proven => boxes.push(ProvenBox { x, y, guarantee: proven.map_or(Guarantee::Undecided, Guarantee::from) }),
                }
            }
            waiting = next;
        }
        Ok(Self { boxes, attempts })
    }

    /// What share of the area of the ranges is known to be so; of [`Guarantee::Undecided`] what is not known.
    #[must_use]
    pub fn share(&self, guarantee: Guarantee) -> f64 {
        let area = |boxes: &mut dyn Iterator<Item = &ProvenBox>| boxes.map(|one| (one.x[1] - one.x[0]) * (one.y[1] - one.y[0])).sum::<f64>();
        // A sum of nothing is −0.
        area(&mut self.boxes.iter().filter(|one| one.guarantee == guarantee)) / area(&mut self.boxes.iter()) + 0.0
    }
}

/// One motion in one combination of contacts: the classes of its peers, for all values of the keys.
struct Motion {
    /// Which of the pieces of a scene it is.
    piece: usize,
    structure: Structure,
}

struct Followed<'a> {
    family: &'a Family,
    motions: Vec<Motion>,
}

impl<'a> Followed<'a> {
    fn new(family: &'a Family) -> Result<Self, ProofError> {
        let keys = family.keys();
        let at = |values: [f64; 2]| family.scene(&values);
        // Values inside tell peers apart that are equal by chance at an end.
        let scenes = [at([keys[0].odd(0), keys[1].odd(1)])?, at([keys[0].low, keys[1].low])?, at([keys[0].high, keys[1].high])?];
        scenes.iter().try_for_each(super::refuse)?;
        let all = scenes.iter().map(|scene| pieces(scene, "a proof")).collect::<Result<Vec<_>, _>>()?;
        let network = NominalNetwork::of(&scenes[0])?;
        let mut motions = Vec::new();
        for (piece, first) in all[0].iter().enumerate() {
            let of_piece: Vec<&Scene> = all.iter().filter_map(|pieces| pieces.get(piece)).map(|piece| &*piece.scene).collect();
            for (_, combination) in pairs(std::slice::from_ref(first), &mut false)? {
                motions.push(Motion { piece, structure: Structure::of(&of_piece, &network, &combination.contacts)? });
            }
        }
        Ok(Self { family, motions })
    }

    /// What all scenes of a box have in common, if that is proven.
    fn decide(&self, x: [f64; 2], y: [f64; 2]) -> Result<Option<Proven>, ProofError> {
        let scenes = [[x[0], y[0]], [x[1], y[0]], [x[0], y[1]], [x[1], y[1]]].map(|values| self.family.written(&values));
        let scenes = scenes.into_iter().collect::<Result<Vec<Scene>, FamilyError>>()?;
        let all = scenes.iter().map(|scene| pieces(scene, "a proof")).collect::<Result<Vec<_>, _>>()?;
        let mut proven = Some(Proven::Stable);
        for motion in &self.motions {
            let scenes: Vec<&Scene> = all.iter().filter_map(|pieces| pieces.get(motion.piece)).map(|piece| &*piece.scene).collect();
            match motion.decide(&scenes)? {
                // One motion that grows is enough.
                Some(Proven::Unstable) => return Ok(Some(Proven::Unstable)),
                Some(Proven::Stable) => {}
                None => proven = None,
            }
        }
        Ok(proven)
    }
}

impl Motion {
    /// What is proven of the motion between four scenes, the corners of a box.
    fn decide(&self, scenes: &[&Scene]) -> Result<Option<Proven>, ProofError> {
        let structure = &self.structure;
        let nodes: Vec<_> = scenes.iter().map(|scene| structure.nodes(scene)).collect();
        let time = structure.time(scenes[0], &nodes[0]);
        let of = |classes: std::ops::Range<usize>, weights: &Matrix, timetable: &Timetable, tied: bool| {
            let ends: Vec<Vec<Node>> = nodes.iter().map(|nodes| nodes[classes.clone()].to_vec()).collect();
            let points: Vec<Point> = ends.iter().map(|nodes| Point { nodes: nodes.clone(), weights: weights.clone() }).collect();
            Ok::<_, ProofError>(decide(&StepSpan::product(&steps(&points, &ends, Common { timetable, tied, time })?)))
        };
        let mut proven = Some(Proven::Stable);
        let mut add = |part: Option<Proven>| {
            proven = match (proven, part) {
                (Some(Proven::Unstable), _) | (_, Some(Proven::Unstable)) => Some(Proven::Unstable),
                (Some(Proven::Stable), Some(Proven::Stable)) => Some(Proven::Stable),
                _ => None,
            };
        };
        for class in 0..structure.classes.len() {
            if let Some(timetable) = &structure.apart[class] {
                let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
                add(of(class..class + 1, &weight, timetable, true)?);
            }
            let radii: Vec<_> = scenes.iter().filter_map(|scene| alone(structure, scene, class, 1)).map(|(part, _)| part.radius).collect();
            if let Some(first) = radii.first() {
                let is_one = radii.iter().all(|radius| radius == first);
                add((is_one && first.verdict() == Verdict::Stable).then_some(Proven::Stable));
            }
        }
        add(of(0..structure.classes.len(), &structure.weights, &structure.timetable, structure.tied)?);
        Ok(proven)
    }
}
