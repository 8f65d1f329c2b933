//! Steady spin: all copies turn at one rate about one axis of the world, driven by torques of the hands along that axis.
//!
//! Samples are held, so a copy is drawn towards old attitudes. With KR the coordination brakes a spin ω by about KR·sin(ω·age), and a spin is steady only if
//! hands make up for this braking and for the damping. The motion repeats if seen from axes turning with the spin, and moving along its axis if the motion is a
//! screw: after a frame of T the state is the same but turned by ω·T. With Φ the frame of real peers ([`super::peers`]), the steady motion is a zero of Φ(z)
//! minus z turned by ω·T, and the slope of Φ there describes small motions. Displacements of everything together and the turn of everything about the axis are
//! removed from this slope.

use cohaptic_peer::rotation::{Attitude, Triple};
use cohaptic_peer::{Hand, Signal};
use cohaptic_scene::Scene;

use super::algebra::{add, apply, cross, transposed, turned, unit};
use super::frame::{SAMPLE, Turning};
use super::levenberg::zero;
use super::load::Pose;
use super::peers::{Bases, members, slope};
use super::together::{Together, allowed, contacts};
use crate::network::NominalNetwork;
use crate::structure::Structure;
use crate::timetable::Instants;
use crate::{AnalysisError, Matrix, Watch};

/// Steady spin of the peers of a scene.
#[derive(Clone, Debug)]
pub(super) struct Spin {
    pub(super) together: Together,
    /// Poses and earlier samples at the beginning of a frame.
    bases: Bases,
    /// State at the beginning of a frame relative to `bases`: positions and angles are zero, velocities are multiplied by the time unit \[m\].
    velocities: Vec<f64>,
    /// Axis of the spin, a unit vector in world axes.
    pub(super) axis: Triple,
    /// Angular velocity about `axis` [rad/s].
    pub(super) rate: f64,
}

/// Candidate for a steady spin.
#[derive(Clone, Debug)]
struct Motion {
    /// State at the beginning of a frame.
    state: Vec<f64>,
    /// Angular velocity about the axis [rad/s].
    rate: f64,
    /// Displacement along the axis per frame \[m\]. Grasps off the centre can turn the spin into a screw.
    climb: f64,
}

/// Torques of the hands and initial rate of a spin.
struct Drive {
    /// Direction of the torques, or of the initial angular velocity without torques: a unit vector in world axes.
    axis: Triple,
    /// Sum of the torques of all hands along the axis \[N·m\].
    torque: f64,
    /// Initial angular velocity of the object along the axis [rad/s].
    begun: f64,
}

fn none(why: impl Into<String>) -> AnalysisError {
    AnalysisError::NoSpin { why: why.into() }
}

impl Drive {
    /// Returns the drive of a scene, or [`AnalysisError::NoSpin`] if hands vary, push or tie the object, act about different axes, or drive nothing.
    fn of(scene: &Scene) -> Result<Self, AnalysisError> {
        let rotation = scene.rotation.as_ref().expect("the object turns");
        let mut torques = Vec::new();
        for (place, spec) in scene.peers.iter().enumerate().filter(|(_, spec)| spec.contact == cohaptic_peer::Contact::Grasp) {
            match rotation.peers[place].device.as_ref().and_then(|device| device.torque.as_ref()) {
                Some(Signal::Constant(torque)) => torques.push(*torque),
                Some(Signal::Sine { .. } | Signal::Table(_)) => return Err(none(format!("the torque of the hand of {} varies", spec.name))),
                None => {}
            }
            match &spec.hand {
                Some(Hand::Arm { .. } | Hand::Operator { .. }) => return Err(none(format!("the arm of {} ties the object to the world", spec.name))),
                Some(Hand::Force(Signal::Constant(force))) if force.iter().all(|component| *component == 0.0) => {}
                Some(Hand::Force(_)) => return Err(none(format!("the hand of {} pushes in one direction of the world", spec.name))),
                None => {}
            }
        }
        if let Some(late) = scene.peers.iter().find(|spec| spec.compute_delay) {
            return Err(none(format!("{} applies forces a tick late, and what waits is not a state here", late.name)));
        }
        let sum = torques.iter().fold([0.0; 3], |sum, torque| add(sum, *torque));
        let begun = rotation.peers[0].attitude;
        let along = if size(sum) > 0.0 { sum } else { begun.world_rate() };
        if size(along) == 0.0 {
            return Err(none("no hand exerts a torque, and the object begins at rest"));
        }
        let axis = along.map(|component| component / size(along));
        if torques.iter().any(|torque| size(cross(axis, *torque)) > 1e-12 * size(*torque)) {
            return Err(none("the torques of the hands are about different axes"));
        }
        Ok(Self { axis, torque: size(sum), begun: dot(axis, begun.world_rate()) })
    }
}

