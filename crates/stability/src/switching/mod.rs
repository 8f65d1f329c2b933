//! Contacts that switch: whether a scene is stable however its one-sided contacts and walls open and close.
//!
//! Each combination of open and closed contacts may be stable and changing between them not ([`analyse`](crate::analyse) says nothing of it). Here the force of a contact is an
//! unknown of which only this is used, at each tick: with δ the depth of the contact (of a push, the device's position relative to its copy in the direction of
//! the push), δ' its velocity, τ = B/K and
//!
//! ```text
//! p = max(0, δ)      f = max(0, δ + τ·δ') while δ > 0, otherwise 0      b = p − δ >= 0
//! ```
//!
//! (K·f is the force), for all ticks k and l
//!
//! ```text
//! (a)  f·(f − p − τ·δ') = 0              closed: f = p + τ·δ'; open: f = 0
//! (b)  p·(f − p − τ·δ') >= 0             δ > 0: f >= δ + τ·δ'
//! (c)  f_k·(b_l − b_k) >= 0              f_k·b_k = 0, f_k >= 0, b_l >= 0
//! (d)  p_k·(b_l − b_k) >= 0              p_k·b_k = 0
//! ```
//!
//! Of b only differences occur, in which a position that all have, or that of a device that lies somewhere, cancels: it does not matter where things rest. With
//! the forces as inputs a frame is linear. Take V > 0 and multipliers, those of (a) of any sign, others not negative. Let the quadratic form
//! V(after) − V(before) + Σ multiplier·product be below zero for all values of states y, forces and depths. The products are not below zero, so
//! V(after) < V(before): V(y, p₀), a norm of motion and springs, shrinks in every frame by a factor below 1, whatever opens and closes. Motion and
//! forces then die out, and devices come to lie somewhere. Forces of hands that stay bounded move a scene by a bounded amount: with an input
//! more the form is below −ε·(all squares) + C·(input)².
//!
//! (a) to (d) hold at walls on both sides of an axis too, with δ the position of the copy, b = p − δ + (the place of the wall), and f and p below zero at the
//! lower end: −b is the position, cut off at the ends, which is largest or smallest where f and p are not zero. Copies i and j have the same walls, so
//! p_i·(b_j − b_i) >= 0 too, and f_i·(b_j − b_i) >= 0.
//! Where an arm ties the scene, depths are measured from its rest, and if no contact presses there, p·(δ − p) >= 0 and f·(δ − p) >= 0.
//!
//! *Equal peers.* All this is the same for equal peers, and sums over them of products u_i·v_i are n·ū·v̄ plus those of the differences from the average. So the
//! inequality splits as a frame does ([`structure`](crate::structure)), into one for the averages and one for differences, with common multipliers; its size
//! does not depend on N. Nothing is lost: an inequality with equal peers that has a solution has the average of all its permutations as one.
//!
//! V and the multipliers are checked with bounds of all rounding errors. Where there are none a motion that grows is looked for.

mod certificate;
mod contact_frame;
mod growing;
mod products;
#[cfg(test)]
mod tests;

pub use certificate::{PushCertificate, SwitchingCertificate};
pub use growing::GrowingMotion;

use std::time::Duration;

use cohaptic_peer::{Contact as ContactKind, Gains};
use cohaptic_scene::Scene;
use rayon::prelude::*;

use self::contact_frame::{Contact, ContactFrame, Kind};
use self::products::{Group, PartFrame, inequality};
use crate::inequality::{Inequality, rate, search};
use crate::lifted::{Lifted, Node, Sampling};
use crate::network::NominalNetwork;
use crate::parts::lifted_part;
use crate::pieces::{Piece, pieces};
use crate::proof::{PartCertificate, stable_difference};
use crate::structure::{Contacts, Structure, check_laws, count};
use crate::timetable::Timetable;
use crate::{AnalysisError, Guarantee, Matrix, Method, PartKind, Watch};

/// The answer of [`prove_switching`].
#[derive(Clone, PartialEq, Debug)]
pub struct Switching {
    /// One for each motion along an axis that has contacts, apart from all others.
    pub motions: Vec<SwitchingMotion>,
    /// What the verdict takes for granted, in words.
    pub notes: Vec<String>,
}

/// The answer about the contacts along one axis.
#[derive(Clone, PartialEq, Debug)]
pub struct SwitchingMotion {
    /// Which motion, in words; empty if there is but one.
    pub name: String,
    /// Stable is proven; unstable means that a motion that grows was found.
    pub guarantee: Guarantee,
    /// The factor by which a quadratic norm of relative motion and contact forces is proven to shrink in a frame at least.
    pub rate: Option<f64>,
    /// The motion that grows.
    pub growing: Option<GrowingMotion>,
    /// How long a frame is.
    pub frame: Duration,
    /// Of a motion that is proven stable, the numbers by which that can be checked.
    pub certificate: Option<SwitchingCertificate>,
}

