//! Admission to a live session: which datagrams from outside reach the scene, and how those to the outside are made.
//!
//! ```text
//!                      ┌── Sample: goes on to the scene's links
//! datagram, address ──►│── Reply: a welcome, to be sent back
//!                      └── Refused: counted by cause, and nothing else has changed
//! ```
//!
//! Without a key the first sample for a seat joins, and the seat belongs to its address until it has been silent for a while. With a key a peer says
//! hello, is answered by a nonce of the server, and joins with the first sample that is sealed under keys made of both nonces. The session remembers
//! nothing of those that asked:
//!
//! - The server's nonce is a keyed hash of the seat, of how often the seat was taken, and of the address that asked. The client's nonce comes with
//!   every sealed sample. So the session can make the keys again when a sample needs them.
//! - When a seat is taken, every nonce given out for it before is void. A recording of an earlier joining, or one that is sent from another address,
//!   has a wrong tag.
//! - A hello changes nothing, and each hello with a right tag is answered: a limit on answers is what a flood of recorded hellos would use up. A host
//!   that repeats recorded ones gets answers that it cannot use. `docs/live-protocol.md` has the argument, attacker by attacker.
//!
//! Memory is that of the seats. The numbers of a seat never go back for those inside: an admitted sample has the number of the joining in its upper 24
//! bits and the number that the peer gave it in the lower 40, so a peer that joins again and counts from 0 is newer than it was.

mod config;
mod refusal;
mod seats;

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_peer::wire::{self, Sample, SampleKind};
use cohaptic_units::Instant;
use zeroize::Zeroizing;

use crate::handshake::{HANDSHAKE_LEN, HELLO_MAGIC, Hello, Welcome};
use crate::seal::{JoiningKeys, MAX_DATAGRAM, SEAL_LEN, Sealed, nonce_of};
use crate::{Entropy, Nonce, SessionKey};

pub use config::{AdmissionConfig, AdmissionConfigError, Limits, Place, Seat};
pub use refusal::{AdmissionStats, Refusal};
pub use seats::{SeatStatus, WINDOW};

use seats::{Occupant, SeatState};

/// The numbers that a peer may give its samples are below this.
pub const SEQUENCE_END: u64 = 1 << SEQUENCE_BITS;

const SEQUENCE_BITS: u32 = 40;
const JOININGS_END: u64 = 1 << (64 - SEQUENCE_BITS);
/// Where the number of a sample stands in its bytes.
const SEQUENCE_AT: core::ops::Range<usize> = 24..32;

/// What became of a datagram.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Admission {
    /// A sample for the scene.
    Sample {
        /// The sender.
        place: Place,
        /// Whether it took the seat: for the first time, or again.
        joined: bool,
        /// The sample, without its seal, and with its number made unique within the session.
        sample: Admitted,
    },
    /// An answer to be sent.
    Reply {
        /// Where to.
        to: SocketAddr,
        /// What.
        bytes: [u8; HANDSHAKE_LEN],
    },
    /// Nothing: it was counted.
    Refused(Refusal),
}

/// The bytes of a sample that was let in.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Admitted {
    buffer: [u8; wire::MAX_LEN],
    len: usize,
}

impl Admitted {
    /// The datagram, in the format of [`wire`].
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.buffer[..self.len]
    }
}

/// Decides about every datagram of a session. See the [module](self).
///
/// The driver hands in whatever its socket receives, with [`AdmissionControl::handle_datagram`], does what the answer says, and asks [`AdmissionControl::seal`] for the bytes
/// of what goes out. There are no deadlines to keep: what has become old is noticed when it matters. Time must not go back; if it does, nothing
/// becomes old in between.
#[derive(Debug)]
pub struct AdmissionControl {
    session: u64,
    axes: usize,
    kind: SampleKind,
    peers: u32,
    update: Duration,
    key: Option<SessionKey>,
    stale_after: Duration,
    limits: Option<Limits>,
    /// What the nonces are made with, drawn anew for each session, so that no two sessions give the same ones.
    secret: Secret,
    /// By place.
    seats: Vec<SeatState>,
    stats: AdmissionStats,
}

struct Secret(Zeroizing<[u8; 32]>);

impl core::fmt::Debug for Secret {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Secret")
    }
}

/// Under which keys a sample came.
enum Under {
    /// Those of the present joining, or of none where there is no key.
    Present,
    /// New ones, made for this address. Where they lie they stay, so that no copies of them are left behind.
    New(Box<JoiningKeys>),
}

