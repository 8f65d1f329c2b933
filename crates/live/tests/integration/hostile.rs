//! Datagrams of strangers: no datagram changes a seat, causes a panic or uses up memory, and every datagram is counted once.

use cohaptic_live::client::{Client, ClientConfig, Heard, Joined};
use cohaptic_live::handshake::Taken;
use cohaptic_live::{Admission, AdmissionControl, MAX_DATAGRAM, Place, Refusal};
use cohaptic_tests_common::properties;
use proptest::prelude::*;

use crate::support::{
    Counting, SEAT, SESSION, address, admitted, assert_counts, at, cases, joining, key, keyed_door, keyless_door, sample, sealed, shake_hands,
};

/// Returns a door whose `SEAT` is taken from address 1 by a sample with the number 10, and the peer that took the seat.
fn taken() -> (AdmissionControl, Joined) {
    let mut door = keyed_door();
    let joined = shake_hands(&mut door, at(0), address(1), &joining(1));
    admitted(door.handle_datagram(at(0), address(1), &sealed(&joined, &sample(1, 10))));
    (door, joined)
}

/// Returns the state of all seats as text, without the counters of the door. A stranger must not be able to change this text.
fn shown(door: &AdmissionControl) -> String {
    door.seats(at(50)).map(|seat| format!("{seat:?}")).collect()
}

#[test]
fn every_flipped_bit_of_a_sealed_sample_is_refused() {
    let (mut door, joined) = taken();
    let good = sealed(&joined, &sample(1, 11));
    let before = shown(&door);
    let mut forged = 0;
    for bit in 0..8 * good.len() {
        let mut bad = good.clone();
        bad[bit / 8] ^= 1 << (bit % 8);
        let Admission::Refused(cause) = door.handle_datagram(at(1), address(1), &bad) else { panic!("bit {bit} passed") };
        // The tag alone protects the sequence number, the time of sending, the state and the seal.
        if (24..40).contains(&(bit / 8)) || bit / 8 >= 48 {
            // Bit 62 of −1.5 is the only bit of its exponent that is not set. Setting the bit makes a number that is not a number.
            let nan = bit == 8 * 56 + 62;
            assert_eq!(cause, if nan { Refusal::NotFinite } else { Refusal::Forged }, "bit {bit}");
            forged += u32::from(!nan);
        }
    }
    assert_eq!(forged, 8 * (16 + 48) - 1);
    assert_eq!(shown(&door), before);
    // Refusals by field: magic, version, axes, motion, session, sender and zeros. A flipped bit makes the sender 1 into 3, 0 and others, but never into 2, so
    // that no changed sender has a seat.
    let count = |cause: Refusal| door.stats().refused(cause);
    assert_eq!([Refusal::Magic, Refusal::Version, Refusal::Axes, Refusal::Motion].map(count), [32, 16, 8, 8]);
    assert_eq!([Refusal::Reserved, Refusal::ForeignSession, Refusal::UnknownSeat].map(count), [32 + 64, 64, 32]);
    assert_eq!(door.stats().refused_in_all(), 8 * 96);
    admitted(door.handle_datagram(at(1), address(1), &good));
}

#[test]
fn every_flipped_bit_and_every_cut_of_a_hello_is_refused() {
    let mut door = keyed_door();
    let good = joining(1).hello();
    for bit in 0..8 * good.len() {
        let mut bad = good;
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(matches!(door.handle_datagram(at(0), address(1), &bad), Admission::Refused(_)), "bit {bit} passed");
    }
    for len in 0..good.len() {
        assert!(matches!(door.handle_datagram(at(0), address(1), &good[..len]), Admission::Refused(_)), "{len} bytes passed");
    }
    assert_eq!(door.stats().refused_in_all(), 8 * 88 + 88);
}

#[test]
fn every_cut_of_a_sealed_sample_is_refused() {
    let (mut door, joined) = taken();
    let good = sealed(&joined, &sample(1, 11));
    for len in 0..good.len() {
        door.handle_datagram(at(1), address(1), &good[..len]);
    }
    // Cuts of 48 to 95 bytes have no valid length. The cut of 64 bytes is a sample without its seal.
    assert_counts(&door, 1, 1, &[(Refusal::TooShort, 48), (Refusal::Length, 47), (Refusal::Unsealed, 1)]);
}

/// Generates a datagram of a stranger: noise, or a good datagram with changed bytes.
fn datagram() -> impl Strategy<Value = Vec<u8>> {
    let noise = prop::collection::vec(any::<u8>(), 0..200);
    let joined = {
        let mut door = keyed_door();
        shake_hands(&mut door, at(0), address(1), &joining(1))
    };
    let good = vec![sample(1, 11), sealed(&joined, &sample(1, 11)), joining(1).hello().to_vec()];
    let changed = (prop::sample::select(good), prop::collection::vec((any::<prop::sample::Index>(), 1..=255_u8), 1..6), 0..3_usize).prop_map(
        |(mut bytes, changes, more)| {
            for (place, mask) in changes {
                let place = place.index(bytes.len());
                bytes[place] ^= mask;
            }
            bytes.extend(std::iter::repeat_n(0, more));
            bytes
        },
    );
    prop_oneof![noise, changed]
}

