//! Frame of simulated peers, in the coordinates of a [`Turning`] about given poses. The linear equations are compared with this frame, and a steady spin has
//! its slope from this frame.

use std::array::from_fn;

use cohaptic_peer::coordination::BuiltInStrategy;
use cohaptic_peer::rotation::{Attitude, Triple};
use cohaptic_peer::{Device as _, Hand, Held, ObjectCopy, Peer, SimulatedDevice, State};
use cohaptic_scene::{FromScene, Scene, Strategies};
use cohaptic_units::Instant;

use super::algebra::{apply, turned};
use super::frame::{SAMPLE, Turning};
use super::load::Pose;
use super::node::Node;
use crate::timetable::{Event, Instants};

pub(super) type Member = Peer<3, SimulatedDevice<3>, BuiltInStrategy<3>>;

/// Local time of every clock at the beginning of a frame \[ns\]. Large, so that samples of earlier frames have positive instants.
const EARLIER: i64 = 1 << 60;

/// Origin of a state: the poses to which the positions and angles of a state are relative.
#[derive(Clone, Debug)]
pub(super) struct Bases {
    /// Pose of each peer.
    pub(super) poses: Vec<Pose>,
    /// Centre \[m\] and attitude of each copy's samples of earlier frames, the newest sample first.
    pub(super) samples: Vec<Vec<(Triple, Attitude)>>,
    /// Orientation and origin \[m\] of the axes in which positions, velocities and attitudes after the frame are expressed.
    pub(super) seen_from: ([f64; 4], Triple),
}

impl Bases {
    /// Returns the bases of peers that have always been at these poses, their samples included.
    pub(super) fn resting(poses: Vec<Pose>, turning: &Turning<'_>) -> Self {
        let samples = poses.iter().zip(&turning.timetable.depth).map(|(pose, depth)| vec![(pose.centre, pose.attitude); *depth]);
        Self { samples: samples.collect(), poses, seen_from: (Attitude::REST.orientation, [0.0; 3]) }
    }

    /// Returns the state of the peers after a frame from the state `z`. The late forces in `z` are ignored: each peer applies the forces that it computed last.
    /// In the returned state the late forces are zero.
    pub(super) fn reached(&self, members: &mut [Member], turning: &Turning<'_>, z: &[f64]) -> Vec<f64> {
        let (nodes, time, timetable) = (turning.nodes, turning.time, turning.timetable);
        self.put(members, turning, z);
        let mut next: usize = nodes.iter().map(Node::states).sum();
        let mut samples = Vec::new();
        for (node, bases) in nodes.iter().zip(&self.samples) {
            let earlier = z[next..next + bases.len() * SAMPLE].chunks_exact(SAMPLE).zip(bases);
            samples.push(earlier.rev().map(|(sample, base)| copy_of(sample, base, node, time)).collect::<Vec<_>>());
            next += bases.len() * SAMPLE;
        }
        let instants = Instants::of(timetable);
        let hold = |members: &mut [Member], samples: &[Vec<(State<3>, Attitude)>], (to, from, sample): (usize, usize, i64)| {
            let earlier = i64::try_from(timetable.depth[from]).unwrap_or(0);
            let (state, attitude) = samples[from][usize::try_from(earlier + sample).unwrap_or(0)];
            let sent = Instant::from_nanos((EARLIER + instants.sent_at(from, sample, timetable.frame)).unsigned_abs());
            // A peer numbers the other peers without itself.
            let other = if from < to { from } else { from - 1 };
            members[to].hold(other, sent, state);
            if let Some(rotation) = members[to].rotation_mut() {
                rotation.hold(other, &attitude);
            }
        };
        timetable.held.iter().for_each(|held| hold(members, &samples, *held));
        for event in &timetable.events {
            match *event {
                Event::Sample { node } => {
                    let sample = (*members[node].object().state(), members[node].attitude());
                    samples[node].push(sample);
                }
                Event::Deliver { from, to, sample } => hold(members, &samples, (to, from, sample)),
                Event::Tick { node, at, span, .. } => {
                    members[node].compute(Instant::from_nanos(at));
                    members[node].advance(Instant::from_nanos(at), span);
                }
            }
        }
        self.write(members, turning, &samples)
    }

