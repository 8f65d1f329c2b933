//! Splits a linear scene into independent parts, and computes the spectral radius of each part.

use std::time::Duration;

use cohaptic_peer::{Plant, StepMap};
use cohaptic_scene::Scene;

use crate::cost::{PartCost, eigenvalue_operations};
use crate::lifted::{Autonomous, Lifted, Sizes};
use crate::spectrum::bounded_radius;
use crate::structure::Structure;
use crate::{AnalysisError, Matrix, Method, Radius, Watch};

/// A part of a scene with a motion independent of the other parts.
#[derive(Clone, PartialEq, Debug)]
pub struct Part {
    /// Described motion.
    pub kind: PartKind,
    /// Number of states of the part.
    pub size: usize,
    /// Number of equal parts for which this part stands, counted over all axes.
    pub copies: usize,
    /// Spectral radius of the part over one frame.
    pub radius: Radius,
    /// Method by which the radius was found.
    pub method: Method,
}

/// Motion described by a part of a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum PartKind {
    /// The whole scene, by the general path.
    Whole,
    /// The averages of the peers of each class.
    Together,
    /// The differences of equal peers from their average.
    Apart {
        /// The first peer of the class, by its place in [`Scene::peers`].
        peer: usize,
    },
    /// The motion of equal peers on a graph along one eigenvector of the graph's averaging matrix.
    Mode {
        /// Eigenvalue of the averaging matrix.
        weight: f64,
    },
    /// A device that touches nothing.
    LooseDevice {
        /// The first such peer, by its place in [`Scene::peers`].
        peer: usize,
    },
}

impl PartKind {
    /// Returns the name of the kind in JSON.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Whole => "whole",
            Self::Together => "together",
            Self::Apart { .. } => "apart",
            Self::Mode { .. } => "mode",
            Self::LooseDevice { .. } => "loose-device",
        }
    }

    /// Returns the first peer of the part, as an index of [`Scene::peers`], or `None` if the part is about all peers.
    #[must_use]
    pub const fn peer(self) -> Option<usize> {
        match self {
            Self::Whole | Self::Together | Self::Mode { .. } => None,
            Self::Apart { peer } | Self::LooseDevice { peer } => Some(peer),
        }
    }
}

impl Part {
    pub(crate) const fn whole(radius: Radius, size: usize) -> Self {
        Self { kind: PartKind::Whole, size, copies: 1, radius, method: Method::Full }
    }
}

/// All parts of a linear scene.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Reduced {
    pub(crate) parts: Vec<Part>,
    pub(crate) rigid_modes: usize,
    /// Number of states of the whole scene, without the rigid-body modes.
    pub(crate) dimension: usize,
    pub(crate) frame: Duration,
}

/// Returns the largest radius of several parts; 0 if there is no part.
pub(crate) fn radius_of(parts: &[Part]) -> Radius {
    parts.iter().map(|part| part.radius).reduce(Radius::or).unwrap_or(Radius { value: 0.0, error: 0.0 })
}

/// Splits a scene, the representative of `axes` equal axes, into parts and computes their radii. The watch is asked before and within each part.
pub(crate) fn reduced(structure: &Structure, scene: &Scene, axes: usize, method: Method, watch: &dyn Watch) -> Result<Reduced, AnalysisError> {
    let nodes = structure.nodes(scene);
    let quotient = structure.quotient(scene, &nodes);
    let mut parts = Vec::new();
    let mut rigid_modes = usize::from(!structure.tied);
    let mut dimension = 0;
    parts.push(lifted_part(&quotient, PartKind::Together, axes, method, watch)?);
    for (class, members) in structure.classes.iter().enumerate() {
        let node = &nodes[class];
        // Each sample is a position and a velocity. An operator remembers the places that it has seen.
        let seen = node.operator.map_or(0, |operator| operator.lag);
        dimension += members.len() * (node.states() + 2 * structure.timetable.depth[class] + seen);
        if let Some(timetable) = &structure.apart[class] {
            let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
            let nodes = Structure::apart(&nodes, class);
            let apart = Lifted { nodes: &nodes, weights: &weight, timetable, tied: true, ..quotient };
            let part = lifted_part(&apart, PartKind::Apart { peer: members[0] }, (members.len() - 1) * axes, method, watch)?;
            // A class on its own may repeat more often than the whole scene.
            // Radii of all parts must count over the same span, or the largest radius would not be the scene's.
            let frames = structure.timetable.frame.as_nanos() / timetable.frame.as_nanos().max(1);
            parts.push(Part { radius: part.radius.over(u32::try_from(frames).unwrap_or(u32::MAX)), ..part });
        }
        if let Some((part, rigid)) = alone(structure, scene, class, axes) {
            parts.push(part);
            rigid_modes += rigid;
            dimension += 2 * members.len();
        }
    }
    Ok(Reduced { parts, rigid_modes: rigid_modes * axes, dimension: (dimension - rigid_modes) * axes, frame: structure.timetable.frame })
}

