//! A session on loopback. Its thread is held up on purpose, and nothing depends on for how long a busy machine holds it up besides.

use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant as Wall};

use cohaptic_live::session::{Conductor, LinkChange, Session, SessionConfig, Status};
use cohaptic_peer::State;
use cohaptic_peer::wire::{MAX_LEN, Sample};
use cohaptic_realtime::Wishes;
use cohaptic_scene::Scene;
use cohaptic_units::Instant;

use crate::support::SESSION;

/// Somebody here, and a program at place 1.
fn scene() -> String {
    format!(
        "scene = {{ duration = \"1h\", seed = {SESSION} }}\nobject = {{ mass = 0.45 }}\n\
         coordination = {{ strategy = \"average-position\", stiffness = 300.0, damping = 5.0, update = \"8ms\" }}\n\
         peer = {{ device = {{ mass = 0.1, damping = 5.0 }}, coupling = {{ stiffness = 800.0, damping = 5.0 }} }}\n\
         [[peers]]\nname = \"here\"\n[[peers]]\nname = \"there\"\nkind = \"udp\"\n"
    )
}

/// Between the two samples of a pair the thread of the session stands still.
const HELD_UP: Duration = Duration::from_millis(100);
/// The kernel's stamps are by the time of day, which may be adjusted meanwhile, by far less than that.
const ADJUSTED: Duration = Duration::from_millis(1);
/// A stamp that is a second old when it is read is not believed; a pair that was read within this is looked at.
const IN_TIME: Duration = Duration::from_millis(900);

/// Sends pairs of samples while it holds the session up, until one pair was read in time.
struct HoldsUp {
    socket: UdpSocket,
    door: SocketAddr,
    number: u64,
    begun: Option<Wall>,
}

impl HoldsUp {
    fn send(&mut self) {
        let sample = Sample { session: SESSION, sender: 1, sequence: self.number, sent: Instant::ZERO, state: State::<1>::REST };
        let mut bytes = [0; MAX_LEN];
        let len = sample.encode(1, &mut bytes);
        self.socket.send_to(&bytes[..len], self.door).unwrap();
        self.number += 1;
    }
}

impl Conductor for HoldsUp {
    fn keep_going(&mut self) -> bool {
        if self.begun.is_some_and(|begun| begun.elapsed() < IN_TIME) || self.number > 200 {
            return false;
        }
        self.begun = Some(Wall::now());
        self.send();
        std::thread::sleep(HELD_UP);
        self.send();
        true
    }

    fn next_change(&mut self) -> Option<LinkChange> {
        None
    }

    fn show(&mut self, _: Status) {}
}

/// Both samples of a pair are read at once, after the second one was sent. Each counts from when the kernel had it: so the first one counts earlier, by at least as
/// long as the thread stood still between them.
#[test]
fn a_sample_counts_from_when_the_kernel_had_it_and_not_from_when_it_was_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene()).unwrap();
    let scene = Scene::read_live(&path, &[]).unwrap();
    let out = folder.path().join("out");
    let config = SessionConfig { wishes: Wishes::NONE, out: Some(out.clone()), ..SessionConfig::new("127.0.0.1:0".parse().unwrap()) };
    let session = Session::open(&scene, config, |_| None).unwrap();
    let door = session.address().unwrap();
    let mut conductor = HoldsUp { socket: UdpSocket::bind("127.0.0.1:0").unwrap(), door, number: 0, begun: None };
    let report = session.run(&mut conductor).unwrap();
    assert!(conductor.begun.unwrap().elapsed() >= HELD_UP && conductor.number <= 200, "no pair was read in time");
    let taken = report.seats[1].unwrap().taken;
    assert_eq!(taken, conductor.number, "{:?}", report.door);
    let inputs = std::fs::read_to_string(out.join("inputs.csv")).unwrap();
    let mut samples = inputs.lines().filter(|line| line.contains(",sample,")).map(|line| line.split(',').next().unwrap().parse::<u64>().unwrap());
    let [last, first] = [(); 2].map(|()| samples.next_back().unwrap());
    let apart = Duration::from_nanos(last - first);
    assert!(apart >= HELD_UP - ADJUSTED, "{apart:?} apart");
}