impl AdmissionControl {
    /// An admission control with all its seats free. 32 bytes are drawn from `entropy`, now and never again: with the same ones it does the same to the same
    /// datagrams.
    ///
    /// # Errors
    ///
    /// [`AdmissionConfigError`] if the configuration makes no sense or there are no random bytes.
    pub fn new(config: AdmissionConfig, entropy: &mut impl Entropy) -> Result<Self, AdmissionConfigError> {
        config.check()?;
        let mut secret = Zeroizing::new([0; 32]);
        entropy.fill(&mut secret[..])?;
        let AdmissionConfig { session, axes, kind, peers, update, mut seats, key, stale_after, limits } = config;
        seats.sort_by_key(|seat| seat.place);
        let seats = seats.into_iter().map(SeatState::free).collect();
        let secret = Secret(secret);
        Ok(Self { session, axes, kind, peers, update, key, stale_after, limits, secret, seats, stats: AdmissionStats::default() })
    }

    /// Decides about a datagram that was received from `from`.
    ///
    /// Never panics, whatever the bytes are, and needs no memory for it. Give it a buffer longer than [`MAX_DATAGRAM`]: what does not fit a shorter one
    /// would be cut, and pass.
    pub fn handle_datagram(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) -> Admission {
        self.stats.handled += 1;
        let admission = self.decide(now, from, datagram);
        match admission {
            Ok(Admission::Sample { joined, .. }) => {
                self.stats.admitted += 1;
                self.stats.joinings += u64::from(joined);
            }
            Ok(Admission::Reply { .. }) => self.stats.welcomed += 1,
            Ok(Admission::Refused(cause)) | Err(cause) => self.stats.count_refused(cause),
        }
        admission.unwrap_or_else(Admission::Refused)
    }

    /// Makes a sample of another peer ready for the one in that seat: writes it, sealed if there is a key, and gives its address and the length.
    ///
    /// `None` if nobody has the seat, if its holder was not heard for [`AdmissionConfig::stale_after`], if `place` is no seat, or if `sample` is longer than
    /// a sample. So a false address cannot have another program flooded for longer than that.
    pub fn seal(&mut self, now: Instant, place: Place, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<(SocketAddr, usize)> {
        let ready = self.make_ready(now, place, sample, out);
        match ready {
            Some(_) => self.stats.sent += 1,
            None => self.stats.nobody_there += 1,
        }
        ready
    }

    /// The counts so far.
    #[must_use]
    pub const fn stats(&self) -> &AdmissionStats {
        &self.stats
    }

    /// Every seat, by place: its holder and since when that was not heard.
    pub fn seats(&self, now: Instant) -> impl Iterator<Item = SeatStatus<'_>> {
        self.seats.iter().map(move |seat| seat.status(now, self.stale_after))
    }

