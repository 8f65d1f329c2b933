//! Objects that turn: what a turn of the world, a motion of the world and other names of axes must not change.

use core::convert::Infallible;
use core::fmt::Write as _;
use std::path::Path;

use cohaptic_harness::{Model, Observer, Simulation, TickRow};
use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::Scene;
use cohaptic_tests_common::{cases, properties};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

type Triple = [f64; 3];

/// A scene in which an object turns.
#[derive(Clone, Debug)]
struct Turning {
    strategy: &'static str,
    /// KT, BT, KR and BR.
    gains: (f64, f64, Triple, f64),
    mass: f64,
    inertia: Option<Triple>,
    /// Of copies and devices, of their turns too.
    damping: f64,
    compute_delay: bool,
    update: &'static str,
    link: String,
    peers: Vec<TurningPeer>,
}

#[derive(Clone, Debug)]
struct TurningPeer {
    position: Triple,
    velocity: Triple,
    orientation: [f64; 4],
    rate: Triple,
    grasp: Triple,
    force: Triple,
    /// For a device that turns: the torque of its hand.
    torque: Option<Triple>,
}

impl Turning {
    fn scene(&self) -> Scene {
        let Self { strategy, gains: (stiffness, damping, turning, turning_damping), mass, damping: ground, update, link, .. } = self;
        let late = u8::from(self.compute_delay);
        let mut text = format!(
            "scene = {{ duration = \"150ms\", axes = 3 }}\n[object]\nmass = {mass:?}\ndamping = {ground:?}\n[coordination]\nstrategy = \"{strategy}\"\n\
             stiffness = {stiffness:?}\ndamping = {damping:?}\nupdate = \"{update}\"\nlocal-lag.lag = \"3ms\"\nlocal-damping.damping = 2.0\n[link]\n{link}\n[peer]\ncompute-delay = {late}\n\
             device = {{ mass = 0.1, damping = {ground:?} }}\ncoupling = {{ stiffness = 300.0, damping = 2.0 }}\n"
        );
        if let Some(inertia) = self.inertia {
            let keys = format!("[object]\ninertia = {inertia:?}\nrotational-damping = {:?}", 1e-4 * ground);
            text = text.replace("[object]", &keys);
            let keys = format!("[coordination]\nrotational-stiffness = {turning:?}\nrotational-damping = {turning_damping:?}");
            text = text.replace("[coordination]", &keys);
        }
        for (number, peer) in self.peers.iter().enumerate() {
            let TurningPeer { position, velocity, orientation, rate, grasp, force, torque } = peer;
            write!(text, "[[peers]]\nname = \"p{number}\"\nposition = {position:?}\nvelocity = {velocity:?}\n").unwrap();
            let torque = torque.filter(|_| self.inertia.is_some());
            let hand = torque.map_or_else(String::new, |torque| format!(", torque = {torque:?}"));
            writeln!(text, "hand = {{ force = {force:?}{hand} }}").unwrap();
            if self.inertia.is_some() {
                write!(text, "orientation = {orientation:?}\nangular-velocity = {rate:?}\ngrasp = {grasp:?}\n").unwrap();
            }
            if torque.is_some() {
                text += "device = { inertia = 0.0001 }\ncoupling = { rotational-stiffness = 0.5, rotational-damping = 0.001 }\n";
            }
        }
        Scene::parse(&text, Path::new("turning.toml"), &[]).unwrap_or_else(|error| unreachable!("{error}\n{text}"))
    }

    /// Each copy at each tick: position, velocity and attitude, if the object turns.
    fn run(&self, model: Model) -> Vec<Moment> {
        let (scene, mut seen) = (self.scene(), Seen::default());
        let Ok(_) = Simulation::new(&scene, model).run(&mut seen);
        seen.0
    }
}

#[derive(Clone, PartialEq, Debug)]
struct Moment {
    position: Triple,
    velocity: Triple,
    attitude: Option<Attitude>,
    seconds: f64,
}

#[derive(Default)]
struct Seen(Vec<Moment>);