/// Why nothing can be said of contacts that switch.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
pub enum SwitchingError {
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// Nothing opens or closes.
    #[error(
        "no contact of this scene opens or closes: expected contact = {{ push = … }} or an enclosure; the verdict without this option is all there is to say"
    )]
    NoContact,
    /// Something is left to chance.
    #[error(
        "links leave something to chance, and a guarantee is about one sequence of events: expected links without jitter and loss, such as --set link.loss=0 --set link.jitter=0s"
    )]
    Chance,
    /// A spring of a contact is none.
    #[error("the contact of {what} has no stiffness: expected one above 0")]
    NoSpring {
        /// Whose.
        what: String,
    },
    /// The inequality is too large.
    #[error(
        "a frame of {ticks} ticks of contacts and {states} states makes an inequality of {rows} rows: expected at most {most}; take a shorter update, slower clocks or more peers that are equal"
    )]
    TooLarge {
        /// The ticks of all contacts in a frame.
        ticks: usize,
        /// The states of a frame.
        states: usize,
        /// The rows.
        rows: usize,
        /// The most.
        most: usize,
    },
}

/// The most rows of an inequality, which takes some ten seconds.
const MOST_ROWS: usize = 150;
/// The most states of a frame, each peer by itself, of which motions are followed.
const MOST_FOLLOWED: usize = 400;

impl Switching {
    /// The worst verdict of all motions.
    #[must_use]
    pub fn guarantee(&self) -> Guarantee {
        let any = |guarantee: Guarantee| self.motions.iter().any(|motion| motion.guarantee == guarantee);
        if any(Guarantee::Unstable) {
            Guarantee::Unstable
        } else if any(Guarantee::Undecided) {
            Guarantee::Undecided
        } else {
            Guarantee::Stable
        }
    }
}

/// Looks whether the scene, as it begins, is stable however its one-sided contacts and walls open and close: proves it, or else looks for a motion that grows.
///
/// # Errors
///
/// [`SwitchingError`] if nothing opens or closes, if links leave something to chance, and for what has no frame of equal axes.
pub fn prove_switching(scene: &Scene, watch: &dyn Watch) -> Result<Switching, SwitchingError> {
    if crate::has_chance(scene) {
        return Err(SwitchingError::Chance);
    }
    let pieces = pieces(scene, "the proof of contacts that switch")?;
    let network = NominalNetwork::of(scene)?;
    // A law without a verdict is refused before contacts are asked for.
    check_laws(scene)?;
    let axes: Vec<(&Piece<'_>, usize, String)> = pieces.iter().flat_map(axes).collect();
    if axes.is_empty() {
        return Err(SwitchingError::NoContact);
    }
    let motions = axes.par_iter().map(|(piece, axis, name)| of_axis(piece, *axis, name, &network, watch)).collect::<Result<Vec<_>, _>>()?;
    let mut notes = crate::analysis::notes(&network.notes, false, scene);
    if motions.iter().any(|(_, takes_rest)| *takes_rest) {
        notes.push("an arm ties the scene: contacts are taken to be open where it rests".to_owned());
    }
    Ok(Switching { motions: motions.into_iter().map(|(motion, _)| motion).collect(), notes })
}

/// The axes of a piece that have contacts.
fn axes<'p, 's>(piece: &'p Piece<'s>) -> Vec<(&'p Piece<'s>, usize, String)> {
    let count = piece.scene.axes.count();
    let pushes = |axis: usize| piece.scene.peers.iter().any(|spec| matches!(spec.contact, ContactKind::Push(direction) if direction.axis == axis));
    let differ = (0..count).any(pushes);
    let axes = if differ { (0..count).filter(|axis| pushes(*axis) || piece.scene.object.enclosure.is_some()).collect() } else { vec![0] };
    let has_contacts = differ || piece.scene.object.enclosure.is_some();
    let name = |axis: usize| {
        let along = if differ && count > 1 { format!("along {}", ["x", "y", "z"][axis]) } else { String::new() };
        [piece.motion.clone(), along].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
    };
    axes.into_iter().filter(|_| has_contacts).map(|axis| (piece, axis, name(axis))).collect()
}

/// The contacts of a scene along one axis.
struct Along<'a> {
    scene: &'a Scene,
    axis: usize,
    contacts: Contacts,
}

