//! The parts of a scene that do not mix, and the spectral radius of each.

use std::time::Duration;

use cohaptic_peer::StepMap;
use cohaptic_scene::Scene;

use crate::lifted::{Autonomous, Lifted, Node};
use crate::spectrum::bounded_radius;
use crate::structure::{Structure, device_plant};
use crate::{Matrix, Method, Radius};

/// A part of a scene that moves on its own.
#[derive(Clone, PartialEq, Debug)]
pub struct Part {
    /// What moves.
    pub kind: PartKind,
    /// How many states it has.
    pub size: usize,
    /// How many equal ones there are, of all axes.
    pub copies: usize,
    /// Its spectral radius over one frame.
    pub radius: Radius,
    /// How it was found.
    pub method: Method,
}

/// What moves in a part of a scene.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum PartKind {
    /// The whole scene, by the general path.
    Whole,
    /// What the peers of each class do on average.
    Together,
    /// How equal peers differ from their average.
    Apart {
        /// The first peer of the class, by its place in [`Scene::peers`].
        peer: usize,
    },
    /// Equal peers on a graph, along one eigenvector of its averaging matrix.
    Mode {
        /// The eigenvalue.
        weight: f64,
    },
    /// A device that touches nothing.
    LooseDevice {
        /// The first such peer, by its place in [`Scene::peers`].
        peer: usize,
    },
}

impl Part {
    pub(crate) const fn whole(radius: Radius, size: usize) -> Self {
        Self { kind: PartKind::Whole, size, copies: 1, radius, method: Method::Full }
    }
}

/// All parts of a scene.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Reduced {
    pub(crate) parts: Vec<Part>,
    pub(crate) rigid_modes: usize,
    /// The states of the whole scene, rigid-body modes left out.
    pub(crate) dimension: usize,
    pub(crate) frame: Duration,
}

/// The largest radius of several parts.
pub(crate) fn radius_of(parts: &[Part]) -> Radius {
    parts.iter().map(|part| part.radius).reduce(Radius::or).unwrap_or(Radius { value: 0.0, error: 0.0 })
}

/// Takes a scene apart along that many equal axes.
pub(crate) fn reduced(structure: &Structure, scene: &Scene, axes: usize, method: Method) -> Reduced {
    let nodes: Vec<Node> = (0..structure.classes.len()).map(|class| structure.node(scene, class)).collect();
    let quotient = structure.quotient(scene, &nodes);
    let mut parts = Vec::new();
    let mut rigid_modes = usize::from(!structure.tied);
    let mut dimension = 0;
    parts.push(lifted_part(&quotient, PartKind::Together, axes, method));
    for (class, members) in structure.classes.iter().enumerate() {
        let node = &nodes[class];
        // Each sample is a position and a velocity.
        dimension += members.len() * (node.states() + 2 * structure.timetable.depth[class]);
        if let Some(timetable) = &structure.apart[class] {
            let weight = Matrix::from_fn(1, 1, |_, _| structure.difference_weight());
            let apart = Lifted { nodes: &nodes[class..=class], weights: &weight, timetable, tied: true, ..quotient };
            let part = lifted_part(&apart, PartKind::Apart { peer: members[0] }, (members.len() - 1) * axes, method);
            // A class on its own may repeat more often than the whole scene.
            let frames = structure.timetable.frame.as_nanos() / timetable.frame.as_nanos().max(1);
            parts.push(Part { radius: part.radius.over(u32::try_from(frames).unwrap_or(u32::MAX)), ..part });
        }
        if let Some((part, rigid)) = alone(structure, scene, class, axes) {
            parts.push(part);
            rigid_modes += rigid;
            dimension += 2 * members.len();
        }
    }
    Reduced { parts, rigid_modes: rigid_modes * axes, dimension: (dimension - rigid_modes) * axes, frame: structure.timetable.frame }
}

/// From how many rows on a matrix is replaced by the determinant, whose cost grows with the number of signals and little with their delay.
const LARGE: usize = 160;
/// Up to how many signals the determinant is small.
const FEW: usize = 32;

