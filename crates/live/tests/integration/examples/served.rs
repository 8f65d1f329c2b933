//! The example programs in a session: a door with a loopback socket, and two other peers that answer every admitted sample.

use std::net::UdpSocket;
use std::time::{Duration, Instant as Wall};

use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, MAX_DATAGRAM, Place, Refusal, SessionKey, SystemEntropy};
use cohaptic_peer::{State, wire};
use cohaptic_units::Instant;

use super::programs::{Language, Running, Summary, summary};
use crate::support::{SEAT, SESSION, config, encode};

/// Position that the other peers claim for their copies \[m\].
const THERE: f64 = 0.02;

/// Door with its socket, and the counts of a session.
struct Served {
    socket: UdpSocket,
    door: AdmissionControl,
    began: Wall,
    key: Option<SessionKey>,
    /// Sequence numbers of the admitted samples, as the door numbered them.
    numbers: Vec<u64>,
    /// Number of samples that each of the other peers has sent.
    answers: u64,
    /// Sequence number of the first sample of each other peer.
    first_number: u64,
    /// `true` if false samples are sent before the samples of the other peers.
    strangers: bool,
}

impl Served {
    fn new(key: Option<SessionKey>, strangers: bool) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
        let door = new_door(key.clone());
        Self { socket, door, began: Wall::now(), key, numbers: Vec::new(), answers: 0, first_number: 1_000_000, strangers }
    }

    /// Replaces the door and counts anew, as a restarted session does.
    fn start_again(&mut self) {
        self.door = new_door(self.key.clone());
        self.numbers.clear();
        self.answers = 0;
        self.first_number = 0;
    }

    /// Handles one datagram, if a datagram comes within 5 ms. Returns whether a datagram came.
    fn serve_one(&mut self) -> bool {
        let mut buffer = [0; 2048];
        // An error is a timeout, or the system's report that the program has closed its socket.
        let Ok((len, from)) = self.socket.recv_from(&mut buffer) else { return false };
        let now = Instant::ZERO.saturating_add(self.began.elapsed());
        match self.door.handle_datagram(now, from, &buffer[..len]) {
            Admission::Sample { sample, .. } => {
                let sample = wire::Sample::<1>::decode(sample.bytes(), 1).unwrap();
                assert_eq!((sample.session, sample.sender), (SESSION, SEAT.0));
                self.numbers.push(sample.sequence);
                self.answer(now);
            }
            Admission::Reply { to, bytes } => drop(self.socket.send_to(&bytes, to)),
            Admission::Refused(_) => {}
        }
        true
    }

    /// Sends a sample of each other peer to the program, after false samples if `strangers`.
    fn answer(&mut self, now: Instant) {
        let mut out = [0; MAX_DATAGRAM];
        let mut send = |sender: u32, session: u64, position: f64, flip: u8| {
            let state = State { position: [position], velocity: [0.0] };
            let sample = encode(&wire::Sample { session, sender, sequence: self.first_number + self.answers, sent: now, state });
            let (to, len) = self.door.seal(now, SEAT, &sample, &mut out).unwrap();
            out[len - 1] ^= flip;
            drop(self.socket.send_to(&out[..len], to));
        };
        if self.strangers {
            // False samples: of another session, not a number, from the program's own place, and with a wrong tag. A believed sample would pull the program
            // far away.
            send(0, SESSION + 1, 1e6, 0);
            send(0, SESSION, f64::NAN, 0);
            send(SEAT.0, SESSION, 1e6, 0);
            if self.key.is_some() {
                send(0, SESSION, 1e6, 0x10);
            }
        }
        send(0, SESSION, THERE, 0);
        send(2, SESSION, THERE, 0);
        self.answers += 1;
    }
}

fn new_door(key: Option<SessionKey>) -> AdmissionControl {
    // Ten minutes are longer than any pause of a busy machine.
    AdmissionControl::new(AdmissionConfig { stale_after: Duration::from_secs(600), ..config() }.with_key(key), &mut SystemEntropy).unwrap()
}

