//! Contacts that switch: whether a scene is stable however its one-sided contacts and walls open and close.
//!
//! A scene can be unstable although every fixed combination of open and closed contacts is stable, and [`analyse`](cohaptic_stability::analyse) looks at fixed
//! combinations only. The proof of this module treats the force of a contact as an unknown, and uses only the following properties of the force at each tick.
//! Let δ be the depth of the contact (of a push: the device's position relative to its copy in the direction of the push), δ' the velocity of δ, τ = B/K and
//!
//! ```text
//! p = max(0, δ)      f = max(0, δ + τ·δ') while δ > 0, otherwise 0      b = p − δ >= 0
//! ```
//!
//! (K·f is the force). Then for all ticks k and l
//!
//! ```text
//! (a)  f·(f − p − τ·δ') = 0              closed: f = p + τ·δ'; open: f = 0
//! (b)  p·(f − p − τ·δ') >= 0             δ > 0: f >= δ + τ·δ'
//! (c)  f_k·(b_l − b_k) >= 0              f_k·b_k = 0, f_k >= 0, b_l >= 0
//! (d)  p_k·(b_l − b_k) >= 0              p_k·b_k = 0
//! ```
//!
//! Only differences of b occur. A displacement of all bodies, or of a device that rests apart from its copy, cancels in these differences, so the place of rest
//! does not matter. With the forces as inputs a frame is linear. Take V > 0 and multipliers: the multipliers of (a) have any sign, all other multipliers are
//! not negative. Let the quadratic form V(after) − V(before) + Σ multiplier·product be below zero for all values of states y, forces and depths. The products
//! are not below zero, so V(after) < V(before): V(y, p₀), a norm of motion and springs, shrinks in every frame by a factor below 1, whichever contacts open and
//! close. Motion and forces then die out, and the devices come to rest. Bounded forces of hands move a scene by a bounded amount, because with one more input
//! the form is below −ε·(all squares) + C·(input)².
//!
//! (a) to (d) hold at walls on both sides of an axis too, with δ the position of the copy, b = p − δ + (the place of the wall), and f and p below zero at the
//! lower end: −b is the position, cut off at the ends, which is largest or smallest where f and p are not zero. Copies i and j have the same walls, so
//! p_i·(b_j − b_i) >= 0 too, and f_i·(b_j − b_i) >= 0. Where an arm ties the scene, depths are measured from its rest, and if no contact presses there,
//! p·(δ − p) >= 0 and f·(δ − p) >= 0.
//!
//! *Equal peers.* Rows and contacts are the same for n equal peers, and the sum over the peers of products u_i·v_i is n·ū·v̄ plus the sum of the products of
//! the differences from the average. So the inequality splits as a frame does ([`Structure`]), into one for the averages and one for the differences, with
//! common multipliers; the size of the two does not depend on n. The split loses no proof: if an inequality with equal peers has a solution, the average of all
//! permutations of the solution is a solution too.
//!
//! V and the multipliers are checked with bounds of all rounding errors. Where no V and multipliers are found, the module searches a motion that grows.

mod along;
mod asked;
mod certificate;
mod contact_frame;
mod error;
mod growing;
mod products;
#[cfg(test)]
mod tests;

pub use certificate::{PushCertificate, SwitchingCertificate};
pub use error::SwitchingError;
pub use growing::GrowingMotion;

use std::time::Duration;

use cohaptic_peer::{Contact as ContactKind, Gains};
use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Node, NominalNetwork, Piece, Structure, check_laws, notes, pieces, refuse_slow_devices};
use cohaptic_stability::{AnalysisError, Watch, has_chance};
use rayon::prelude::*;

use self::along::Along;
use self::asked::Asked;
use self::contact_frame::ContactFrame;
use crate::boxes::Guarantee;
use crate::inequality::{rate, search};

/// The answer of [`prove_switching`].
#[derive(Clone, PartialEq, Debug)]
pub struct Switching {
    /// The verdict on each motion along an axis with contacts that open and close. The motions do not depend on each other.
    pub motions: Vec<SwitchingMotion>,
    /// Assumptions of the verdict, in words.
    pub notes: Vec<String>,
}

/// The verdict on the contacts along one axis.
#[derive(Clone, PartialEq, Debug)]
pub struct SwitchingMotion {
    /// Name of the motion, in words; empty if the scene has only one motion.
    pub name: String,
    /// Stable means proven; unstable means that the search found a motion that grows.
    pub guarantee: Guarantee,
    /// Factor, at most 1, by which a quadratic norm of relative motion and contact forces is proven to shrink in each frame; `None` without a proof.
    pub rate: Option<f64>,
    /// The motion that grows, if the search found such a motion.
    pub growing: Option<GrowingMotion>,
    /// Duration of a frame.
    pub frame: Duration,
    /// Numbers by which a reader can check the proof; `None` if the motion is not proven stable.
    pub certificate: Option<SwitchingCertificate>,
}

/// Largest number of states of a frame, with each peer counted by itself, up to which the search follows motions.
const MOST_FOLLOWED: usize = 400;