/// The part of a scene that a lifted system is.
pub(crate) fn lifted_part(lifted: &Lifted<'_>, kind: PartKind, copies: usize, method: Method) -> Part {
    let frame = lifted.frame(&mut Autonomous);
    let size = frame.size();
    let long = method == Method::Determinant && frame.history() > 0 || size > LARGE && frame.signals() <= FEW;
    let delayed = if long { frame.delayed_loop().ok() } else { None };
    match delayed {
        Some(delayed) => Part { kind, size, copies, radius: delayed.bounded_radius(frame.error), method: Method::Determinant },
        None => Part { kind, size, copies, radius: bounded_radius(&frame.monodromy(), frame.error), method: Method::Reduced },
    }
}

/// The devices of a class if they touch nothing, and how many rigid-body modes they have along one axis.
pub(crate) fn alone(structure: &Structure, scene: &Scene, class: usize, axes: usize) -> Option<(Part, usize)> {
    let members = &structure.classes[class];
    (!structure.touching[class]).then(|| {
        let (radius, size) = loose_device(structure, scene, class);
        (
            Part { kind: PartKind::LooseDevice { peer: members[0] }, size, copies: members.len() * axes, radius, method: Method::Reduced },
            members.len() * (2 - size),
        )
    })
}

/// A device that touches nothing: its velocity and, if an arm ties it to ground, its position.
pub(crate) fn loose_device(structure: &Structure, scene: &Scene, class: usize) -> (Radius, usize) {
    let spec = &scene.peers[structure.classes[class][0]];
    let (short, long) = spec.clock.spans();
    let plant = device_plant(spec);
    // A frame is so many ticks; of a clock that drifts, some are longer by a nanosecond. Their steps commute.
    let frame = structure.timetable.frame.as_nanos();
    let ticks = frame / short.as_nanos().max(1);
    let longer = if long == short { 0 } else { frame - ticks * short.as_nanos() };
    let time = (plant.mass / plant.stiffness).sqrt().min(structure.timetable.frame.as_secs_f64());
    let step = |span| step_matrix(&plant.step(span, scene.integrator), time);
    let (mut matrix, mut error) = power(&step(short), ticks - longer);
    if longer > 0 {
        let (other, other_error) = power(&step(long), longer);
        error = error * other.frobenius_norm() + other_error * matrix.frobenius_norm();
        matrix = matrix.times(&other);
    }
    let radius = bounded_radius(&matrix, error);
    (radius, matrix.rows())
}

/// One step of a body, velocities multiplied by `time`: of its velocity alone if nothing ties it to ground.
fn step_matrix(map: &StepMap, time: f64) -> Matrix {
    let ([[e00, e01], [e10, e11]], _) = map.coefficients();
    if map.is_free() {
        return Matrix::from_fn(1, 1, |_, _| 1.0 + e11);
    }
    let entries = [[1.0 + e00, e01 / time], [e10 * time, 1.0 + e11]];
    Matrix::from_fn(2, 2, |row, column| entries[row][column])
}

/// A power by repeated squaring, and a bound of its rounding errors in the 2-norm: each product adds those of its factors times the norms of the others, and
/// four roundings of its own.
fn power(base: &Matrix, exponent: u128) -> (Matrix, f64) {
    let times = |(one, one_error): &(Matrix, f64), (other, other_error): &(Matrix, f64)| {
        let (norm, other_norm) = (one.frobenius_norm(), other.frobenius_norm());
        (one.times(other), one_error * other_norm + norm * other_error + 4.0 * f64::EPSILON * norm * other_norm)
    };
    let mut total = (Matrix::identity(base.rows()), 0.0);
    let mut square = (base.clone(), f64::EPSILON * base.frobenius_norm());
    let mut left = exponent;
    while left > 0 {
        if left % 2 == 1 {
            total = times(&total, &square);
        }
        square = times(&square, &square);
        left /= 2;
    }
    total
}
