//! A scene with a growing largest class of equal peers, and the verdict on all numbers N of peers in a span.
//!
//! Averages of classes and differences within a class do not mix (`structure`), and only numbers in them depend on N: the mass of a copy, m or m/N; gains,
//! multiplied by 1, 2/N, N − 1, 4(N − 1)/N² or 4(N − 1)²/N²; and the weights. Of F peers in the other classes, with ν = 1/(N − 1), a class of n is heard with
//! weight nν, itself with (n − 1)ν, and the growing class with 1 − (F − 1)ν, itself with 1 − Fν; differences hear themselves with −ν. So the heard force has
//! two terms: a gain times a constant, and a gain times ν times another constant. Each of these factors is monotone in N from 2 on, so the factors at the ends
//! of a span of numbers enclose the factors between.
//!
//! Without damping of the object a copy of the mass m/N moves by N times a force, and nothing else of the copy depends on N. Forces may then be counted in
//! newtons divided by N: gains are N times as large, copies have the mass m, devices have N times their mass, and the motion is the same. If gains shrink
//! with N, the scaled numbers have limits and the original numbers have none.

use std::sync::atomic::{AtomicUsize, Ordering};

use cohaptic_peer::{Gains, StepMap};
use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Body, Node, NominalNetwork, Structure, alone, check_laws, classes, pairs, pieces};
use cohaptic_stability::numerics::real;
use cohaptic_stability::{Matrix, Verdict, radius};

use super::certificate::{Certified, Named};
use super::corners::{Common, Growth, Point, doubled, steps, steps_beyond};
use super::discs::decide;
use super::error::ProofError;
use super::guarantee::Proven;
use super::program::NamedFrame;
use super::span::FrameSpan;
use super::steps::Plans;
use super::waves::{self, Part, Waves};

/// Number of peers in place of the end of an endless span: the weight 1/(N − 1) is below a rounding there.
pub(super) const ENDLESS: u64 = 1 << 53;

/// Factor by which radii are widened for a certificate, since the checker encloses with wider intervals than the prover.
pub(super) const WIDER: f64 = 8.0;

/// Motion of the scene in one combination of contacts, with one growing class.
#[derive(Debug)]
pub(super) struct Motion {
    pub(super) scene: Scene,
    pub(super) structure: Structure,
    /// The growing class.
    growing: usize,
    /// `true` if forces are counted in newtons divided by N.
    divides_forces: bool,
    /// Plans of the averages of classes, and of the differences within each class, indexed by class.
    plans: (Plans, Vec<Plans>),
    /// Waves between the copies, if the coordination has waves.
    waves: Option<Waves>,
}

/// Scene with a growing largest class of equal peers.
#[derive(Debug)]
pub(super) struct Growing {
    pub(super) motions: Vec<Motion>,
    /// The first peer of the growing class.
    pub(super) first: usize,
    /// Least number of peers with a peer left in the growing class.
    pub(super) least: u64,
    /// Place of the part last proven unstable, tried first for other numbers.
    grown: AtomicUsize,
}

/// Part of the motion: the place of its motion, and the class of the differences, or `None` for the averages of all classes.
pub(super) type PartPlace = (usize, Option<usize>);