impl Spin {
    /// Finds the steady spin driven by the hands of a scene, near the initial attitude of the object.
    pub(super) fn of(scene: &Scene, network: &NominalNetwork, watch: &dyn Watch) -> Result<Self, AnalysisError> {
        let structure = Structure::of_each(scene, network, &contacts(scene)?)?;
        allowed(&structure, watch)?;
        if structure.silent {
            return Err(none("a link never delivers, and the samples of the beginning do not turn"));
        }
        let drive = Drive::of(scene)?;
        let together = Together { free: Vec::new(), ..Together::new(scene, structure) };
        let mut spin = Self { bases: Bases::resting(Vec::new(), &together.turning()), velocities: Vec::new(), axis: drive.axis, rate: 0.0, together };
        let rate = if drive.begun == 0.0 { spin.balance(scene, &drive) } else { drive.begun };
        spin.begin(scene, rate);
        if spin.settle(scene).is_err() {
            // Grasps off the axis move the axis, so the first guess may be too far from the steady spin. Simulated motion comes
            // nearer.
            spin.begin(scene, rate);
            spin.relax(scene);
            spin.settle(scene)?;
        }
        Ok(spin)
    }

    /// Returns the length of a frame \[s\].
    fn frame(&self) -> f64 {
        self.together.structure.timetable.frame.as_secs_f64()
    }

    /// Returns the age at the beginning of the frame of a peer's `number`-th latest earlier sample \[s\]; `number` counts from 1.
    fn age(&self, place: usize, number: usize) -> f64 {
        let timetable = &self.together.structure.timetable;
        let sent = Instants::of(timetable).sent_at(place, -i64::try_from(number).unwrap_or(0), timetable.frame);
        -1e-9 * approximate(sent)
    }

    /// Returns the rate of balance between the torque on one side and damping and the lag of the samples on the other [rad/s], for small angles of lag: a first
    /// guess of the spin.
    fn balance(&self, scene: &Scene, drive: &Drive) -> f64 {
        let structure = &self.together.structure;
        let lag = structure.timetable.depth.iter().enumerate().map(|(place, depth)| self.age(place, *depth)).fold(0.0, f64::max);
        let braked = |place: usize| {
            let config = scene.rotation_config(place).expect("the object turns");
            let along = apply(&transposed(&scene.rotation.as_ref().expect("the object turns").peers[place].attitude.matrix()), drive.axis);
            // Held samples of age τ brake a spin ω with about KR·ω·τ for small angles, like a damper of KR·τ.
            let spins = config.device.iter().filter(|_| self.together.nodes[place].touching).map(|device| device.handle.damping);
            let damping = spins.chain([config.copy.damping, config.gains.stiffness.map(|stiffness| lag * stiffness)]);
            damping.map(|damping| (0..3).map(|axis| along[axis] * along[axis] * damping[axis]).sum::<f64>()).sum::<f64>()
        };
        drive.torque / (0..scene.peers.len()).map(braked).sum::<f64>().max(f64::MIN_POSITIVE)
    }

