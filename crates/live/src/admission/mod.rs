//! Admission to a live session: decides which datagrams from outside reach the scene, and makes the datagrams to peers outside.

mod config;
mod refusal;
mod seats;

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_peer::wire::{self, Sample, SampleKind};
use cohaptic_units::Instant;
use zeroize::Zeroizing;

use crate::handshake::hello::HELLO_MAGIC;
use crate::handshake::{HANDSHAKE_LEN, Hello, Notice, Taken, Welcome};
use crate::place::Place;
use crate::seal::{JoiningKeys, MAX_DATAGRAM, SEAL_LEN, Sealed, nonce_of};
use crate::{Entropy, Nonce, SessionKey};

pub use config::{AdmissionConfig, AdmissionConfigError, Limits, Seat};
pub use refusal::{AdmissionStats, Refusal};
pub use seats::SeatStatus;

use seats::{Occupant, SeatState};

/// Upper bound (exclusive) of the sequence numbers of a peer's samples: 2⁴⁰.
pub(crate) const SEQUENCE_END: u64 = 1 << SEQUENCE_BITS;

/// Bits of an admitted sequence number for the peer's own number.
const SEQUENCE_BITS: u32 = 40;
/// Largest number of joinings at a seat: the numbers from 0 fill the upper bits of an admitted sequence number.
const JOININGS_END: u64 = 1 << (64 - SEQUENCE_BITS);
/// Bytes of a sample with the sequence number, in little-endian order.
const SEQUENCE_AT: core::ops::Range<usize> = 24..32;

/// Decision about a received datagram.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Admission {
    /// The datagram was a sample, to be handed to the scene.
    Sample {
        /// Sender of the sample.
        place: Place,
        /// Whether the sample took the seat, for the first time or again.
        joined: bool,
        /// The sample without its seal. Its sequence number is unique within the session.
        sample: Admitted,
    },
    /// The datagram was a hello. A welcome answers the hello.
    Reply {
        /// Receiver of the welcome: the address that sent the hello.
        to: SocketAddr,
        /// The welcome.
        bytes: [u8; HANDSHAKE_LEN],
    },
    /// The datagram was refused and counted by cause.
    Refused(Refusal),
}

/// Bytes of an admitted sample.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Admitted {
    buffer: [u8; wire::MAX_LEN],
    len: usize,
}

impl Admitted {
    /// Returns the sample, in the format of [`wire`].
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.buffer[..self.len]
    }
}

/// Decides about every received datagram of a session, and seals every sent sample.
///
/// ```text
///                      ┌── Sample: goes on to the scene's links
/// datagram, address ──►│── Reply: a welcome, to be sent back
///                      └── Refused: counted by cause, and nothing else has changed
/// ```
///
/// Without a key the first sample for a seat joins, and the seat belongs to the address of the sample until no sample has been admitted for a while. With a key
/// a peer says hello, gets a nonce of the server in a welcome, and joins with the first sample sealed under keys derived from the nonces of both sides. The
/// session keeps no state for peers that have only said hello:
///
/// - The server's nonce is a keyed hash of the place, of the number of joinings at the seat so far, and of the address that asked. The client's nonce comes
///   with every sealed sample. So the session can derive the keys again when a sample needs the keys.
/// - When a seat is taken, every earlier server nonce for the seat becomes void. A sample recorded in an earlier joining, or sent from another address, then
///   has a wrong tag.
/// - A hello changes nothing but the label that displays show, and each hello with a right tag for the session's scene is answered. A limit on the number of
///   answers would be used up by a flood of recorded hellos. A host that repeats recorded hellos gets welcomes that the host cannot use.
///   `docs/live-protocol.md` has the argument, attacker by attacker.
///
/// Memory is bounded by the number of seats. Inside the session the sequence numbers of a seat never go back: an admitted sample has the number of the joining
/// in its upper 24 bits and the peer's own number in the lower 40 bits. A peer that joins again and counts from 0 is therefore newer than before.
///
/// The driver hands each received datagram to [`AdmissionControl::handle_datagram`], carries out the decision, and asks [`AdmissionControl::seal`] for the
/// bytes of each sample to a peer outside. A sample refused with [`Refusal::SeatTaken`] is answered with [`AdmissionControl::notice`]. There are no
/// deadlines: whether a peer is silent is computed from the instant of the call that needs to know. If time goes back, no peer becomes silent in between.
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
    /// Fingerprint of the scene, to which hellos are compared. 0: hellos are not compared.
    scene: u64,
    /// Latest hello with a right tag and the fingerprint of another scene.
    other_scene: Option<OtherScene>,
    /// Secret key of the hash for server nonces. Drawn anew for each session, so that no two sessions give the same nonces.
    secret: Secret,
    /// Seats, sorted by place, so that a place is found by binary search.
    seats: Vec<SeatState>,
    stats: AdmissionStats,
}

/// Peer whose scene is not that of the session.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct OtherScene {
    /// Place for which the peer asked.
    pub place: Place,
    /// Address of the peer.
    pub from: SocketAddr,
    /// Fingerprint of the peer's scene.
    pub theirs: u64,
    /// Fingerprint of the session's scene.
    pub ours: u64,
}