/// Starts a program for `seconds` seconds and serves the program until its end. Returns the door's side and the program's summary, or `None` if the program
/// cannot be run. `restart_after`: number of admitted samples after which the session is restarted.
fn serve(language: Language, with_key: bool, strangers: bool, seconds: f64, restart_after: Option<usize>) -> Option<(Served, Summary)> {
    let program = language.program()?;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.key");
    let key = with_key.then(|| {
        SessionKey::generate_to(&path, &mut SystemEntropy).unwrap();
        SessionKey::read_from(&path).unwrap()
    });
    let mut served = Served::new(key, strangers);
    let mut command = program.command();
    command.arg(served.socket.local_addr().unwrap().to_string());
    command.args(["--session", &SESSION.to_string(), "--place", "1", "--duration", &seconds.to_string(), "--patience", "100"]);
    if with_key {
        // The welcome tells axes, peers and periods.
        command.arg("--key-file").arg(&path);
    } else {
        command.args(["--peers", "3"]);
    }
    let mut restart_after = restart_after;
    let mut running = Running::new(command.spawn().unwrap());
    while running.is_running() || served.serve_one() {
        served.serve_one();
        if restart_after.is_some_and(|count| served.numbers.len() >= count) {
            restart_after = None;
            served.start_again();
        }
    }
    Some((served, summary(running)))
}

/// Serves a program for a longer and longer time until `enough` is true: on a busy machine a program may end before the program is answered. Results are
/// checked only after that.
fn serve_until(
    language: Language,
    with_key: bool,
    strangers: bool,
    seconds: [f64; 4],
    restart_after: Option<usize>,
    enough: impl Fn(&Served, &Summary) -> bool,
) -> Option<(Served, Summary)> {
    for seconds in seconds {
        let (served, summary) = serve(language, with_key, strangers, seconds, restart_after)?;
        if enough(&served, &summary) {
            return Some((served, summary));
        }
    }
    panic!("it was never answered")
}

fn takes_part(language: Language, with_key: bool) {
    // Samples heard in the last tick no longer move the program, so that the position is checked too.
    let heard = |_: &Served, summary: &Summary| summary.others.iter().all(|other| other.received > 0) && summary.position[0] != 0.0;
    let Some((served, summary)) = serve_until(language, with_key, true, [0.3, 2.0, 10.0, 40.0], None, heard) else { return };
    let stats = served.door.stats();
    // Every sample of the program was admitted, in order. Loopback loses no datagram while the socket has room, and the socket has room for 100 datagrams even
    // if nobody reads.
    let joinings_differ = served.numbers.iter().any(|number| number >> 40 > 0);
    let numbers: Vec<u64> = served.numbers.iter().map(|number| number & ((1 << 40) - 1)).collect();
    if summary.sent <= 100 {
        assert_eq!(numbers, (0..summary.sent).collect::<Vec<_>>());
    }
    assert!(numbers.is_sorted_by(|before, after| before < after) && numbers.iter().all(|&number| number < summary.sent));
    assert_eq!(summary.sent, summary.ticks.div_ceil(8));
    assert_eq!(joinings_differ, stats.joinings > 1);
    // The program may have said hello again after a second without a new sample.
    assert!(stats.joinings >= 1 && stats.joinings <= summary.joinings.max(1), "{stats:?} {summary:?}");
    assert_eq!(stats.refused_in_all(), 0, "{stats:?}");
    assert_eq!(stats.welcomed > 0, with_key);
    assert_eq!(summary.others.iter().map(|other| other.sender).collect::<Vec<_>>(), [0, 2]);
    for other in &summary.others {
        assert!(other.received <= served.answers, "{summary:?}");
    }
    // No false sample was believed: only the other peers drew the program, which can overshoot their position by at most the distance itself.
    assert!(summary.position[0] > 0.0 && summary.position[0] < 2.0 * THERE, "{summary:?}");
    assert!(summary.ignored > 0, "{summary:?}");
    let false_ones = if with_key { 4 } else { 3 };
    assert!(summary.ignored <= false_ones * served.answers + stats.welcomed, "{summary:?}");
    assert!(served.door.seat(Instant::MAX, Place(2)).is_some_and(|seat| seat.address.is_none()));
    // Of the programs the bridge alone names its device.
    let label = served.door.seat(Instant::MAX, SEAT).unwrap().label;
    assert_eq!(label.text(), matches!(language, Language::Chai3d).then_some("chai3d"));
}

