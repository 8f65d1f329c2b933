//! Every number of equal peers at once.
//!
//! The largest class of equal peers grows, and all others keep their members. Averages of classes and differences within one do not mix (`structure`), and only numbers in them depend on N: the mass of a copy, m or
//! m/N; gains, multiplied by 1, 2/N, N − 1, 4(N − 1)/N² or 4(N − 1)²/N²; and the weights. Of F peers in the other classes, with ν = 1/(N − 1), a class of n is heard with weight nν, itself with (n − 1)ν, and
//! the growing one with 1 − (F − 1)ν, itself with 1 − Fν; differences hear themselves with −ν. So what a gain hears is that gain times a constant, and that gain times ν times another. Each of these
//! factors is monotone in N from 2 on, so that those of the ends of a span of numbers enclose them, and spans are halved until each is [decided](super::discs). Of a span without end, the other end is N = 2⁵³, which
//! is as far from the limit as a rounding, if there is a limit.

use cohaptic_scene::Scene;

use super::corners::{Common, Point, doubled, steps, steps_beyond};
use super::discs::decide;
use super::span::StepSpan;
use super::{Guarantee, ProofError, Proven};
use crate::analysis::pairs;
use crate::lifted::Node;
use crate::network::NominalNetwork;
use crate::parts::alone;
use crate::pieces::pieces;
use crate::structure::{Structure, count};
use crate::{Matrix, Verdict, Watch};

/// Numbers of peers from one to another, ends included, of which one verdict holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NumberSpan {
    /// The least.
    pub from: u64,
    /// The greatest; `None`: all beyond.
    pub to: Option<u64>,
    /// The verdict on each.
    pub guarantee: Guarantee,
}

/// The verdicts on all numbers of equal peers.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct EveryNumber {
    /// The first of the equal peers of which there are more and more, by its place in [`Scene::peers`].
    pub growing: usize,
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
pub const MOST_FOLLOWED: u64 = 100_000;
/// More certificates than this are not looked for.
const MOST_ATTEMPTS: u64 = 200_000;

