//! A family of scenes with open keys, and the verdict on all scenes in a box of values, optionally for every number of equal peers.

use std::borrow::Cow;

use cohaptic_scene::Scene;
use cohaptic_stability::frames::{EnclosedSpectrum, Node, NominalNetwork, Structure, Timetable, alone, node_on, on_this_topology, pairs, pieces};
use cohaptic_stability::numerics::real;
use cohaptic_stability::{AnalysisError, Family, FamilyError, Graph, GraphError, Matrix, Verdict, Watch, has_chance};
use rayon::prelude::*;

use super::certificate::{BoxCertificate, Certified, Named, PartCertificate, refuse_certificate};
use super::corners::{Common, Point, doubled, steps};
use super::delays;
use super::discs::decide;
use super::error::ProofError;
use super::growing::{ENDLESS, nu, plans_of, weights_of_growing};
use super::guarantee::{Guarantee, Proven};
use super::server::Server;
use super::steps::Plans;
use super::waves::{self, Waves};

/// Motion of a piece of the scene in one combination of contacts, for all values of the keys.
pub(super) struct Motion {
    /// Place of the piece among the pieces of a scene.
    piece: usize,
    pub(super) structure: Structure,
    /// Growing class, for a verdict on every number of peers.
    growing: Option<usize>,
    /// Action of the peers of the motion on each other.
    action: Action,
    /// Plans of the averages of classes, and of the differences within each class, indexed by class.
    plans: (Plans, Vec<Plans>),
}

/// Action of peers on each other.
enum Action {
    /// Each peer follows the mean of all other peers.
    Mean,
    /// Equal peers. Each peer follows the mean of its neighbours.
    Graph(EnclosedSpectrum),
    /// A server and its clients.
    Server(Server),
    /// Waves over equal links.
    Waves(Waves),
}

impl Action {
    /// Returns the feature by which a proof is limited to the scene's own number of peers, or `None` if a proof can cover every number.
    const fn special(&self) -> Option<&'static str> {
        match self {
            Self::Mean => None,
            Self::Graph(_) => Some("a [topology]"),
            Self::Server(_) => Some("client-server coordination"),
            Self::Waves(_) => Some("wave coordination"),
        }
    }
}

/// Part of a motion: the averages of all classes, or the differences between the members of one class.
struct PartOf<'a> {
    apart: Option<usize>,
    timetable: &'a Timetable,
    plans: &'a Plans,
    tied: bool,
    /// On a graph, least and greatest weight of the node's own samples; otherwise `None`.
    weight: Option<[f64; 2]>,
}

/// Range of a delay with equal frames throughout, and the motions of the scenes in the range. Without a delay among the keys there is one stretch.
pub(super) struct Stretch {
    /// Least and greatest value of the delay; `None` if no key is a delay.
    range: Option<[f64; 2]>,
    pub(super) motions: Vec<Motion>,
}

/// Family with keys for gains, masses and dampings and at most one key for a delay, and the motions of the family.
pub(super) struct Followed<'a> {
    family: &'a Family,
    /// Place of the key of a delay.
    delay: Option<usize>,
    pub(super) stretches: Vec<Stretch>,
    /// Least and greatest value of 1/(N − 1), for a verdict on every number N of peers.
    numbers: Option<[f64; 2]>,
}

/// Largest number of halvings of the range of 1/(N − 1) in an undecided box.
const HALVINGS: u32 = 3;