impl Observer for Seen {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        let triple = |numbers: &[f64]| Triple::try_from(numbers).unwrap();
        let (position, velocity) = (triple(row.object.position), triple(row.object.velocity));
        self.0.push(Moment { position, velocity, attitude: row.turn.map(|turn| *turn.object), seconds: row.at.as_secs_f64() });
        Ok(())
    }
}

fn triple(size: f64) -> BoxedStrategy<Triple> {
    [-size..size, -size..size, -size..size].boxed()
}

const LAWS: [&str; 6] = ["average-position", "proportional-derivative", "extrapolated", "smoothed-average-position", "local-damping", "local-lag"];

/// Scenes that stay near where they begin for as long as they last.
fn turning() -> BoxedStrategy<Turning> {
    let attitude = ([-1.0..1.0, -1.0..1.0, -1.0..1.0, 0.2..1.0_f64], triple(3.0));
    let peer = (triple(0.01), triple(0.05), attitude, triple(0.05), triple(1.0), proptest::option::of(triple(0.01)));
    let peer = peer.prop_map(|(position, velocity, (orientation, rate), grasp, force, torque)| TurningPeer {
        position,
        velocity,
        orientation,
        rate,
        grasp,
        force,
        torque,
    });
    // Moments of inertia of a body are sums of two positive numbers each.
    let parts = [1e-4..1e-3_f64, 1e-4..1e-3, 1e-4..1e-3];
    let bodies = (0.2..1.0_f64, parts.prop_map(|[a, b, c]| [b + c, c + a, a + b]), 0.0..2.0_f64);
    let gains = (50.0..200.0_f64, 1.0..4.0_f64, [0.05..0.1_f64, 0.05..0.1, 0.05..0.1], 1e-4..1e-3_f64);
    let link = select(&["", "delay = \"3ms\"", "delay = \"5ms\"\nloss = \"20%\"", "delay = \"4ms\"\njitter = \"2ms\""][..]);
    let timing = (any::<bool>(), select(&["1ms", "8ms"][..]), link);
    (select(&LAWS[..]), gains, bodies, timing, vec(peer, 2..=6))
        .prop_map(|(strategy, gains, (mass, inertia, damping), (compute_delay, update, link), peers)| Turning {
            strategy,
            gains,
            mass,
            inertia: Some(inertia),
            damping,
            compute_delay,
            update,
            link: link.to_owned(),
            peers,
        })
        .boxed()
}

fn product(p: [f64; 4], q: [f64; 4]) -> [f64; 4] {
    let ([a, b, c, d], [w, x, y, z]) = (p, q);
    [a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w]
}

fn turned(by: [f64; 4], vector: Triple) -> Triple {
    let matrix = Attitude { orientation: by, rate: [0.0; 3] }.matrix();
    core::array::from_fn(|row| (0..3).map(|column| matrix[row][column] * vector[column]).sum())
}

fn apart(one: Triple, other: Triple) -> f64 {
    (0..3).map(|axis| (one[axis] - other[axis]).abs()).fold(0.0, f64::max)
}

/// Numbers of at most 10 in each of 150 ticks of at most 6 peers are rounded in another way, some hundred times each; scenes this short do not make it grow by
/// more than a thousand times.
const ROUNDINGS: f64 = 1e-10;