/// Decides a scene for every number of peers from `from` to `to`, or without end, where the largest class of equal peers over equal links grows and all others stay as they are. How many of that class the scene
/// itself has does not matter, but that there are two. Numbers for which none is left are passed over.
///
/// # Errors
///
/// [`ProofError`] if no two peers are equal, if something is left to chance or not linear, or if the watch ends it.
pub fn prove_every_number(scene: &Scene, from: u64, to: Option<u64>, watch: &dyn Watch) -> Result<EveryNumber, ProofError> {
    if from < 2 || to.is_some_and(|to| to < from) {
        return Err(ProofError::Numbers);
    }
    super::refuse(scene)?;
    let followed = Followed::new(scene, &NominalNetwork::of(scene)?)?;
    if to.is_some_and(|to| to < followed.least) {
        return Err(ProofError::Fewer { least: followed.least });
    }
    let from = from.max(followed.least);
    let without_limit = if to.is_some() { None } else { followed.without_limit()? };
    let end = match to {
        Some(to) => to,
        None if without_limit.is_some() => MOST_FOLLOWED.max(from),
        None => ENDLESS,
    };
    let mut spans: Vec<NumberSpan> = Vec::new();
    let mut attempts = 0;
    // From the least number on: an undecided span is halved, and the far half waits.
    let mut waiting = vec![(from, end)];
    while let Some((low, high)) = waiting.pop() {
        if watch.stops() {
            return Err(ProofError::Analysis(crate::AnalysisError::Stopped));
        }
        attempts += 1;
        // The least number has no second member of the class that grows, and no differences within it.
        let is_mixed = low == followed.least && high > low;
        let found = if attempts > MOST_ATTEMPTS || is_mixed { None } else { followed.decide(low, high)? };
        if found.is_none() && low < high && attempts <= MOST_ATTEMPTS {
            let middle = if is_mixed {
                low
            } else if high / low > 4 {
                2 * low
            } else {
                low.midpoint(high)
            };
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
        let guarantee = if followed.is_unstable_beyond(end)? { Guarantee::Unstable } else { Guarantee::Undecided };
        match spans.last_mut() {
            Some(last) if last.guarantee == guarantee => last.to = None,
            _ => spans.push(NumberSpan { from: end + 1, to: None, guarantee }),
        }
    }
    Ok(EveryNumber { growing: followed.growing, spans, without_limit, attempts })
}

/// A motion of the scene, in one combination of contacts: its classes, of which one grows.
struct Motion {
    scene: Scene,
    structure: Structure,
    /// The class that grows.
    growing: usize,
}

struct Followed {
    motions: Vec<Motion>,
    /// The first peer of the class that grows.
    growing: usize,
    /// The least number of peers of which one is of the class that grows.
    least: u64,
}

impl Followed {
    fn new(scene: &Scene, network: &NominalNetwork) -> Result<Self, ProofError> {
        let all = pieces(scene, "every number of peers")?;
        let (mut motions, mut least, mut first) = (Vec::new(), 2, 0);
        for (piece, combination) in pairs(&all, &mut false)? {
            let structure = Structure::of(&[&*piece.scene], network, &combination.contacts)?;
            let Some(growing) =
                (0..structure.classes.len()).filter(|class| structure.apart[*class].is_some()).max_by_key(|class| structure.classes[*class].len())
            else {
                return Err(ProofError::Unequal);
            };
            for class in 0..structure.classes.len() {
                // It does not depend on N.
                if alone(&structure, &piece.scene, class, 1).is_some_and(|(part, _)| part.radius.verdict() != Verdict::Stable) {
                    return Err(ProofError::Loose { peer: scene.peers[structure.classes[class][0]].name.clone() });
                }
            }
            least = least.max(structure.peers - structure.classes[growing].len() + 1);
            first = structure.classes[growing][0];
            motions.push(Motion { scene: piece.scene.clone().into_owned(), structure, growing });
        }
        Ok(Self { motions, growing: first, least: least as u64 })
    }

    /// What every number of peers from `low` to `high` has in common, if that is proven.
    fn decide(&self, low: u64, high: u64) -> Result<Option<Proven>, ProofError> {
        let mut all = Some(Proven::Stable);
        for motion in &self.motions {
            let has_differences = |class: &usize| motion.structure.apart[*class].is_some() && (*class != motion.growing || motion.size(low) > 1);
            let parts = std::iter::once(None).chain((0..motion.structure.classes.len()).filter(has_differences).map(Some));
            for part in parts {
                match motion.decide(low, high, part)? {
                    // One part that grows is enough.
                    Some(Proven::Unstable) => return Ok(Some(Proven::Unstable)),
                    Some(Proven::Stable) => {}
                    None => all = None,
                }
            }
        }
        Ok(all)
    }

    /// Whether all numbers of peers from one on are proven unstable, where something grows without a limit.
    fn is_unstable_beyond(&self, from: u64) -> Result<bool, ProofError> {
        for motion in &self.motions {
            let parts =
                std::iter::once(None).chain((0..motion.structure.classes.len()).filter(|class| motion.structure.apart[*class].is_some()).map(Some));
            for part in parts {
                if motion.is_unstable_beyond(from, part)? {
                    return Ok(true);
                }
            }
        }
        Ok(false)
    }

    /// The number of a node that has no limit as N grows, in words.
    fn without_limit(&self) -> Result<Option<String>, ProofError> {
        for motion in &self.motions {
            let [far, near] = [ENDLESS, ENDLESS / 2].map(|number| motion.nodes(number).swap_remove(motion.growing));
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
    /// The nodes of all classes.
    fn nodes(&self, number: u64) -> Vec<Node> {
        self.structure.nodes(&self.scene.scaled_for(usize::try_from(number).unwrap_or(usize::MAX)))
    }

    /// How many members the class that grows has among that number of peers.
    fn size(&self, number: u64) -> u64 {
        number.saturating_sub((self.structure.peers - self.structure.classes[self.growing].len()) as u64)
    }

    /// The weight of the average of a class (column) in the target of a class (row): a constant, and a multiple of ν.
    fn weight(&self, row: usize, column: usize) -> (f64, f64) {
        let classes = &self.structure.classes;
        let (own, others) = (f64::from(u8::from(row == column)), count(self.structure.peers - classes[self.growing].len()));
        if column == self.growing { (1.0, 1.0 - others - own) } else { (0.0, count(classes[column].len()) - own) }
    }

    /// The nodes of all classes, or that of one.
    fn part(&self, number: u64, apart: Option<usize>) -> Vec<Node> {
        let nodes = self.nodes(number);
        apart.map_or_else(|| nodes.clone(), |class| vec![nodes[class].clone()])
    }

    fn weights(&self, nu: f64, apart: Option<usize>) -> Matrix {
        let classes = if apart.is_some() { 1 } else { self.structure.classes.len() };
        Matrix::from_fn(classes, classes, |row, column| {
            let (constant, slope) = if apart.is_some() { (0.0, -1.0) } else { self.weight(row, column) };
            constant + slope * nu
        })
    }

    fn common(&self, apart: Option<usize>, time: f64) -> Common<'_> {
        let timetable = apart.and_then(|class| self.structure.apart[class].as_ref()).unwrap_or(&self.structure.timetable);
        Common { timetable, tied: apart.is_some() || self.structure.tied, time }
    }

    /// Whether all numbers of peers from one on are proven unstable in a part of which either the gains of the law or the effects of a force on the copies grow with N, and nothing else changes but
    /// towards a limit. A frame divided by N/N₀ a step is one of a box then, and an unstable one is so without the division.
    fn is_unstable_beyond(&self, from: u64, apart: Option<usize>) -> Result<bool, ProofError> {
        let [near, far, end] = [from, 2 * from, ENDLESS].map(|number| self.part(number, apart));
        let grows = |of: &dyn Fn(&Node) -> f64| of(&end[0]) > 2.0 * of(&far[0]);
        let force = |node: &Node| node.object.only_map().map_or(0.0, |map| map.coefficients().1[1]);
        let (law_grows, mass_vanishes) = (grows(&gain), grows(&force));
        let free = |nodes: &[Node]| nodes.iter().map(|node| node.object.only_map().map(|map| map.coefficients().0)).collect::<Vec<_>>();
        let has_limits = free(&near) == free(&far)
            && free(&far) == free(&end)
            && (mass_vanishes || near.iter().zip(&end).all(|(near, end)| near.object == end.object));
        let third = self.part(3 * from, apart);
        let is_affine = |of: &dyn Fn(&Node) -> f64| (of(&third[0]) - 2.0 * of(&far[0]) + of(&near[0])).abs() <= 1e-12 * of(&third[0]).abs();
        if law_grows == mass_vanishes || !has_limits || !is_affine(&gain) && law_grows || !is_affine(&force) && mass_vanishes {
            return Ok(false);
        }
        let nu = |number: u64| 1.0 / (count_of(number) - 1.0);
        let heard = [gain(&near[0]) * nu(from), gain(&end[0]) * nu(ENDLESS)];
        let points = |at: &[Node]| {
            let mixed = at.iter().zip(&near).map(|(at, near)| Node {
                object: if mass_vanishes { at.object } else { near.object },
                law: if law_grows { at.law.clone() } else { near.law.clone() },
                ..near.clone()
            });
            let mut points = vec![Point { nodes: mixed.collect(), weights: self.weights(0.0, apart) }];
            let with = |point: &Point, change: &dyn Fn(usize, &Node) -> Node| {
                let nodes = point.nodes.iter().enumerate().map(|(class, node)| change(class, node)).collect();
                Point { nodes, ..point.clone() }
            };
            if !law_grows && near.iter().zip(&end).any(|(near, end)| near.law != end.law) {
                points = doubled(&points, |point, upper| {
                    with(point, &|class, node| Node { law: if upper { end[class].law.clone() } else { node.law.clone() }, ..node.clone() })
                });
            }
            points = doubled(&points, |point, upper| Point {
                weights: self.weights(heard[usize::from(upper)] / gain(&point.nodes[0]), apart),
                ..point.clone()
            });
            if near.iter().zip(&end).any(|(near, end)| near.coupling != end.coupling) {
                points = doubled(&points, |point, upper| {
                    with(point, &|class, node| Node { coupling: if upper { end[class].coupling } else { node.coupling }, ..node.clone() })
                });
            }
            points
        };
        let time = self.structure.time(&self.scene, &self.nodes(from));
        let span = StepSpan::product(&steps_beyond(&points(&near), &points(&far), self.common(apart, time))?);
        Ok(decide(&span).is_some_and(|decision| decision.proven == Proven::Unstable))
    }

    /// The verdict on the averages of all classes, or on how the members of one differ.
    fn decide(&self, low: u64, high: u64, apart: Option<usize>) -> Result<Option<Proven>, ProofError> {
        let numbers = if low == high { vec![low] } else { vec![low, high] };
        let time = self.structure.time(&self.scene, &self.nodes(low));
        let ends: Vec<Vec<Node>> = numbers.iter().map(|number| self.part(*number, apart)).collect();
        let (first, last) = (&ends[0], &ends[ends.len() - 1]);
        let nu = |place: usize| 1.0 / (count_of(numbers[place]) - 1.0);
        let at = |upper: bool| if upper { last } else { first };
        let with = |point: &Point, change: &dyn Fn(usize, &Node) -> Node| {
            let nodes = point.nodes.iter().enumerate().map(|(class, node)| change(class, node)).collect();
            Point { nodes, ..point.clone() }
        };
        let differ = |of: &dyn Fn(&Node, &Node) -> bool| first.iter().zip(last).any(|(first, last)| of(first, last));
        let mut points = vec![Point { nodes: first.clone(), weights: self.weights(nu(0), apart) }];
        if differ(&|first, last| first.law != last.law) {
            points = doubled(&points, |point, upper| with(point, &|class, node| Node { law: at(upper)[class].law.clone(), ..node.clone() }));
        }
        if numbers.len() > 1 && self.weights(0.0, apart) != self.weights(1.0, apart) {
            // ν times the gains is a number of its own beside the gains.
            points = doubled(&points, |point, upper| {
                let ratio = gain(&at(upper)[0]) / gain(&point.nodes[0]);
                Point { weights: self.weights(nu(usize::from(upper)) * if ratio.is_finite() { ratio } else { 1.0 }, apart), ..point.clone() }
            });
        }
        if differ(&|first, last| first.coupling != last.coupling) {
            points = doubled(&points, |point, upper| with(point, &|class, node| Node { coupling: at(upper)[class].coupling, ..node.clone() }));
        }
        Ok(decide(&StepSpan::product(&steps(&points, &ends, self.common(apart, time))?)).map(|decision| decision.proven))
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