impl Growing {
    pub(super) fn new(scene: &Scene, network: &NominalNetwork) -> Result<Self, ProofError> {
        let all = pieces(scene, "the proof for every number of peers")?;
        let (mut motions, mut least, mut first) = (Vec::new(), 2, 0);
        let pairs = pairs(&all, &mut false)?;
        // Refusals come before any frame is made, because a frame of drifting clocks has very many events.
        for (piece, combination) in &pairs {
            if !Waves::tie(&piece.scene) {
                check_laws(&piece.scene)?;
            }
            if classes(&[&*piece.scene], network, &combination.contacts, |_, _| false).iter().all(|class| class.len() == 1) {
                return Err(ProofError::Unequal);
            }
        }
        for (piece, combination) in pairs {
            let (structure, waves) = match Waves::structure(&[&*piece.scene], network, &combination.contacts)? {
                Some((structure, waves)) => (structure, Some(waves)),
                None => (Structure::of(&[&*piece.scene], network, &combination.contacts)?, None),
            };
            let growing = structure.largest_equal().ok_or(ProofError::Unequal)?;
            for class in 0..structure.classes.len() {
                // The motion of a loose device does not depend on N.
                if alone(&structure, &piece.scene, class, 1).is_some_and(|(part, _)| part.radius.verdict() != Verdict::Stable) {
                    return Err(ProofError::Loose { peer: scene.peers[structure.classes[class][0]].name.clone() });
                }
            }
            // Every other class keeps all its members, and the growing class keeps at least one.
            least = least.max(structure.peers - structure.classes[growing].len() + 1);
            first = structure.classes[growing][0];
            let plans = plans_of(&structure);
            let mut motion = Motion { scene: piece.scene.clone().into_owned(), structure, growing, divides_forces: false, plans, waves };
            motion.divides_forces = motion.has_limits_of_divided_forces();
            motions.push(motion);
        }
        Ok(Self { motions, first, least: least as u64, grown: AtomicUsize::new(0) })
    }

    /// Returns whether waves tie the copies of any motion.
    pub(super) fn has_waves(&self) -> bool {
        self.motions.iter().any(|motion| motion.waves.is_some())
    }

    /// Returns the proven verdict on every number of peers from `low` to `high`, or `None`, and adds the certificates of the parts to `certified`. Parts in
    /// `stable` are known to be stable for all of these numbers and are skipped; parts proven stable here are added to `stable`.
    pub(super) fn decide(
        &self,
        low: u64,
        high: u64,
        stable: &mut Vec<PartPlace>,
        mut certified: Certified<'_>,
    ) -> Result<Option<Proven>, ProofError> {
        let parts = self.parts(low);
        // The part behind the last unstable verdict comes first. The order does not change the verdict.
        let grown = self.grown.load(Ordering::Relaxed).min(parts.len() - 1);
        let mut all = Some(Proven::Stable);
        for (place, part) in parts.iter().enumerate().cycle().skip(grown).take(parts.len()) {
            if stable.contains(part) {
                continue;
            }
            match self.motions[part.0].decide(low, high, part.1, certified.as_deref_mut())? {
                // One unstable part makes the whole motion unstable.
                Some(Proven::Unstable) => {
                    self.grown.store(place, Ordering::Relaxed);
                    return Ok(Some(Proven::Unstable));
                }
                Some(Proven::Stable) => stable.push(*part),
                None => all = None,
            }
        }
        Ok(all)
    }

    /// Returns the parts of all motions for a number of peers.
    fn parts(&self, number: u64) -> Vec<PartPlace> {
        let parts_of = |motion: &'_ Motion| {
            let has_differences = |class: &usize| motion.structure.apart[*class].is_some() && (*class != motion.growing || motion.size(number) > 1);
            std::iter::once(None).chain((0..motion.structure.classes.len()).filter(has_differences).map(Some)).collect::<Vec<_>>()
        };
        self.motions.iter().enumerate().flat_map(|(place, motion)| parts_of(motion).into_iter().map(move |part| (place, part))).collect()
    }

    /// Returns the approximate modulus of the largest eigenvalue and the largest bound of an entry, over all parts without a proof of stability for a number of
    /// peers; `None` if all parts are proven stable.
    pub(super) fn nearness(&self, number: u64) -> Result<Option<[f64; 2]>, ProofError> {
        let mut found: Option<[f64; 2]> = None;
        for (motion, part) in self.parts(number) {
            let span = self.motions[motion].frame([number; 2], part)?.0.product();
            if decide(&span).is_none_or(|decision| decision.proven != Proven::Stable) {
                let bound = if span.mean.is_finite() && span.radius.is_finite() { span.radius.largest() } else { f64::INFINITY };
                let before = found.unwrap_or_default();
                found = Some([larger(before[0], radius(&span.mean)), larger(before[1], bound)]);
            }
        }
        Ok(found)
    }

    /// Returns whether all numbers of peers from `from` on are proven unstable, if a number of the scene grows without a limit.
    pub(super) fn is_unstable_beyond(&self, from: u64) -> Result<bool, ProofError> {
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

    /// Returns the number of a node without a limit as N grows, in words; `None` if all numbers have limits.
    pub(super) fn without_limit(&self) -> Result<Option<String>, ProofError> {
        for motion in &self.motions {
            let [far, near] = [ENDLESS, ENDLESS / 2].map(|number| motion.scaled(number).swap_remove(motion.growing));
            let force = |node: &Node| force(node).ok_or(ProofError::Drift);
            if differs(force(&far)?, force(&near)?) && !motion.divides_forces {
                return Ok(Some("the mass of a copy, m/N, vanishes".to_owned()));
            }
            if !motion.divides_forces && differs(held(&far), held(&near)) {
                let grows = held(&far) > held(&near);
                return Ok(Some(if grows { "the gains of the coordination grow with N" } else { "the gains of the coordination vanish" }.to_owned()));
            }
            let touches = motion.structure.touching.contains(&true);
            if touches && differs(coupled(&far), coupled(&near)) {
                return Ok(Some("the coupling of devices and copies vanishes".to_owned()));
            }
        }
        Ok(None)
    }
}