impl<'a> Followed<'a> {
    /// Prepares the proofs of a family. `every`: first and last number of peers of the verdicts; `None`: the number of the scene.
    pub(super) fn new(family: &'a Family, every: Option<(u64, Option<u64>)>) -> Result<Self, ProofError> {
        let keys = family.keys();
        // A learned key sets numbers only. An unlearned key may change the frame itself, and only a delay is followed then, stretch by stretch.
        let mut unlearned = (0..keys.len()).filter(|key| !family.learned()[*key]);
        let delay = unlearned.next();
        if let Some(other) = unlearned.next() {
            return Err(ProofError::Key { key: keys[other].key.clone() });
        }
        let numbers = every.map(|(from, to)| [to.map_or(0.0, nu), nu(from)]);
        let of = |delayed: Option<f64>| motions(family, delay.zip(delayed), every);
        let Some(place) = delay else {
            return Ok(Self { family, delay, stretches: vec![Stretch { range: None, motions: of(None)? }], numbers });
        };
        let lows: Vec<f64> = keys.iter().map(|key| key.low).collect();
        let first = family.scene(&lows)?;
        let frame = |value: f64| {
            let mut values = lows.clone();
            values[place] = value;
            let scene = family.scene(&values)?;
            if !delays::differ_in_delays_alone(&first, &scene) {
                return Err(ProofError::Key { key: keys[place].key.clone() });
            }
            let motions = motions(family, Some((place, value)), every)?;
            let scene = mutual(&scene);
            let all = pieces(&scene, "a proof")?;
            let of = |motion: &Motion| {
                let nodes = all.get(motion.piece).map(|piece| motion.nodes(&piece.scene)).transpose()?;
                Ok::<_, ProofError>(format!("{:?} {nodes:?}", motion.structure))
            };
            // Two delays give the same frame if the timetables, weights and nodes are equal, and their text shows every digit of each number.
            motions.iter().map(of).collect::<Result<String, _>>()
        };
        let found = delays::stretches(&keys[place], frame)?;
        let stretch = |range: [f64; 2]| Ok::<_, ProofError>(Stretch { range: Some(range), motions: of(Some(range[0]))? });
        Ok(Self { family, delay, stretches: found.into_iter().map(stretch).collect::<Result<_, _>>()?, numbers })
    }

    /// Returns the first boxes of values of a proof: one box per stretch of the delay, otherwise one box.
    pub(super) fn beginnings(&self) -> Vec<Vec<[f64; 2]>> {
        let whole: Vec<[f64; 2]> = self.family.keys().iter().map(|key| [key.low, key.high]).collect();
        let of = |stretch: &Stretch| {
            let mut ranges = whole.clone();
            if let Some((place, range)) = self.delay.zip(stretch.range) {
                ranges[place] = range;
            }
            ranges
        };
        self.stretches.iter().map(of).collect()
    }

    /// Returns the place of the key of a delay. Stretches of a delay are not divided further.
    pub(super) fn delay(&self) -> Option<usize> {
        self.delay
    }

    /// Returns the proven verdict on all scenes of a box, or `None` if the box is undecided. `ranges`: least and greatest value of each key.
    pub(super) fn decide(&self, ranges: &[[f64; 2]]) -> Result<Option<Proven>, ProofError> {
        match self.numbers {
            None => self.decide_at(ranges, None, None),
            Some(numbers) => self.decide_over(ranges, numbers, HALVINGS, None),
        }
    }

    /// Returns the certificates of a box: one, or one per part of the numbers of peers; no certificate if the box is undecided.
    pub(super) fn certify(&self, ranges: &[[f64; 2]]) -> Result<Vec<BoxCertificate>, ProofError> {
        let mut found = Vec::new();
        let Some(numbers) = self.numbers else {
            let mut parts = Vec::new();
            let proven = self.decide_at(ranges, None, Some(&mut parts))?;
            found.extend(proven.map(|proven| BoxCertificate::new(ranges.to_vec(), proven, parts)));
            return Ok(found);
        };
        if self.decide_over(ranges, numbers, HALVINGS, Some(&mut found))?.is_none() {
            found.clear();
        }
        Ok(found)
    }

    /// Returns the certificate of an undecided box, for all numbers of peers.
    fn open(&self, mut ranges: Vec<[f64; 2]>) -> BoxCertificate {
        ranges.extend(self.numbers);
        BoxCertificate { ranges, guarantee: Guarantee::Undecided, parts: Vec::new() }
    }