/// Key of the server nonces. Overwritten when dropped, and never printed.
struct Secret(Zeroizing<[u8; 32]>);

impl core::fmt::Debug for Secret {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Secret")
    }
}

/// Keys under which a sample was sealed.
enum Under {
    /// Keys of the present joining, or no keys in a session without a key.
    Present,
    /// Newly derived keys, for the address of the sample. Boxed, so that the box moves and not the keys: moved keys would leave copies in memory.
    New(Box<JoiningKeys>),
}

impl AdmissionControl {
    /// Returns an admission control with free seats only. Draws 32 bytes from `entropy`, in this call only. With the same bytes, the same datagrams at the same
    /// instants get the same decisions.
    ///
    /// # Errors
    ///
    /// [`AdmissionConfigError`] if a number of the configuration is out of range, two seats have the same place, or `entropy` has no random bytes.
    pub fn new(config: AdmissionConfig, entropy: &mut impl Entropy) -> Result<Self, AdmissionConfigError> {
        config.check()?;
        let mut secret = Zeroizing::new([0; 32]);
        entropy.fill(&mut secret[..])?;
        let AdmissionConfig { session, axes, kind, peers, update, mut seats, key, stale_after, limits, scene } = config;
        // `find` searches the seats by place.
        seats.sort_by_key(|seat| seat.place);
        let seats = seats.into_iter().map(SeatState::free).collect();
        let secret = Secret(secret);
        Ok(Self {
            session,
            axes,
            kind,
            peers,
            update,
            key,
            stale_after,
            limits,
            scene,
            other_scene: None,
            secret,
            seats,
            stats: AdmissionStats::default(),
        })
    }

    /// Decides about a datagram received from the address `from` at the instant `now`.
    ///
    /// Never panics, whatever the bytes are. Memory does not grow with the number of datagrams. Receive into a buffer longer than [`MAX_DATAGRAM`]: a shorter
    /// buffer would cut an oversized datagram to a length that may be admitted.
    pub fn handle_datagram(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) -> Admission {
        self.stats.handled += 1;
        // Every decision is counted here and nowhere else, so that the counts add up.
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

    /// Makes the datagram that carries `sample` to the peer at `place`: writes the sample to `out`, sealed if the session has a key. Returns the address of
    /// the peer and the length of the datagram.
    ///
    /// Returns `None` if the seat was never taken, if no sample of its holder was admitted for [`AdmissionConfig::stale_after`], if `place` is no seat, or if
    /// `sample` is longer than [`wire::MAX_LEN`]. So a false address can direct samples to an uninvolved program no longer than `stale_after`.
    pub fn seal(&mut self, now: Instant, place: Place, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<(SocketAddr, usize)> {
        let ready = self.make_ready(now, place, sample, out);
        match ready {
            Some(_) => self.stats.sent += 1,
            None => self.stats.nobody_there += 1,
        }
        ready
    }

    /// Returns the answer to `sample`, a datagram refused with [`Refusal::SeatTaken`]: the notice that another program has the seat. Without an answer the
    /// sender could not tell a taken seat from a session in which nobody else sends. Returns `None` if `sample` is no sample for a seat of this session.
    #[must_use]
    pub fn notice(&self, sample: &[u8]) -> Option<Notice> {
        let (plain, seal) = match &self.key {
            None => (sample, None),
            Some(key) => Sealed::split(sample).map(|sealed| (sealed.sample, Some((key, *sealed.client_nonce))))?,
        };
        let (Sample { sender, .. }, _) = Sample::<3>::decode_as(plain, self.kind, self.axes).ok()?;
        let place = self.seats[self.find(Place(sender))?].place();
        Some(Taken { session: self.session, place, seal }.encode())
    }

    /// Returns the counts so far.
    #[must_use]
    pub const fn stats(&self) -> &AdmissionStats {
        &self.stats
    }

    /// Returns the latest peer that asked with the fingerprint of another scene, under the right key.
    #[must_use]
    pub const fn other_scene(&self) -> Option<OtherScene> {
        self.other_scene
    }

    /// Returns the status of every seat at the instant `now`, sorted by place.
    pub fn seats(&self, now: Instant) -> impl Iterator<Item = SeatStatus<'_>> {
        self.seats.iter().map(move |seat| seat.status(now, self.stale_after))
    }

    /// Returns the status of the seat at `place`, or `None` if the peer at that place is not another program.
    #[must_use]
    pub fn seat(&self, now: Instant, place: Place) -> Option<SeatStatus<'_>> {
        self.find(place).map(|index| self.seats[index].status(now, self.stale_after))
    }

    /// Returns the index in `seats` of the seat at `place`.
    fn find(&self, place: Place) -> Option<usize> {
        self.seats.binary_search_by_key(&place, SeatState::place).ok()
    }