    /// Sets positions, attitudes and velocities of the peers to the state `z`, and their clocks to the beginning of the frame.
    pub(super) fn put(&self, members: &mut [Member], turning: &Turning<'_>, z: &[f64]) {
        let mut first = 0;
        for ((member, node), base) in members.iter_mut().zip(turning.nodes).zip(&self.poses) {
            let (z, time, devices) = (&z[first..], turning.time, node.device.len());
            first += node.states();
            let (state, turned) = copy_of(z, &(base.centre, base.attitude), node, time);
            member.object_mut().set_state(state);
            member.device_mut().set_state(body(base.device, &z[12..], &z[12 + devices..], time));
            if let Some(rotation) = member.rotation_mut() {
                rotation.set_copy(turned);
                if devices == 6 {
                    rotation.set_device(attitude(&base.handle, &z[15..], &z[15 + devices..], node.length, time));
                }
            }
            member.set_local_time(Instant::from_nanos(EARLIER.unsigned_abs()));
        }
    }

    /// Returns the bases moved to the positions and angles of a state.
    pub(super) fn moved_to(mut self, turning: &Turning<'_>, z: &[f64]) -> Self {
        let time = turning.time;
        let mut next = 0;
        for (node, base) in turning.nodes.iter().zip(&mut self.poses) {
            let (z, devices) = (&z[next..], node.device.len());
            next += node.states();
            let (state, turned) = copy_of(z, &(base.centre, base.attitude), node, time);
            (base.centre, base.attitude) = (state.position, Attitude { rate: [0.0; 3], ..turned });
            base.device = body(base.device, &z[12..], &z[12 + devices..], time).position;
            if devices == 6 {
                base.handle = Attitude { rate: [0.0; 3], ..attitude(&base.handle, &z[15..], &z[15 + devices..], node.length, time) };
            }
        }
        for (node, bases) in turning.nodes.iter().zip(&mut self.samples) {
            for base in bases {
                let (state, turned) = copy_of(&z[next..], base, node, time);
                *base = (state.position, Attitude { rate: [0.0; 3], ..turned });
                next += SAMPLE;
            }
        }
        self
    }

    /// Returns the state of the peers relative to the bases, seen from `seen_from`. `samples` has the oldest sample first.
    fn write(&self, members: &[Member], turning: &Turning<'_>, samples: &[Vec<(State<3>, Attitude)>]) -> Vec<f64> {
        let (nodes, time) = (turning.nodes, turning.time);
        let (orientation, point) = self.seen_from;
        let back = Attitude { orientation: conjugate(orientation), rate: [0.0; 3] };
        let matrix = back.matrix();
        let moved = |state: &State<3>| State {
            position: apply(&matrix, from_fn(|axis| state.position[axis] - point[axis])),
            velocity: apply(&matrix, state.velocity),
        };
        let seen = |attitude: &Attitude| Attitude { orientation: turned(back.orientation, attitude.orientation), ..*attitude };
        let mut reached = vec![0.0; turning.size()];
        let mut first = 0;
        for ((member, node), base) in members.iter().zip(nodes).zip(&self.poses) {
            let out = &mut reached[first..];
            first += node.states();
            write(out, &(base.centre, base.attitude), node, time, (&moved(member.object().state()), &seen(&member.attitude())));
            let (state, devices) = (moved(&member.device().state()), node.device.len());
            let handle = member.rotation().and_then(|rotation| rotation.device()).map(seen);
            for axis in 0..3 {
                (out[12 + axis], out[12 + devices + axis]) = (state.position[axis] - base.device[axis], state.velocity[axis] * time);
                if let Some(handle) = &handle {
                    let turned = angle(&base.handle, handle)[axis] * node.length;
                    (out[15 + axis], out[15 + devices + axis]) = (turned, handle.rate[axis] * node.length * time);
                }
            }
        }
        let mut next: usize = nodes.iter().map(Node::states).sum();
        for ((node, bases), samples) in nodes.iter().zip(&self.samples).zip(samples) {
            for ((state, attitude), base) in samples.iter().rev().zip(bases) {
                write(&mut reached[next..], base, node, time, (&moved(state), &seen(attitude)));
                next += SAMPLE;
            }
        }
        reached
    }
}

