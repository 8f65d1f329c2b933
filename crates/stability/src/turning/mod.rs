//! Analysis of objects that turn, with all six components of each copy together. Linearised at rest, at rest under a load, or about a steady spin.
//!
//! At rest without a load the copies coincide. In body axes, with y = (δp, δθ), M = diag(m·I, J), G = \[I, −\[r\]\]:
//!
//! ```text
//! M·ÿ = Gᵀ·FC + (0, τC) − diag(KT·I, KR)·(y − ȳ) − diag(BT·I, BR)·(ẏ − ẏ̄) − diag(bO·I, bR)·ẏ
//! FC = KC·(δx − G·y) + BC·(δvH − G·ẏ),   τC = KCR·(δθH − δθ) + BCR·(δωH − δω)
//! ```
//!
//! The further terms of a peer's equations are products of small quantities. Frames, samples and delays are as in [`crate::full`], and each component moves by
//! the step map of one axis. Angles are multiplied by √(tr J/3m), so that all states are lengths. Peers that are equal, their grasps included, form a class.

mod algebra;
mod frame;
mod levenberg;
mod load;
mod node;
mod peers;
mod rigid;
mod spin;
#[cfg(test)]
mod tests;
mod together;

use std::time::Duration;

use cohaptic_scene::Scene;

pub(crate) use self::frame::Turning;
use self::load::{Loaded, Pose};
use self::spin::Spin;
pub(crate) use self::together::{Together, allowed, contacts};
use crate::analysis::combine;
use crate::cost::eigenvalue_operations;
use crate::network::NominalNetwork;
use crate::parts::radius_of;
use crate::radius::worse;
use crate::spectrum::{Workspace, bounded_radius};
use crate::structure::Structure;
use crate::timetable::Timetable;
use crate::{Analysis, AnalysisError, ContactMode, Matrix, Method, Part, PartKind, Radius, UNLOADED, Unwatched, Watch};

/// Analyses an object that turns. With [`Method::Full`] each peer is a class of its own.
pub(crate) fn analyse(scene: &Scene, method: Method, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    let network = NominalNetwork::of(scene)?;
    let mode = mode(scene, &network, method, watch)?;
    let mut analysis = combine(vec![mode], method, &network, scene);
    if scene.object.enclosure.is_some() {
        analysis.notes.push("the enclosure is left out: the scene is analysed away from its walls".to_owned());
    }
    Ok(analysis)
}

/// Analyses small motions of an object that turns about its rest under constant forces of the hands. Each peer is a class of its own.
pub(crate) fn analyse_loaded(scene: &Scene, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    let network = NominalNetwork::of(scene)?;
    let (together, poses) = loaded(scene, &network, watch)?;
    let mode = mode_of(&together, Method::Full, watch)?;
    let mut analysis = combine(vec![mode], Method::Full, &network, scene);
    analysis.notes.retain(|note| note != UNLOADED);
    let pairs = || poses.iter().flat_map(|one| poses.iter().map(move |other| (one, other)));
    let apart = |one: &Pose, other: &Pose| (0..3).map(|axis| (one.centre[axis] - other.centre[axis]).powi(2)).sum::<f64>().sqrt();
    let distance = pairs().map(|(one, other)| apart(one, other)).fold(0.0, f64::max);
    let angle = pairs().map(|(one, other)| one.attitude.angle_to(&other.attitude.orientation)).fold(0.0, f64::max);
    analysis.notes.push(format!(
        "the object turns: the verdict is about small motions near the rest under the constant forces of the hands, copies {distance:.3e} m and {angle:.3e} rad apart"
    ));
    if scene.object.enclosure.is_some() {
        analysis.notes.push("the enclosure is left out: the scene is analysed away from its walls".to_owned());
    }
    Ok(analysis)
}

/// Analyses small motions of an object that turns about the steady spin that torques of the hands drive. Each peer is a class of its own.
pub(crate) fn analyse_spinning(scene: &Scene, watch: &dyn Watch) -> Result<Analysis, AnalysisError> {
    let network = NominalNetwork::of(scene)?;
    let spin = Spin::of(scene, &network, watch)?;
    spin.together.turning().cost().begin(watch)?;
    let (matrix, error) = spin.monodromy(scene, watch).ok_or(AnalysisError::Stopped)?;
    if watch.stops() {
        return Err(AnalysisError::Stopped);
    }
    let structure = &spin.together.structure;
    let radius = bounded_radius(&matrix, error);
    let parts = vec![Part { kind: PartKind::Whole, size: matrix.rows(), copies: 1, radius, method: Method::Full }];
    let mode = ContactMode {
        motion: "translations and turns together".to_owned(),
        contacts: String::new(),
        radius: radius_of(&parts),
        parts,
        rigid_modes: spin.together.turning().size() - matrix.rows(),
        dimension: matrix.rows(),
        frame: structure.timetable.frame,
    };
    let mut analysis = combine(vec![mode], Method::Full, &network, scene);
    analysis.notes.retain(|note| note != UNLOADED);
    let [x, y, z] = spin.axis;
    analysis.notes.push(format!(
        "the object turns: the verdict is about small motions near a steady spin of {:.6} rad/s about ({x:.3}, {y:.3}, {z:.3}), copies {:.3e} rad apart",
        spin.rate,
        spin.apart()
    ));
    if scene.object.enclosure.is_some() {
        analysis.notes.push("the enclosure is left out: the scene is analysed away from its walls".to_owned());
    }
    Ok(analysis)
}