    /// Sets the state to coinciding copies with an endless turn at `rate` [rad/s], the earlier samples included.
    fn begin(&mut self, scene: &Scene, rate: f64) {
        let rotation = scene.rotation.as_ref().expect("the object turns");
        let attitude = Attitude { rate: [0.0; 3], ..rotation.peers[0].attitude };
        let matrix = attitude.matrix();
        let pose = |grasp: Triple| Pose { centre: [0.0; 3], attitude, device: apply(&matrix, grasp), handle: attitude };
        let poses: Vec<Pose> = rotation.peers.iter().map(|peer| pose(peer.grasp)).collect();
        let earlier = |place: usize| {
            let back = |number: usize| turn(self.axis, -rate * self.age(place, number));
            let sampled = |number: usize| ([0.0; 3], Attitude { orientation: turned(back(number), attitude.orientation), rate: [0.0; 3] });
            (1..=self.together.structure.timetable.depth[place]).map(sampled).collect()
        };
        let samples = (0..poses.len()).map(earlier).collect();
        self.bases = Bases { poses, samples, seen_from: (turn(self.axis, rate * self.frame()), [0.0; 3]) };
        self.rate = rate;
        let (nodes, time) = (&self.together.nodes, self.together.time());
        let body_rate = apply(&transposed(&matrix), self.axis.map(|component| rate * component));
        let mut z = Vec::new();
        for node in nodes {
            let spun = body_rate.map(|component| component * node.length * time);
            // Positions are zero, since the state counts from the bases. The grasp moves with ω × r.
            let [vx, vy, vz] = cross(self.axis, apply(&matrix, node.grasp)).map(|component| component * rate * time);
            z.extend([0.0; 9]);
            z.extend(spun);
            z.extend(vec![0.0; node.device.len()]);
            let device = [vx, vy, vz, spun[0], spun[1], spun[2]];
            z.extend(&device[..node.device.len()]);
            if !node.touching {
                let devices = node.device.len();
                let length = z.len();
                z[length - devices..].fill(0.0);
            }
        }
        for (node, depth) in nodes.iter().zip(&self.together.structure.timetable.depth) {
            for _ in 0..*depth {
                z.extend([0.0; 9]);
                z.extend(body_rate.map(|component| component * node.length * time));
            }
        }
        self.velocities = z;
    }

    /// Simulates frames until the turn per frame no longer changes, or for a limited number of frames, and takes the rate from the last frame.
    fn relax(&mut self, scene: &Scene) {
        const FRAMES: usize = 40_000;
        let turning = self.together.turning();
        let mut members = hands(scene);
        self.bases.seen_from = (Attitude::REST.orientation, [0.0; 3]);
        let mut turned_by = 0.0;
        for _ in 0..FRAMES {
            let from = self.bases.poses[0].attitude;
            let reached = self.bases.reached(&mut members, &turning, &self.velocities);
            self.bases = self.bases.clone().moved_to(&turning, &reached);
            self.velocities = reached;
            // The bases have moved to the reached positions and angles, and the states count from the bases.
            positions(&turning).into_iter().for_each(|state| self.velocities[state] = 0.0);
            let before = std::mem::replace(&mut turned_by, dot(self.axis, self.bases.poses[0].attitude.rotation_from(&from.orientation)));
            if (turned_by - before).abs() <= 1e-13 {
                break;
            }
        }
        self.rate = turned_by / self.frame();
        self.bases.seen_from = (turn(self.axis, turned_by), [0.0; 3]);
    }

    /// Finds the steady spin near the present state; [`AnalysisError::NoSpin`] if no zero is found.
    fn settle(&mut self, scene: &Scene) -> Result<(), AnalysisError> {
        let turning = self.together.turning();
        let kept: Vec<usize> = turning.kept();
        let span = self.frame() * turning.nodes[0].length;
        let seen = |rate: f64, climb: f64| (turn(self.axis, rate * self.frame()), self.axis.map(|component| component * climb));
        let placed = |motion: &Motion| Bases { seen_from: seen(motion.rate, motion.climb), ..self.bases.clone() };
        let residual = |motion: &Motion| -> Vec<f64> {
            let reached = placed(motion).reached(&mut hands(scene), &turning, &motion.state);
            kept.iter().map(|state| reached[*state] - motion.state[*state]).collect()
        };
        // The unknowns are the kept states, the rate and the climb, more than there are equations: a displacement or a turn of everything along the axis
        // changes no residual. Levenberg's method does not need a regular matrix.
        let moved = |motion: &Motion, by: &[f64]| {
            let mut moved = Motion { rate: motion.rate + by[kept.len()] / span, climb: motion.climb + by[kept.len() + 1], ..motion.clone() };
            kept.iter().zip(by).for_each(|(state, by)| moved.state[*state] += by);
            moved
        };
        let begun = Motion { state: self.velocities.clone(), rate: self.rate, climb: 0.0 };
        let (found, left) = zero(begun, kept.len() + 2, residual, moved);
        // A frame rounds velocities of some metres per second, multiplied by the time unit, some hundred times. A larger residual is not rounding.
        if left.is_nan() || left > 1e-11 {
            return Err(none(format!("no steady spin near {:.3} rad/s: frames are {left:.1e} m apart", self.rate)));
        }
        let bases = placed(&found).moved_to(&turning, &found.state);
        let mut velocities = found.state;
        positions(&turning).into_iter().for_each(|state| velocities[state] = 0.0);
        (self.bases, self.velocities, self.rate) = (bases, velocities, found.rate);
        Ok(())
    }