properties! {
    #![proptest_config(cases(300))]

    /// Sends 100 datagrams in each of 300 cases. Two changes of the same byte can cancel out. The datagram is then good, and is skipped, because a stranger
    /// can only repeat a good datagram.
    #[test]
    fn strangers_change_nothing_at_a_door_with_a_key(datagrams in prop::collection::vec((datagram(), 1..4_u16), 100)) {
        let (mut door, joined) = taken();
        let before = shown(&door);
        let good = [sealed(&joined, &sample(1, 11)), joining(1).hello().to_vec()];
        for (bytes, port) in &datagrams {
            if good.contains(bytes) {
                continue;
            }
            let admission = door.handle_datagram(at(50), address(*port), bytes);
            prop_assert!(matches!(admission, Admission::Refused(_)), "{admission:?}");
        }
        prop_assert_eq!(shown(&door), before);
        prop_assert_eq!((door.stats().admitted, door.stats().joinings, door.stats().welcomed), (1, 1, 1));
        prop_assert_eq!(door.stats().handled, 2 + door.stats().refused_in_all());
    }

    /// Without a key, an admitted datagram is a good sample of this session from a seat, and a sample that joins has a higher number than all joinings before.
    #[test]
    fn a_door_without_a_key_lets_in_good_samples_alone(datagrams in prop::collection::vec((datagram(), 1..4_u16, 0..60_u64), 100)) {
        let mut door = keyless_door();
        let mut now = at(0);
        let mut newest = std::collections::BTreeMap::new();
        for (bytes, port, later) in &datagrams {
            now = now.saturating_add_nanos(later * 1_000_000);
            match door.handle_datagram(now, address(*port), bytes) {
                Admission::Sample { place, joined, sample } => {
                    let inside = cohaptic_peer::wire::Sample::<1>::decode(sample.bytes(), 1).unwrap();
                    let outside = cohaptic_peer::wire::Sample::<1>::decode(bytes, 1).unwrap();
                    prop_assert_eq!((inside.sender, inside.session), (place.0, SESSION));
                    prop_assert!(inside.state == outside.state && inside.state.is_finite());
                    if joined {
                        let before = newest.insert(place, inside.sequence);
                        prop_assert!(before.is_none_or(|before| inside.sequence > before));
                    }
                }
                Admission::Refused(_) => {}
                Admission::Reply { .. } => prop_assert!(false, "a welcome without a key"),
            }
        }
        let stats = door.stats();
        prop_assert_eq!(stats.handled, 100);
        prop_assert_eq!(stats.handled, stats.admitted + stats.refused_in_all());
    }

    /// The client accepts only samples that the door made, and only the welcome for its own hello.
    #[test]
    fn strangers_tell_a_client_nothing(datagrams in prop::collection::vec(datagram(), 100)) {
        let (mut door, joined) = taken();
        let mut out = [0; MAX_DATAGRAM];
        door.seal(at(1), SEAT, &sample(0, 1), &mut out).unwrap();
        let mut client = Client::new(ClientConfig::Keyed { session: SESSION, place: SEAT, key: key() }, at(0));
        client.poll_hello(at(0), &mut Counting::default()).unwrap().unwrap();
        for bytes in &datagrams {
            prop_assert!(joined.open(bytes).is_err());
            prop_assert!(joining(1).handle_welcome(bytes).is_err());
            prop_assert_eq!(client.handle_datagram(at(1), bytes), Heard::Ignored);
        }
    }
}

/// A notice counts for the joining whose sample was refused, under the key, and bit by bit.
#[test]
fn a_forged_or_recorded_notice_tells_a_client_nothing() {
    let mut door = keyed_door();
    let mut client = Client::new(ClientConfig::Keyed { session: SESSION, place: SEAT, key: key() }, at(0));
    let nobody = Taken { session: SESSION, place: SEAT, seal: None }.encode();
    assert_eq!(client.handle_datagram(at(0), nobody.bytes()), Heard::Ignored, "without a tag, before the welcome");
    let hello = client.poll_hello(at(0), &mut Counting::default()).unwrap().unwrap();
    let Admission::Reply { bytes, .. } = door.handle_datagram(at(0), address(1), &hello) else { panic!("no welcome") };
    client.handle_datagram(at(0), &bytes);
    let nonce = client.welcome().unwrap().client_nonce;
    let good = Taken { session: SESSION, place: SEAT, seal: Some((&key(), nonce)) };
    assert_eq!(client.handle_datagram(at(1), good.encode().bytes()), Heard::Taken);
    for bit in 0..8 * good.encode().bytes().len() {
        let mut bad = good.encode().bytes().to_vec();
        bad[bit / 8] ^= 1 << (bit % 8);
        assert_eq!(client.handle_datagram(at(1), &bad), Heard::Ignored, "bit {bit}");
    }
    for bad in [
        Taken { session: 43, ..good },
        Taken { place: Place(2), ..good },
        Taken { seal: Some((&key(), [7; 16])), ..good },
        Taken { seal: None, ..good },
    ] {
        assert_eq!(client.handle_datagram(at(1), bad.encode().bytes()), Heard::Ignored, "{bad:?}");
    }
}

#[test]
fn nothing_is_kept_of_who_has_tried() {
    // A door owns memory for its seats only, and its text shows all of its data. A list of senders that have tried would make the text longer.
    let (mut door, _) = taken();
    let before = format!("{door:?}");
    for port in 2..60_000 {
        door.handle_datagram(at(1), address(port), &sample(1, u64::from(port)));
    }
    let after = format!("{door:?}");
    assert_eq!(door.stats().refused(Refusal::Unsealed), 59_998);
    // Only the digits of the counters differ.
    assert!(after.len() < before.len() + 20, "{after}");
}
