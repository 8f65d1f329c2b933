//! Floods of hellos with a right tag, in virtual time: recorded hellos that are sent again, and new hellos of a guest who has the key.

use std::net::SocketAddr;

use cohaptic_live::client::{Joined, Joining};
use cohaptic_live::{Admission, AdmissionControl, Place};
use cohaptic_tests_common::quarter_by_day;
use cohaptic_units::Instant;

use crate::support::{SEAT, SESSION, address, admitted, assert_counts, at, joining, key, keyed_door, sample, sealed, shake_hands};

/// Time between two hellos of a flood \[ns\]: 9,700 hellos a second.
const EVERY: u64 = 1_000_000_000 / 9_700;
/// Time between the joinings of two honest peers \[ms\]. In this time the former peer becomes silent for longer than the session waits.
const SPACING: u64 = 150;
/// Number of samples that an honest peer sends, one sample every 8 ms.
const SAMPLES: u64 = 5;

/// Contents and source addresses of the hellos of a flood.
#[derive(Clone, Copy, PartialEq, Debug)]
enum Flood {
    /// A recorded hello, from the address of the attacker.
    Recorded,
    /// A recorded hello, each time from another false address.
    FromFalseAddresses,
    /// The hello of the honest peer that joins, sent from the address of that peer by an attacker on the path.
    OnThePath,
    /// A new hello each time, from false addresses, by a guest who has the key.
    OfAGuest,
}

impl Flood {
    /// Returns the hello number `number` of the flood with its source address, while the peer `honest` joins or has joined.
    fn hello(self, number: u64, honest: u8) -> (SocketAddr, Joining) {
        let [low, high, ..] = number.to_le_bytes();
        let anywhere = SocketAddr::from(([198, 51, 100, high], 1024 + u16::from(low)));
        match self {
            Self::Recorded => (address(666), joining(0xee)),
            Self::FromFalseAddresses => (anywhere, joining(0xee)),
            Self::OnThePath => (honest_address(honest), joining(honest)),
            Self::OfAGuest => {
                let mut nonce = [0xdd; 16];
                nonce[..8].copy_from_slice(&number.to_le_bytes());
                (anywhere, Joining::new(SESSION, SEAT, &key(), nonce))
            }
        }
    }
}

/// Number of honest peers that join during a flood, one after another, at the seat that the flood asks for.
fn honest_peers() -> u64 {
    quarter_by_day(20)
}

fn honest_address(honest: u8) -> SocketAddr {
    address(7000 + u16::from(honest))
}

/// Peer that has joined at the other seat before the flood, and sends a sample every 8 ms.
struct Present {
    joined: Joined,
    sent: u64,
}

impl Present {
    const PLACE: Place = Place(2);

    fn join(door: &mut AdmissionControl) -> Self {
        Self { joined: shake_hands(door, at(0), address(3), &Joining::new(SESSION, Self::PLACE, &key(), [3; 16])), sent: 0 }
    }

    /// Sends the next sample, which the door must admit.
    fn speak(&mut self, door: &mut AdmissionControl, now: Instant) {
        let admission = door.handle_datagram(now, address(3), &sealed(&self.joined, &sample(2, self.sent)));
        assert!(matches!(admission, Admission::Sample { place: Self::PLACE, .. }), "sample {} of a peer that is in: {admission:?}", self.sent);
        self.sent += 1;
    }
}

/// Runs a flood and returns the number of honest peers that were answered at their first hello and joined.
fn came_in(flood: Flood) -> u8 {
    let mut door = keyed_door();
    let mut present = Present::join(&mut door);
    let (mut honest, mut came_in, mut hellos) = (0, 0, 0);
    let mut joined: Option<(Joined, u64)> = None;
    for tick in 0..honest_peers() * SPACING {
        let now = at(tick);
        // All hellos of the flood that are sent before this millisecond.
        while EVERY * hellos < now.as_nanos() {
            let (from, joining) = flood.hello(hellos, honest);
            let hello = joining.hello();
            match door.handle_datagram(Instant::from_nanos(EVERY * hellos), from, &hello) {
                Admission::Reply { to, bytes } => assert!(to == from && bytes.len() <= hello.len(), "an answer amplifies nothing"),
                Admission::Refused(_) => {}
                Admission::Sample { .. } => panic!("a hello is no sample"),
            }
            hellos += 1;
        }
        // Halfway through a spacing the next honest peer says hello, once only.
        if tick % SPACING == SPACING / 2 {
            honest += 1;
            if let Admission::Reply { bytes, .. } = door.handle_datagram(now, honest_address(honest), &joining(honest).hello()) {
                joined = Some((joining(honest).handle_welcome(&bytes).unwrap(), 0));
            }
        }
        if tick % 8 == 0 {
            present.speak(&mut door, now);
            if let Some((keys, number)) = joined.as_mut().filter(|(_, number)| *number < SAMPLES) {
                let (is_new, _) = admitted(door.handle_datagram(now, honest_address(honest), &sealed(keys, &sample(1, *number))));
                assert_eq!(is_new, *number == 0, "{flood:?} {honest}");
                came_in += u8::from(is_new);
                *number += 1;
            }
        }
    }
    // The flood has changed nothing: only honest peers took the seat, and no datagram was refused.
    assert_eq!(door.seat(at(0), SEAT).unwrap().joinings, u64::from(came_in));
    assert_counts(&door, present.sent + u64::from(came_in) * SAMPLES, hellos + u64::from(came_in) + 1, &[]);
    came_in
}

#[test]
fn a_flood_of_hellos_keeps_nobody_out_and_throws_nobody_out() {
    for flood in [Flood::Recorded, Flood::FromFalseAddresses, Flood::OnThePath, Flood::OfAGuest] {
        assert_eq!(u64::from(came_in(flood)), honest_peers(), "{flood:?}");
    }
}
