//! The programs of `docs/examples`, compiled, run, and compared with a door on a loopback socket and with the peers of this project.
//!
//! No result depends on the speed of the machine: the programs compute the same numbers however late the programs are. A program that must hear something
//! before its end is run again for a longer time until the program has heard it.

mod header;
mod programs;
mod served;

use std::net::UdpSocket;

use cohaptic_peer::rotation::{Attitude, HeldAttitudes, Rotation, RotationConfig, Spin};
use cohaptic_peer::{
    Clock, Contact, Coordination, CopyConfig, DeviceConfig, Exchange, Gains, Hand, Held, Integrator, ObjectCopy, Peer, PeerConfig, Signal,
    SimulatedDevice, State,
};
use cohaptic_units::Instant;
use std::time::Duration;

use crate::support::SESSION;
use programs::{Language, finish};

/// Mechanics of a program, as its options give them.
struct Mechanics {
    axes: usize,
    peers: u32,
    object: CopyConfig,
    device: DeviceConfig,
    coupling: Gains,
    coordination: Gains,
    law: Coordination,
    exchange: Exchange,
    /// Constant force of the hand along the first axis \[N\].
    force: f64,
    /// Inertia of the whole object \[kg·m²\] and grasp point \[m\]. `None` if the object does not turn.
    turning: Option<([f64; 3], [f64; 3])>,
}

impl Mechanics {
    /// Returns the options of the program for these mechanics.
    fn options(&self) -> Vec<String> {
        let Self { axes, peers, object, device, coupling, coordination, law, exchange, force, turning } = self;
        let whole = object.mass * f64::from(*peers);
        let pair = |gains: &Gains| format!("{},{}", gains.stiffness, gains.damping);
        let options = [
            ("--axes", axes.to_string()),
            ("--peers", peers.to_string()),
            ("--object-mass", whole.to_string()),
            ("--object-damping", object.damping.to_string()),
            ("--device-mass", device.mass.to_string()),
            ("--device-damping", device.damping.to_string()),
            ("--coupling", pair(coupling)),
            ("--coordination", pair(coordination)),
            ("--law", law.short_name().unwrap().to_owned()),
            ("--exchange-every", exchange.every.to_string()),
            ("--exchange-age", u8::from(exchange.late).to_string()),
            ("--force", force.to_string()),
        ];
        let triple = |[x, y, z]: [f64; 3]| format!("{x},{y},{z}");
        let turning = turning.iter().flat_map(|(inertia, grasp)| [("--inertia", triple(*inertia)), ("--grasp", triple(*grasp))]);
        options.into_iter().chain(turning).flat_map(|(name, value)| [name.to_owned(), value]).collect()
    }

    /// Returns device, copy and attitude after `ticks` ticks of 1 ms without samples from other peers, computed by the peer of this project.
    fn alone(&self, ticks: u64) -> (State<3>, State<3>, Option<Attitude>) {
        let tick = Duration::from_millis(1);
        let clock = Clock::regular(tick);
        let hand = Hand::Force(Signal::Constant([self.force, 0.0, 0.0]));
        let held_at = State { position: self.turning.map_or([0.0; 3], |(_, grasp)| grasp), ..State::REST };
        let device = SimulatedDevice::new(self.device, Some(&hand), held_at, Integrator::Exact, &clock);
        let object = ObjectCopy::new(self.object, State::REST, Integrator::Exact, &clock);
        let config = PeerConfig {
            session: SESSION,
            place: 1,
            axes: 3,
            contact: Contact::Grasp,
            coupling: self.coupling,
            tick,
            compute_delay: false,
            exchange: self.exchange,
            own_damping: 0.0,
            enclosure: None,
        };
        let others = Held::new((1..self.peers).map(|_| State::REST));
        let mut peer: Peer<3, _, _> = Peer::new(config, device, object, self.law.strategy(self.coordination, self.peers as usize, tick), others);
        if let Some((inertia, grasp)) = self.turning {
            let peers = f64::from(self.peers);
            let share = inertia.map(|moment| moment / (self.object.mass * peers));
            let of = |gain: f64| share.map(|share| gain * share);
            let config = RotationConfig {
                copy: Spin { inertia: inertia.map(|moment| moment / peers), damping: of(self.object.damping) },
                grasp,
                gains: Gains { stiffness: of(self.coordination.stiffness), damping: of(self.coordination.damping) },
                device: None,
                integrator: Integrator::Exact,
                steps: 1,
            };
            let held = HeldAttitudes::new((1..self.peers).map(|_| Attitude::REST));
            peer = peer.with_rotation(Rotation::new(config, Attitude::REST, held, &clock));
        }
        for k in 0..ticks {
            let now = Instant::from_nanos(k * 1_000_000);
            peer.compute(now);
            peer.advance(now, tick);
        }
        let attitude = peer.rotation().map(|rotation| *rotation.copy());
        (cohaptic_peer::Device::state(peer.device()), *peer.object().state(), attitude)
    }
}