    /// Returns the common verdict on all values of 1/(N − 1) from `low` to `high`. An undecided range is halved up to `halvings` times, and both halves
    /// must agree.
    fn decide_over(
        &self,
        ranges: &[[f64; 2]],
        [low, high]: [f64; 2],
        halvings: u32,
        mut certified: Option<&mut Vec<BoxCertificate>>,
    ) -> Result<Option<Proven>, ProofError> {
        let mut parts = Vec::new();
        if let Some(proven) = self.decide_at(ranges, Some([low, high]), certified.is_some().then_some(&mut parts))? {
            if let Some(certified) = certified {
                certified.push(BoxCertificate::new(ranges.iter().copied().chain([[low, high]]).collect(), proven, parts));
            }
            return Ok(Some(proven));
        }
        let middle = low.midpoint(high);
        if halvings == 0 || !(low < middle && middle < high) {
            return Ok(None);
        }
        let Some(near) = self.decide_over(ranges, [low, middle], halvings - 1, certified.as_deref_mut())? else { return Ok(None) };
        Ok(self.decide_over(ranges, [middle, high], halvings - 1, certified)?.filter(|far| *far == near))
    }

    fn decide_at(&self, ranges: &[[f64; 2]], numbers: Option<[f64; 2]>, mut certified: Certified<'_>) -> Result<Option<Proven>, ProofError> {
        let stretch = self.delay.map_or(0, |key| self.stretches.iter().position(|one| one.range == Some(ranges[key])).unwrap_or(0));
        let free: Vec<usize> = (0..ranges.len()).filter(|key| self.delay != Some(*key)).collect();
        let corner = |place: usize| {
            // Bit b of a corner chooses the end of the b-th free key. A delay is equal in effect over its stretch, so its lower end stands for the stretch.
            let upper = |key: usize| free.iter().position(|own| *own == key).is_some_and(|bit| place >> bit & 1 == 1);
            ranges.iter().enumerate().map(|(key, range)| range[usize::from(upper(key))]).collect::<Vec<f64>>()
        };
        let scenes = (0..1 << free.len()).map(|place| self.family.written(&corner(place))).collect::<Result<Vec<Scene>, FamilyError>>()?;
        let scenes: Vec<Cow<'_, Scene>> = scenes.iter().map(mutual).collect();
        let all = scenes.iter().map(|scene| pieces(scene, "a proof")).collect::<Result<Vec<_>, _>>()?;
        let mut proven = Some(Proven::Stable);
        for motion in &self.stretches[stretch].motions {
            let scenes: Vec<&Scene> = all.iter().filter_map(|pieces| pieces.get(motion.piece)).map(|piece| &*piece.scene).collect();
            match motion.decide(&scenes, numbers, certified.as_deref_mut())? {
                // One unstable motion makes the whole scene unstable.
                Some(Proven::Unstable) => return Ok(Some(Proven::Unstable)),
                Some(Proven::Stable) => {}
                None => proven = None,
            }
        }
        Ok(proven)
    }
}