/// The session is restarted while the program runs: the program hears nothing new for a second, says hello again, and joins again with new keys.
fn comes_back(language: Language) {
    // In the second session, samples to the program count from 0, below the numbers that the program has heard before.
    let back = |served: &Served, summary: &Summary| {
        let is_back = served.first_number == 0 && summary.joinings >= 2 && served.answers > 0 && summary.position[0] != 0.0;
        is_back && served.door.stats().refused(Refusal::NotJoined) > 0
    };
    let Some((served, summary)) = serve_until(language, true, false, [1.8, 6.0, 20.0, 60.0], Some(20), back) else { return };
    let stats = served.door.stats();
    assert!(stats.joinings >= 1 && stats.admitted > 0);
    assert_eq!(stats.refused_in_all(), stats.refused(Refusal::NotJoined));
    assert!(summary.position[0] > 0.0 && summary.position[0] < 2.0 * THERE, "{summary:?}");
}

/// Without a key no welcome tells the program of the restart. All samples seem old until the program forgets the old numbers after a second.
fn believes_the_new_session(language: Language) {
    let back = |served: &Served, summary: &Summary| {
        served.first_number == 0 && summary.others.iter().all(|other| other.late > 0 && other.received > other.late && !other.stale)
    };
    serve_until(language, false, false, [1.8, 6.0, 20.0, 60.0], Some(20), back);
}

#[test]
fn the_python_peer_believes_a_session_that_was_started_again_without_a_key() {
    believes_the_new_session(Language::Python);
}

#[test]
fn the_cpp_peer_believes_a_session_that_was_started_again_without_a_key() {
    believes_the_new_session(Language::Cpp);
}

#[test]
fn the_python_peer_takes_part_without_a_key() {
    takes_part(Language::Python, false);
}

#[test]
fn the_cpp_peer_takes_part_without_a_key() {
    takes_part(Language::Cpp, false);
}

#[test]
fn the_python_peer_takes_part_with_a_key() {
    takes_part(Language::Python, true);
}

#[test]
fn the_cpp_peer_takes_part_with_a_key() {
    takes_part(Language::Cpp, true);
}

#[test]
fn the_bridge_to_chai3d_takes_part_with_a_key() {
    takes_part(Language::Chai3d, true);
}

#[test]
fn the_bridge_to_chai3d_comes_back_when_the_session_is_started_again() {
    comes_back(Language::Chai3d);
}

#[test]
fn the_bridge_to_chai3d_with_another_key_gives_up() {
    gives_up(Language::Chai3d);
}

#[test]
fn the_python_peer_comes_back_when_the_session_is_started_again() {
    comes_back(Language::Python);
}

#[test]
fn the_cpp_peer_comes_back_when_the_session_is_started_again() {
    comes_back(Language::Cpp);
}

/// A program with another key is never answered, and reports the possible cause.
fn gives_up(language: Language) {
    let Some(program) = language.program() else { return };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("session.key");
    SessionKey::generate_to(&path, &mut SystemEntropy).unwrap();
    let mut served = Served::new(Some(SessionKey::generate(&mut SystemEntropy).unwrap()), false);
    let mut command = program.command();
    command.arg(served.socket.local_addr().unwrap().to_string());
    command.args(["--session", &SESSION.to_string(), "--place", "1", "--patience", "0.5", "--key-file"]).arg(&path);
    let mut running = Running::new(command.spawn().unwrap());
    while running.is_running() || served.serve_one() {
        served.serve_one();
    }
    let (success, out, error) = running.output();
    assert!(!success && out.is_empty() && error.contains("is the key the same?"), "{error}");
    let stats = served.door.stats();
    assert!(stats.handled > 0);
    assert_eq!(stats.handled, stats.refused(Refusal::Forged));
}

#[test]
fn the_python_peer_with_another_key_gives_up() {
    gives_up(Language::Python);
}

#[test]
fn the_cpp_peer_with_another_key_gives_up() {
    gives_up(Language::Cpp);
}