impl Switching {
    /// Returns the worst verdict of all motions: unstable before undecided before stable.
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

/// Proves that the scene, with its settings at the start, is stable however its one-sided contacts and walls open and close. Without a proof, searches a motion
/// that grows.
///
/// # Errors
///
/// [`SwitchingError`] if no contact of the scene opens or closes, if links have jitter or random loss, or if the scene cannot be analysed.
pub fn prove_switching(scene: &Scene, watch: &dyn Watch) -> Result<Switching, SwitchingError> {
    if has_chance(scene) {
        return Err(SwitchingError::Chance);
    }
    refuse_slow_devices(scene, "the proof of contacts that switch")?;
    let pieces = pieces(scene, "the proof of contacts that switch")?;
    let network = NominalNetwork::of(scene)?;
    // A control law that the analysis does not know is refused first: this error says more than the error of a scene without contacts.
    check_laws(scene)?;
    let axes: Vec<(&Piece<'_>, usize, String)> = pieces.iter().flat_map(axes).collect();
    if axes.is_empty() {
        return Err(SwitchingError::NoContact);
    }
    let motions = axes.par_iter().map(|(piece, axis, name)| of_axis(piece, *axis, name, &network, watch)).collect::<Result<Vec<_>, _>>()?;
    let mut notes = notes(&network.notes, false, scene);
    if motions.iter().any(|(_, takes_rest)| *takes_rest) {
        notes.push("an arm ties the scene: contacts are taken to be open where it rests".to_owned());
    }
    Ok(Switching { motions: motions.into_iter().map(|(motion, _)| motion).collect(), notes })
}

/// Returns the axes of a piece that have contacts, with the name of each motion.
fn axes<'p, 's>(piece: &'p Piece<'s>) -> Vec<(&'p Piece<'s>, usize, String)> {
    let count = piece.scene.axes.count();
    let pushes = |axis: usize| piece.scene.peers.iter().any(|spec| matches!(spec.contact, ContactKind::Push(direction) if direction.axis == axis));
    // Without pushes all axes have equal equations, and axis 0 stands for all of them.
    let differ = (0..count).any(pushes);
    let axes = if differ { (0..count).filter(|axis| pushes(*axis) || piece.scene.object.enclosure.is_some()).collect() } else { vec![0] };
    let has_contacts = differ || piece.scene.object.enclosure.is_some();
    let name = |axis: usize| {
        let along = if differ && count > 1 { format!("along {}", ["x", "y", "z"][axis]) } else { String::new() };
        [piece.motion.clone(), along].into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
    };
    axes.into_iter().filter(|_| has_contacts).map(|axis| (piece, axis, name(axis))).collect()
}

/// Returns the verdict along an axis, and whether the proof takes contacts to be open at rest.
fn of_axis(
    piece: &Piece<'_>,
    axis: usize,
    name: &str,
    network: &NominalNetwork,
    watch: &dyn Watch,
) -> Result<(SwitchingMotion, bool), SwitchingError> {
    let along = Along::new(piece, axis);
    // Peers that push in opposite directions have different contacts, so they never share a class.
    let structure = Structure::with_apart(&[along.scene], network, &along.contacts, |one, other| along.pushes(one) != along.pushes(other))?;
    let structure = along.tied(structure);
    let nodes = walled(&along, structure.nodes(along.scene));
    let asked = Asked::of(&along, &structure, &nodes, watch)?;
    let takes_rest = asked.takes_rest();
    let proven = asked.inequality().and_then(|inequality| search(&inequality, watch, |solution| rate(&inequality, solution)));
    // A stopped search has found nothing. That is no verdict.
    if watch.stops() {
        return Err(AnalysisError::Stopped.into());
    }
    let frame = structure.timetable.frame;
    let motion = |guarantee, rate, growing| SwitchingMotion { name: name.to_owned(), guarantee, rate, growing, frame, certificate: None };
    if let Some((solution, rate)) = proven {
        let certificate = asked.certificate(axis, &structure, &nodes, &solution, rate);
        return Ok((SwitchingMotion { certificate: Some(certificate), ..motion(Guarantee::Stable, Some(rate), None) }, takes_rest));
    }
    // The search comes after the proof: no motion of a scene that is proven stable can grow.
    let growing = grows(&along, network, watch)?;
    let guarantee = if growing.is_some() { Guarantee::Unstable } else { Guarantee::Undecided };
    Ok((motion(guarantee, None, growing), false))
}

/// Adds the gains of the walls to the nodes. The bound of rounding errors counts these gains.
fn walled(along: &Along<'_>, nodes: Vec<Node>) -> Vec<Node> {
    let wall = along.scene.object.enclosure.map(|wall| Gains { stiffness: wall.stiffness, damping: wall.damping });
    nodes.into_iter().map(|node| Node { wall, ..node }).collect()
}

/// Searches a motion that grows, with each peer by itself and away from walls.
fn grows(along: &Along<'_>, network: &NominalNetwork, watch: &dyn Watch) -> Result<Option<GrowingMotion>, SwitchingError> {
    let structure = along.tied(Structure::of_each(along.scene, network, &along.contacts)?);
    let nodes = structure.nodes(along.scene);
    let quotient = structure.quotient(along.scene, &nodes);
    let mut contacts = Vec::new();
    for class in 0..structure.classes.len() {
        // Without walls: a motion may be scaled only if no place of a wall enters the equations as a constant.
        contacts.extend(along.of_class(&structure, class, class, false)?);
    }
    if nodes.iter().map(Node::states).sum::<usize>() > MOST_FOLLOWED {
        return Ok(None);
    }
    let found = growing::search(&ContactFrame::new(&quotient, contacts), watch);
    if watch.stops() { Err(AnalysisError::Stopped.into()) } else { Ok(found) }
}