/// Number of rows above which a matrix is replaced by the determinant. The cost of the determinant grows with the number of signals and little with their
/// delay. The number where both cost the same is between 300 and 1000, by docs/measured-stability.md.
const LARGE: usize = 500;
/// Largest number of signals for an unrequested determinant. With few signals the determinant is small.
const FEW: usize = 32;

/// Largest number of signals for a requested determinant. The determinant's matrix has a row and a column per signal. With drifting clocks a frame can last
/// minutes and have 50,000 signals. The matrix would then take 40 GB.
const MOST_SIGNALS: usize = 1024;

/// Computes the radius of a lifted system and returns the part of the scene described by the system.
///
/// # Errors
///
/// [`AnalysisError::TooMuchMemory`] beyond what the watch allows; [`AnalysisError::Stopped`] if the watch stops the analysis.
pub fn lifted_part(lifted: &Lifted<'_>, kind: PartKind, copies: usize, method: Method, watch: &dyn Watch) -> Result<Part, AnalysisError> {
    let Sizes { states: size, history, signals } = lifted.sizes();
    // The places that an operator has seen are as many eigenvalues at zero, and rounding spreads those of a matrix so far that its bound says nothing. The
    // determinant has none of them.
    let asked = (method == Method::Determinant || lifted.has_operators()) && history > 0 && signals <= MOST_SIGNALS;
    let long = asked || size > LARGE && signals <= FEW;
    // The watch cannot stop the computation of eigenvalues, and the frame itself may be too large a matrix, so the cost is checked first.
    let cost = PartCost::of_eigenvalues(size);
    if !long {
        cost.begin(watch)?;
    }
    let frame = lifted.frame_watched(&mut Autonomous, watch).ok_or(AnalysisError::Stopped)?;
    debug_assert_eq!((size, history, signals), (frame.size(), frame.history(), frame.signals()));
    let delayed = if long { frame.delayed_loop().ok() } else { None };
    if let Some(delayed) = delayed {
        // The determinant has few rows and columns for any number of states, so its memory is negligible.
        let operations = delayed.operations();
        PartCost { states: size, bytes: 0.0, operations }.begin(watch)?;
        let radius = delayed.bounded_radius_watched(frame.error, watch).ok_or(AnalysisError::Stopped)?;
        return Ok(Part { kind, size, copies, radius, method: Method::Determinant });
    }
    if long {
        cost.begin(watch)?;
    }
    let radius = bounded_radius(&frame.monodromy(), frame.error);
    watch.done(eigenvalue_operations(size));
    Ok(Part { kind, size, copies, radius, method: Method::Reduced })
}

/// Returns the part of the loose devices of a class, and the number of the devices' rigid-body modes along one axis. A loose device touches nothing. `None` if
/// the class has no such devices.
pub fn alone(structure: &Structure, scene: &Scene, class: usize, axes: usize) -> Option<(Part, usize)> {
    let members = &structure.classes[class];
    structure.has_loose_devices(class).then(|| {
        let (radius, size) = loose_device(structure, scene, class);
        (
            Part { kind: PartKind::LooseDevice { peer: members[0] }, size, copies: members.len() * axes, radius, method: Method::Reduced },
            members.len() * (2 - size),
        )
    })
}