    /// Returns the largest angle between the attitudes of two copies \[rad\].
    pub(super) fn apart(&self) -> f64 {
        let poses = &self.bases.poses;
        let angles = poses.iter().flat_map(|one| poses.iter().map(move |other| one.attitude.angle_to(&other.attitude.orientation)));
        angles.fold(0.0, f64::max)
    }

    /// Returns the slope of a frame at the steady spin, without displacements of everything and the turn of everything about the axis, and an estimate of the
    /// error of its entries; `None` if the watcher ends the computation.
    pub(super) fn monodromy(&self, scene: &Scene, watch: &dyn Watch) -> Option<(Matrix, f64)> {
        let turning = self.together.turning();
        let (symmetries, references) = self.symmetries(&turning);
        let kept: Vec<usize> = turning.kept().into_iter().filter(|state| !references.contains(state)).collect();
        let (mut matrix, mut error) = (Matrix::zeros(kept.len(), kept.len()), 0.0_f64);
        for (column, state) in kept.iter().enumerate() {
            if watch.stops() {
                return None;
            }
            let (slope, change) = slope(|size| {
                let mut z = self.velocities.clone();
                z[*state] += size;
                self.bases.reached(&mut hands(scene), &turning, &z)
            });
            error = error.max(change);
            for (row, target) in kept.iter().enumerate() {
                let along: f64 = symmetries.iter().zip(&references).map(|(symmetry, reference)| slope[*reference] * symmetry[*target]).sum();
                matrix[(row, column)] = slope[*target] - along;
            }
        }
        Some((matrix, error))
    }

    /// Returns the directions of the three displacements of everything and of the turn of everything about the axis, and the reference state of each. A
    /// direction is 1 in its own reference and 0 in the other references.
    fn symmetries(&self, turning: &Turning<'_>) -> (Vec<Vec<f64>>, Vec<usize>) {
        let mut symmetries: Vec<Vec<f64>> = (0..4).map(|which| self.symmetry(turning, which)).collect();
        let mut references = Vec::new();
        for place in 0..symmetries.len() {
            // The largest component as reference keeps the division exact to rounding. Elimination then makes the other directions zero in this reference.
            let reference = (0..6).max_by(|a, b| symmetries[place][*a].abs().total_cmp(&symmetries[place][*b].abs())).unwrap_or(0);
            let own = symmetries[place][reference];
            symmetries[place].iter_mut().for_each(|entry| *entry /= own);
            let chosen = symmetries[place].clone();
            for (_, other) in symmetries.iter_mut().enumerate().filter(|(other, _)| *other != place) {
                let factor = other[reference];
                other.iter_mut().zip(&chosen).for_each(|(entry, by)| *entry -= factor * by);
            }
            references.push(reference);
        }
        (symmetries, references)
    }

