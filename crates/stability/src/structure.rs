//! Sorts the peers of a linear scene on one axis into classes of equal peers.
//!
//! The motion of equal peers over equal links has two independent parts: the average of the class, and the differences of the members from the average.
//! The averages of all classes form one system with one node per class, the *quotient*. The differences of a class add up to zero, so member i hears the
//! differences of the other members as −d_i/(N−1). Each class of n > 1 members therefore has n − 1 copies of one system of a single node with the weight
//! −1/(N−1). The spectrum of the scene is exactly the union of the spectra of these blocks.

use std::borrow::Cow;
use std::collections::BTreeSet;
use std::time::Duration;

use cohaptic_peer::Gains;
use cohaptic_peer::wire::SampleKind;
use cohaptic_scene::{PeerRotation, PeerSpec, Scene};

use crate::lifted::{Body, Lifted, Node, Operator, Sampling, Seen};
use crate::linear_form::LinearLaw;
use crate::network::{LinkTiming, NominalNetwork};
use crate::operators::Crossover;
use crate::rounding::real;
use crate::timetable::{NodeClock, Timetable};
use crate::{AnalysisError, Matrix};

/// Closed contacts of a scene. With given closed contacts, a scene with one-sided contacts is linear.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Contacts {
    /// `true` if the device and the copy of each peer are coupled, indexed by peer.
    pub touching: Vec<bool>,
    /// `true` if every copy is at a wall of the enclosure.
    pub at_wall: bool,
    /// `true` if each peer has no device at all, indexed by peer.
    pub absent: Vec<bool>,
}

/// Classes of equal peers of a scene, with the events and the weights between classes in a frame.
#[derive(Clone, Debug)]
pub struct Structure {
    /// Members of each class in rising order, as indices of [`Scene::peers`]. The classes are in the order of their first members.
    pub classes: Vec<Vec<usize>>,
    /// `true` if the members of each class touch the object, indexed by class.
    pub touching: Vec<bool>,
    /// `true` if the members of each class have no device, indexed by class.
    pub(crate) absent: Vec<bool>,
    pub(crate) at_wall: bool,
    /// Timetable of a frame of the classes' averages, with one node per class.
    pub timetable: Timetable,
    /// Timetable of a frame of a single node hearing itself, indexed by class. `None` for a class of one member.
    pub apart: Vec<Option<Timetable>>,
    /// The weight of each class's average (column) in the target of each class (row).
    pub weights: Matrix,
    /// `true` if something ties the object to ground: an arm's stiffness, a wall, or a peer with only its initial samples, held forever.
    pub tied: bool,
    /// `true` if some peer never receives a sample over a link and holds its initial sample forever.
    pub silent: bool,
    /// Number of peers of the scene.
    pub peers: usize,
}

impl Structure {
    /// Sorts the peers into classes of members equal in each of the scenes. The scenes may differ in numbers only.
    ///
    /// # Errors
    ///
    /// The errors of [`check_laws`], and [`AnalysisError::NoFrame`] or [`AnalysisError::FrameTooLong`] if clocks do not meet soon enough.
    pub fn of(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts) -> Result<Self, AnalysisError> {
        Self::with_apart(scenes, network, contacts, |_, _| false)
    }

    /// Like [`of`](Self::of), but puts the peer `alone` into a class of its own even if other peers equal it: a pushed peer does not move like its equals.
    pub(crate) fn with_alone(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts, alone: Option<usize>) -> Result<Self, AnalysisError> {
        Self::with_apart(scenes, network, contacts, |one, other| Some(one) == alone || Some(other) == alone)
    }

    /// Like [`Structure::of`], but never puts a pair of peers into one class if `apart` returns true for the pair.
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

    /// Like [`Structure::with_apart`], for laws of any kind. The laws are not checked; the caller supplies the nodes.
    ///
    /// # Errors
    ///
    /// As for [`Structure::of`], without the errors of laws.
    pub fn of_any_law(
        scenes: &[&Scene],
        network: &NominalNetwork,
        contacts: &Contacts,
        apart: impl Fn(usize, usize) -> bool,
    ) -> Result<Self, AnalysisError> {
        Self::of_classes(scenes[0], classes(scenes, network, contacts, apart), network, contacts)
    }

