//! Sessions with a key: hello, welcome, and samples sealed under the keys of their joining.

use cohaptic_live::client::{Joined, OpenError};
use cohaptic_live::handshake::Taken;
use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, Label, MAX_DATAGRAM, OtherScene, Place, Refusal, SessionKey};
use cohaptic_peer::wire;

use crate::support::{Counting, SEAT, SESSION, address, admitted, assert_counts, at, config, joining, key, keyed_door, sample, sealed, shake_hands};

#[test]
fn a_peer_says_hello_is_welcomed_and_joins_with_its_first_sample() {
    let mut door = keyed_door();
    let joined = shake_hands(&mut door, at(0), address(1), &joining(1));
    let welcome = joined.welcome();
    assert_eq!((welcome.axes, welcome.peers, welcome.place, welcome.session), (1, 3, SEAT, SESSION));
    assert_eq!((welcome.tick.as_micros(), welcome.update.as_micros()), (1000, 8000));
    assert!(!door.seat(at(0), SEAT).unwrap().present, "a hello takes no seat");
    let (first, passed) = admitted(door.handle_datagram(at(1), address(1), &sealed(&joined, &sample(1, 0))));
    assert!(first);
    assert_eq!(passed.bytes(), sample(1, 0), "the seal is off");
    assert!(!admitted(door.handle_datagram(at(2), address(1), &sealed(&joined, &sample(1, 1)))).0);

    let mut out = [0; MAX_DATAGRAM];
    let (to, len) = door.seal(at(3), SEAT, &sample(0, 9), &mut out).unwrap();
    assert_eq!((to, len), (address(1), 96));
    assert_eq!(joined.open(&out[..len]), Ok(&sample(0, 9)[..]));
    assert_counts(&door, 2, 1, &[]);
}

#[test]
fn without_the_key_nothing_gets_in() {
    let mut door = keyed_door();
    let other_key = SessionKey::from_bytes([0xa4; 32]);
    let stranger = cohaptic_live::client::Joining::new(SESSION, SEAT, &other_key, [1; 16]);
    assert_eq!(door.handle_datagram(at(0), address(1), &stranger.hello()), Admission::Refused(Refusal::Forged));
    assert_eq!(door.handle_datagram(at(0), address(1), &sample(1, 0)), Admission::Refused(Refusal::Unsealed));
    let guess = [sample(1, 0), vec![0; 32]].concat();
    assert_eq!(door.handle_datagram(at(0), address(1), &guess), Admission::Refused(Refusal::NotJoined));
    assert_counts(&door, 0, 0, &[(Refusal::Forged, 1), (Refusal::Unsealed, 1), (Refusal::NotJoined, 1)]);
}

#[test]
fn a_seal_is_good_for_one_address() {
    let mut door = keyed_door();
    let joined = shake_hands(&mut door, at(0), address(1), &joining(1));
    let first = sealed(&joined, &sample(1, 0));
    assert_eq!(door.handle_datagram(at(0), address(2), &first), Admission::Refused(Refusal::NotJoined), "faster than its owner");
    admitted(door.handle_datagram(at(0), address(1), &first));
    assert_eq!(door.handle_datagram(at(0), address(2), &sealed(&joined, &sample(1, 1))), Admission::Refused(Refusal::Forged));
    // An IPv4 address and its mapped form give the same nonce, but the owner of a seat is compared by the address as the socket shows it.
    let mapped = std::net::SocketAddr::new("::ffff:192.0.2.1".parse().unwrap(), 1);
    assert_eq!(door.handle_datagram(at(0), mapped, &sealed(&joined, &sample(1, 1))), Admission::Refused(Refusal::Forged));
}

