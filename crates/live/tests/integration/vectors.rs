//! Worked examples of `docs/live-protocol.md`, whose bytes were computed by another program.

use std::time::Duration;

use cohaptic_live::client::Joining;
use cohaptic_live::handshake::{Taken, Welcome};
use cohaptic_live::{MAX_DATAGRAM, Place, SessionKey};
use cohaptic_peer::{State, wire};

use crate::support::{at, encode};

const EXAMPLES: &str = include_str!("../../../../docs/examples/live-protocol.txt");
const SESSION: u64 = 0x0123_4567_89ab_cdef;

/// Returns the bytes of the block with the title `title`.
fn bytes(title: &str) -> Vec<u8> {
    let (_, rest) = EXAMPLES.split_once(&format!("[{title}]\n")).expect(title);
    // A line is an offset of four digits, two spaces, and up to 16 bytes in 47 characters; a text may follow.
    let hex = rest
        .lines()
        .take_while(|line| !line.is_empty())
        .flat_map(|line| line.get(6..).unwrap_or_default().chars().take(47).collect::<String>().split(' ').map(str::to_owned).collect::<Vec<_>>());
    hex.filter(|pair| !pair.is_empty()).map(|pair| u8::from_str_radix(&pair, 16).unwrap()).collect()
}

/// Returns bytes that count up from `from`.
fn counting<const N: usize>(from: u8) -> [u8; N] {
    std::array::from_fn(|place| from + u8::try_from(place).unwrap())
}

fn sample(sender: u32, sequence: u64, millis: u64, position: f64, velocity: f64) -> Vec<u8> {
    encode(&wire::Sample { session: SESSION, sender, sequence, sent: at(millis), state: State { position: [position], velocity: [velocity] } })
}

#[test]
fn the_code_makes_the_bytes_of_the_page() {
    let key = SessionKey::from_bytes(counting(0));
    let joining = Joining::new(SESSION, Place(1), &key, counting(0x40));
    assert_eq!(joining.hello()[..], bytes("hello"));

    let welcome = Welcome {
        turns: false,
        axes: 1,
        session: SESSION,
        place: Place(1),
        peers: 3,
        client_nonce: counting(0x40),
        server_nonce: counting(0x80),
        tick: Duration::from_millis(1),
        update: Duration::from_millis(8),
    };
    assert_eq!(welcome.encode(&key)[..], bytes("welcome"));

    let joined = joining.handle_welcome(&bytes("welcome")).unwrap();
    assert_eq!(*joined.welcome(), welcome);
    let mut out = [0; MAX_DATAGRAM];
    let len = joined.seal(&sample(1, 5, 40, 0.025, -1.5), &mut out).unwrap();
    assert_eq!(out[..len], bytes("to the session"));
    assert_eq!(joined.open(&bytes("to the peer")), Ok(&sample(0, 7, 56, -0.5, 0.125)[..]));

    let taken = Taken { session: SESSION, place: Place(1), seal: Some((&key, counting(0x40))) };
    assert_eq!(taken.encode().bytes(), bytes("taken"));
    assert!(taken.is(&bytes("taken")));
    let taken = Taken { seal: None, ..taken };
    assert_eq!(taken.encode().bytes(), bytes("taken without a key"));
    assert!(taken.is(&bytes("taken without a key")));
}
