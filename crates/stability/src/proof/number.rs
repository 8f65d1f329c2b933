//! Every number of equal peers at once.
//!
//! Equal peers over equal links move in two ways that do not mix: together, and apart from each other by a node that hears itself with the weight −1/(N−1) (`structure`). The number N is in the
//! mass of a copy, m or m/N; in the gains, multiplied by 1, 2/N, N − 1 or 2(N − 1)/N; in the weight; and in the weight times the gains. Each is monotone in N, so that those of the
//! ends of a span of numbers enclose them, and spans are halved until each is [decided](super::discs). Of a span without end, the other end is N = 2⁵³, which is as far from
//! the limit as a rounding, if there is a limit.

use cohaptic_scene::Scene;

use super::corners::{Common, Point, doubled, steps};
use super::discs::decide;
use super::span::StepSpan;
use super::{Guarantee, ProofError, Proven};
use crate::analysis::pairs;
use crate::lifted::Node;
use crate::network::NominalNetwork;
use crate::pieces::pieces;
use crate::structure::{Structure, count};
use crate::timetable::Timetable;
use crate::{Matrix, Watch};

/// Numbers of peers from one to another, ends included, of which the same is known.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NumberSpan {
    /// The least.
    pub from: u64,
    /// The greatest; `None`: all beyond.
    pub to: Option<u64>,
    /// What is known.
    pub guarantee: Guarantee,
}

/// What is proven of every number of equal peers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct EveryNumber {
    /// In order, without gaps; neighbours differ.
    pub spans: Vec<NumberSpan>,
    /// What grows or vanishes without a limit as N grows, in words.
    pub without_limit: Option<String>,
    /// How many certificates were looked for.
    pub attempts: u64,
}

/// As good as without end: a weight of 1/(N − 1) is below a rounding.
const ENDLESS: u64 = 1 << 53;
/// Where nothing has a limit, numbers are followed up to this.
const MOST_FOLLOWED: u64 = 1_000_000;
/// More certificates than this are not looked for.
const MOST_ATTEMPTS: u64 = 200_000;

/// Decides a scene with equal peers for every number of them from `from` to `to`, or without end. How many peers the scene itself has does not matter.
///
/// # Errors
///
/// [`ProofError`] if peers or links differ, if something is left to chance or not linear, or if the watch ends it.
pub fn prove_every_number(scene: &Scene, from: u64, to: Option<u64>, watch: &dyn Watch) -> Result<EveryNumber, ProofError> {
    if from < 2 || to.is_some_and(|to| to < from) {
        return Err(ProofError::Numbers);
    }
    super::refuse(scene)?;
    let network = NominalNetwork::of(scene)?;
    let followed = Followed::new(scene, &network)?;
    let without_limit = if to.is_some() { None } else { followed.without_limit()? };
    let end = match to {
        Some(to) => to,
        None if without_limit.is_some() => MOST_FOLLOWED.max(from),
        None => ENDLESS,
    };
    let mut spans: Vec<NumberSpan> = Vec::new();
    let mut attempts = 0;
    // From the least number on: what is not decided is halved, and the far half waits.
    let mut waiting = vec![(from, end)];
    while let Some((low, high)) = waiting.pop() {
        if watch.stops() {
            return Err(ProofError::Analysis(crate::AnalysisError::Stopped));
        }
        attempts += 1;
        let found = if attempts > MOST_ATTEMPTS { None } else { followed.decide(low, high)? };
        if found.is_none() && low < high && attempts <= MOST_ATTEMPTS {
            let middle = if high / low > 4 { 2 * low } else { low.midpoint(high) };
            waiting.push((middle + 1, high));
            waiting.push((low, middle));
            continue;
        }
        let guarantee = found.map_or(Guarantee::Undecided, Guarantee::from);
        let to = if high == ENDLESS { None } else { Some(high) };
        match spans.last_mut() {
            Some(last) if last.guarantee == guarantee => last.to = to,
            _ => spans.push(NumberSpan { from: low, to, guarantee }),
        }
    }
    if without_limit.is_some() {
        spans.push(NumberSpan { from: end + 1, to: None, guarantee: Guarantee::Undecided });
    }
    Ok(EveryNumber { spans, without_limit, attempts })
}

/// A motion of the scene, in one combination of contacts: its equal peers, for any number of them.
struct Motion {
    scene: Scene,
    structure: Structure,
}

struct Followed {
    motions: Vec<Motion>,
}

impl Followed {
    fn new(scene: &Scene, network: &NominalNetwork) -> Result<Self, ProofError> {
        let all = pieces(scene, "every number of peers")?;
        let mut motions = Vec::new();
        for (piece, combination) in pairs(&all, &mut false)? {
            let structure = Structure::of(&[&*piece.scene], network, &combination.contacts)?;
            if structure.classes.len() > 1 {
                let other = structure.classes[1][0];
                return Err(ProofError::Unequal { peer: scene.peers[other].name.clone() });
            }
            if structure.has_loose_devices(0) {
                return Err(ProofError::Loose { peer: scene.peers[0].name.clone() });
            }
            motions.push(Motion { scene: piece.scene.clone().into_owned(), structure });
        }
        Ok(Self { motions })
    }

