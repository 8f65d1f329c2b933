//! The driver without its loop: each step is called with instants of the test, so that nothing depends on the speed of this machine.

use std::net::UdpSocket;
use std::path::Path;

use cohaptic_peer::State;
use cohaptic_peer::wire::{MAX_LEN, Sample};

use super::*;
use crate::{Admission, AdmissionConfig, AdmissionControl, Label, Place, Seat, SessionKey};

const SCENE: &str = "scene = { title = \"two\", duration = \"3s\", seed = 7 }\nobject = { mass = 0.45 }\n\
    coordination = { strategy = \"average-position\", stiffness = 500.0, damping = 5.0, update = \"8ms\" }\n\
    peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }\n\
    peers = [{ name = \"left\", hand = { force = 1.5 } }, { name = \"right\" }]\n";

fn at(micros: u64) -> Instant {
    Instant::from_nanos(micros * 1000)
}

fn key() -> SessionKey {
    SessionKey::from_bytes([0xa5; 32])
}

fn socket() -> UdpSocket {
    UdpSocket::bind("127.0.0.1:0").unwrap()
}

/// Returns the peer `left` of a session at `session` before its run.
fn open(session: &UdpSocket, key: Option<SessionKey>, length: Option<Duration>, out: Option<&Path>) -> Join {
    let config = JoinConfig {
        session: session.local_addr().unwrap(),
        joined: JoinedConfig { key, scene: 0, label: Label::NONE, stale_after: Duration::from_secs(1) },
        allow_remote: false,
        pacing: Pacing::Sleep,
        wishes: Wishes::NONE,
        tolerance: Tolerance { limit: Duration::from_secs(600) },
        out: out.map(Path::to_path_buf),
        length,
    };
    let scene = Scene::parse_live(SCENE, Path::new("two.toml"), &[]).unwrap();
    Join::open(&scene, 0, config, None).unwrap()
}

/// Handles the deadline of each millisecond in `millis`.
fn handle(join: &mut Join, millis: impl IntoIterator<Item = u64>) {
    for millis in millis {
        assert!(!join.handle_timeout(at(1000 * millis)));
    }
}

/// Lets the peer say hello, and passes the welcome of a session with a key at `at`.
fn welcome(join: &mut Join, at: Instant) {
    let seats = vec![Seat { place: Place(0), name: "left".to_owned(), tick: Duration::from_millis(1) }];
    let admission = AdmissionConfig::new(7, 1, 2, Duration::from_millis(8), seats).with_key(Some(key()));
    let mut door = AdmissionControl::new(admission, &mut SystemEntropy).unwrap();
    handle(join, [0]);
    let (hello, from) = (join.peer.poll_transmit().unwrap(), join.socket.local_address());
    let Admission::Reply { bytes, .. } = door.handle_datagram(at, from, hello.bytes()) else { panic!("no welcome") };
    join.peer.handle_datagram(at, &bytes);
}

fn waits_for_datagrams(join: &Join) -> bool {
    join.readable().into_iter().next().is_some()
}

#[test]
fn the_run_ends_before_the_tick_at_the_end_or_between_two_ticks() {
    for (micros, ticks) in [(3000, 3), (2500, 3), (3001, 4)] {
        let mut join = open(&socket(), None, Some(Duration::from_micros(micros)), None);
        handle(&mut join, 0..10);
        assert_eq!(join.peer.status(at(10_000)).ticks, ticks, "{micros}");
        // The loop wakes up at the end, also if no tick is due then.
        assert_eq!(join.poll_timeout(), Some(at(micros)), "{micros}");
    }
}

#[test]
fn the_length_counts_from_the_welcome_and_before_it_from_the_beginning() {
    let length = Duration::from_millis(3);
    let mut join = open(&socket(), Some(key()), Some(length), None);
    handle(&mut join, [0]);
    assert_eq!(join.end(), Some(at(3000)));
    let mut join = open(&socket(), Some(key()), Some(length), None);
    welcome(&mut join, at(2000));
    handle(&mut join, 2..10);
    assert_eq!((join.peer.status(at(10_000)).ticks, join.poll_timeout()), (3, Some(at(5000))));
    // Without a length the run has no end.
    let mut endless = open(&socket(), None, None, None);
    handle(&mut endless, 0..100);
    assert_eq!((endless.peer.status(at(99_000)).ticks, endless.end(), endless.is_over()), (100, None, false));
    // The clock of the driver has passed the beginning.
    assert!(open(&socket(), None, Some(Duration::ZERO), None).is_over());
}

#[test]
fn between_two_ticks_the_loop_waits_for_a_welcome_and_for_the_rest_of_a_full_batch_alone() {
    let session = socket();
    let mut keyed = open(&session, Some(key()), None, None);
    assert!(waits_for_datagrams(&keyed), "the instant of the welcome is tick 0");
    welcome(&mut keyed, at(2000));
    assert!(!waits_for_datagrams(&keyed), "samples wait in the kernel until the next tick");

    let mut join = open(&session, None, None, None);
    handle(&mut join, [0]);
    assert!(!waits_for_datagrams(&join));
    let state = State { position: [0.01], velocity: [0.0] };
    let batch = UdpEndpoint::BATCH as u64;
    for sequence in 0..=batch {
        let mut buffer = [0; MAX_LEN];
        let len = Sample { session: 7, sender: 1, sequence, sent: Instant::ZERO, state }.encode(1, &mut buffer);
        session.send_to(&buffer[..len], join.socket.local_address()).unwrap();
    }
    for (count, is_more) in [(batch, true), (1, false)] {
        let now = join.clock.now();
        let received = join.receive(now).unwrap();
        assert_eq!((received.count as u64, received.until), (count, now));
        assert_eq!(waits_for_datagrams(&join), is_more);
    }
    assert_eq!(join.peer.senders()[1].taken, batch + 1);
}

/// A device that is full lets a file be created and refuses each write.
#[test]
#[cfg(target_os = "linux")]
fn a_record_that_cannot_be_written_ends_the_run() {
    let folder = tempfile::tempdir().unwrap();
    std::os::unix::fs::symlink("/dev/full", folder.path().join("trajectory.csv")).unwrap();
    let mut join = open(&socket(), None, None, Some(folder.path()));
    // The writer fails at the first full buffer, or the queue of 65,536 rows fills and the next row waits for the writer: either way the run ends.
    let ended = (0..200_000).find(|millis| {
        handle(&mut join, [*millis]);
        join.is_over()
    });
    assert!(ended.is_some());
    assert!(matches!(join.run(|_| ControlFlow::Continue(())), Err(JoinError::Record(_))));
}