#[test]
fn what_the_door_sends_cannot_be_sent_back() {
    let mut door = keyed_door();
    let joined = shake_hands(&mut door, at(0), address(1), &joining(1));
    admitted(door.handle_datagram(at(0), address(1), &sealed(&joined, &sample(1, 0))));
    let mut out = [0; MAX_DATAGRAM];
    // The sample claims to come from the seat itself. The door never sends such a sample to the seat, so that only the tag can refuse the sample.
    let (_, len) = door.seal(at(0), SEAT, &sample(1, 1), &mut out).unwrap();
    assert_eq!(door.handle_datagram(at(0), address(1), &out[..len]), Admission::Refused(Refusal::Forged));
    assert_eq!(joined.open(&sealed(&joined, &sample(1, 1))), Err(OpenError::Forged), "nor the other way round");
    let Admission::Reply { bytes, .. } = door.handle_datagram(at(0), address(1), &joining(2).hello()) else { panic!("no welcome") };
    assert_eq!(door.handle_datagram(at(0), address(1), &bytes), Admission::Refused(Refusal::Magic), "a welcome is no hello");
}

#[test]
fn a_recording_of_an_earlier_joining_is_worthless() {
    let mut door = keyed_door();
    let mut recording = vec![joining(1).hello().to_vec()];
    let joined = shake_hands(&mut door, at(0), address(1), &joining(1));
    for number in 0..50 {
        recording.push(sealed(&joined, &sample(1, number)));
        admitted(door.handle_datagram(at(number), address(1), recording.last().unwrap()));
    }
    // Replayed at once, from the same address: every number has been seen before. The hello is answered, which changes nothing.
    for datagram in &recording {
        door.handle_datagram(at(50), address(1), datagram);
    }
    assert_counts(&door, 50, 2, &[(Refusal::Replayed, 50)]);
    assert_eq!(door.seat(at(50), SEAT).unwrap().heard, Some(at(49)));
    // Replayed after the peer has gone: refused in the same way.
    for datagram in &recording {
        door.handle_datagram(at(5000), address(1), datagram);
    }
    assert_counts(&door, 50, 3, &[(Refusal::Replayed, 100)]);
    // Replayed after the peer has joined again: the keys have changed.
    let again = shake_hands(&mut door, at(6000), address(1), &joining(2));
    assert!(admitted(door.handle_datagram(at(6000), address(1), &sealed(&again, &sample(1, 0)))).0);
    for datagram in &recording {
        door.handle_datagram(at(7000), address(1), datagram);
    }
    assert_counts(&door, 51, 5, &[(Refusal::Replayed, 100), (Refusal::Forged, 50)]);
    // Replayed at another door with the same key and the same session: the nonces differ.
    let mut other = Counting::default();
    cohaptic_live::Entropy::fill(&mut other, &mut [0; 64]).unwrap();
    let mut door = AdmissionControl::new(config().with_key(Some(key())), &mut other).unwrap();
    for datagram in &recording {
        door.handle_datagram(at(0), address(1), datagram);
    }
    assert_counts(&door, 0, 1, &[(Refusal::NotJoined, 50)]);
}

#[test]
fn a_present_peer_is_not_thrown_out_and_a_silent_one_is_replaced() {
    let mut door = keyed_door();
    let first = shake_hands(&mut door, at(0), address(1), &joining(1));
    admitted(door.handle_datagram(at(0), address(1), &sealed(&first, &sample(1, 0))));
    // A second program has the key, and asks for the same place.
    let second = shake_hands(&mut door, at(10), address(2), &joining(2));
    assert_eq!(door.handle_datagram(at(10), address(2), &sealed(&second, &sample(1, 0))), Admission::Refused(Refusal::SeatTaken));
    // The notice is the second program's alone.
    let notice = door.notice(&sealed(&second, &sample(1, 0))).unwrap();
    let taken = |joined: &Joined| Taken { session: SESSION, place: SEAT, seal: Some((&key(), joined.welcome().client_nonce)) }.is(notice.bytes());
    assert_eq!((taken(&second), taken(&first), notice.bytes().len()), (true, false, 56));
    assert_eq!(door.notice(&sample(1, 0)), None, "not sealed");
    admitted(door.handle_datagram(at(11), address(1), &sealed(&first, &sample(1, 1))));
    let (joined, passed) = admitted(door.handle_datagram(at(111), address(2), &sealed(&second, &sample(1, 1))));
    assert!(joined, "its welcome is still good: nobody has joined since");
    assert_eq!(wire::Sample::<1>::decode(passed.bytes(), 1).unwrap().sequence, 1 << 40 | 1);
    // The first program comes back too late: its joining is over, and the door cannot tell its samples from forged samples.
    assert_eq!(door.handle_datagram(at(112), address(1), &sealed(&first, &sample(1, 2))), Admission::Refused(Refusal::Forged));
    let mut out = [0; MAX_DATAGRAM];
    let (to, len) = door.seal(at(113), SEAT, &sample(0, 0), &mut out).unwrap();
    assert_eq!(to, address(2));
    assert_eq!(first.open(&out[..len]), Err(OpenError::OtherJoining));
}