/// Returns the motions of a family. `delayed` gives the key with this index, a delay, the given value in place of its range. `every` marks a proof for all
/// numbers of peers.
fn motions(family: &Family, delayed: Option<(usize, f64)>, every: Option<(u64, Option<u64>)>) -> Result<Vec<Motion>, ProofError> {
    let keys = family.keys();
    let at = |value: &dyn Fn(usize) -> f64| {
        let of = |key: usize| delayed.filter(|(place, _)| *place == key).map_or_else(|| value(key), |(_, delay)| delay);
        family.scene(&(0..keys.len()).map(of).collect::<Vec<f64>>())
    };
    // A scene inside the ranges separates peers with a coincidental equality at an end of the ranges.
    let scenes = [at(&|key| keys[key].odd(key))?, at(&|key| keys[key].low)?, at(&|key| keys[key].high)?];
    scenes.iter().try_for_each(refuse)?;
    let graph = scenes[0].topology.as_ref().map(|topology| Graph::from(&**topology));
    let scenes: Vec<Cow<'_, Scene>> = scenes.iter().map(mutual).collect();
    let all = scenes.iter().map(|scene| pieces(scene, "a proof")).collect::<Result<Vec<_>, _>>()?;
    let network = NominalNetwork::of(&scenes[0])?;
    let mut motions = Vec::new();
    for (piece, first) in all[0].iter().enumerate() {
        let of_piece: Vec<&Scene> = all.iter().filter_map(|pieces| pieces.get(piece)).map(|piece| &*piece.scene).collect();
        for (_, combination) in pairs(std::slice::from_ref(first), &mut false)? {
            let contacts = &combination.contacts;
            let (structure, action) = if let Some((structure, server)) = Server::structure(&of_piece, &network, contacts)? {
                (structure, Action::Server(server))
            } else if let Some((structure, waves)) = Waves::structure(&of_piece, &network, contacts)? {
                (structure, Action::Waves(waves))
            } else {
                let structure = Structure::of(&of_piece, &network, contacts)?;
                let spectrum = graph.as_ref().map(|graph| on_graph(graph, &of_piece, &structure)).transpose()?;
                (structure, spectrum.map_or(Action::Mean, Action::Graph))
            };
            if every.is_some()
                && let Some(what) = action.special()
            {
                return Err(ProofError::OneNumber { what });
            }
            let growing = every.map(|(from, _)| growing(&structure, &of_piece, from)).transpose()?;
            let plans = plans_of(&structure);
            motions.push(Motion { piece, structure, growing, action, plans });
        }
    }
    Ok(motions)
}

/// Returns the scene without its topology, as if every peer heard every other peer. The averaging matrix of the graph replaces the topology.
fn mutual(scene: &Scene) -> Cow<'_, Scene> {
    if scene.topology.is_some() { Cow::Owned(scene.without_topology()) } else { Cow::Borrowed(scene) }
}

/// Returns the enclosed spectrum of a graph of equal peers.
fn on_graph(graph: &Graph, scenes: &[&Scene], structure: &Structure) -> Result<EnclosedSpectrum, AnalysisError> {
    if let Some(other) = structure.classes.get(1) {
        return Err(on_this_topology(GraphError::Unequal { peer: scenes[0].peers[other[0]].name.clone() }));
    }
    let spectrum = graph.enclosed_spectrum(scenes[0]).map_err(on_this_topology)?;
    node_on(scenes[0], structure, spectrum.degree).map_err(on_this_topology)?;
    Ok(spectrum)
}

/// Returns the growing class, if only the weights depend on the number of peers.
fn growing(structure: &Structure, scenes: &[&Scene], from: u64) -> Result<usize, ProofError> {
    let growing = structure.largest_equal().ok_or(ProofError::Unequal)?;
    let least = (structure.peers - structure.classes[growing].len() + 2) as u64;
    if from < least {
        return Err(ProofError::Fewer { least });
    }
    let of = |scene: &Scene, number: u64| structure.nodes(&scene.scaled_for(usize::try_from(number).unwrap_or(usize::MAX)));
    // Three numbers of peers show whether the nodes depend on N: all scalings of a strategy change the nodes from N to 2·N.
    let is_same = |scene: &&Scene| [from, 2 * from, ENDLESS].iter().all(|number| of(scene, *number) == structure.nodes(scene));
    if scenes.iter().all(is_same) { Ok(growing) } else { Err(ProofError::Scaled) }
}

/// Returns the certificates of boxes of a family, in the order of the boxes. A box is an operation of the watch. The watch may end the certification.
pub(super) fn certify(
    family: &Family,
    every: Option<(u64, Option<u64>)>,
    boxes: Vec<Vec<[f64; 2]>>,
    watch: &dyn Watch,
) -> Result<Vec<BoxCertificate>, ProofError> {
    let lows: Vec<f64> = family.keys().iter().map(|key| key.low).collect();
    refuse_certificate(&family.scene(&lows)?)?;
    let followed = Followed::new(family, every)?;
    watch.expects(real(boxes.len()));
    let certificates = boxes.into_par_iter().map(|ranges| {
        if watch.stops() {
            return Err(ProofError::Analysis(AnalysisError::Stopped));
        }
        watch.done(1.0);
        let found = followed.certify(&ranges)?;
        Ok(if found.is_empty() { vec![followed.open(ranges)] } else { found })
    });
    Ok(certificates.collect::<Result<Vec<_>, _>>()?.concat())
}

