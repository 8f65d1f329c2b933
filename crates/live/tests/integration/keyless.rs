//! Sessions without a key: the first good sample takes a seat.

use cohaptic_live::AdmissionControl;
use cohaptic_live::handshake::Taken;
use cohaptic_live::{Admission, AdmissionConfig, AdmissionConfigError, Limits, MAX_DATAGRAM, Place, Refusal, Seat};
use cohaptic_peer::{State, wire};
use std::time::Duration;

use crate::support::{Counting, SEAT, SESSION, STALE, address, admitted, assert_counts, at, config, encode, keyless_door, sample, seat};

#[test]
fn the_first_sample_takes_the_seat_and_passes_unchanged() {
    let mut door = keyless_door();
    assert!(!door.seat(at(0), SEAT).unwrap().present);
    let (joined, passed) = admitted(door.handle_datagram(at(0), address(1), &sample(1, 17)));
    assert!(joined);
    assert_eq!(passed.bytes(), sample(1, 17));
    let (joined, passed) = admitted(door.handle_datagram(at(8), address(1), &sample(1, 18)));
    assert!(!joined);
    assert_eq!(passed.bytes(), sample(1, 18));
    let status = door.seat(at(8), SEAT).unwrap();
    assert_eq!((status.name, status.address, status.heard, status.present), ("right", Some(address(1)), Some(at(8)), true));
    assert_eq!((status.joinings, status.admitted), (1, 2));
    assert_eq!(door.seats(at(8)).map(|seat| seat.place).collect::<Vec<_>>(), [Place(1), Place(2)]);
    assert_counts(&door, 2, 0, &[]);
}

#[test]
fn a_present_peer_keeps_its_seat_and_a_silent_one_loses_it() {
    let mut door = keyless_door();
    admitted(door.handle_datagram(at(0), address(1), &sample(1, 500)));
    assert_eq!(door.handle_datagram(at(99), address(2), &sample(1, 0)), Admission::Refused(Refusal::SeatTaken));
    let notice = door.notice(&sample(1, 0)).unwrap();
    assert!(Taken { session: SESSION, place: SEAT, seal: None }.is(notice.bytes()) && notice.bytes().len() == 24);
    assert!((door.notice(&sample(0, 0)), door.notice(&[0; 64])) == (None, None), "no seat, and no sample");
    // A refused sample does not count as heard: at 100 ms the first program is gone.
    assert!(!door.seat(at(100), SEAT).unwrap().present);
    let (joined, passed) = admitted(door.handle_datagram(at(100), address(2), &sample(1, 3)));
    assert!(joined);
    // Inside the session the sample is newer than all samples before, although the program counts anew.
    let inside = wire::Sample::<1>::decode(passed.bytes(), 1).unwrap();
    assert_eq!(inside.sequence, 1 << 40 | 3);
    assert_eq!(door.handle_datagram(at(101), address(1), &sample(1, 501)), Admission::Refused(Refusal::SeatTaken));
    assert_counts(&door, 2, 0, &[(Refusal::SeatTaken, 2)]);
}

#[test]
fn a_program_that_starts_again_at_its_address_waits_until_its_old_self_is_gone() {
    let mut door = keyless_door();
    admitted(door.handle_datagram(at(0), address(1), &sample(1, 500)));
    assert_eq!(door.handle_datagram(at(50), address(1), &sample(1, 0)), Admission::Refused(Refusal::Replayed));
    let (joined, _) = admitted(door.handle_datagram(at(100), address(1), &sample(1, 1)));
    assert!(joined);
    assert_eq!(door.stats().joinings, 2);
}

#[test]
fn late_samples_pass_once_within_the_window() {
    let mut door = keyless_door();
    for number in [0, 200, 73, 72, 199, 73, 200, 201] {
        door.handle_datagram(at(number / 8), address(1), &sample(1, number));
    }
    // Number 72 is 128 below the highest number. Numbers 73 and 200 are repeated.
    assert_counts(&door, 5, 0, &[(Refusal::Replayed, 3)]);
}

#[test]
fn samples_go_to_who_is_present_and_to_nobody_else() {
    let mut door = keyless_door();
    let mut out = [0; MAX_DATAGRAM];
    assert_eq!(door.seal(at(0), SEAT, &sample(0, 0), &mut out), None);
    admitted(door.handle_datagram(at(0), address(1), &sample(1, 0)));
    assert_eq!(door.seal(at(99), SEAT, &sample(0, 0), &mut out), Some((address(1), 64)));
    assert_eq!(out[..64], sample(0, 0));
    assert_eq!(door.seal(at(100), SEAT, &sample(0, 1), &mut out), None, "silent for as long as a peer may be");
    assert_eq!(door.seal(at(0), Place(0), &sample(2, 1), &mut out), None, "no seat");
    assert_eq!(door.seal(at(0), SEAT, &[0; 153], &mut out), None, "longer than a sample");
    assert_eq!((door.stats().sent, door.stats().nobody_there), (1, 4));
}