    /// Returns the direction of the displacement of everything along the world axis `which`, or for `which` = 3 of the turn about the axis of the spin.
    fn symmetry(&self, turning: &Turning<'_>, which: usize) -> Vec<f64> {
        let mut state = Vec::new();
        let moved = |point: Triple, length: f64| if which < 3 { unit(which) } else { cross(self.axis, point).map(|way| way / length) };
        let spun = |attitude: &Attitude| if which < 3 { [0.0; 3] } else { apply(&transposed(&attitude.matrix()), self.axis) };
        // A turn of everything turns velocities too. Velocities in a state are multiplied by the time unit, as here.
        let faster = |velocity: &[f64], length: f64| {
            if which < 3 { [0.0; 3] } else { cross(self.axis, [velocity[0], velocity[1], velocity[2]]).map(|way| way / length) }
        };
        let mut next = 0;
        for (node, pose) in turning.nodes.iter().zip(&self.bases.poses) {
            let (z, devices) = (&self.velocities[next..], node.device.len());
            next += node.states();
            state.extend([moved(pose.centre, node.length), spun(&pose.attitude), faster(&z[6..], node.length), [0.0; 3]].concat());
            let held = [moved(pose.device, node.length), spun(&pose.handle)].concat();
            let moving = [faster(&z[12 + devices..], node.length), [0.0; 3]].concat();
            let touching = if node.touching { 1.0 } else { 0.0 };
            state.extend(held[..devices].iter().chain(&moving[..devices]).map(|entry| touching * entry));
        }
        for (node, samples) in turning.nodes.iter().zip(&self.bases.samples) {
            for (centre, attitude) in samples {
                let z = &self.velocities[next..];
                next += SAMPLE;
                state.extend([moved(*centre, node.length), spun(attitude), faster(&z[6..], node.length), [0.0; 3]].concat());
            }
        }
        state
    }
}

#[cfg(test)]
impl Spin {
    /// Asserts that a hundred frames leave the spin unchanged, and that a frame maps each symmetry to a combination of the symmetries.
    pub(super) fn assert_steady(&self, scene: &Scene) {
        let turning = self.together.turning();
        let kept = turning.kept();
        let mut state = self.velocities.clone();
        for frame in 0..100 {
            state = self.bases.reached(&mut hands(scene), &turning, &state);
            let away = kept.iter().map(|place| (state[*place] - self.velocities[*place]).abs()).fold(0.0, f64::max);
            assert!(away < 1e-9, "after {frame} frames {away} m away");
        }
        let (symmetries, references) = self.symmetries(&turning);
        for (which, symmetry) in symmetries.iter().enumerate() {
            let (reached, _) = slope(|size| {
                let z: Vec<f64> = self.velocities.iter().zip(symmetry).map(|(z, by)| z + size * by).collect();
                self.bases.reached(&mut hands(scene), &turning, &z)
            });
            let among = |place: usize| symmetries.iter().zip(&references).map(|(by, reference)| reached[*reference] * by[place]).sum::<f64>();
            let left = kept.iter().map(|place| (reached[*place] - among(*place)).abs()).fold(0.0, f64::max);
            assert!(left < 1e-7, "symmetry {which}: {left}");
        }
    }
}

/// Returns the peers of the scene with their hands.
fn hands(scene: &Scene) -> Vec<super::peers::Member> {
    members(scene, |place| scene.peers[place].hand.clone())
}

/// Converts nanoseconds to a real number.
#[expect(clippy::cast_precision_loss, reason = "below 2⁵³, some hundred days")]
const fn approximate(nanos: i64) -> f64 {
    nanos as f64
}

/// Returns the indices of positions and angles among the states.
fn positions(turning: &Turning<'_>) -> Vec<usize> {
    let (mut next, mut states) = (0, Vec::new());
    for node in turning.nodes {
        states.extend((next..next + 6).chain(next + 12..next + 12 + node.device.len()));
        next += node.states();
    }
    for _ in 0..turning.timetable.depth.iter().sum::<usize>() {
        states.extend(next..next + 6);
        next += SAMPLE;
    }
    states
}

/// Returns the quaternion of a turn by `angle` \[rad\] about a unit vector.
fn turn(axis: Triple, angle: f64) -> [f64; 4] {
    let (sine, cosine) = libm::sincos(0.5 * angle);
    [cosine, sine * axis[0], sine * axis[1], sine * axis[2]]
}

fn size(vector: Triple) -> f64 {
    dot(vector, vector).sqrt()
}

fn dot(a: Triple, b: Triple) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