/// Returns the larger of two numbers, or NaN if either number is NaN.
fn larger(one: f64, other: f64) -> f64 {
    if other > one || other.is_nan() { other } else { one }
}

/// Returns the body with the effects of a force divided by `by`. A body with ticks of different lengths stays unchanged.
fn heavier(body: &Body, by: f64) -> Body {
    let of = |map: StepMap| {
        let (e, g) = map.coefficients();
        StepMap::new(e, g.map(|g| g / by))
    };
    body.only_map().map_or(*body, |map| body.with_map(of(map)))
}

/// Returns the effect of a force on the velocity of the copy in a tick; `None` if the ticks of the copy differ in length.
fn force(node: &Node) -> Option<f64> {
    node.object.only_map().map(|map| map.coefficients().1[1])
}

fn sum(gains: Gains) -> f64 {
    gains.stiffness + gains.damping
}

fn held(node: &Node) -> f64 {
    sum(node.law.held_by())
}

fn coupled(node: &Node) -> f64 {
    sum(node.coupling)
}

fn differs(far: f64, near: f64) -> bool {
    (far - near).abs() > 1e-9 * far.abs().max(near.abs())
}

impl Motion {
    /// Returns the node of each class for a number of peers, with forces in newtons.
    fn scaled(&self, number: u64) -> Vec<Node> {
        let scene = self.scene.scaled_for(usize::try_from(number).unwrap_or(usize::MAX));
        if self.waves.is_some() { Waves::nodes(&self.structure, &scene) } else { self.structure.nodes(&scene) }
    }

    /// Returns the node of each class for a number of peers, with forces in newtons or in newtons divided by N.
    fn nodes(&self, number: u64) -> Vec<Node> {
        let nodes = self.scaled(number);
        if !self.divides_forces {
            return nodes;
        }
        // In newtons divided by N a copy of mass m/N moves like a copy of mass m. The copy of two peers with half the effect of a force is such a copy.
        let halves = self.scaled(2);
        let divided = |(node, half): (Node, Node)| {
            let by = count_of(number);
            Node {
                object: heavier(&half.object, 2.0),
                device: node.device.as_ref().map(|device| heavier(device, by)),
                law: node.law.scaled(by),
                coupling: node.coupling.scaled(by),
                wall: node.wall.map(|wall| wall.scaled(by)),
                ..node
            }
        };
        nodes.into_iter().zip(halves).map(divided).collect()
    }

    /// Returns the time by which velocities are multiplied for a number of peers \[s\].
    pub(super) fn time(&self, number: u64) -> f64 {
        self.structure.time(&self.scene.scaled_for(usize::try_from(number).unwrap_or(usize::MAX)), &self.scaled(number))
    }