impl Motion {
    /// Returns the node of each class.
    fn nodes(&self, scene: &Scene) -> Result<Vec<Node>, ProofError> {
        match &self.action {
            Action::Mean => Ok(self.structure.nodes(scene)),
            Action::Graph(spectrum) => Ok(vec![node_on(scene, &self.structure, spectrum.degree).map_err(on_this_topology)?]),
            Action::Server(server) => Ok(server.nodes(&self.structure, scene)),
            Action::Waves(_) => Ok(Waves::nodes(&self.structure, scene)),
        }
    }

    /// Returns the verdict on the motion over a box with the corners `scenes`, and adds the certificates of its parts to `certified`. `numbers`: least and
    /// greatest value of 1/(N − 1).
    fn decide(&self, scenes: &[&Scene], numbers: Option<[f64; 2]>, mut certified: Certified<'_>) -> Result<Option<Proven>, ProofError> {
        let structure = &self.structure;
        let nodes = scenes.iter().map(|scene| self.nodes(scene)).collect::<Result<Vec<_>, _>>()?;
        let time = structure.time(scenes[0], &nodes[0]);
        let mut of = |part: &PartOf<'_>| {
            let classes = part.apart.map_or(0..structure.classes.len(), |class| class..class + 1);
            let ends: Vec<Vec<Node>> = nodes.iter().map(|nodes| nodes[classes.clone()].to_vec()).collect();
            let common = Common { timetable: part.timetable, plans: part.plans, tied: part.tied, time };
            let (frame, named) = match &self.action {
                Action::Server(server) => server.frame(structure, &ends, part.apart, time)?.into(),
                Action::Waves(waves) => {
                    let points = self.points(&ends, numbers, part);
                    waves.frame(&waves::Part::of(structure, part.apart), &points, &ends, time)?.into()
                }
                Action::Mean | Action::Graph(_) => {
                    let points = self.points(&ends, numbers, part);
                    (steps(&points, &ends, common)?, Named::AtPoints(points))
                }
            };
            // A checker multiplies the steps one after another, so a certificate must be decided with the product in this order.
            let product = if certified.is_some() { frame.product_in_order() } else { frame.product() };
            let Some(decision) = decide(&product) else { return Ok(None) };
            if let Some(certified) = certified.as_deref_mut() {
                let members = classes.map(|class| structure.classes[class].clone()).collect();
                let certificate = named.certificate(members, part.apart.is_some(), common, &decision.witness)?;
                let eigenvalues = part.weight.filter(|_| part.apart.is_some());
                certified.push((decision.proven, PartCertificate { eigenvalues, ..certificate }));
            }
            Ok::<_, ProofError>(Some(decision.proven))
        };
        let mut proven = Some(Proven::Stable);
        // One unstable part makes the motion unstable. The motion is stable only if every part is.
        let mut add = |part: Option<Proven>| {
            proven = match (proven, part) {
                (Some(Proven::Unstable), _) | (_, Some(Proven::Unstable)) => Some(Proven::Unstable),
                (Some(Proven::Stable), Some(Proven::Stable)) => Some(Proven::Stable),
                _ => None,
            };
        };
        for part in self.parts() {
            add(of(&part)?);
        }
        for class in 0..structure.classes.len() {
            let radii: Vec<_> = scenes.iter().filter_map(|scene| alone(structure, scene, class, 1)).map(|(part, _)| part.radius).collect();
            if let Some(first) = radii.first() {
                // The radius of a loose device is computed at the corners only, so the verdict holds for the box if the radius does not vary.
                let is_one = radii.iter().all(|radius| radius == first);
                add((is_one && first.verdict() == Verdict::Stable).then_some(Proven::Stable));
            }
        }
        Ok(proven)
    }

    /// Returns the parts of the motion without loose devices.
    fn parts(&self) -> Vec<PartOf<'_>> {
        let structure = &self.structure;
        let mut parts = Vec::new();
        match &self.action {
            Action::Graph(spectrum) => {
                // All parts of a graph are single nodes hearing themselves, so the timetable of the differences serves the eigenvalue 1 too.
                let timetable = structure.apart[0].as_ref().unwrap_or(&structure.timetable);
                let of = |weight: &[f64; 2]| PartOf { apart: Some(0), timetable, plans: &self.plans.0, tied: true, weight: Some(*weight) };
                parts.extend(spectrum.others.iter().map(of));
                parts.push(PartOf { apart: None, timetable, plans: &self.plans.0, tied: structure.tied, weight: Some([1.0; 2]) });
                return parts;
            }
            Action::Mean => {
                let of = |(class, timetable): (usize, &'_ Option<Timetable>)| timetable.as_ref().map(|_| class);
                for class in structure.apart.iter().enumerate().filter_map(of) {
                    let timetable = structure.apart[class].as_ref().unwrap_or(&structure.timetable);
                    parts.push(PartOf { apart: Some(class), timetable, plans: &self.plans.1[class], tied: true, weight: None });
                }
            }
            Action::Server(_) | Action::Waves(_) => {
                let has_differences = |class: &usize| match self.action {
                    Action::Server(_) => Server::has_differences(structure, *class),
                    Action::Mean | Action::Graph(_) | Action::Waves(_) => structure.classes[*class].len() > 1,
                };
                for class in (0..structure.classes.len()).filter(has_differences) {
                    parts.push(PartOf { apart: Some(class), timetable: &structure.timetable, plans: &self.plans.0, tied: true, weight: None });
                }
            }
        }
        parts.push(PartOf { apart: None, timetable: &structure.timetable, plans: &self.plans.0, tied: structure.tied, weight: None });
        parts
    }

    /// Returns the corners of a box for a part of the motion. Weights are affine in 1/(N − 1), a further number of the box unless the weights are
    /// constant.
    fn points(&self, ends: &[Vec<Node>], numbers: Option<[f64; 2]>, part: &PartOf<'_>) -> Vec<Point> {
        let (structure, apart) = (&self.structure, part.apart);
        if let Some([low, high]) = part.weight {
            let hears = |nodes: &Vec<Node>, weight: f64| Point { nodes: nodes.clone(), weights: Matrix::from_fn(1, 1, |_, _| weight) };
            let points: Vec<Point> = ends.iter().map(|nodes| hears(nodes, low)).collect();
            return if low < high { doubled(&points, |point, upper| hears(&point.nodes, if upper { high } else { low })) } else { points };
        }
        let Some((growing, numbers)) = self.growing.zip(numbers) else {
            let whole = || match &self.action {
                Action::Waves(_) => waves::with_shares(&structure.weights, &waves::Part::of(structure, apart).shares()),
                Action::Mean | Action::Graph(_) | Action::Server(_) => structure.weights.clone(),
            };
            let weights = apart.map_or_else(whole, |_| Matrix::from_fn(1, 1, |_, _| structure.difference_weight()));
            return ends.iter().map(|nodes| Point { nodes: nodes.clone(), weights: weights.clone() }).collect();
        };
        let weights = numbers.map(|nu| weights_of_growing(structure, growing, nu, apart.is_some()));
        let points: Vec<Point> = ends.iter().map(|nodes| Point { nodes: nodes.clone(), weights: weights[0].clone() }).collect();
        if weights[0] == weights[1] {
            return points;
        }
        doubled(&points, |point, upper| Point { weights: weights[usize::from(upper)].clone(), ..point.clone() })
    }
}

/// Refuses scenes with chance, since their frames are not deterministic.
fn refuse(scene: &Scene) -> Result<(), ProofError> {
    if has_chance(scene) { Err(ProofError::Chance) } else { Ok(()) }
}