    /// Puts each peer into a separate class, even if peers are equal.
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
        // Members of a class hear each other over the class's link to itself. A class of one member has no such link and no differences.
        let apart = classes.iter().enumerate().map(|(class, members)| {
            let own = links.iter().find(|(from, to, _)| (*from, *to) == (class, class)).filter(|_| members.len() > 1);
            own.map(|(_, _, timing)| Timetable::new(&clocks[class..=class], &[(0, 0, timing.clone())])).transpose()
        });
        let apart = apart.collect::<Result<Vec<_>, _>>()?;
        // Every peer averages over all others with weight 1/(N−1). A peer does not hear itself, so the own class counts one sender less.
        let others = real(peers - 1);
        let weights = Matrix::from_fn(classes.len(), classes.len(), |row, column| {
            let heard = classes[column].len() - usize::from(row == column);
            real(heard) / others
        });
        // A held initial sample acts like a spring to a fixed point, so silence ties the object as an arm does.
        let silent = links.iter().any(|(_, _, timing)| matches!(timing, LinkTiming::Pattern(pattern) if pattern.iter().all(Option::is_none)));
        let arm = |class: &Vec<usize>| contacts.touching[class[0]] && knows_origin(scene, class[0]);
        let tied = contacts.at_wall || silent || classes.iter().any(arm);
        let touching = classes.iter().map(|class| contacts.touching[class[0]]).collect();
        let absent = classes.iter().map(|class| contacts.absent[class[0]]).collect();
        Ok(Self { classes, touching, absent, at_wall: contacts.at_wall, timetable, apart, weights, tied, silent, peers })
    }

    /// Returns the linear form of the law of a class.
    pub(crate) fn law(&self, scene: &Scene, class: usize) -> LinearLaw {
        linear_law(scene, self.classes[class][0]).expect("a structure is made only of scenes whose laws have one")
    }

    /// Returns the nodes of all classes, indexed by class.
    pub fn nodes(&self, scene: &Scene) -> Vec<Node> {
        (0..self.classes.len()).map(|class| self.node(scene, class)).collect()
    }

    /// Returns the numbers of a sample used by the laws of the classes.
    pub(crate) fn sampling(&self, scene: &Scene) -> Sampling {
        Sampling::of(&self.nodes(scene))
    }

    /// Tells whether no class's law uses a sample.
    pub(crate) fn is_silent(&self, scene: &Scene) -> bool {
        let nodes = self.nodes(scene);
        Sampling::of(&nodes).is_silent(self.time(scene, &nodes))
    }

    /// Returns the node of a class, with the equations of any member.
    pub fn node(&self, scene: &Scene, class: usize) -> Node {
        self.node_with(scene, class, self.law(scene, class))
    }

    /// Returns the node of a class, with `law` in place of the class's own law.
    pub fn node_with(&self, scene: &Scene, class: usize, law: LinearLaw) -> Node {
        let place = self.classes[class][0];
        let spec = &scene.peers[place];
        Node {
            device: self.touching[class].then(|| Body::new(scene.device_plant(place), scene.integrator, &spec.clock)),
            object: Body::new(scene.copy_config(place).plant(), scene.integrator, &spec.clock),
            operator: self.operator(scene, class),
            coupling: scene.coupling(place),
            law,
            wall: scene.object.enclosure.filter(|_| self.at_wall).map(|wall| Gains { stiffness: wall.stiffness, damping: wall.damping }),
            compute_delay: spec.compute_delay,
            exchange: spec.exchange,
            keeps_whole_past: false,
        }
    }

    /// Returns the operator of a class. A hand without a contact moves nothing but its own device, and its operator is left out.
    pub(crate) fn operator(&self, scene: &Scene, class: usize) -> Option<Operator> {
        let person = Crossover::of(scene, self.classes[class][0]).filter(|_| self.touching[class])?;
        // A peer that is seen is alone in its class: see `classes`.
        let class_of = |peer: usize| self.classes.iter().position(|members| members[0] == peer);
        let sees = person.seen_peer().map_or(Seen::Own, |peer| class_of(peer).map_or(Seen::Nothing, |from| Seen::Held { from }));
        let arm = Gains { stiffness: person.arm.stiffness, damping: person.arm.damping };
        Some(Operator { crossover: person.frequency, arm, lag: person.lag, tick: person.tick, sees })
    }

    /// Returns the node of the differences between the members of a class, as a slice of one node. `nodes` are the nodes of all classes.
    pub(crate) fn apart<'a>(nodes: &'a [Node], class: usize) -> Cow<'a, [Node]> {
        match nodes[class].operator {
            Some(operator) if operator != operator.apart() => Cow::Owned(vec![Node { operator: Some(operator.apart()), ..nodes[class].clone() }]),
            _ => Cow::Borrowed(&nodes[class..=class]),
        }
    }

    /// Returns the largest class of more than one member, the last of several equally large classes, or `None` if every class has one member.
    pub fn largest_equal(&self) -> Option<usize> {
        (0..self.classes.len()).filter(|class| self.apart[*class].is_some()).max_by_key(|class| self.classes[*class].len())
    }

    /// Tells whether the members of a class have devices without a contact.
    pub(crate) fn has_loose_devices(&self, class: usize) -> bool {
        !self.touching[class] && !self.absent[class]
    }

    /// Returns the weight −1/(N−1) of a member's own difference from the average in the average that the member hears.
    pub fn difference_weight(&self) -> f64 {
        -1.0 / real(self.peers - 1)
    }

    /// Returns the common time of the classes with the nodes `nodes` \[s\]. Velocities times the common time are lengths.
    pub fn time(&self, scene: &Scene, nodes: &[Node]) -> f64 {
        let peers = self.classes.iter().zip(&self.touching).map(|(class, touching)| (class[0], *touching));
        common_time(scene, self.timetable.frame, nodes[0].law.held_by(), peers, self.at_wall)
    }

    /// Returns the system of the classes' averages.
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