    /// Returns whether the motion of a copy by a force is proportional to N, and N times all gains have limits.
    fn has_limits_of_divided_forces(&self) -> bool {
        let [two, near, far] = [2, ENDLESS / 2, ENDLESS].map(|number| self.scaled(number));
        let free = |node: &Node| node.object.only_map().map(|map| map.coefficients().0);
        two.iter().zip(near.iter().zip(&far)).all(|(two, (near, far))| {
            let is_light = free(two).is_some() && free(two) == free(far) && force(near).zip(force(far)).is_some_and(|(near, far)| far > 1.5 * near);
            let of_device = two.device.is_none_or(|device| device.only_map().is_some()) && two.wall.is_none();
            let shrinks = |of: &dyn Fn(&Node) -> f64| !differs(2.0 * of(far), of(near));
            is_light && of_device && shrinks(&held) && (two.device.is_none() || shrinks(&coupled))
        })
    }

    /// Returns the number of members of the growing class, for a number of peers.
    fn size(&self, number: u64) -> u64 {
        number.saturating_sub((self.structure.peers - self.structure.classes[self.growing].len()) as u64)
    }

    /// Returns the node of each class, or only the node of the class `apart`.
    pub(super) fn part(&self, number: u64, apart: Option<usize>) -> Vec<Node> {
        let nodes = self.nodes(number);
        apart.map_or_else(|| nodes.clone(), |class| vec![nodes[class].clone()])
    }

    fn weights(&self, nu: f64, apart: Option<usize>) -> Matrix {
        let weights = weights_of_growing(&self.structure, self.growing, nu, apart.is_some());
        if self.waves.is_some() && apart.is_none() { waves::with_shares(&weights, &self.shares(nu)) } else { weights }
    }

    /// Returns the size of each class relative to the growing class. The growing class's own entry is 1 and is not used.
    fn shares(&self, nu: f64) -> Vec<f64> {
        let classes = &self.structure.classes;
        let others = real(self.structure.peers - classes[self.growing].len());
        (0..classes.len())
            // With N − 1 = 1/ν, the growing class has N − others = (1 − (others − 1)·ν)/ν members.
            .map(|class| if class == self.growing { 1.0 } else { real(classes[class].len()) * nu / (1.0 - (others - 1.0) * nu) })
            .collect()
    }

    /// Returns the frame of waves of a part with the nodes `ends` at both ends of the span of numbers.
    fn frame_of_waves(
        &self,
        waves: &Waves,
        [low, high]: [u64; 2],
        points: Vec<Point>,
        ends: &[Vec<Node>; 2],
        apart: Option<usize>,
    ) -> Result<NamedFrame, ProofError> {
        let mut points = points;
        // With a single other peer the shares are affine in ν, as the weights are. Otherwise the shares are a further number of the box.
        if apart.is_none() && self.structure.peers - self.structure.classes[self.growing].len() > 1 {
            let shares = [low, high].map(|number| self.shares(nu(number)));
            points =
                doubled(&points, |point, upper| Point { weights: waves::with_shares(&point.weights, &shares[usize::from(upper)]), ..point.clone() });
        }
        let part = Part { structure: &self.structure, apart, rest: self.growing, is_pair: high == 2 };
        waves.frame(&part, &points, ends, self.time(low))
    }