    /// Tells hellos from samples by their first bytes. The length is checked before any byte is read.
    fn decide(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) -> Result<Admission, Refusal> {
        if datagram.len() > MAX_DATAGRAM {
            return Err(Refusal::Oversized);
        }
        if datagram.starts_with(&HELLO_MAGIC) { self.handle_hello(from, datagram) } else { self.handle_sample(now, from, datagram) }
    }

    /// Answers a hello. The decision depends neither on the time nor on earlier hellos: otherwise the hellos of an attacker could keep another peer from the
    /// welcome. A hello leaves nothing but its label and, with the fingerprint of another scene, a note for displays.
    fn handle_hello(&mut self, from: SocketAddr, datagram: &[u8]) -> Result<Admission, Refusal> {
        let unchecked = Hello::decode(datagram).map_err(Refusal::of_hello)?;
        // Without a key there is nothing to answer; the hello is counted under a cause that tells the sender's mistake.
        let Some(key) = &self.key else { return Err(Refusal::Keyless) };
        let Hello { session, place, client_nonce, scene, label } = unchecked.hello;
        if session != self.session {
            return Err(Refusal::ForeignSession);
        }
        let index = self.find(place).ok_or(Refusal::UnknownSeat)?;
        // The tag is checked last, because the hash costs more than all other checks.
        unchecked.verify(key).map_err(Refusal::of_hello)?;
        // Compared after the tag, so that only a holder of the key can make the session show a fingerprint.
        if scene != 0 && self.scene != 0 && scene != self.scene {
            self.other_scene = Some(OtherScene { place, from, theirs: scene, ours: self.scene });
            return Err(Refusal::OtherScene);
        }
        let server_nonce = self.server_nonce(index, from);
        let tick = self.seats[index].tick();
        let axes = u8::try_from(self.axes).expect("at most three");
        let Self { peers, update, kind, .. } = *self;
        let turns = kind == SampleKind::Attitude;
        let welcome = Welcome { axes, turns, session, place, peers, client_nonce, server_nonce, tick, update };
        let bytes = welcome.encode(key);
        self.seats[index].introduce(from, label);
        Ok(Admission::Reply { to: from, bytes })
    }

    /// Decides about a sample. Format, session and seat are checked before the tag, because the hash costs more. State changes only after all checks, in
    /// `take_or_keep`.
    fn handle_sample(&mut self, now: Instant, from: SocketAddr, datagram: &[u8]) -> Result<Admission, Refusal> {
        let plain_len = self.kind.datagram_len(self.axes);
        // Whether a seal is present follows from the length alone. Whether the seal is right is decided in `unseal`.
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
        // From here on, in a session with a key, the sample is known to be unchanged since a holder of the key made the seal.
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
        // A decoded sample has a full header, so that bytes 24 to 31 are within `plain`, and `plain` is at most `MAX_LEN` long.
        buffer[SEQUENCE_AT].copy_from_slice(&seat.number_inside(sample.sequence).to_le_bytes());
        Ok(Admission::Sample { place: seat.place(), joined, sample: Admitted { buffer, len: plain.len() } })
    }

    /// Checks the seal of a sample, first under the keys of the present joining, then under keys derived for a new joining from `from`.
    fn unseal(&self, key: &SessionKey, index: usize, from: SocketAddr, sealed: Sealed<'_>) -> Result<Under, Refusal> {
        let seat = &self.seats[index];
        // The address is compared first, and the nonce before the tag, so that only samples that claim the present joining cost a hash here.
        if let Some(Occupant { address, keys: Some(keys), .. }) = seat.occupant()
            && *address == from
            && keys.client_nonce == *sealed.client_nonce
            && keys.to_door.verify(sealed.body, sealed.tag)
        {
            return Ok(Under::Present);
        }
        // Not sealed under the present keys: a program that joins, or a forgery. `of_sample` returns keys only if the tag fits.
        let keys = JoiningKeys::of_sample(key, self.session, seat.place(), sealed, &self.server_nonce(index, from));
        // A sample for a seat that was never taken can be an honest peer's: its session was restarted, and the peer must say hello again.
        let otherwise = if seat.occupant().is_some() { Refusal::Forged } else { Refusal::NotJoined };
        keys.map(|keys| Under::New(Box::new(keys))).ok_or(otherwise)
    }

    /// Returns the server nonce for a program at the address `from` that asks for the seat. Changes when the seat is taken.
    fn server_nonce(&self, index: usize, from: SocketAddr) -> Nonce {
        let seat = &self.seats[index];
        // A socket of IPv6 shows an IPv4 address in mapped form; both forms must give the same nonce. Scope and flow label are left out, because both have a
        // meaning on this machine only.
        let ip = match from {
            SocketAddr::V4(v4) => v4.ip().to_ipv6_mapped(),
            SocketAddr::V6(v6) => *v6.ip(),
        };
        nonce_of(&self.secret.0, &[&seat.place().0.to_le_bytes(), &seat.joinings().to_le_bytes(), &ip.octets(), &from.port().to_le_bytes()])
    }

    /// Writes a sample for the peer at `place`. The caller [`AdmissionControl::seal`] also counts.
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