/// Tells whether the hand of a peer that touches the object knows where the origin is: by an arm with a stiffness, or by what an operator sees.
pub(crate) fn knows_origin(scene: &Scene, peer: usize) -> bool {
    scene.device_plant(peer).stiffness > 0.0 || Crossover::of(scene, peer).is_some()
}

/// Returns the linear form of the law of a peer, or `None` if the law has no linear form.
pub(crate) fn linear_law(scene: &Scene, peer: usize) -> Option<LinearLaw> {
    LinearLaw::of(&scene.law(peer)?)
}

/// Tells whether all peers have the same tick, offset and drift.
pub fn has_equal_clocks(scene: &Scene) -> bool {
    scene.peers.iter().all(|spec| spec.clock == scene.peers[0].clock)
}

/// Tells whether all peers have the same drift. The distances of the clocks are then equal in every frame.
pub(crate) fn has_one_drift(scene: &Scene) -> bool {
    scene.peers.iter().all(|spec| spec.clock.drift == scene.peers[0].clock.drift)
}

/// Refuses laws without a linear form, and laws with ages of samples between clocks of different drift: ages then do not repeat from frame to frame.
///
/// # Errors
///
/// [`AnalysisError`] with the name of the law.
pub fn check_laws(scene: &Scene) -> Result<(), AnalysisError> {
    let strategy = scene.coordination.strategy.name();
    let (first, peers) = (&scene.peers[0], scene.peers.len());
    // Laws differ between peers only through the tick, so only peers with another tick need a separate check.
    let other = (1..peers).filter(|peer| scene.peers[*peer].clock.tick != first.clock.tick);
    for peer in std::iter::once(0).chain(other) {
        // Strategies with samples of energies are not linear, so no analysis follows these strategies.
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

/// Returns the common time \[s\], by which velocities are multiplied to become lengths: the time of a swing by a radian of the stiffest body, at least a tick
/// and at most a frame. Positions and velocities then change into each other with factors of about 1, so that errors of both have the same weight.
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
    // The natural frequency is √(k/m). A body without springs has frequency zero, and the bounds keep the time finite.
    (1.0 / fastest.sqrt()).clamp(tick.as_secs_f64(), frame.as_secs_f64())
}

/// Returns the classes of peers equal in each of the scenes. A pair of peers is never in one class if `apart` returns true for the pair.
pub fn classes(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts, apart: impl Fn(usize, usize) -> bool) -> Vec<Vec<usize>> {
    let mut classes: Vec<Vec<usize>> = Vec::new();
    // A peer that an operator sees is seen with its own motion, not with the average of a class.
    let seen_by = |scene: &Scene, peer: usize| Crossover::of(scene, peer)?.seen_peer();
    let seen: BTreeSet<usize> = scenes.iter().flat_map(|scene| (0..scene.peers.len()).filter_map(|peer| seen_by(scene, peer))).collect();
    for place in 0..scenes[0].peers.len() {
        // Equality of parameters is transitive, so comparing with the first member of a class is enough.
        let found = classes.iter().position(|class| {
            !apart(class[0], place)
                && !seen.contains(&class[0])
                && !seen.contains(&place)
                && contacts.touching[class[0]] == contacts.touching[place]
                && contacts.absent[class[0]] == contacts.absent[place]
                && scenes.iter().all(|scene| {
                    let touching = contacts.touching[place];
                    alike(&scene.peers[class[0]], &scene.peers[place], touching)
                        && (!touching || Crossover::of(scene, class[0]) == Crossover::of(scene, place))
                        && turn_alike(scene, class[0], place, touching)
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

/// Returns the common clock of the members of each class.
pub fn clocks(classes: &[Vec<usize>], scene: &Scene) -> Vec<NodeClock> {
    classes.iter().map(|class| NodeClock::of(scene, class[0])).collect()
}

/// Returns the links between classes as (sender, receiver, timing). A class of one member has no link to itself.
pub fn links(classes: &[Vec<usize>], network: &NominalNetwork) -> Vec<(usize, usize, LinkTiming)> {
    let mut links = Vec::new();
    for (to, receivers) in classes.iter().enumerate() {
        for (from, senders) in classes.iter().enumerate() {
            // Any pair of members represents the links between two classes: `split_by_links` has made their timings equal.
            let pair = if from == to { senders.get(1).map(|second| (*second, receivers[0])) } else { Some((senders[0], receivers[0])) };
            if let Some((sender, receiver)) = pair {
                links.push((from, to, network.timing(sender, receiver).clone()));
            }
        }
    }
    links
}

/// Tells whether two peers move by the same equations. The coupling is compared only if the peers touch the object.
fn alike(one: &PeerSpec, other: &PeerSpec, touching: bool) -> bool {
    // Bodies integrate per tick of their clock, so peers with different clocks or phases move differently even with equal parameters.
    let clock = |spec: &PeerSpec| (spec.clock, spec.phase, spec.compute_delay, spec.exchange);
    let plant = |spec: &PeerSpec| spec.device.plant(spec.hand.as_ref());
    let same_device = || (one.device, plant(one)) == (other.device, plant(other));
    let same_coupling = || (one.coupling, one.coupling_scaling) == (other.coupling, other.coupling_scaling);
    clock(one) == clock(other) && same_device() && (!touching || same_coupling())
}

/// Tells whether two peers turn by the same equations. True if the object does not turn.
fn turn_alike(scene: &Scene, one: usize, other: usize, touching: bool) -> bool {
    scene.rotation.as_ref().is_none_or(|rotation| {
        let (one, other) = (&rotation.peers[one], &rotation.peers[other]);
        let device = |peer: &PeerRotation| peer.device.as_ref().map(|device| (device.handle, device.coupling));
        device(one) == device(other) && (!touching || one.grasp.iter().zip(&other.grasp).all(|(one, other)| one - other == 0.0))
    })
}

/// Splits classes into single peers until all links from one class to another have the same timing.
fn split_by_links(mut classes: Vec<Vec<usize>>, network: &NominalNetwork) -> Vec<Vec<usize>> {
    loop {
        let uneven =
            // Each pass splits at least one class of several members, so the loop ends. A split may make further links uneven, hence another pass.
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

/// Tells whether all links from one class to another have the same timing.
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