    fn common(&self, apart: Option<usize>, time: f64) -> Common<'_> {
        let timetable = apart.and_then(|class| self.structure.apart[class].as_ref()).unwrap_or(&self.structure.timetable);
        let plans = apart.map_or(&self.plans.0, |class| &self.plans.1[class]);
        Common { timetable, plans, tied: apart.is_some() || self.structure.tied, time }
    }

    /// Returns the corners of a box, beginning with `nodes`. `heard` is ν times the gain at both ends. Couplings vary from the couplings of `near` to the
    /// couplings of `end`, and laws vary likewise if `varies`; otherwise laws stay.
    pub(super) fn corners(&self, nodes: Vec<Node>, [near, end]: [&[Node]; 2], heard: [f64; 2], varies: bool, apart: Option<usize>) -> Vec<Point> {
        let differ = |of: &dyn Fn(&Node, &Node) -> bool| near.iter().zip(end).any(|(near, end)| of(near, end));
        let with = |point: &Point, change: &dyn Fn(&Node, &mut Node)| {
            let mut point = point.clone();
            point.nodes.iter_mut().zip(end).for_each(|(node, end)| change(end, node));
            point
        };
        let mut points = vec![Point { weights: self.weights(heard[0] / gain(&nodes[0]), apart), nodes }];
        if varies && differ(&|near, end| near.law != end.law) {
            points = doubled(&points, |point, upper| if upper { with(point, &|end, node| node.law = end.law.clone()) } else { point.clone() });
        }
        // The product of ν and the gains is a number in addition to the gains. The step is then affine in each number.
        if self.weights(0.0, apart) != self.weights(1.0, apart) {
            let hears = |point: &Point, heard: f64| Point { weights: self.weights(heard / gain(&point.nodes[0]), apart), ..point.clone() };
            points = if heard[0].to_bits() == heard[1].to_bits() {
                points.iter().map(|point| hears(point, heard[0])).collect()
            } else {
                doubled(&points, |point, upper| hears(point, heard[usize::from(upper)]))
            };
        }
        if differ(&|near, end| near.coupling != end.coupling) {
            points = doubled(&points, |point, upper| if upper { with(point, &|end, node| node.coupling = end.coupling) } else { point.clone() });
        }
        points
    }

    /// Returns whether a part is proven unstable for all numbers of peers from `from` on. In the part the gains of the law or the effects of a force on the
    /// copies, or both, grow with N, and all other numbers have limits. Each step divided by N/N₀, or by its square, then lies in a box. A frame that is
    /// unstable after this division by at least 1 is unstable without the division too.
    fn is_unstable_beyond(&self, from: u64, apart: Option<usize>) -> Result<bool, ProofError> {
        if self.waves.is_some() {
            return Ok(false);
        }
        let [near, far, end] = [from, 2 * from, ENDLESS].map(|number| self.part(number, apart));
        let grows = |of: &dyn Fn(&Node) -> f64| of(&end[0]) > 2.0 * of(&far[0]);
        let force = |node: &Node| force(node).unwrap_or(0.0);
        let (law_grows, mass_vanishes) = (grows(&gain), grows(&force));
        let free = |nodes: &[Node]| nodes.iter().map(|node| node.object.only_map().map(|map| map.coefficients().0)).collect::<Vec<_>>();
        let has_limits = free(&near) == free(&far)
            && free(&far) == free(&end)
            && (mass_vanishes || near.iter().zip(&end).all(|(near, end)| near.object == end.object))
            && near.iter().zip(&end).all(|(near, end)| near.device == end.device);
        // Three equally spaced numbers of peers show an affine growth: the second difference is then zero but for rounding.
        let third = self.part(3 * from, apart);
        let is_affine = |of: &dyn Fn(&Node) -> f64| (of(&third[0]) - 2.0 * of(&far[0]) + of(&near[0])).abs() <= 1e-12 * of(&third[0]).abs();
        if !law_grows && !mass_vanishes || !has_limits || !is_affine(&gain) && law_grows || !is_affine(&force) && mass_vanishes {
            return Ok(false);
        }
        let heard = [gain(&near[0]) * nu(from), gain(&end[0]) * nu(ENDLESS)];
        let points = |at: &[Node]| {
            let mixed = at.iter().zip(&near).map(|(at, near)| Node {
                object: if mass_vanishes { at.object } else { near.object },
                law: if law_grows { at.law.clone() } else { near.law.clone() },
                ..near.clone()
            });
            self.corners(mixed.collect(), [&near, &end], heard, !law_grows, apart)
        };
        let time = self.structure.time(&self.scene, &self.nodes(from));
        let growth = if law_grows && mass_vanishes { Growth::Quadratic } else { Growth::Linear };
        let [near, far, third] = [points(&near), points(&far), points(&third)];
        let span = steps_beyond([&near, &far, &third], growth, self.common(apart, time))?.product();
        Ok(decide(&span).is_some_and(|decision| decision.proven == Proven::Unstable))
    }

    /// Returns the frame of a part over a span of numbers, the source of the names of its states, and the time by which velocities are multiplied \[s\].
    fn frame(&self, [low, high]: [u64; 2], apart: Option<usize>) -> Result<(FrameSpan, Named, f64), ProofError> {
        let ends = [low, high].map(|number| self.part(number, apart));
        let [first, last] = ends.each_ref().map(Vec::as_slice);
        let time = self.time(low);
        let heard = [gain(&first[0]) * nu(low), gain(&last[0]) * nu(high)];
        let points = self.corners(first.to_vec(), [first, last], heard, true, apart);
        let (frame, named) = match &self.waves {
            None => (steps(&points, &ends, self.common(apart, time))?, Named::AtPoints(points)),
            Some(waves) => self.frame_of_waves(waves, [low, high], points, &ends, apart)?.into(),
        };
        Ok((frame, named, time))
    }

    /// Returns the verdict on a part for all numbers from `low` to `high`, and adds its certificate to `certified`.
    fn decide(&self, low: u64, high: u64, apart: Option<usize>, certified: Certified<'_>) -> Result<Option<Proven>, ProofError> {
        let (frame, named, time) = self.frame([low, high], apart)?;
        // The checker multiplies the steps in order and encloses with wider intervals, so a certificate is decided with wider bounds than the answer.
        let span = match certified {
            None => frame.product(),
            Some(_) if low < high => frame.product_in_order().widened(WIDER),
            Some(_) => frame.product_in_order(),
        };
        let Some(decision) = decide(&span) else { return Ok(None) };
        if let Some(certified) = certified {
            let classes = apart.map_or(0..self.structure.classes.len(), |class| class..class + 1);
            let members = classes.map(|class| self.structure.classes[class].clone()).collect();
            certified.push((decision.proven, named.certificate(members, apart.is_some(), self.common(apart, time), &decision.witness)?));
        }
        Ok(Some(decision.proven))
    }
}