impl<'a> Along<'a> {
    fn new(piece: &'a Piece<'_>, axis: usize) -> Self {
        let scene: &Scene = &piece.scene;
        let touches = |spec: &cohaptic_scene::PeerSpec| match spec.contact {
            ContactKind::Grasp => true,
            ContactKind::None => false,
            ContactKind::Push(direction) => direction.axis == axis,
        };
        let touching = scene.peers.iter().map(touches).collect();
        Self { scene, axis, contacts: Contacts { touching, at_wall: false, absent: piece.absent.clone() } }
    }

    /// The direction in which a peer pushes.
    fn pushes(&self, peer: usize) -> Option<bool> {
        match self.scene.peers[peer].contact {
            ContactKind::Push(direction) if direction.axis == self.axis => Some(direction.positive),
            ContactKind::Push(_) | ContactKind::Grasp | ContactKind::None => None,
        }
    }

    /// Ties the structure by the arms alone that hold on to the object whatever happens.
    fn tied(&self, mut structure: Structure) -> Structure {
        let holds = |class: &Vec<usize>| {
            self.contacts.touching[class[0]] && self.pushes(class[0]).is_none() && self.scene.device_plant(class[0]).stiffness > 0.0
        };
        structure.tied = structure.silent || structure.classes.iter().any(holds);
        structure
    }

    /// The contacts of a class, which is that node.
    fn of_class(&self, structure: &Structure, class: usize, node: usize, walls: bool) -> Result<Vec<Contact>, SwitchingError> {
        let peer = structure.classes[class][0];
        let mut all = Vec::new();
        if let Some(positive) = self.pushes(peer) {
            let armed = self.scene.device_plant(peer).stiffness > 0.0;
            all.push(Contact { node, kind: Kind::Push { positive }, gains: self.scene.coupling(peer), armed });
        }
        if let Some(wall) = self.scene.object.enclosure.filter(|_| walls) {
            all.push(Contact { node, kind: Kind::Wall, gains: Gains { stiffness: wall.stiffness, damping: wall.damping }, armed: false });
        }
        if all.iter().any(|contact| contact.gains.stiffness <= 0.0) {
            return Err(SwitchingError::NoSpring { what: self.scene.peers[peer].name.clone() });
        }
        Ok(all)
    }
}

/// The verdict along an axis, and whether it takes contacts to be open at rest.
fn of_axis(
    piece: &Piece<'_>,
    axis: usize,
    name: &str,
    network: &NominalNetwork,
    watch: &dyn Watch,
) -> Result<(SwitchingMotion, bool), SwitchingError> {
    let along = Along::new(piece, axis);
    let structure = Structure::with_apart(&[along.scene], network, &along.contacts, |one, other| along.pushes(one) != along.pushes(other))?;
    let structure = along.tied(structure);
    let nodes = walled(&along, structure.nodes(along.scene));
    let asked = Asked::of(&along, &structure, &nodes, watch)?;
    let takes_rest = asked.takes_rest();
    let proven = asked.inequality().and_then(|inequality| search(&inequality, watch, |solution| rate(&inequality, solution)));
    if watch.stops() {
        return Err(AnalysisError::Stopped.into());
    }
    let frame = structure.timetable.frame;
    let motion = |guarantee, rate, growing| SwitchingMotion { name: name.to_owned(), guarantee, rate, growing, frame, certificate: None };
    if let Some((solution, rate)) = proven {
        let certificate = asked.certificate(axis, &structure, &nodes, &solution, rate);
        return Ok((SwitchingMotion { certificate: Some(certificate), ..motion(Guarantee::Stable, Some(rate), None) }, takes_rest));
    }
    let growing = grows(&along, network, watch)?;
    let guarantee = if growing.is_some() { Guarantee::Unstable } else { Guarantee::Undecided };
    Ok((motion(guarantee, None, growing), false))
}

/// Nodes with the gains of their walls, which the bound of rounding errors counts.
fn walled(along: &Along<'_>, nodes: Vec<Node>) -> Vec<Node> {
    let wall = along.scene.object.enclosure.map(|wall| Gains { stiffness: wall.stiffness, damping: wall.damping });
    nodes.into_iter().map(|node| Node { wall, ..node }).collect()
}