    /// What every number of peers from `low` to `high` has in common, if that is proven.
    fn decide(&self, low: u64, high: u64) -> Result<Option<Proven>, ProofError> {
        let mut all = Some(Proven::Stable);
        for motion in &self.motions {
            for apart in [true, false] {
                match motion.decide(low, high, apart)? {
                    // One part that grows is enough.
                    Some(Proven::Unstable) => return Ok(Some(Proven::Unstable)),
                    Some(Proven::Stable) => {}
                    None => all = None,
                }
            }
        }
        Ok(all)
    }

    /// The number of a node that has no limit as N grows, in words.
    fn without_limit(&self) -> Result<Option<String>, ProofError> {
        for motion in &self.motions {
            let (far, near) = (motion.node(ENDLESS), motion.node(ENDLESS / 2));
            let differs = |far: f64, near: f64| (far - near).abs() > 1e-9 * far.abs().max(near.abs());
            let force = |node: &Node| node.object.only_map().map(|map| map.coefficients().1[1]).ok_or(ProofError::Drift);
            let held = |node: &Node| node.law.held_by().stiffness + node.law.held_by().damping;
            if differs(force(&far)?, force(&near)?) {
                return Ok(Some("the mass of a copy, m/N, vanishes".to_owned()));
            }
            if differs(held(&far), held(&near)) {
                let grows = held(&far) > held(&near);
                return Ok(Some(if grows { "the gains of the coordination grow with N" } else { "the gains of the coordination vanish" }.to_owned()));
            }
            if differs(far.coupling.stiffness + far.coupling.damping, near.coupling.stiffness + near.coupling.damping) {
                return Ok(Some("the coupling of devices and copies vanishes".to_owned()));
            }
        }
        Ok(None)
    }
}

impl Motion {
    fn node(&self, number: u64) -> Node {
        let scene = self.scene.scaled_for(usize::try_from(number).unwrap_or(usize::MAX));
        self.structure.node(&scene, 0)
    }

    /// What is proven of the part in which peers move together, or apart from each other.
    fn decide(&self, low: u64, high: u64, apart: bool) -> Result<Option<Proven>, ProofError> {
        let numbers = if low == high { vec![low] } else { vec![low, high] };
        let nodes: Vec<Node> = numbers.iter().map(|number| self.node(*number)).collect();
        let weight = |place: usize| if apart { -1.0 / (count_of(numbers[place]) - 1.0) } else { 1.0 };
        let (first, last) = (&nodes[0], &nodes[nodes.len() - 1]);
        let mut points = vec![Point { nodes: vec![first.clone()], weights: Matrix::from_fn(1, 1, |_, _| weight(0)) }];
        if last.law != first.law {
            points = doubled(&points, |point, upper| {
                let law = if upper { &last.law } else { &first.law };
                Point { nodes: vec![Node { law: law.clone(), ..point.nodes[0].clone() }], ..point.clone() }
            });
        }
        if apart && numbers.len() > 1 {
            // What is heard is the weight times the gains: a number of its own beside what holds the copy.
            points = doubled(&points, |point, upper| {
                let place = usize::from(upper);
                let ratio = gain(&nodes[place]) / gain(&point.nodes[0]);
                let weight = weight(place) * if ratio.is_finite() { ratio } else { 1.0 };
                Point { weights: Matrix::from_fn(1, 1, |_, _| weight), ..point.clone() }
            });
        }
        if last.coupling != first.coupling {
            points = doubled(&points, |point, upper| {
                let coupling = if upper { last.coupling } else { first.coupling };
                Point { nodes: vec![Node { coupling, ..point.nodes[0].clone() }], ..point.clone() }
            });
        }
        if last.object != first.object {
            points = doubled(&points, |point, upper| {
                let object = if upper { last.object } else { first.object };
                Point { nodes: vec![Node { object, ..point.nodes[0].clone() }], ..point.clone() }
            });
        }
        let timetable: &Timetable = match (apart, &self.structure.apart[0]) {
            (true, Some(timetable)) => timetable,
            (true, None) => return Err(ProofError::Numbers),
            (false, _) => &self.structure.timetable,
        };
        let common = Common { timetable, tied: apart || self.structure.tied, time: self.structure.time(&self.scene, &nodes) };
        Ok(decide(&StepSpan::product(&steps(&points, common)?)))
    }
}

/// A gain of the law that is not zero, if there is one: all of them are multiples of the same function of N.
fn gain(node: &Node) -> f64 {
    let gains = node.law.rows().flat_map(|row| [row.own.stiffness, row.own.damping, row.past.stiffness, row.past.damping]);
    gains.into_iter().find(|gain| *gain != 0.0).unwrap_or(1.0)
}

fn count_of(number: u64) -> f64 {
    usize::try_from(number).map_or(f64::INFINITY, count)
}
