//! A linear scene on one axis, sorted into classes of equal peers.
//!
//! Peers that are equal, over links that are equal, move in two ways that do not mix: what a class does on average, and how its members differ. The
//! averages of all classes form one system with a node a class, the *quotient*; member i hears the others' differences as −d_i/(N−1), because the
//! differences of a class add up to nothing, so each class of n > 1 members has n − 1 copies of one system of a single node with the weight −1/(N−1).
//! The spectrum of the whole is that of these blocks, exactly.

use std::time::Duration;

use cohaptic_peer::Gains;
use cohaptic_peer::wire::SampleKind;
use cohaptic_scene::{PeerRotation, PeerSpec, Scene};

use crate::lifted::{Body, Lifted, Node, Sampling};
use crate::linear_form::LinearLaw;
use crate::network::{LinkTiming, NominalNetwork};
use crate::rounding::real;
use crate::timetable::{NodeClock, Timetable};
use crate::{AnalysisError, Matrix};

/// Which parts of a scene that is not linear are in force: one linear scene.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Contacts {
    /// For each peer, whether its device and its copy are coupled.
    pub touching: Vec<bool>,
    /// Whether every copy is at a wall of the enclosure.
    pub at_wall: bool,
    /// For each peer, whether it has no device at all.
    pub absent: Vec<bool>,
}

/// The classes of a scene and what happens among them in a frame.
#[derive(Clone, Debug)]
pub struct Structure {
    /// The members of each class, in order; classes in the order of their first members.
    pub classes: Vec<Vec<usize>>,
    /// For each class, whether its members touch the object.
    pub touching: Vec<bool>,
    /// For each class, whether its members have no device.
    pub(crate) absent: Vec<bool>,
    pub(crate) at_wall: bool,
    /// A frame of the classes' averages.
    pub timetable: Timetable,
    /// For each class of more than one member, a frame of a single node that hears itself.
    pub apart: Vec<Option<Timetable>>,
    /// The weight of each class's average (column) in the target of each class (row).
    pub weights: Matrix,
    /// Whether something ties the object to ground: an arm's stiffness, a wall, or a peer that holds forever what it began with.
    pub tied: bool,
    /// Whether some peer holds forever what it began with.
    pub silent: bool,
    /// How many peers there are.
    pub peers: usize,
}

impl Structure {
    /// The classes of peers that are equal in every one of the scenes, which differ in numbers only.
    ///
    /// # Errors
    ///
    /// Those of [`check_laws`], and [`AnalysisError::NoFrame`] or [`AnalysisError::FrameTooLong`] where clocks do not meet soon enough.
    pub fn of(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts) -> Result<Self, AnalysisError> {
        Self::with_apart(scenes, network, contacts, |_, _| false)
    }

    /// The same with one peer in a class of its own, also if others are equal to it: that which is pushed moves unlike those that are not.
    pub(crate) fn with_alone(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts, alone: Option<usize>) -> Result<Self, AnalysisError> {
        Self::with_apart(scenes, network, contacts, |one, other| Some(one) == alone || Some(other) == alone)
    }

    /// Like [`Structure::of`], where some pairs of peers are in one class in no case.
    ///
    /// # Errors
    ///
    /// As for [`Structure::of`].
    pub fn with_apart(
        scenes: &[&Scene],
        network: &NominalNetwork,
        contacts: &Contacts,
        apart: impl Fn(usize, usize) -> bool,
    ) -> Result<Self, AnalysisError> {
        for scene in scenes {
            check_laws(scene)?;
        }
        Self::of_any_law(scenes, network, contacts, apart)
    }

    /// Like [`Structure::with_apart`], for laws of any kind, whose nodes are the caller's.
    ///
    /// # Errors
    ///
    /// As for [`Structure::of`], but for those of laws.
    pub fn of_any_law(
        scenes: &[&Scene],
        network: &NominalNetwork,
        contacts: &Contacts,
        apart: impl Fn(usize, usize) -> bool,
    ) -> Result<Self, AnalysisError> {
        Self::of_classes(scenes[0], classes(scenes, network, contacts, apart), network, contacts)
    }