    /// The seat at that place; `None` if that peer is no other program.
    #[must_use]
    pub fn seat(&self, now: Instant, place: Place) -> Option<SeatStatus<'_>> {
        self.find(place).map(|index| self.seats[index].status(now, self.stale_after))
    }

    fn find(&self, place: Place) -> Option<usize> {
        self.seats.binary_search_by_key(&place, SeatState::place).ok()
    }

    fn decide(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) -> Result<Admission, Refusal> {
        if datagram.len() > MAX_DATAGRAM {
            return Err(Refusal::Oversized);
        }
        if datagram.starts_with(&HELLO_MAGIC) { self.handle_hello(from, datagram) } else { self.handle_sample(now, from, datagram) }
    }

    /// Answers a hello. Neither the time nor earlier hellos decide whether it is answered: then no hello of an attacker can take the answer from another one.
    fn handle_hello(&self, from: SocketAddr, datagram: &[u8]) -> Result<Admission, Refusal> {
        let unchecked = Hello::decode(datagram).map_err(Refusal::of_hello)?;
        let Some(key) = &self.key else { return Err(Refusal::Keyless) };
        let Hello { session, place, client_nonce } = unchecked.hello;
        if session != self.session {
            return Err(Refusal::ForeignSession);
        }
        let index = self.find(place).ok_or(Refusal::UnknownSeat)?;
        unchecked.verify(key).map_err(Refusal::of_hello)?;
        let server_nonce = self.server_nonce(index, from);
        let tick = self.seats[index].tick();
        let axes = u8::try_from(self.axes).expect("at most three");
        let Self { peers, update, kind, .. } = *self;
        let turns = kind == SampleKind::Attitude;
        let welcome = Welcome { axes, turns, session, place, peers, client_nonce, server_nonce, tick, update };
        Ok(Admission::Reply { to: from, bytes: welcome.encode(key) })
    }

    fn handle_sample(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) -> Result<Admission, Refusal> {
        let plain_len = self.kind.datagram_len(self.axes);
        // The seal is taken off by length alone; what the bytes are worth is decided below.
        let sealed = (datagram.len() == plain_len + SEAL_LEN).then(|| Sealed::split(datagram)).flatten();
        let plain = sealed.map_or(datagram, |sealed| sealed.sample);
        let (sample, _) = Sample::<3>::decode_as(plain, self.kind, self.axes).map_err(Refusal::of_sample)?;
        if sample.session != self.session {
            return Err(Refusal::ForeignSession);
        }
        let index = self.find(Place(sample.sender)).ok_or(Refusal::UnknownSeat)?;
        let under = match (&self.key, sealed) {
            (None, None) => Under::Present,
            (None, Some(_)) => return Err(Refusal::Keyless),
            (Some(_), None) => return Err(Refusal::Unsealed),
            (Some(key), Some(sealed)) => self.unseal(key, index, from, sealed)?,
        };
        // From here on it is known to be what its sender wrote, if there is a key.
        if sample.sequence >= SEQUENCE_END {
            return Err(Refusal::SequenceRange);
        }
        if let Some(limits) = self.limits {
            let within = |numbers: [f64; 3], limit: f64| numbers.into_iter().all(|number| number.abs() <= limit);
            if !within(sample.state.position, limits.position) || !within(sample.state.velocity, limits.velocity) {
                return Err(Refusal::OutOfRange);
            }
        }
        let joined = self.seats[index].take_or_keep(now, self.stale_after, from, sample.sequence, under)?;
        let seat = &self.seats[index];
        let mut buffer = [0; wire::MAX_LEN];
        buffer[..plain.len()].copy_from_slice(plain);
        buffer[SEQUENCE_AT].copy_from_slice(&seat.number_inside(sample.sequence).to_le_bytes());
        Ok(Admission::Sample { place: seat.place(), joined, sample: Admitted { buffer, len: plain.len() } })
    }

    fn unseal(&self, key: &SessionKey, index: usize, from: SocketAddr, sealed: Sealed<'_>) -> Result<Under, Refusal> {
        let seat = &self.seats[index];
        if let Some(Occupant { address, keys: Some(keys), .. }) = seat.occupant()
            && *address == from
            && keys.client_nonce == *sealed.client_nonce
            && keys.to_door.verify(sealed.body, sealed.tag)
        {
            return Ok(Under::Present);
        }
        let keys = JoiningKeys::of_sample(key, self.session, seat.place(), sealed, &self.server_nonce(index, from));
        let otherwise = if seat.occupant().is_some() { Refusal::Forged } else { Refusal::NotJoined };
        keys.map(|keys| Under::New(Box::new(keys))).ok_or(otherwise)
    }

    /// The nonce for a program that asks for that seat from that address, until the seat is taken the next time.
    fn server_nonce(&self, index: usize, from: SocketAddr) -> Nonce {
        let seat = &self.seats[index];
        // An IPv4 address reads the same where a socket of IPv6 shows it mapped. Scope and flow label are of this machine alone.
        let ip = match from {
            SocketAddr::V4(v4) => v4.ip().to_ipv6_mapped(),
            SocketAddr::V6(v6) => *v6.ip(),
        };
        nonce_of(&self.secret.0, &[&seat.place().0.to_le_bytes(), &seat.joinings().to_le_bytes(), &ip.octets(), &from.port().to_le_bytes()])
    }

    fn make_ready(&self, now: Instant, place: Place, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<(SocketAddr, usize)> {
        let occupant = self.seats[self.find(place)?].present(now, self.stale_after)?;
        let len = match &occupant.keys {
            Some(keys) => keys.to_peer.seal(&keys.client_nonce, sample, out)?,
            None if sample.len() <= wire::MAX_LEN => {
                out[..sample.len()].copy_from_slice(sample);
                sample.len()
            }
            None => return None,
        };
        Some((occupant.address, len))
    }
}
