//! The programs in a session: a door behind a loopback socket, and two others who answer every sample that is let in.

use std::net::UdpSocket;
use std::time::{Duration, Instant as Wall};

use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, MAX_DATAGRAM, Place, Refusal, SessionKey, SystemEntropy};
use cohaptic_peer::{State, wire};
use cohaptic_units::Instant;

use super::programs::{Language, Running, Summary, summary};
use crate::support::{SEAT, SESSION, config, encode};

/// Where the others say that their copies are \[m\].
const THERE: f64 = 0.02;

/// A door, its socket, and what came through.
struct Served {
    socket: UdpSocket,
    door: AdmissionControl,
    began: Wall,
    key: Option<SessionKey>,
    /// The numbers of the samples that were let in, as the door numbered them.
    numbers: Vec<u64>,
    /// How many samples each of the others has sent.
    answers: u64,
    /// The number of the first.
    first_number: u64,
    /// Whether each of them comes with a false one.
    strangers: bool,
}

impl Served {
    fn new(key: Option<SessionKey>, strangers: bool) -> Self {
        let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
        socket.set_read_timeout(Some(Duration::from_millis(5))).unwrap();
        let door = new_door(key.clone());
        Self { socket, door, began: Wall::now(), key, numbers: Vec::new(), answers: 0, first_number: 1_000_000, strangers }
    }

    /// As if the session had been ended and started again.
    fn start_again(&mut self) {
        self.door = new_door(self.key.clone());
        self.numbers.clear();
        self.answers = 0;
        self.first_number = 0;
    }

    /// Takes in one datagram, if one comes. Whether one did.
    fn serve_one(&mut self) -> bool {
        let mut buffer = [0; 2048];
        // An error is a timeout, or says that the program has ended.
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
            // From nowhere near, if one of them were believed: of another session, with a wrong tag, not a number, from the peer itself.
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
    // Long enough for any pause that a busy machine makes.
    AdmissionControl::new(AdmissionConfig { stale_after: Duration::from_secs(600), ..config() }.with_key(key), &mut SystemEntropy).unwrap()
}

/// Starts a program for so many seconds, serves it to its end, and gives both sides' accounts. `restart_after`: how many samples are let in before
/// the session is started again.
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
        // Axes, peers and periods are told by the door.
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

/// Serves it for a longer and longer time until it has heard the others: on a busy machine it may end before it is answered. Nothing is checked
/// before.
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
    // What it hears in its last tick does not move it any more.
    let heard = |_: &Served, summary: &Summary| summary.others.iter().all(|other| other.received > 0) && summary.position[0] != 0.0;
    let Some((served, summary)) = serve_until(language, with_key, true, [0.3, 2.0, 10.0, 40.0], None, heard) else { return };
    let stats = served.door.stats();
    // Every sample that it sent was let in, in order: what is on loopback is not lost while the socket has room, which it has for 100 of them
    // even if nobody reads.
    let joinings_differ = served.numbers.iter().any(|number| number >> 40 > 0);
    let numbers: Vec<u64> = served.numbers.iter().map(|number| number & ((1 << 40) - 1)).collect();
    if summary.sent <= 100 {
        assert_eq!(numbers, (0..summary.sent).collect::<Vec<_>>());
    }
    assert!(numbers.is_sorted_by(|before, after| before < after) && numbers.iter().all(|&number| number < summary.sent));
    assert_eq!(summary.sent, summary.ticks.div_ceil(8));
    assert_eq!(joinings_differ, stats.joinings > 1);
    // It may have said hello again if it heard nothing for a second.
    assert!(stats.joinings >= 1 && stats.joinings <= summary.joinings.max(1), "{stats:?} {summary:?}");
    assert_eq!(stats.refused_in_all(), 0, "{stats:?}");
    assert_eq!(stats.welcomed > 0, with_key);
    assert_eq!(summary.others.iter().map(|other| other.sender).collect::<Vec<_>>(), [0, 2]);
    for other in &summary.others {
        assert!(other.received <= served.answers, "{summary:?}");
    }
    // Nothing false was believed: it was drawn to where the others are, and by nothing else. It swings no farther than as far again.
    assert!(summary.position[0] > 0.0 && summary.position[0] < 2.0 * THERE, "{summary:?}");
    assert!(summary.ignored > 0, "{summary:?}");
    let false_ones = if with_key { 4 } else { 3 };
    assert!(summary.ignored <= false_ones * served.answers + stats.welcomed, "{summary:?}");
    assert!(served.door.seat(Instant::MAX, Place(2)).is_some_and(|seat| seat.address.is_none()));
}

/// The session is started again under the program: it hears nothing for a second, says hello again, and is there again with new keys.
fn comes_back(language: Language) {
    // Samples of the second session are answered from number 0, below what it has heard before.
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

/// Without a key nobody tells it that the session was started again, but all that it hears is old; after a second it believes that.
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
fn the_python_peer_comes_back_when_the_session_is_started_again() {
    comes_back(Language::Python);
}

#[test]
fn the_cpp_peer_comes_back_when_the_session_is_started_again() {
    comes_back(Language::Cpp);
}

/// A program with another key is told nothing, and says so.
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
