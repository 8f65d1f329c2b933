//! Helpers: doors of a scene of three peers, two of which have seats, and the datagrams of one peer.

use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_live::client::{Joined, Joining};
use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, Admitted, Entropy, EntropyError, MAX_DATAGRAM, Place, Refusal, Seat, SessionKey};
use cohaptic_peer::{State, wire};
pub(crate) use cohaptic_tests_common::cases;
use cohaptic_units::Instant;

pub(crate) const SESSION: u64 = 42;
/// Silence after which a peer counts as gone.
pub(crate) const STALE: Duration = Duration::from_millis(100);
/// Seat in most tests. Place 0 is a simulated peer.
pub(crate) const SEAT: Place = Place(1);

/// Predictable bytes for tests, in 64-bit counts that never repeat.
#[derive(Default)]
pub(crate) struct Counting(u64);

impl Entropy for Counting {
    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), EntropyError> {
        for chunk in bytes.chunks_mut(8) {
            self.0 += 1;
            chunk.copy_from_slice(&self.0.to_be_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

pub(crate) fn key() -> SessionKey {
    SessionKey::from_bytes([0xa5; 32])
}

pub(crate) fn seat(place: Place, name: &str) -> Seat {
    Seat { place, name: name.to_owned(), tick: Duration::from_millis(1) }
}

/// Returns a configuration without a key, with seats at places 1 and 2, in descending order so that the door must sort them.
pub(crate) fn config() -> AdmissionConfig {
    let seats = [(2, "third"), (1, "right")].map(|(place, name)| seat(Place(place), name));
    AdmissionConfig { stale_after: STALE, ..AdmissionConfig::new(SESSION, 1, 3, Duration::from_millis(8), seats.to_vec()) }
}

pub(crate) fn keyless_door() -> AdmissionControl {
    AdmissionControl::new(config(), &mut Counting::default()).unwrap()
}

pub(crate) fn keyed_door() -> AdmissionControl {
    AdmissionControl::new(config().with_key(Some(key())), &mut Counting::default()).unwrap()
}

pub(crate) fn at(millis: u64) -> Instant {
    Instant::from_nanos(millis * 1_000_000)
}

/// Returns an address of a documentation network, so that no test can mean a real host.
pub(crate) fn address(port: u16) -> SocketAddr {
    SocketAddr::from(([192, 0, 2, 1], port))
}

/// Returns a sample of one axis.
pub(crate) fn sample(sender: u32, sequence: u64) -> Vec<u8> {
    let state = State { position: [0.025], velocity: [-1.5] };
    encode(&wire::Sample { session: SESSION, sender, sequence, sent: at(8 * (sequence % 1_000_000)), state })
}

pub(crate) fn encode(sample: &wire::Sample<1>) -> Vec<u8> {
    let mut buffer = [0; wire::MAX_LEN];
    let len = sample.encode(1, &mut buffer);
    buffer[..len].to_vec()
}

/// Returns a joining at `SEAT` whose nonce repeats the byte `nonce`.
pub(crate) fn joining(nonce: u8) -> Joining {
    Joining::new(SESSION, SEAT, &key(), [nonce; 16])
}

/// Sends a hello to the door and returns the peer that has joined.
pub(crate) fn shake_hands(door: &mut AdmissionControl, now: Instant, from: SocketAddr, joining: &Joining) -> Joined {
    let Admission::Reply { to, bytes } = door.handle_datagram(now, from, &joining.hello()) else { panic!("no welcome") };
    assert_eq!(to, from);
    joining.handle_welcome(&bytes).unwrap()
}

/// Returns `sample`, sealed for the door.
pub(crate) fn sealed(joined: &Joined, sample: &[u8]) -> Vec<u8> {
    let mut out = [0; MAX_DATAGRAM];
    let len = joined.seal(sample, &mut out).unwrap();
    out[..len].to_vec()
}

/// Returns whether an admitted sample of `SEAT` took the seat, and the sample. Fails for any other decision.
pub(crate) fn admitted(admission: Admission) -> (bool, Admitted) {
    match admission {
        Admission::Sample { place, joined, sample } => {
            assert_eq!(place, SEAT);
            (joined, sample)
        }
        other @ (Admission::Reply { .. } | Admission::Refused(_)) => panic!("a sample was expected: {other:?}"),
    }
}

/// Asserts that the counts of refusals are `refused` and zero for causes that are not listed, and that every datagram was counted exactly once.
pub(crate) fn assert_counts(door: &AdmissionControl, admitted: u64, welcomed: u64, refused: &[(Refusal, u64)]) {
    let stats = door.stats();
    let found: Vec<_> = stats.refusals().filter(|&(_, count)| count > 0).collect();
    let mut expected: Vec<_> = refused.iter().copied().filter(|&(_, count)| count > 0).collect();
    expected.sort_unstable();
    assert_eq!(found, expected);
    assert_eq!((stats.admitted, stats.welcomed), (admitted, welcomed));
    assert_eq!(stats.handled, admitted + welcomed + stats.refused_in_all());
}
