//! Client side of the protocol: welcomes and samples that a client must refuse.

use cohaptic_live::client::{Joining, OpenError, WelcomeError};
use cohaptic_live::handshake::{HandshakeError, Welcome};
use cohaptic_live::{Admission, MAX_DATAGRAM, Place, SessionKey};

use crate::support::{Counting, SEAT, SESSION, address, admitted, at, joining, key, keyed_door, sample, sealed, shake_hands};

#[test]
fn a_welcome_is_for_one_hello() {
    let mut door = keyed_door();
    let Admission::Reply { bytes, .. } = door.handle_datagram(at(0), address(1), &joining(1).hello()) else { panic!("no welcome") };
    joining(1).handle_welcome(&bytes).unwrap();
    let refuse = |joining: Joining| joining.handle_welcome(&bytes).unwrap_err();
    assert_eq!(refuse(joining(2)), WelcomeError::Other);
    assert_eq!(refuse(Joining::new(SESSION, Place(2), &key(), [1; 16])), WelcomeError::Other);
    assert_eq!(refuse(Joining::new(SESSION + 1, SEAT, &key(), [1; 16])), WelcomeError::Other);
    assert_eq!(refuse(Joining::new(SESSION, SEAT, &SessionKey::from_bytes([0; 32]), [1; 16])), HandshakeError::Forged.into());
    for bit in 0..8 * bytes.len() {
        let mut bad = bytes;
        bad[bit / 8] ^= 1 << (bit % 8);
        assert!(joining(1).handle_welcome(&bad).is_err(), "bit {bit} passed");
    }
}

#[test]
fn a_welcome_that_makes_no_sense_is_refused_even_with_a_right_tag() {
    let mut door = keyed_door();
    let good = *shake_hands(&mut door, at(0), address(1), &joining(1)).welcome();
    let decode = |welcome: Welcome| Welcome::decode(&welcome.encode(&key()), &key());
    assert_eq!(decode(good), Ok(good));
    let zero = std::time::Duration::ZERO;
    for bad in [
        Welcome { axes: 0, ..good },
        Welcome { axes: 4, ..good },
        Welcome { peers: 1, ..good },
        Welcome { tick: zero, ..good },
        Welcome { update: zero, ..good },
    ] {
        assert_eq!(decode(bad), Err(HandshakeError::Reserved), "{bad:?}");
    }
}

#[test]
fn every_flipped_bit_of_what_the_door_sends_is_refused() {
    let mut door = keyed_door();
    let joined = shake_hands(&mut door, at(0), address(1), &joining(1));
    admitted(door.handle_datagram(at(0), address(1), &sealed(&joined, &sample(1, 0))));
    let mut out = [0; MAX_DATAGRAM];
    let (_, len) = door.seal(at(1), SEAT, &sample(0, 1), &mut out).unwrap();
    for bit in 0..8 * len {
        let mut bad = out[..len].to_vec();
        bad[bit / 8] ^= 1 << (bit % 8);
        // Bytes 64 to 79 are the nonce of the client, which is compared before the tag is verified.
        let nonce = (64..80).contains(&(bit / 8));
        assert_eq!(joined.open(&bad), Err(if nonce { OpenError::OtherJoining } else { OpenError::Forged }), "bit {bit}");
    }
    assert_eq!(joined.open(&out[..95]), Err(OpenError::Length { found: 95, expected: 96 }));
    assert_eq!(joined.open(&[]), Err(OpenError::Length { found: 0, expected: 96 }));
    assert_eq!(joined.seal(&[0; 153], &mut out), None);
}

#[test]
fn nonces_are_drawn() {
    let mut entropy = Counting::default();
    let mut draw = || Joining::draw(SESSION, SEAT, &key(), &mut entropy).unwrap().hello();
    assert_ne!(draw(), draw());
}