/// Returns the peers of a scene at rest, with the hand of each peer given by `hand`.
pub(super) fn members(scene: &Scene, hand: impl Fn(usize) -> Option<Hand>) -> Vec<Member> {
    let member = |place: usize| {
        let spec = &scene.peers[place];
        let device = SimulatedDevice::new(spec.device, hand(place).as_ref(), State::REST, scene.integrator, &spec.clock);
        let object = ObjectCopy::new(scene.copy_config(place), State::REST, scene.integrator, &spec.clock);
        let held = Held::new((1..scene.peers.len()).map(|_| State::REST));
        let peer = Peer::new(scene.peer_config(place), device, object, FromScene.strategy(scene, place), held);
        peer.with_rotation(scene.rotation_of(place).expect("the object turns"))
    };
    (0..scene.peers.len()).map(member).collect()
}

/// Returns the slope of a function at 0, and an estimate of the slope's error. The slope combines central differences over ±e and ±e/2 for an error of order
/// e⁴, with e = 2·10⁻⁵ m. The estimate is the largest change of an entry from the finer difference.
pub(super) fn slope(at: impl Fn(f64) -> Vec<f64>) -> (Vec<f64>, f64) {
    let over = |size: f64| -> Vec<f64> { at(size).iter().zip(at(-size)).map(|(up, down)| (up - down) / (2.0 * size)).collect() };
    let (coarse, fine) = (over(2e-5), over(1e-5));
    let slope: Vec<f64> = coarse.iter().zip(&fine).map(|(coarse, fine)| (4.0 * fine - coarse) / 3.0).collect();
    let change = slope.iter().zip(&fine).map(|(slope, fine)| (slope - fine).abs()).fold(0.0, f64::max);
    (slope, change)
}

/// Returns the position and velocity of a body from entries of a state.
fn body(base: Triple, position: &[f64], velocity: &[f64], time: f64) -> State<3> {
    State { position: from_fn(|axis| base[axis] + position[axis]), velocity: from_fn(|axis| velocity[axis] / time) }
}

/// Returns the attitude and the angular velocity of a body from entries of a state, in which angles are multiplied by `length`.
fn attitude(base: &Attitude, angle: &[f64], rate: &[f64], length: f64, time: f64) -> Attitude {
    let mut attitude = Attitude { rate: from_fn(|axis| rate[axis] / length / time), ..*base };
    attitude.turn(from_fn(|axis| angle[axis] / length));
    attitude
}

fn copy_of(z: &[f64], (centre, base): &(Triple, Attitude), node: &Node, time: f64) -> (State<3>, Attitude) {
    (body(*centre, z, &z[6..], time), attitude(base, &z[3..], &z[9..], node.length, time))
}

/// Writes a copy or a sample into its entries of a state, the inverse of [`copy_of`].
fn write(z: &mut [f64], (centre, base): &(Triple, Attitude), node: &Node, time: f64, (state, attitude): (&State<3>, &Attitude)) {
    let turned = angle(base, attitude);
    for axis in 0..3 {
        (z[axis], z[6 + axis]) = (state.position[axis] - centre[axis], state.velocity[axis] * time);
        (z[3 + axis], z[9 + axis]) = (turned[axis] * node.length, attitude.rate[axis] * node.length * time);
    }
}

/// Returns the rotation vector from `base` to `attitude` \[rad\], in the body axes of `base`.
fn angle(base: &Attitude, attitude: &Attitude) -> Triple {
    Attitude { orientation: turned(conjugate(base.orientation), attitude.orientation), rate: [0.0; 3] }.rotation_vector()
}

fn conjugate([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [w, -x, -y, -z]
}