    /// Every peer by itself, whether or not it is like another.
    ///
    /// # Errors
    ///
    /// As for [`Structure::of`].
    pub fn of_each(scene: &Scene, network: &NominalNetwork, contacts: &Contacts) -> Result<Self, AnalysisError> {
        check_laws(scene)?;
        Self::of_classes(scene, (0..scene.peers.len()).map(|peer| vec![peer]).collect(), network, contacts)
    }

    fn of_classes(scene: &Scene, classes: Vec<Vec<usize>>, network: &NominalNetwork, contacts: &Contacts) -> Result<Self, AnalysisError> {
        let peers = scene.peers.len();
        let clocks = clocks(&classes, scene);
        let links = links(&classes, network);
        let timetable = Timetable::new(&clocks, &links)?;
        let apart = classes.iter().enumerate().map(|(class, members)| {
            let own = links.iter().find(|(from, to, _)| (*from, *to) == (class, class)).filter(|_| members.len() > 1);
            own.map(|(_, _, timing)| Timetable::new(&clocks[class..=class], &[(0, 0, timing.clone())])).transpose()
        });
        let apart = apart.collect::<Result<Vec<_>, _>>()?;
        let others = real(peers - 1);
        let weights = Matrix::from_fn(classes.len(), classes.len(), |row, column| {
            let heard = classes[column].len() - usize::from(row == column);
            real(heard) / others
        });
        let silent = links.iter().any(|(_, _, timing)| matches!(timing, LinkTiming::Pattern(pattern) if pattern.iter().all(Option::is_none)));
        let arm = |class: &Vec<usize>| contacts.touching[class[0]] && scene.device_plant(class[0]).stiffness > 0.0;
        let tied = contacts.at_wall || silent || classes.iter().any(arm);
        let touching = classes.iter().map(|class| contacts.touching[class[0]]).collect();
        let absent = classes.iter().map(|class| contacts.absent[class[0]]).collect();
        Ok(Self { classes, touching, absent, at_wall: contacts.at_wall, timetable, apart, weights, tied, silent, peers })
    }

    /// The linear form of the law of a class.
    pub(crate) fn law(&self, scene: &Scene, class: usize) -> LinearLaw {
        linear_law(scene, self.classes[class][0]).expect("a structure is made only of scenes whose laws have one")
    }

    /// The nodes of all classes.
    pub fn nodes(&self, scene: &Scene) -> Vec<Node> {
        (0..self.classes.len()).map(|class| self.node(scene, class)).collect()
    }

    /// Which numbers of a sample the laws of all classes use.
    pub(crate) fn sampling(&self, scene: &Scene) -> Sampling {
        Sampling::of(&self.nodes(scene))
    }

    /// Whether the laws of all classes hear nothing.
    pub(crate) fn is_silent(&self, scene: &Scene) -> bool {
        let nodes = self.nodes(scene);
        Sampling::of(&nodes).is_silent(self.time(scene, &nodes))
    }

    /// The node that stands for a class.
    pub fn node(&self, scene: &Scene, class: usize) -> Node {
        self.node_with(scene, class, self.law(scene, class))
    }

    /// The node that stands for a class, with a law in place of its own.
    pub fn node_with(&self, scene: &Scene, class: usize, law: LinearLaw) -> Node {
        let place = self.classes[class][0];
        let spec = &scene.peers[place];
        Node {
            device: self.touching[class].then(|| Body::new(scene.device_plant(place), scene.integrator, &spec.clock)),
            object: Body::new(scene.copy_config(place).plant(), scene.integrator, &spec.clock),
            coupling: scene.coupling(place),
            law,
            wall: scene.object.enclosure.filter(|_| self.at_wall).map(|wall| Gains { stiffness: wall.stiffness, damping: wall.damping }),
            compute_delay: spec.compute_delay,
            keeps_whole_past: false,
        }
    }

    /// The largest class with more members than one, the last of those that are as large.
    pub fn largest_equal(&self) -> Option<usize> {
        (0..self.classes.len()).filter(|class| self.apart[*class].is_some()).max_by_key(|class| self.classes[*class].len())
    }