properties! {
    #![proptest_config(cases(60))]

    #[test]
    fn both_models_turn_alike(turning in turning()) {
        prop_assert_eq!(turning.run(Model::Least), turning.run(Model::General));
    }

    /// A force at the centre of mass turns nothing, and no turn moves it.
    #[test]
    fn held_at_its_centre_an_object_moves_as_if_it_did_not_turn(mut turning in turning()) {
        for peer in &mut turning.peers {
            peer.grasp = [0.0; 3];
        }
        let (turns, moves) = (turning.run(Model::Least), Turning { inertia: None, ..turning }.run(Model::Least));
        prop_assert_eq!(turns.len(), moves.len());
        for (turns, moves) in turns.iter().zip(&moves) {
            prop_assert!(turns.attitude.is_some() && moves.attitude.is_none());
            for (a, b) in turns.position.iter().chain(&turns.velocity).zip(moves.position.iter().chain(&moves.velocity)) {
                prop_assert_eq!(a.to_bits(), b.to_bits());
            }
        }
    }

    /// The torque of the mean is the mean of the torques.
    #[test]
    fn proportional_derivative_is_average_position_with_all_gains_times_the_others(mut turning in turning()) {
        turning.strategy = "proportional-derivative";
        let others = super::count(turning.peers.len() - 1);
        let (stiffness, damping, turn, turn_damping) = turning.gains;
        let gains = (stiffness * others, damping * others, turn.map(|gain| gain * others), turn_damping * others);
        let average = Turning { strategy: "average-position", gains, ..turning.clone() };
        prop_assert_eq!(turning.run(Model::Least), average.run(Model::Least));
    }

    #[test]
    fn a_turned_world_turns_as_the_world_does(turning in turning(), by in [-1.0..1.0, -1.0..1.0, -1.0..1.0, 0.2..1.0_f64]) {
        let mut other = turning.clone();
        for peer in &mut other.peers {
            (peer.position, peer.velocity, peer.force) = (turned(by, peer.position), turned(by, peer.velocity), turned(by, peer.force));
            peer.torque = peer.torque.map(|torque| turned(by, torque));
            peer.orientation = product(by, peer.orientation);
        }
        for (here, there) in turning.run(Model::Least).iter().zip(&other.run(Model::Least)) {
            prop_assert!(apart(turned(by, here.position), there.position) <= ROUNDINGS);
            let (here, there) = (here.attitude.unwrap(), there.attitude.unwrap());
            let expected = product(by, here.orientation);
            let norm = expected.iter().map(|q| q * q).sum::<f64>().sqrt();
            prop_assert!(there.angle_to(&expected.map(|q| q / norm)) <= 100.0 * ROUNDINGS);
            prop_assert!(apart(here.rate, there.rate) <= 100.0 * ROUNDINGS);
        }
    }

    /// x becomes y, y becomes z, z becomes x.
    #[test]
    fn body_axes_have_no_names(mut turning in turning()) {
        // The axes of a device that turns are no axes of the object.
        turning.peers.iter_mut().for_each(|peer| peer.torque = None);
        let next = |[x, y, z]: Triple| [z, x, y];
        let mut other = turning.clone();
        other.inertia = other.inertia.map(next);
        other.gains.2 = next(other.gains.2);
        // The turn by 120° about (1, 1, 1) takes the new body axes to the old ones.
        let renaming = [0.5, -0.5, -0.5, -0.5];
        for peer in &mut other.peers {
            (peer.grasp, peer.rate) = (next(peer.grasp), next(peer.rate));
            peer.orientation = product(peer.orientation, renaming);
        }
        for (here, there) in turning.run(Model::Least).iter().zip(&other.run(Model::Least)) {
            prop_assert!(apart(here.position, there.position) <= ROUNDINGS);
            let (here, there) = (here.attitude.unwrap(), there.attitude.unwrap());
            prop_assert!(there.angle_to(&product(here.orientation, renaming)) <= 100.0 * ROUNDINGS);
            prop_assert!(apart(next(here.rate), there.rate) <= 100.0 * ROUNDINGS);
        }
    }

    /// Where nothing is late and nothing is tied to ground, a world that moves evenly is the world.
    #[test]
    fn a_moving_world_turns_as_the_world_does(mut turning in turning(), by in triple(2.0)) {
        (turning.damping, turning.update, turning.link, turning.compute_delay) = (0.0, "1ms", String::new(), false);
        // The one damps to ground, and the other compares what was with what is.
        if ["local-damping", "local-lag"].contains(&turning.strategy) {
            turning.strategy = "smoothed-average-position";
        }
        let mut other = turning.clone();
        for peer in &mut other.peers {
            peer.velocity = core::array::from_fn(|axis| peer.velocity[axis] + by[axis]);
        }
        for (here, there) in turning.run(Model::Least).iter().zip(&other.run(Model::Least)) {
            let expected = core::array::from_fn(|axis| here.position[axis] + by[axis] * here.seconds);
            prop_assert!(apart(expected, there.position) <= ROUNDINGS);
            prop_assert!(here.attitude.unwrap().angle_to(&there.attitude.unwrap().orientation) <= 100.0 * ROUNDINGS);
        }
    }
}