#[test]
fn a_program_that_starts_again_at_its_address_joins_at_once() {
    let mut door = keyed_door();
    let first = shake_hands(&mut door, at(0), address(1), &joining(1));
    admitted(door.handle_datagram(at(0), address(1), &sealed(&first, &sample(1, 500))));
    let again = shake_hands(&mut door, at(1), address(1), &joining(2));
    // The old keys are valid until the first sample under the new keys.
    admitted(door.handle_datagram(at(2), address(1), &sealed(&first, &sample(1, 501))));
    assert!(admitted(door.handle_datagram(at(3), address(1), &sealed(&again, &sample(1, 0)))).0);
    assert_eq!(door.handle_datagram(at(4), address(1), &sealed(&first, &sample(1, 502))), Admission::Refused(Refusal::Forged));
}

#[test]
fn a_peer_that_was_silent_goes_on_under_its_keys() {
    let mut door = keyed_door();
    let joined = shake_hands(&mut door, at(0), address(1), &joining(1));
    admitted(door.handle_datagram(at(0), address(1), &sealed(&joined, &sample(1, 7))));
    assert!(!door.seat(at(60_000), SEAT).unwrap().present);
    assert_eq!(door.handle_datagram(at(60_000), address(1), &sealed(&joined, &sample(1, 7))), Admission::Refused(Refusal::Replayed));
    let (anew, _) = admitted(door.handle_datagram(at(60_000), address(1), &sealed(&joined, &sample(1, 8))));
    assert!(!anew);
    assert!(door.seat(at(60_000), SEAT).unwrap().present);
}

#[test]
fn each_fault_of_a_hello_has_its_own_count() {
    let mut door = keyed_door();
    let hello = |session: u64, place: u32| cohaptic_live::client::Joining::new(session, Place(place), &key(), [1; 16]).hello();
    let mut refuse = |cause: Refusal, bytes: &[u8]| {
        assert_eq!(door.handle_datagram(at(0), address(1), bytes), Admission::Refused(cause), "{cause}");
    };
    let edited = |at: usize, byte: u8| {
        let mut bytes = hello(SESSION, 1);
        bytes[at] ^= byte;
        bytes
    };
    refuse(Refusal::ForeignSession, &hello(43, 1));
    refuse(Refusal::UnknownSeat, &hello(SESSION, 0));
    refuse(Refusal::UnknownSeat, &hello(SESSION, u32::MAX));
    refuse(Refusal::Version, &edited(4, 2));
    refuse(Refusal::Reserved, &edited(6, 1));
    refuse(Refusal::Reserved, &edited(23, 1));
    refuse(Refusal::Reserved, &edited(71, 0x80));
    refuse(Refusal::Forged, &edited(24, 1));
    refuse(Refusal::Forged, &edited(87, 1));
    refuse(Refusal::Length, &hello(SESSION, 1)[..87]);
    refuse(Refusal::Length, &[&hello(SESSION, 1)[..], &[0]].concat());
    assert_eq!(door.stats().welcomed, 0);
}