    /// Whether the members of a class have devices that touch nothing.
    pub(crate) fn has_loose_devices(&self, class: usize) -> bool {
        !self.touching[class] && !self.absent[class]
    }

    /// The weight with which a difference within a class comes back: −1/(N−1).
    pub fn difference_weight(&self) -> f64 {
        -1.0 / real(self.peers - 1)
    }

    /// The common time of the classes, of which those are the nodes \[s\].
    pub fn time(&self, scene: &Scene, nodes: &[Node]) -> f64 {
        let peers = self.classes.iter().zip(&self.touching).map(|(class, touching)| (class[0], *touching));
        common_time(scene, self.timetable.frame, nodes[0].law.held_by(), peers, self.at_wall)
    }

    /// The system of the classes' averages.
    pub fn quotient<'a>(&'a self, scene: &Scene, nodes: &'a [Node]) -> Lifted<'a> {
        Lifted {
            nodes,
            weights: &self.weights,
            timetable: &self.timetable,
            sampling: Sampling::of(nodes),
            time: self.time(scene, nodes),
            tied: self.tied,
        }
    }
}

/// The linear form of the law of a peer; `None` if it has none.
pub(crate) fn linear_law(scene: &Scene, peer: usize) -> Option<LinearLaw> {
    LinearLaw::of(&scene.law(peer)?)
}

/// Whether all peers have the same tick, offset and drift.
pub fn has_equal_clocks(scene: &Scene) -> bool {
    scene.peers.iter().all(|spec| spec.clock == scene.peers[0].clock)
}

/// Returns whether all peers have the same drift: then their clocks are as far apart in every frame.
pub(crate) fn has_one_drift(scene: &Scene) -> bool {
    scene.peers.iter().all(|spec| spec.clock.drift == scene.peers[0].clock.drift)
}

/// Refuses laws that have no linear form, and laws that use the ages of samples between clocks that drift apart: ages then do not repeat from frame to frame.
///
/// # Errors
///
/// [`AnalysisError`] that names the law.
pub fn check_laws(scene: &Scene) -> Result<(), AnalysisError> {
    let strategy = scene.coordination.strategy.name();
    let (first, peers) = (&scene.peers[0], scene.peers.len());
    // Of equal ticks the laws are equal.
    let other = (1..peers).filter(|peer| scene.peers[*peer].clock.tick != first.clock.tick);
    for peer in std::iter::once(0).chain(other) {
        // What samples of energies are for is not linear.
        let none = || {
            if scene.sample_kind() == SampleKind::Energy { AnalysisError::NoAnalysis { strategy } } else { AnalysisError::OtherStrategy { strategy } }
        };
        let law = linear_law(scene, peer).ok_or_else(none)?;
        if law.horizon.is_some() && !has_one_drift(scene) {
            return Err(AnalysisError::AgesByClocks { strategy });
        }
    }
    Ok(())
}

/// What velocities are multiplied by to be lengths like positions \[s\]: the time in which the stiffest of the bodies swings by a radian, from a tick to
/// a frame. Positions and velocities then grow into each other by about 1, and errors in either weigh the same.
pub(crate) fn common_time(scene: &Scene, frame: Duration, coordination: Gains, peers: impl Iterator<Item = (usize, bool)>, at_wall: bool) -> f64 {
    let wall = scene.object.enclosure.filter(|_| at_wall).map_or(0.0, |wall| wall.stiffness);
    let (mut fastest, mut tick) = (0.0_f64, frame);
    for (place, touching) in peers {
        let device = scene.device_plant(place);
        let coupling = if touching { scene.coupling(place).stiffness } else { 0.0 };
        fastest = fastest.max((coordination.stiffness + wall + coupling) / scene.copy_mass());
        if touching {
            fastest = fastest.max((coupling + device.stiffness) / device.mass);
        }
        tick = tick.min(scene.peers[place].clock.tick);
    }
    (1.0 / fastest.sqrt()).clamp(tick.as_secs_f64(), frame.as_secs_f64())
}

