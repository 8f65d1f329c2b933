//! A family of scenes with open keys, and the verdict on all of them in a box of values.

use cohaptic_scene::Scene;
use rayon::prelude::*;

use super::certificate::{BoxCertificate, Certified, PartCertificate, needed};
use super::corners::{Common, Point, states, steps};
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
use crate::worst_case::rounding::real;
use crate::{AnalysisError, Family, FamilyError, Matrix, Verdict, Watch};

/// One motion in one combination of contacts: the classes of its peers, for all values of the keys.
pub(super) struct Motion {
    /// Which of the pieces of a scene it is.
    piece: usize,
    pub(super) structure: Structure,
}

/// A family whose keys do nothing but set gains, masses and dampings, and its motions.
pub(super) struct Followed<'a> {
    family: &'a Family,
    pub(super) motions: Vec<Motion>,
}

impl<'a> Followed<'a> {
    pub(super) fn new(family: &'a Family) -> Result<Self, ProofError> {
        let keys = family.keys();
        if let Some(place) = family.learned().iter().position(|learned| !learned) {
            return Err(ProofError::Key { key: keys[place].key.clone() });
        }
        let at = |value: &dyn Fn(usize) -> f64| family.scene(&(0..keys.len()).map(value).collect::<Vec<f64>>());
        // Values inside tell peers apart that are equal by chance at an end.
        let scenes = [at(&|key| keys[key].odd(key))?, at(&|key| keys[key].low)?, at(&|key| keys[key].high)?];
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

    /// What all scenes of a box have in common, from one value to another of each key, if that is proven.
    pub(super) fn decide(&self, ranges: &[[f64; 2]]) -> Result<Option<Proven>, ProofError> {
        self.decide_with(ranges, None)
    }

    /// The verdict on a box with all by which it can be checked; `None` if there is none.
    pub(super) fn certify(&self, ranges: &[[f64; 2]]) -> Result<Option<BoxCertificate>, ProofError> {
        let mut parts = Vec::new();
        let Some(proven) = self.decide_with(ranges, Some(&mut parts))? else { return Ok(None) };
        Ok(Some(BoxCertificate { ranges: ranges.to_vec(), guarantee: proven.into(), parts: needed(Some(proven), parts) }))
    }

    fn decide_with(&self, ranges: &[[f64; 2]], mut certified: Certified<'_>) -> Result<Option<Proven>, ProofError> {
        let corner = |place: usize| ranges.iter().enumerate().map(|(key, range)| range[place >> key & 1]).collect::<Vec<f64>>();
        let scenes = (0..1 << ranges.len()).map(|place| self.family.written(&corner(place))).collect::<Result<Vec<Scene>, FamilyError>>()?;
        let all = scenes.iter().map(|scene| pieces(scene, "a proof")).collect::<Result<Vec<_>, _>>()?;
        let mut proven = Some(Proven::Stable);
        for motion in &self.motions {
            let scenes: Vec<&Scene> = all.iter().filter_map(|pieces| pieces.get(motion.piece)).map(|piece| &*piece.scene).collect();
            match motion.decide(&scenes, certified.as_deref_mut())? {
                // One motion that grows is enough.
                Some(Proven::Unstable) => return Ok(Some(Proven::Unstable)),
                Some(Proven::Stable) => {}
                None => proven = None,
            }
        }
        Ok(proven)
    }
}

/// Boxes of a family with all by which their verdicts can be checked. A box is an operation of the watch, which may end it.
pub(super) fn certify(family: &Family, boxes: Vec<Vec<[f64; 2]>>, watch: &dyn Watch) -> Result<Vec<BoxCertificate>, ProofError> {
    let followed = Followed::new(family)?;
    watch.expects(real(boxes.len()));
    let certificates = boxes.into_par_iter().map(|ranges| {
        if watch.stops() {
            return Err(ProofError::Analysis(AnalysisError::Stopped));
        }
        watch.done(1.0);
        Ok(followed.certify(&ranges)?.unwrap_or(BoxCertificate { ranges, guarantee: Guarantee::Undecided, parts: Vec::new() }))
    });
    certificates.collect()
}

impl Motion {
    /// The verdict on the motion between scenes, the corners of a box, and the certificates of its parts where they are asked for.
    fn decide(&self, scenes: &[&Scene], mut certified: Certified<'_>) -> Result<Option<Proven>, ProofError> {
        let structure = &self.structure;
        let nodes: Vec<_> = scenes.iter().map(|scene| structure.nodes(scene)).collect();
        let time = structure.time(scenes[0], &nodes[0]);
        let mut of = |apart: Option<usize>, weights: &Matrix, timetable: &Timetable, tied: bool| {
            let classes = apart.map_or(0..structure.classes.len(), |class| class..class + 1);
            let ends: Vec<Vec<Node>> = nodes.iter().map(|nodes| nodes[classes.clone()].to_vec()).collect();
            let points: Vec<Point> = ends.iter().map(|nodes| Point { nodes: nodes.clone(), weights: weights.clone() }).collect();
            let common = Common { timetable, tied, time };
            let Some(decision) = decide(&StepSpan::product(&steps(&points, &ends, common)?)) else { return Ok(None) };
            if let Some(certified) = certified.as_deref_mut() {
                let members = classes.map(|class| structure.classes[class].clone()).collect();
                let part = PartCertificate::new(members, apart.is_some(), states(&points, common)?, time, &decision.witness);
                certified.push((decision.proven, part));
            }
            Ok::<_, ProofError>(Some(decision.proven))
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
                add(of(Some(class), &weight, timetable, true)?);
            }
            let radii: Vec<_> = scenes.iter().filter_map(|scene| alone(structure, scene, class, 1)).map(|(part, _)| part.radius).collect();
            if let Some(first) = radii.first() {
                let is_one = radii.iter().all(|radius| radius == first);
                add((is_one && first.verdict() == Verdict::Stable).then_some(Proven::Stable));
            }
        }
        add(of(None, &structure.weights, &structure.timetable, structure.tied)?);
        Ok(proven)
    }
}