/// Returns the radius and the number of states of a loose device. The states are the velocity and, if an arm ties the device to ground, the position.
pub(crate) fn loose_device(structure: &Structure, scene: &Scene, class: usize) -> (Radius, usize) {
    let place = structure.classes[class][0];
    let (short, long) = scene.peers[place].clock.spans();
    let plant = scene.device_plant(place);
    // A frame is a whole number of ticks. If the clock drifts, some ticks are longer by a nanosecond; the steps of both lengths have the same eigenvectors,
    // so the radii are multiplied.
    let frame = structure.timetable.frame.as_nanos();
    let ticks = frame / short.as_nanos().max(1);
    let longer = if long == short { 0 } else { frame - ticks * short.as_nanos() };
    let over = |span, ticks: u128| step_radius(&plant.step(span, scene.integrator), &plant, span).over(u32::try_from(ticks).unwrap_or(u32::MAX));
    let (some, others) = (over(short, ticks - longer), over(long, longer));
    // The relative errors of the factors add up: |(a + α)(b + β) − ab| ≤ α·(b + β) + a·β, and the product rounds once.
    let value = some.value * others.value;
    let error = some.error * (others.value + others.error) + some.value * others.error + f64::EPSILON * value;
    // A bound that overflowed over the frame says nothing.
    let radius = if error.is_finite() { Radius { value, error } } else { Radius::UNKNOWN };
    (radius, if plant.stiffness > 0.0 { 2 } else { 1 })
}

/// Returns the spectral radius of one step of a body. If nothing ties the body to ground, only the velocity counts.
fn step_radius(map: &StepMap, plant: &Plant, span: Duration) -> Radius {
    let ([[e00, e01], [e10, e11]], _) = map.coefficients();
    let rounding = 32.0 * f64::EPSILON * plant.rounding_factor(span);
    if map.is_free() {
        // A free body has the eigenvalue 1 for its position, a displacement without a force, and 1 + e11 for its velocity.
        return Radius { value: (1.0 + e11).abs(), error: 2.0 * f64::EPSILON + rounding * e11.abs() };
    }
    // The eigenvalues are 1 + middle ± √discriminant; nearly equal eigenvalues, of a body next to critical damping, are only as sure as the square root.
    let (middle, half, product) = (1.0 + 0.5 * (e00 + e11), 0.5 * (e00 - e11), e01 * e10);
    let modulus = |discriminant: f64| {
        if discriminant < 0.0 { (middle * middle - discriminant).sqrt() } else { middle.abs() + discriminant.sqrt() }
    };
    let discriminant = half * half + product;
    let doubt = rounding * ((e00.abs() + e11.abs()).powi(2) + product.abs());
    let (below, above) = (modulus(discriminant - doubt), modulus(discriminant + doubt));
    let value = modulus(discriminant);
    // With a discriminant of uncertain sign the eigenvalues may be equal, so the modulus may be as small as |middle|.
    let lowest = if discriminant.abs() <= doubt { middle.abs() } else { below.min(above) };
    let error = (below.max(above) - value).max(value - lowest) + rounding * (e00.abs() + e11.abs()) + 4.0 * f64::EPSILON * value;
    Radius { value, error }
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::Integrator;

    use super::*;

    /// m = 1 kg, b² = 4·m·k to thirteen digits: e^(−b·h/2m ± √(b² − 4mk)·h/2m) within the bound, which is not more than a root of the rounding allows.
    #[test]
    fn a_body_next_to_critical_damping_is_within_its_bound() {
        let span = Duration::from_millis(1);
        for excess in [0.0_f64, 1e-12, 1e-9, -1e-9, 1e-3, -1e-3, 1.0] {
            let plant = Plant { mass: 1.0, damping: 0.25 + excess, stiffness: 0.015_625 };
            let found = step_radius(&plant.step(span, Integrator::Exact), &plant, span);
            // b² − 4mk without cancellation, of the damping as rounded.
            let excess = plant.damping - 0.25;
            let square = 0.5 * excess + excess * excess;
            let slowest = -0.5 * plant.damping + if square > 0.0 { 0.5 * square.sqrt() } else { 0.0 };
            let expected = libm::exp(slowest * 1e-3);
            assert!((found.value - expected).abs() <= found.error, "{excess:e}: {found:?} is not {expected}");
            assert!(found.error < 1e-10, "{found:?}");
        }
    }
}
