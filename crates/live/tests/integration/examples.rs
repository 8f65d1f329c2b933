//! The programs of `docs/examples`, compiled, run, and checked against a door on a loopback socket and against the peers of this project.
//!
//! Nothing here depends on how fast the machine is: what the programs compute is the same however late they are, and where one must hear something
//! before it ends, it is given more time until it has.

mod programs;
mod served;

use std::net::UdpSocket;

use cohaptic_peer::{
    Clock, Contact, Coordination, CopyConfig, DeviceConfig, Gains, Hand, Held, Integrator, ObjectCopy, Peer, PeerConfig, Signal, SimulatedDevice,
    State,
};
use cohaptic_units::Instant;
use std::time::Duration;

use crate::support::SESSION;
use programs::{Language, finish};

/// What the options of a program say of its mechanics.
struct Mechanics {
    axes: usize,
    peers: u32,
    object: CopyConfig,
    device: DeviceConfig,
    coupling: Gains,
    coordination: Gains,
    force: f64,
}

impl Mechanics {
    fn options(&self) -> Vec<String> {
        let Self { axes, peers, object, device, coupling, coordination, force } = self;
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
            ("--force", force.to_string()),
        ];
        options.into_iter().flat_map(|(name, value)| [name.to_owned(), value]).collect()
    }

    /// Device and copy after this number of ticks of 1 ms without a word from the others, by the peer of this project.
    fn alone(&self, ticks: u64) -> (State<3>, State<3>) {
        let tick = Duration::from_millis(1);
        let clock = Clock::regular(tick);
        let hand = Hand::Force(Signal::Constant([self.force, 0.0, 0.0]));
        let device = SimulatedDevice::new(self.device, Some(&hand), State::REST, Integrator::Exact, &clock);
        let object = ObjectCopy::new(self.object, State::REST, Integrator::Exact, &clock);
        let config = PeerConfig {
            session: SESSION,
            place: 1,
            axes: 3,
            contact: Contact::Grasp,
            coupling: self.coupling,
            tick,
            compute_delay: false,
            own_damping: 0.0,
            enclosure: None,
        };
        let others = Held::new((1..self.peers).map(|_| State::REST));
        let mut peer: Peer<3, _, _> =
            Peer::new(config, device, object, Coordination::AveragePosition.strategy(self.coordination, self.peers as usize, tick), others);
        for k in 0..ticks {
            let now = Instant::from_nanos(k * 1_000_000);
            peer.compute(now);
            peer.advance(now, tick);
        }
        (cohaptic_peer::Device::state(peer.device()), *peer.object().state())
    }
}

/// A program that hears nobody moves exactly as a simulated peer does: its equations, its step and its order of things are the same.
fn moves_as_a_simulated_peer_does(language: Language) {
    let Some(program) = language.program() else { return };
    // A socket that never answers.
    let silent = UdpSocket::bind("127.0.0.1:0").unwrap();
    let door = silent.local_addr().unwrap().to_string();
    let usual = Mechanics {
        axes: 1,
        peers: 3,
        object: CopyConfig { mass: 0.15, damping: 0.0 },
        device: DeviceConfig { mass: 0.1, damping: 5.0 },
        coupling: Gains { stiffness: 3500.0, damping: 5.0 },
        coordination: Gains { stiffness: 300.0, damping: 5.0 },
        force: 0.5,
    };
    // Dampings for which each branch of the step is taken: b·h/m is 1e-4 for the device and 0.02 for the copy.
    let other = Mechanics {
        axes: 3,
        peers: 2,
        object: CopyConfig { mass: 0.25, damping: 5.0 },
        device: DeviceConfig { mass: 0.2, damping: 0.02 },
        coupling: Gains { stiffness: 1000.0, damping: 2.0 },
        coordination: Gains { stiffness: 0.0, damping: 0.0 },
        force: -1.25,
    };
    for mechanics in [usual, other] {
        let mut command = program.command();
        command.args([&door, "--session", &SESSION.to_string(), "--place", "1", "--duration", "0.25"]).args(mechanics.options());
        let summary = finish(command.spawn().unwrap());
        let (device, copy) = mechanics.alone(250);
        assert_eq!((summary.ticks, summary.sent), (250, 32), "{summary:?}");
        for axis in 0..mechanics.axes {
            let pairs = [(summary.position[axis], copy.position[axis]), (summary.velocity[axis], copy.velocity[axis])];
            for (found, expected) in pairs.into_iter().chain([(summary.device[axis], device.position[axis])]) {
                // 250 steps of a stable system, each rounded a few times: some 1e3 ulp of the forces' quotients. A wrong order of two steps shows
                // at 1e-4 of the motion.
                assert!((found - expected).abs() <= 1e-10 * (1.0 + expected.abs()), "axis {axis}: {found} instead of {expected}");
            }
        }
        assert_eq!(summary.position.len(), mechanics.axes);
        assert!(copy.position[0].abs() > 1e-4, "it has moved");
        assert!(summary.others.iter().all(|other| other.received == 0 && other.stale));
    }
}

#[test]
fn the_python_peer_moves_as_a_simulated_peer_does() {
    moves_as_a_simulated_peer_does(Language::Python);
}

#[test]
fn the_cpp_peer_moves_as_a_simulated_peer_does() {
    moves_as_a_simulated_peer_does(Language::Cpp);
}