/// The part of a scene along an axis that is looked at.
struct Asked {
    groups: Vec<Group>,
    /// The frames of the parts that have contacts, the groups of these, and whether it is about differences.
    frames: Vec<(ContactFrame, Vec<usize>, bool)>,
    /// Of each of these parts, which class its differences are of, and of each of its classes how many numbers of samples of earlier frames it has.
    parts: Vec<(Option<usize>, Vec<usize>)>,
    sampling: Sampling,
    time: f64,
    tied: bool,
    /// Whether every part without contacts is stable.
    rest_is_stable: bool,
    /// The certificates of these parts, of those that have one.
    rest: Vec<PartCertificate>,
}

impl Asked {
    fn of(along: &Along<'_>, structure: &Structure, nodes: &[Node], watch: &dyn Watch) -> Result<Self, SwitchingError> {
        let quotient = structure.quotient(along.scene, nodes);
        let (mut contacts, mut groups) = (Vec::new(), Vec::new());
        let ticks = quotient.ticks();
        for (class, members) in structure.classes.iter().enumerate() {
            for contact in along.of_class(structure, class, class, true)? {
                let is_wall = contact.kind == Kind::Wall;
                let has_rest = structure.tied && (is_wall || contact.armed);
                groups.push(Group { ticks: ticks[class], members: count(members.len()), is_wall, has_rest });
                contacts.push(contact);
            }
        }
        let history: usize = structure.timetable.depth.iter().sum::<usize>() * quotient.sampling.channels();
        let states = nodes.iter().map(Node::states).sum::<usize>() + history;
        let ticks = groups.iter().map(|group| group.ticks).sum::<usize>();
        let rows = states + 2 * ticks + groups.len();
        if rows > MOST_ROWS {
            return Err(SwitchingError::TooLarge { ticks, states, rows, most: MOST_ROWS });
        }
        let history = |timetable: &Timetable| timetable.depth.iter().map(|depth| depth * quotient.sampling.channels()).collect::<Vec<_>>();
        let mut asked = Self {
            frames: vec![(ContactFrame::new(&quotient, contacts.clone()), (0..groups.len()).collect(), false)],
            parts: vec![(None, history(&structure.timetable))],
            groups,
            rest_is_stable: true,
            rest: Vec::new(),
            sampling: quotient.sampling,
            time: quotient.time,
            tied: structure.tied,
        };
        for class in 0..structure.classes.len() {
            let Some(timetable) = &structure.apart[class] else { continue };
            let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
            let lifted = Lifted { nodes: &nodes[class..=class], weights: &weight, timetable, tied: true, ..quotient };
            let own: Vec<usize> = (0..contacts.len()).filter(|contact| contacts[*contact].node == class).collect();
            if own.is_empty() {
                let part = lifted_part(&lifted, PartKind::Apart { peer: structure.classes[class][0] }, 1, Method::Reduced, watch)?;
                asked.rest_is_stable &= part.radius.value + part.radius.error < 1.0;
                asked.rest.extend(stable_difference(
                    &structure.classes[class],
                    &nodes[class],
                    structure.difference_weight(),
                    timetable,
                    quotient.time,
                ));
                continue;
            }
            let at_zero = own.iter().map(|contact| Contact { node: 0, ..contacts[*contact] }).collect();
            asked.frames.push((ContactFrame::new(&lifted, at_zero), own, true));
            asked.parts.push((Some(class), history(timetable)));
        }
        Ok(asked)
    }

    /// Whether contacts are taken to be open at rest.
    fn takes_rest(&self) -> bool {
        self.groups.iter().any(|group| group.has_rest)
    }

    /// The inequality of all parts that have contacts; `None` if another is not stable.
    fn inequality(&self) -> Option<Inequality> {
        let parts: Vec<PartFrame<'_>> =
            self.frames.iter().map(|(frame, groups, is_apart)| PartFrame { frame, groups, is_apart: *is_apart }).collect();
        self.rest_is_stable.then(|| inequality(&parts, &self.groups)).flatten()
    }
}

/// A motion that grows, each peer by itself and away from walls.
fn grows(along: &Along<'_>, network: &NominalNetwork, watch: &dyn Watch) -> Result<Option<GrowingMotion>, SwitchingError> {
    let structure = along.tied(Structure::of_each(along.scene, network, &along.contacts)?);
    let nodes = structure.nodes(along.scene);
    let quotient = structure.quotient(along.scene, &nodes);
    let mut contacts = Vec::new();
    for class in 0..structure.classes.len() {
        contacts.extend(along.of_class(&structure, class, class, false)?);
    }
    if nodes.iter().map(Node::states).sum::<usize>() > MOST_FOLLOWED {
        return Ok(None);
    }
    let found = growing::search(&ContactFrame::new(&quotient, contacts), watch);
    if watch.stops() { Err(AnalysisError::Stopped.into()) } else { Ok(found) }
}
