//! Operators in a running scene: what each person sees and is asked to do at a tick, and the motion that each person wants.

use cohaptic_peer::operator::{Operator, OperatorLaw, Seen, View};
use cohaptic_peer::{ArmConfig, Device, Hand, State, Strategy};
use cohaptic_scene::Scene;
use cohaptic_units::Instant;
use cohaptic_wan::random::{Purpose, Stream};

use super::member::{DeviceModel, Member};
use crate::task::Judge;

/// Modelled persons of a scene.
#[derive(Debug)]
pub(super) struct Operators<const A: usize> {
    /// Persons in the order of their peers.
    persons: Vec<Person<A>>,
    /// First instant of the task.
    start: Instant,
    /// Number of axes of the scene, at most A. Nobody moves along the other axes.
    axes: usize,
}

#[derive(Debug)]
struct Person<const A: usize> {
    /// Index of the peer.
    peer: usize,
    operator: Operator<A>,
    arm: ArmConfig,
    sees: Seen,
    /// Standard deviation of the end of a movement over its length.
    noise: f64,
    draws: Stream,
}

impl<const A: usize> Operators<A> {
    /// Returns the persons of a scene, and lets each arm hold its device at the initial place. `None` for a scene without persons.
    pub(super) fn new<S: Strategy<A>, D: Device<A>>(scene: &Scene, members: &mut [Member<A, S, D>]) -> Option<Box<Self>> {
        let person = |(peer, member): (usize, &mut Member<A, S, D>)| {
            let Some(Hand::Operator { arm, operator }) = &scene.peers[peer].hand else { return None };
            // A device that is not simulated touches nothing and is seen by nobody.
            let DeviceModel::Simulated(device) = member.peer.device_mut() else { return None };
            let place = device.state().position;
            device.want(arm, &State { position: place, velocity: [0.0; A] });
            Some(Person {
                peer,
                operator: Operator::new(operator, scene.peers[peer].clock.tick, scene.expected_delay(peer), place),
                arm: *arm,
                sees: operator.sees,
                noise: if let OperatorLaw::Moves(moves) = &operator.law { moves.noise } else { 0.0 },
                // No link has this label: the label of a link is an arrow between two names, and no name has a space.
                draws: Stream::new(scene.seed, format!("operator {}", scene.peers[peer].name).as_bytes()),
            })
        };
        let persons: Vec<Person<A>> = members.iter_mut().enumerate().filter_map(person).collect();
        if persons.is_empty() {
            return None;
        }
        Some(Box::new(Self { persons, start: scene.task.as_ref()?.start, axes: scene.axes.count() }))
    }

    /// Lets each person whose peer ticks see and move, after the deliveries of the instant. `ticking` has the peers that tick, in ascending order. `judge` has
    /// judged all earlier instants, and knows the present targets.
    pub(super) fn act<S: Strategy<A>, D: Device<A>>(&mut self, now: Instant, ticking: &[usize], members: &mut [Member<A, S, D>], judge: &Judge) {
        if now < self.start {
            return;
        }
        let Self { persons, axes, .. } = self;
        // A target that depends on the time alone is the same for all persons, and its sines take as long as the rest of a tick.
        let (is_common, mut common) = (!judge.target_follows_copies(), None);
        for Person { peer, operator, arm, sees, noise, draws } in persons {
            let member = &mut members[*peer];
            if ticking.binary_search(peer).is_err() {
                continue;
            }
            let seen = member.peer.seen(*sees).expect("a scene in which a person sees what the peer does not hear is refused");
            // In a session a pointer may hold the device in place of the person.
            let DeviceModel::Simulated(device) = member.peer.device_mut() else { continue };
            let asked = common.filter(|_| is_common).unwrap_or_else(|| judge.asks(*peer, now, *noise));
            common = Some(asked);
            let (target, radius) = asked;
            let view = View { position: seen, target: core::array::from_fn(|axis| target.get(axis).copied().unwrap_or(0.0)), radius };
            let wanted = operator.tick(&view, |movement| normals(*draws, movement, *axes));
            device.want(arm, &wanted);
        }
    }
}

/// Returns a standard normal number for each axis of a movement; zero beyond the axes of the scene.
fn normals<const A: usize>(draws: Stream, movement: u64, axes: usize) -> [f64; A] {
    let mut normals = [0.0; A];
    for (copy, normal) in (0..).zip(normals.iter_mut().take(axes)) {
        let mut words = draws.copy(movement, copy).draws(Purpose::Movement);
        // Box & Muller (1958), from two uniform numbers. 1 − u is above zero.
        let (radius, angle) = (words.next_unit(), words.next_unit());
        *normal = libm::sqrt(-2.0 * libm::log1p(-radius)) * libm::cos(core::f64::consts::TAU * angle);
    }
    normals
}