#[test]
fn each_fault_has_its_own_count() {
    let mut door = keyless_door();
    let mut refuse = |cause: Refusal, bytes: &[u8]| {
        assert_eq!(door.handle_datagram(at(0), address(1), bytes), Admission::Refused(cause), "{cause}");
    };
    let edited = |at: usize, byte: u8| {
        let mut bytes = sample(1, 0);
        bytes[at] = byte;
        bytes
    };
    let with_state = |position: f64, velocity: f64| {
        encode(&wire::Sample { session: SESSION, sender: 1, sequence: 0, sent: at(0), state: State { position: [position], velocity: [velocity] } })
    };
    refuse(Refusal::TooShort, &[]);
    refuse(Refusal::TooShort, &sample(1, 0)[..47]);
    refuse(Refusal::Oversized, &[0; 185]);
    refuse(Refusal::Oversized, &[b'C'; 65_507]);
    refuse(Refusal::Magic, &edited(0, b'X'));
    refuse(Refusal::Version, &edited(4, 2));
    refuse(Refusal::Axes, &edited(6, 2));
    refuse(Refusal::Length, &sample(1, 0)[..63]);
    refuse(Refusal::Motion, &edited(7, 1));
    refuse(Refusal::NotFinite, &with_state(f64::NAN, 0.0));
    refuse(Refusal::NotFinite, &with_state(0.0, f64::INFINITY));
    refuse(Refusal::ForeignSession, &edited(8, 43));
    refuse(Refusal::UnknownSeat, &sample(0, 0));
    refuse(Refusal::UnknownSeat, &sample(3, 0));
    refuse(Refusal::SequenceRange, &sample(1, 1 << 40));
    refuse(Refusal::SequenceRange, &sample(1, u64::MAX));
    refuse(Refusal::Keyless, &[sample(1, 0), vec![0; 32]].concat());
    refuse(Refusal::Keyless, &crate::support::joining(1).hello());
    refuse(Refusal::Length, &[&b"CHPH\x01\x00"[..], &[0; 81]].concat());
    assert!(door.seats(at(0)).all(|seat| seat.address.is_none()), "nothing of it has taken a seat");
    assert_eq!(door.stats().refused_in_all(), 19);
}

#[test]
fn limits_keep_a_copy_in_the_room() {
    let limits = Some(Limits { position: 1.0, velocity: 10.0 });
    let mut door = AdmissionControl::new(AdmissionConfig { limits, ..config() }, &mut Counting::default()).unwrap();
    let mut send = |sequence: u64, position: f64, velocity: f64| {
        let state = State { position: [position], velocity: [velocity] };
        door.handle_datagram(at(0), address(1), &encode(&wire::Sample { session: SESSION, sender: 1, sequence, sent: at(0), state }))
    };
    assert_eq!(send(0, 1e300, 0.0), Admission::Refused(Refusal::OutOfRange));
    assert_eq!(send(1, 0.0, -10.1), Admission::Refused(Refusal::OutOfRange));
    admitted(send(2, -1.0, 10.0));
}

#[test]
fn a_configuration_that_makes_no_sense_makes_no_door() {
    let refuse = |config: AdmissionConfig| AdmissionControl::new(config, &mut Counting::default()).unwrap_err();
    assert_eq!(refuse(AdmissionConfig { axes: 0, ..config() }), AdmissionConfigError::Axes { found: 0 });
    assert_eq!(refuse(AdmissionConfig { axes: 4, ..config() }), AdmissionConfigError::Axes { found: 4 });
    assert_eq!(refuse(AdmissionConfig { peers: 2, ..config() }), AdmissionConfigError::Beyond { place: Place(2), peers: 2 });
    let twice = vec![seat(SEAT, "a"), seat(SEAT, "b")];
    assert_eq!(refuse(AdmissionConfig { seats: twice, ..config() }), AdmissionConfigError::Twice { place: SEAT });
    assert_eq!(
        refuse(AdmissionConfig { seats: vec![Seat { tick: Duration::ZERO, ..seat(SEAT, "a") }], ..config() }),
        AdmissionConfigError::Span { name: "tick", found: Duration::ZERO }
    );
    assert_eq!(refuse(AdmissionConfig { update: Duration::MAX, ..config() }), AdmissionConfigError::Span { name: "update", found: Duration::MAX });
    let limits = Limits { position: f64::INFINITY, velocity: 0.0 };
    assert_eq!(refuse(AdmissionConfig { limits: Some(limits), ..config() }), AdmissionConfigError::Limits { found: limits });
    assert_eq!(STALE, config().stale_after);
}