/// Checks that a program without samples from other peers moves exactly as a simulated peer: with the same equations, the same step and the same order of
/// operations.
fn moves_as_a_simulated_peer_does(language: Language) {
    let Some(program) = language.program() else { return };
    // The socket never answers.
    let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
    let door = silent.local_addr().unwrap().to_string();
    let usual = Mechanics {
        axes: 1,
        peers: 3,
        object: CopyConfig { mass: 0.15, damping: 0.0 },
        device: DeviceConfig { mass: 0.1, damping: 5.0 },
        coupling: Gains { stiffness: 3500.0, damping: 5.0 },
        coordination: Gains { stiffness: 300.0, damping: 5.0 },
        law: Coordination::AveragePosition,
        exchange: Exchange::EACH_TICK,
        force: 0.5,
        turning: None,
    };
    // The dampings take each branch of the step: b·h/m is 1e-4 for the device and 0.02 for the copy.
    let other = Mechanics {
        axes: 3,
        peers: 2,
        object: CopyConfig { mass: 0.25, damping: 5.0 },
        device: DeviceConfig { mass: 0.2, damping: 0.02 },
        coupling: Gains { stiffness: 1000.0, damping: 2.0 },
        coordination: Gains { stiffness: 0.0, damping: 0.0 },
        law: Coordination::AveragePosition,
        exchange: Exchange { every: 1, late: true },
        force: -1.25,
        turning: None,
    };
    // The Runge-Kutta method of the program is as exact as the step here: at 3 rad/s and 1 ms the error is below 1e-13 rad per step.
    let turning = Mechanics {
        axes: 3,
        peers: 3,
        object: CopyConfig { mass: 0.2, damping: 1.0 },
        device: DeviceConfig { mass: 0.1, damping: 5.0 },
        coupling: Gains { stiffness: 500.0, damping: 2.0 },
        coordination: Gains { stiffness: 100.0, damping: 2.0 },
        law: Coordination::AveragePosition,
        exchange: Exchange::EACH_TICK,
        force: 1.0,
        turning: Some(([0.001, 0.002, 0.0025], [0.05, 0.02, -0.03])),
    };
    // Both parts of a slow device, and the law whose force is the sum over the other peers.
    let slow = Mechanics {
        axes: 2,
        peers: 4,
        object: CopyConfig { mass: 0.2, damping: 0.5 },
        device: DeviceConfig { mass: 0.1, damping: 5.0 },
        coupling: Gains { stiffness: 800.0, damping: 2.0 },
        coordination: Gains { stiffness: 100.0, damping: 2.0 },
        law: Coordination::ProportionalDerivative,
        exchange: Exchange { every: 3, late: true },
        force: 0.5,
        turning: None,
    };
    for mechanics in [usual, other, turning, slow] {
        let mut command = program.command();
        command.args([&door, "--session", &SESSION.to_string(), "--place", "1", "--duration", "0.25"]).args(mechanics.options());
        let summary = finish(command.spawn().unwrap());
        let (device, copy, attitude) = mechanics.alone(250);
        assert_eq!((summary.ticks, summary.sent), (250, 32), "{summary:?}");
        for axis in 0..mechanics.axes {
            let pairs = [
                (summary.position[axis], copy.position[axis]),
                (summary.velocity[axis], copy.velocity[axis]),
                (summary.device[axis], device.position[axis]),
                (summary.device_velocity[axis], device.velocity[axis]),
            ];
            for (found, expected) in pairs {
                // The tolerance is for 250 steps of a stable system, each rounded a few times: some 1e3 ulp of the forces' quotients. A wrong order of two
                // operations changes the motion by 1e-4 of its size.
                assert!((found - expected).abs() <= 1e-12 * (1.0 + expected.abs()), "axis {axis}: {found} instead of {expected}");
            }
        }
        assert_eq!(summary.orientation.is_some(), attitude.is_some());
        if let (Some(found), Some(expected)) = (summary.orientation, attitude) {
            assert!(expected.angle_to(&found) <= 1e-10, "{found:?} instead of {expected:?}");
            assert!(Attitude::REST.angle_to(&found) > 0.01, "it has turned");
        }
        assert_eq!(summary.position.len(), mechanics.axes);
        assert!(copy.position[0].abs() > 1e-4, "it has moved");
        assert!(summary.others.iter().all(|other| other.received == 0 && other.stale));
    }
}

/// Checks the state after 100 ticks under 1.5 N against figures that a program of its own computed: two peers, and the copy of the other one at rest.
fn moves_to_the_figures(language: Language) {
    let Some(program) = language.program() else { return };
    let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
    let door = silent.local_addr().unwrap().to_string();
    let at_once = (["3500,5", "1", "0"], [0.00418909868044695, -0.0126283653899512, 0.003717446243695, -0.0121602475770235]);
    let slow = (["1000,2", "2", "1"], [0.00524952463767579, -0.0111540648355197, 0.00377446409899885, -0.00545479030280096]);
    for ([coupling, every, age], figures) in [at_once, slow] {
        let mut command = program.command();
        command.args([&door, "--session", "1", "--place", "1", "--duration", "0.1", "--force", "1.5", "--coordination", "500,5"]);
        command.args(["--coupling", coupling, "--exchange-every", every, "--exchange-age", age]);
        let summary = finish(command.spawn().unwrap());
        let found = [summary.device[0], summary.device_velocity[0], summary.position[0], summary.velocity[0]];
        for (found, expected) in found.into_iter().zip(figures) {
            assert!((found - expected).abs() < 1e-12, "{found} instead of {expected}");
        }
    }
}

#[test]
fn the_python_peer_moves_to_the_figures() {
    moves_to_the_figures(Language::Python);
}

#[test]
fn the_cpp_peer_moves_to_the_figures() {
    moves_to_the_figures(Language::Cpp);
}

#[test]
fn the_python_peer_moves_as_a_simulated_peer_does() {
    moves_as_a_simulated_peer_does(Language::Python);
}

#[test]
fn the_cpp_peer_moves_as_a_simulated_peer_does() {
    moves_as_a_simulated_peer_does(Language::Cpp);
}
