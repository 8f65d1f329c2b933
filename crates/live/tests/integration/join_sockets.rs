//! A joined peer over a socket: datagrams of strangers, a session that does not fit, and the end of the run.

use std::net::UdpSocket;
use std::ops::ControlFlow;
use std::thread;
use std::time::Duration;

use cohaptic_live::join::{Join, JoinConfig, JoinError, JoinReport, JoinedStatus};
use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, Place, Seat, SessionKey};
use cohaptic_peer::{State, wire};
use cohaptic_realtime::{Pacing, Tolerance, Wishes};
use cohaptic_units::Instant;

use crate::join::{config, scene};
use crate::support::{Counting, encode, key};

/// Socket that waits for a datagram for at most ten seconds.
fn socket() -> UdpSocket {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(10))).unwrap();
    socket
}

/// Runs the peer `left` of a session at `session`, until its length is over or `look` breaks.
fn run(
    session: &UdpSocket,
    key: Option<SessionKey>,
    length: Option<Duration>,
    look: impl FnMut(&JoinedStatus) -> ControlFlow<()>,
) -> Result<JoinReport, JoinError> {
    let config = JoinConfig {
        session: session.local_addr().unwrap(),
        joined: config(key),
        allow_remote: false,
        pacing: Pacing::Sleep,
        wishes: Wishes::NONE,
        // Nothing depends on the speed of this machine.
        tolerance: Tolerance { limit: Duration::from_secs(600) },
        out: None,
        length,
    };
    Join::open(&scene(&[]), 0, config, None).unwrap().run(look)
}

fn sample(sequence: u64) -> Vec<u8> {
    encode(&wire::Sample { session: 7, sender: 1, sequence, sent: Instant::ZERO, state: State { position: [0.01], velocity: [0.0] } })
}

#[test]
fn a_sample_from_another_address_than_that_of_the_session_is_not_taken() {
    let (session, stranger) = (socket(), socket());
    let until_taken = |status: &JoinedStatus| if status.taken > 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    thread::scope(|scope| {
        let running = scope.spawn(|| run(&session, None, Some(Duration::from_secs(60)), until_taken));
        let (_, joined) = session.recv_from(&mut [0; 2048]).unwrap();
        // The datagrams arrive at the socket in this order, so that the first one has been refused when the second one is taken.
        stranger.send_to(&sample(3), joined).unwrap();
        session.send_to(&sample(7), joined).unwrap();
        let report = running.join().unwrap().unwrap();
        let right = report.senders[1];
        assert_eq!((right.taken, right.late, right.lost()), (1, 0, 0));
    });
}

#[test]
fn the_tick_at_the_end_is_not_made_and_every_tick_has_a_lateness() {
    let report = run(&socket(), None, Some(Duration::from_millis(50)), |_| ControlFlow::Continue(())).unwrap();
    // Ticks 0 to 49; fewer if this machine was too late for the last ones.
    assert!((1..=50).contains(&report.status.ticks), "{report:?}");
    assert_eq!((report.ticks.count, report.late_ticks, report.validity.is_valid()), (report.status.ticks, 0, true));
    assert!(report.device.is_none() && report.gate.is_none());
}

#[test]
fn a_session_that_does_not_fit_ends_the_run_by_itself() {
    let session = socket();
    let seats = vec![Seat { place: Place(0), name: "left".to_owned(), tick: Duration::from_millis(1) }];
    let other = AdmissionConfig::new(7, 1, 4, Duration::from_millis(8), seats).with_key(Some(key()));
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut door = AdmissionControl::new(other, &mut Counting::default()).unwrap();
            let mut buffer = [0; 2048];
            let (len, from) = session.recv_from(&mut buffer).unwrap();
            let Admission::Reply { bytes, .. } = door.handle_datagram(Instant::ZERO, from, &buffer[..len]) else { panic!("no welcome") };
            session.send_to(&bytes, from).unwrap();
        });
        // Fifty looks a second: without the end by the welcome, half a minute.
        let mut looks = 0;
        let error = run(&session, Some(key()), None, |_| {
            looks += 1;
            if looks < 1500 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        });
        assert!(matches!(&error, Err(JoinError::Mismatch(_))) && looks < 1500, "{error:?} after {looks} looks");
        assert_eq!(error.unwrap_err().to_string(), "the session is another one: it has 4 peers, this scene 2");
    });
}