/// The classes of peers that are equal in every one of the scenes, but for pairs that are in one class in no case.
pub fn classes(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts, apart: impl Fn(usize, usize) -> bool) -> Vec<Vec<usize>> {
    let mut classes: Vec<Vec<usize>> = Vec::new();
    for place in 0..scenes[0].peers.len() {
        let found = classes.iter().position(|class| {
            !apart(class[0], place)
                && contacts.touching[class[0]] == contacts.touching[place]
                && contacts.absent[class[0]] == contacts.absent[place]
                && scenes.iter().all(|scene| {
                    let touching = contacts.touching[place];
                    alike(&scene.peers[class[0]], &scene.peers[place], touching) && turn_alike(scene, class[0], place, touching)
                })
        });
        match found {
            Some(class) => classes[class].push(place),
            None => classes.push(vec![place]),
        }
    }
    if !network.is_uniform() {
        classes = split_by_links(classes, network);
    }
    classes
}

/// The clock of each class.
pub fn clocks(classes: &[Vec<usize>], scene: &Scene) -> Vec<NodeClock> {
    classes.iter().map(|class| NodeClock::of(scene, class[0])).collect()
}

/// How samples of each class (first) get to each class (second), but for those of a class of one to itself.
pub fn links(classes: &[Vec<usize>], network: &NominalNetwork) -> Vec<(usize, usize, LinkTiming)> {
    let mut links = Vec::new();
    for (to, receivers) in classes.iter().enumerate() {
        for (from, senders) in classes.iter().enumerate() {
            let pair = if from == to { senders.get(1).map(|second| (*second, receivers[0])) } else { Some((senders[0], receivers[0])) };
            if let Some((sender, receiver)) = pair {
                links.push((from, to, network.timing(sender, receiver).clone()));
            }
        }
    }
    links
}

/// Whether two peers move by the same equations.
fn alike(one: &PeerSpec, other: &PeerSpec, touching: bool) -> bool {
    let same_clock = (one.clock, one.phase, one.compute_delay) == (other.clock, other.phase, other.compute_delay);
    let plant = |spec: &PeerSpec| spec.device.plant(spec.hand.as_ref());
    let same_device = || (one.device, plant(one)) == (other.device, plant(other));
    let same_coupling = || (one.coupling, one.coupling_scaling) == (other.coupling, other.coupling_scaling);
    same_clock && same_device() && (!touching || same_coupling())
}

/// Whether two copies turn by the same equations, if the object turns.
fn turn_alike(scene: &Scene, one: usize, other: usize, touching: bool) -> bool {
    scene.rotation.as_ref().is_none_or(|rotation| {
        let (one, other) = (&rotation.peers[one], &rotation.peers[other]);
        let device = |peer: &PeerRotation| peer.device.as_ref().map(|device| (device.handle, device.coupling));
        device(one) == device(other) && (!touching || one.grasp.iter().zip(&other.grasp).all(|(one, other)| one - other == 0.0))
    })
}

/// Splits classes until every link between two classes is the same.
fn split_by_links(mut classes: Vec<Vec<usize>>, network: &NominalNetwork) -> Vec<Vec<usize>> {
    loop {
        let uneven =
            (0..classes.len()).find_map(|from| (0..classes.len()).find(|to| !even(&classes[from], &classes[*to], network)).map(|to| (from, to)));
        let Some((from, to)) = uneven else {
            return classes;
        };
        let mut split: Vec<Vec<usize>> = Vec::with_capacity(classes.len());
        for (class, members) in classes.iter().enumerate() {
            if class == from || class == to {
                split.extend(members.iter().map(|member| vec![*member]));
            } else {
                split.push(members.clone());
            }
        }
        split.sort_unstable_by_key(|class| class[0]);
        classes = split;
    }
}

/// Whether all links from one class to another are the same.
fn even(senders: &[usize], receivers: &[usize], network: &NominalNetwork) -> bool {
    let mut first: Option<&LinkTiming> = None;
    for from in senders {
        for to in receivers.iter().filter(|to| *to != from) {
            let timing = network.timing(*from, *to);
            if first.is_some_and(|first| first != timing) {
                return false;
            }
            first = Some(timing);
        }
    }
    true
}