/// Returns empty plans for the averages of classes, and for the differences within each class, indexed by class.
pub(super) fn plans_of(structure: &Structure) -> (Plans, Vec<Plans>) {
    (Plans::default(), structure.classes.iter().map(|_| Plans::default()).collect())
}

/// Returns the weights of the averages of classes (columns) in the targets of classes (rows) with one growing class, or the weight of a difference in its own
/// target. Each weight is a constant plus a multiple of ν.
pub(super) fn weights_of_growing(structure: &Structure, growing: usize, nu: f64, is_difference: bool) -> Matrix {
    let classes = &structure.classes;
    let others = real(structure.peers - classes[growing].len());
    let size = if is_difference { 1 } else { classes.len() };
    Matrix::from_fn(size, size, |row, column| {
        let own = f64::from(u8::from(row == column));
        // A class of n members has weight n·ν, without the receiver itself. The growing class has all peers but `others`, and N·ν = 1 + ν.
        let (constant, slope) = match column {
            _ if is_difference => (0.0, -1.0),
            _ if column == growing => (1.0, 1.0 - others - own),
            _ => (0.0, real(classes[column].len()) - own),
        };
        constant + slope * nu
    })
}

/// Returns a gain of the law that is not zero, or 1 if all are zero. One gain represents all gains, since all gains are multiples of the same function of N.
fn gain(node: &Node) -> f64 {
    let gains = node.law.rows().flat_map(|row| [row.own.stiffness, row.own.damping, row.past.stiffness, row.past.damping]);
    gains.into_iter().find(|gain| *gain != 0.0).unwrap_or(1.0)
}

/// Returns ν = 1/(N − 1) for a number N of peers.
pub(super) fn nu(number: u64) -> f64 {
    1.0 / (count_of(number) - 1.0)
}

fn count_of(number: u64) -> f64 {
    usize::try_from(number).map_or(f64::INFINITY, real)
}