/// Returns the peers of a scene, linearised at the rest under constant forces of the hands, and their poses at that rest.
fn loaded(scene: &Scene, network: &NominalNetwork, watch: &dyn Watch) -> Result<(Together, Vec<Pose>), AnalysisError> {
    let structure = Structure::of_each(scene, network, &contacts(scene)?)?;
    allowed(&structure, watch)?;
    if structure.silent {
        return Err(AnalysisError::NoRest { why: "a link never delivers, and the samples of the beginning are a load of their own".to_owned() });
    }
    let mut together = Together::new(scene, structure);
    let loaded = Loaded::new(scene, &together.nodes)?;
    let poses = loaded.rest()?;
    let (nodes, candidates) = (loaded.stressed(&poses), loaded.together(&poses));
    // Which displacements are free depends on a frame of the loaded nodes, so the nodes must be in place first.
    (together.nodes, together.free) = (nodes, Vec::new());
    together.free = rigid::unmoved(&together.turning(), candidates);
    Ok((together, poses))
}

/// Returns the largest radius of all parts over a frame of the scene, without a bound of its error.
pub(crate) fn radius(together: &Together, workspace: &mut Workspace) -> Radius {
    let structure = &together.structure;
    let mut of = |turning: &Turning<'_>| {
        let (matrix, _) = turning.monodromy(&Unwatched).expect("without a watch nothing ends it");
        Radius { value: workspace.radius(&matrix), error: 0.0 }
    };
    let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
    let mut worst = of(&together.turning());
    for (class, timetable) in structure.apart.iter().enumerate() {
        let Some(timetable) = timetable else { continue };
        let radius = of(&together.apart(class, timetable, &weight)).over(repeats(&structure.timetable, timetable));
        worst = worse::<false>(worst, radius);
    }
    worst
}

fn mode(scene: &Scene, network: &NominalNetwork, method: Method, watch: &dyn Watch) -> Result<ContactMode, AnalysisError> {
    let contacts = contacts(scene)?;
    let one_by_one = method == Method::Full;
    let structure = if one_by_one { Structure::of_each(scene, network, &contacts)? } else { Structure::of(&[scene], network, &contacts)? };
    allowed(&structure, watch)?;
    mode_of(&Together::new(scene, structure), method, watch)
}

/// Analyses the parts of a scene: the system of the classes' averages, and the differences within each class of several peers.
pub(crate) fn mode_of(together: &Together, method: Method, watch: &dyn Watch) -> Result<ContactMode, AnalysisError> {
    let (structure, turning) = (&together.structure, together.turning());
    let kind = if method == Method::Full { PartKind::Whole } else { PartKind::Together };
    let mut parts = vec![part(&turning, kind, 1, method, watch)?];
    let mut dimension = 0;
    let mut rigid_modes = turning.free.len();
    let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
    for (class, members) in structure.classes.iter().enumerate() {
        let node = together.node(class);
        rigid_modes += members.len() * node.loose().count();
        dimension += members.len() * (node.states() + frame::SAMPLE * structure.timetable.depth[class]);
        let Some(timetable) = &structure.apart[class] else { continue };
        let apart = together.apart(class, timetable, &weight);
        let part = part(&apart, PartKind::Apart { peer: members[0] }, members.len() - 1, method, watch)?;
        parts.push(Part { radius: part.radius.over(repeats(&structure.timetable, timetable)), ..part });
    }
    Ok(ContactMode {
        motion: "translations and turns together".to_owned(),
        contacts: String::new(),
        radius: radius_of(&parts),
        parts,
        rigid_modes,
        dimension: dimension - rigid_modes,
        frame: structure.timetable.frame,
    })
}

/// Returns the number of frames of `own`, the timetable of one class, in a frame of `all`, the timetable of the scene.
fn repeats(all: &Timetable, own: &Timetable) -> u32 {
    let nanos = |frame: Duration| frame.as_nanos().max(1);
    u32::try_from(nanos(all.frame) / nanos(own.frame)).unwrap_or(u32::MAX)
}

fn part(turning: &Turning<'_>, kind: PartKind, copies: usize, method: Method, watch: &dyn Watch) -> Result<Part, AnalysisError> {
    turning.cost().begin(watch)?;
    let (matrix, error) = turning.monodromy(watch).ok_or(AnalysisError::Stopped)?;
    // The computation of eigenvalues does not ask the watcher, so this is the last chance to stop.
    if watch.stops() {
        return Err(AnalysisError::Stopped);
    }
    let radius = bounded_radius(&matrix, error);
    watch.done(eigenvalue_operations(matrix.rows()));
    let method = if method == Method::Full { Method::Full } else { Method::Reduced };
    Ok(Part { kind, size: matrix.rows(), copies, radius, method })
}
