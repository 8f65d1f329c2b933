//! Clock, hellos, sending and figures of a joined peer, in virtual time.

use std::time::Duration;

use cohaptic_live::join::JoinedPeer;
use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, Place, Refusal, Seat};
use cohaptic_peer::{State, wire};
use cohaptic_units::Instant;

use crate::join::{at, pass, peer};
use crate::support::{Counting, address, encode, key};

/// Admission control of the session, for scenes with the fingerprint `scene`.
fn door(scene: u64) -> AdmissionControl {
    let seats = vec![Seat { place: Place(0), name: "left".to_owned(), tick: Duration::from_millis(1) }];
    let admission = AdmissionConfig { scene, ..AdmissionConfig::new(7, 1, 2, Duration::from_millis(8), seats) };
    AdmissionControl::new(admission.with_key(Some(key())), &mut Counting::default()).unwrap()
}

fn sample(sender: u32, sequence: u64) -> Vec<u8> {
    encode(&wire::Sample { session: 7, sender, sequence, sent: Instant::ZERO, state: State { position: [0.01], velocity: [0.0] } })
}

/// Returns the send times \[ms\] of the samples that a peer without a key sends until `millis`, and the position of its copy at each tick.
fn sent(overrides: &[&str], millis: u64) -> (Vec<u64>, Vec<f64>) {
    let mut positions = Vec::new();
    let datagrams = pass(&mut peer(overrides, None, None), at(millis * 1000), &mut |row| positions.push(row.object.position[0]));
    let times = datagrams.iter().map(|datagram| wire::Sample::<1>::decode(datagram, 1).unwrap().sent.as_nanos() / 1_000_000);
    (times.collect(), positions)
}

/// A clock of the scene stands for the clock of the computer in virtual time. At a computer that joins, the clock is the computer's own.
#[test]
fn a_clock_in_the_scene_changes_no_tick_of_a_joined_peer() {
    let rows = |overrides: &[&str]| {
        let mut rows = Vec::new();
        pass(&mut peer(overrides, None, None), at(200_000), &mut |row| {
            rows.push((row.at, row.device.position[0], row.object.position[0], row.coupling_force[0]));
        });
        rows
    };
    let regular = rows(&[]);
    assert_eq!(regular.len(), 201);
    assert_eq!(rows(&["peers.left.clock={ offset = \"3ms\", drift = \"20000ppm\" }"]), regular);
    // Automatic parameters need clocks that are alike, as the clocks of this scene are.
    for law in ["local-damping", "local-lag"] {
        let strategy = format!("coordination.strategy=\"{law}\"");
        let regular = rows(&[&strategy]);
        assert_eq!(rows(&[&strategy, "peer.clock={ offset = \"3ms\", drift = \"20000ppm\" }"]), regular, "{law}");
    }
}

#[test]
fn samples_are_sent_at_the_phase_of_the_peer() {
    assert_eq!(sent(&[], 20).0, [0, 8, 16]);
    assert_eq!(sent(&["peers.left.phase=3"], 20).0, [3, 11, 19]);
}

/// A dead band counts from the latest sample that was sent: its state and its time.
#[test]
fn dead_bands_count_from_the_last_sample_sent() {
    let (found, positions) = sent(&["coordination.send-when={ position = 0.0005, heartbeat = \"96ms\" }"], 900);
    let (mut last, mut expected, mut moved) = (0, vec![0], 0);
    for tick in (8..=900).step_by(8) {
        let is_moved = (positions[tick] - positions[last]).abs() >= 0.0005;
        if is_moved || tick - last >= 96 {
            expected.push(tick as u64);
            (last, moved) = (tick, moved + u64::from(is_moved));
        }
    }
    assert_eq!(found, expected);
    // Both reasons occur, and most samples are left out.
    assert!(moved >= 3 && expected.len() as u64 > moved + 3 && expected.len() < 56, "{moved}: {expected:?}");
}

#[test]
fn the_hello_tells_the_fingerprint_and_the_label_of_the_configuration() {
    // The configuration of the tests has the fingerprint 7 and the label "test".
    let mut left = peer(&[], Some(key()), None);
    let hello = pass(&mut left, at(0), &mut |_| ()).remove(0);
    assert_eq!(door(8).handle_datagram(at(0), address(1), &hello), Admission::Refused(Refusal::OtherScene));
    let mut door = door(7);
    let Admission::Reply { bytes, .. } = door.handle_datagram(at(0), address(1), &hello) else { panic!("no welcome") };
    left.handle_datagram(at(0), &bytes);
    for datagram in pass(&mut left, at(0), &mut |_| ()) {
        door.handle_datagram(at(0), address(1), &datagram);
    }
    assert_eq!(door.seat(at(0), Place(0)).unwrap().label.text(), Some("test"));
}

/// The silence of the session counts from tick 0 and not from the beginning of the program, and before the welcome there is no session.
#[test]
fn a_session_is_there_from_the_welcome_on_and_silent_a_second_later() {
    let mut left = peer(&[], Some(key()), None);
    let hello = pass(&mut left, at(0), &mut |_| ()).remove(0);
    pass(&mut left, at(4_999_000), &mut |_| ());
    let is_there = |left: &JoinedPeer, millis: u64| left.status(at(millis * 1000)).is_session_there;
    assert!(left.began().is_none() && !is_there(&left, 4999));
    let Admission::Reply { bytes, .. } = door(7).handle_datagram(at(5_000_000), address(1), &hello) else { panic!("no welcome") };
    left.handle_datagram(at(5_000_000), &bytes);
    for (millis, there) in [(5000, true), (5999, true), (6000, false)] {
        pass(&mut left, at(millis * 1000), &mut |_| ());
        let status = left.status(at(millis * 1000));
        assert_eq!((status.is_session_there, status.silences), (there, u64::from(!there)), "{millis}");
        assert_eq!((status.ticks, status.elapsed), (millis - 4999, Duration::from_millis(millis - 5000)));
    }
}

#[test]
fn the_status_sums_the_samples_of_all_senders() {
    let mut left = peer(&["peers=[{ name = \"left\" }, { name = \"middle\" }, { name = \"right\" }]"], None, None);
    pass(&mut left, at(0), &mut |_| ());
    // One of five samples of the second peer is lost, and one comes late. Three of five samples of the third peer are lost.
    let numbers = [(1, 10), (1, 12), (2, 5), (1, 11), (1, 14), (2, 9)];
    for (micros, (sender, sequence)) in (100..).zip(numbers) {
        left.handle_datagram(at(micros), &sample(sender, sequence));
    }
    pass(&mut left, at(1000), &mut |_| ());
    let status = left.status(at(1000));
    assert_eq!((status.taken, status.lost, status.sent), (5, 4, 1));
    assert_eq!(status.age, Some(Duration::from_micros(895)));
    let by_sender: Vec<_> = left.senders().iter().map(|sender| (sender.taken, sender.late, sender.lost())).collect();
    assert_eq!(by_sender, [(0, 0, 0), (3, 1, 1), (2, 0, 3)]);
}