#[test]
fn secrets_are_not_printed() {
    let mut door = keyed_door();
    let joined = shake_hands(&mut door, at(0), address(1), &joining(1));
    admitted(door.handle_datagram(at(0), address(1), &sealed(&joined, &sample(1, 0))));
    let printed = format!("{door:?} {joined:?} {:?} {:?}", config().with_key(Some(key())), joining(1));
    // The key is 32 times the byte 0xa5, which is 165.
    assert!(!printed.contains("165, 165") && !printed.to_lowercase().contains("a5a5"), "{printed}");
    assert!(printed.contains("SessionKey(secret)") && printed.contains("WayKey(secret)"));
}

#[test]
fn a_peer_of_another_scene_is_counted_and_not_answered() {
    let scene = 0x8594_4171_f739_67e8;
    let mut door = AdmissionControl::new(AdmissionConfig { scene, ..config().with_key(Some(key())) }, &mut Counting::default()).unwrap();
    let asks = |scene: u64| joining(1).introduced(scene, Label::NONE).hello();
    assert_eq!(door.handle_datagram(at(0), address(1), &asks(7)), Admission::Refused(Refusal::OtherScene));
    assert_eq!(door.other_scene(), Some(OtherScene { place: SEAT, from: address(1), theirs: 7, ours: scene }));
    assert_eq!((door.stats().refused(Refusal::OtherScene), door.stats().welcomed), (1, 0));
    // A hello of the same scene is answered, and so is one that tells none.
    for told in [scene, 0] {
        assert!(matches!(door.handle_datagram(at(0), address(1), &asks(told)), Admission::Reply { .. }), "{told:x}");
    }
    // Without the key nobody makes the session show a fingerprint.
    let mut forged = asks(9);
    forged[87] ^= 1;
    assert_eq!(door.handle_datagram(at(0), address(1), &forged), Admission::Refused(Refusal::Forged));
    assert_eq!(door.other_scene().unwrap().theirs, 7);
    // A session that does not know its scene answers everybody.
    assert!(matches!(keyed_door().handle_datagram(at(0), address(1), &asks(7)), Admission::Reply { .. }));
}

#[test]
fn the_label_of_the_hello_is_that_of_the_peer_that_joins_and_lost_samples_are_counted() {
    let mut door = keyed_door();
    let introduced = |nonce: u8, label: &str| joining(nonce).introduced(0, Label::new(label).unwrap());
    let first = shake_hands(&mut door, at(0), address(1), &introduced(1, "falcon"));
    assert_eq!(door.seat(at(0), SEAT).unwrap().label, Label::NONE, "a hello alone is nobody");
    for number in [5, 6, 9, 8] {
        admitted(door.handle_datagram(at(0), address(1), &sealed(&first, &sample(1, number))));
    }
    let status = door.seat(at(0), SEAT).unwrap();
    assert_eq!((status.label.text(), status.admitted, status.lost), (Some("falcon"), 4, 1), "number 7 is missing");
    // The hello of a program at another address does not rename a peer that is there.
    shake_hands(&mut door, at(0), address(2), &introduced(2, "chai3d"));
    assert_eq!(door.seat(at(0), SEAT).unwrap().label.text(), Some("falcon"));
    // A new joining counts from its own first number.
    let again = shake_hands(&mut door, at(0), address(1), &introduced(3, "inverse3"));
    for number in [0, 3] {
        admitted(door.handle_datagram(at(0), address(1), &sealed(&again, &sample(1, number))));
    }
    let status = door.seat(at(0), SEAT).unwrap();
    assert_eq!((status.label.text(), status.admitted, status.lost), (Some("inverse3"), 6, 3));
}

#[test]
fn a_label_of_other_bytes_than_printable_ones_is_refused() {
    let mut door = keyed_door();
    let mut hello = joining(1).introduced(0, Label::new("falcon").unwrap()).hello();
    hello[50] = 0x1b;
    assert_eq!(door.handle_datagram(at(0), address(1), &hello), Admission::Refused(Refusal::Reserved));
}
