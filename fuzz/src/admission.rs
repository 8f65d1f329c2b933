//! Admission to a live session with programs that join, speak and are imitated: nothing that no holder of the key has made is let in, and nothing twice.

use std::collections::{BTreeMap, BTreeSet};
use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_live::client::{Joined, Joining};
use cohaptic_live::{Admission, AdmissionConfig, AdmissionControl, Entropy, EntropyError, Limits, MAX_DATAGRAM, Place, Refusal, Seat, SessionKey};
use cohaptic_peer::wire::{Extra, MAX_LEN, Sample, SampleKind};
use cohaptic_peer::{State, rotation::Attitude};
use cohaptic_units::Instant;

use crate::Input;
use crate::wire::KINDS;

const SESSION: u64 = 42;
const LIMITS: Limits = Limits { position: 10.0, velocity: 100.0 };
/// Datagrams that can be sent again.
const REMEMBERED: usize = 8;

/// Bytes that never repeat.
struct Counting(u64);

impl Entropy for Counting {
    fn fill(&mut self, bytes: &mut [u8]) -> Result<(), EntropyError> {
        for chunk in bytes.chunks_mut(8) {
            self.0 += 1;
            chunk.copy_from_slice(&self.0.to_be_bytes()[..chunk.len()]);
        }
        Ok(())
    }
}

/// A program that may take a seat.
struct Guest {
    address: SocketAddr,
    place: Place,
    joined: Option<Joined>,
    sequence: u64,
}

struct World {
    server: AdmissionControl,
    key: Option<SessionKey>,
    kind: SampleKind,
    axes: usize,
    has_limits: bool,
    now: Instant,
    entropy: Counting,
    guests: [Guest; 3],
    /// Datagrams that a guest has made under its keys, with its address.
    authentic: BTreeSet<(SocketAddr, Vec<u8>)>,
    remembered: Vec<Vec<u8>>,
    /// Numbers of the samples that were let in, by seat.
    inside: BTreeMap<Place, BTreeSet<u64>>,
}

/// The first byte chooses the session, and the rest are what its programs do.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let mut world = World::new(input.byte());
    while !input.is_empty() {
        let action = input.byte();
        let guest = usize::from(action >> 3) % world.guests.len();
        world.act(action & 7, guest, &mut input);
    }
    let stats = *world.server.stats();
    assert_eq!(stats.handled, stats.admitted + stats.welcomed + stats.refused_in_all());
    let admitted: u64 = world.server.seats(world.now).map(|seat| seat.admitted).sum();
    let joinings: u64 = world.server.seats(world.now).map(|seat| seat.joinings).sum();
    assert_eq!((stats.admitted, stats.joinings), (admitted, joinings));
}

impl World {
    fn new(setup: u8) -> Self {
        let key = (setup & 1 == 1).then(|| SessionKey::from_bytes([0xa5; 32]));
        let has_limits = setup & 2 == 2;
        let (kind, axes) = (KINDS[usize::from(setup >> 2) % 6], 1 + usize::from(setup >> 5) % 3);
        let seat = |place, name: &str| Seat { place: Place(place), name: name.to_owned(), tick: Duration::from_millis(1) };
        let config = AdmissionConfig {
            kind,
            key: key.clone(),
            stale_after: Duration::from_millis(100),
            limits: has_limits.then_some(LIMITS),
            ..AdmissionConfig::new(SESSION, axes, 3, Duration::from_millis(8), vec![seat(1, "right"), seat(2, "third")])
        };
        let mut entropy = Counting(0);
        let server = AdmissionControl::new(config, &mut entropy).unwrap();
        // Two programs want one seat.
        let guest = |port: u16, place| Guest { address: ([192, 0, 2, 1], port).into(), place: Place(place), joined: None, sequence: 0 };
        let guests = [guest(1, 1), guest(2, 1), guest(3, 2)];
        let (authentic, remembered, inside) = (BTreeSet::new(), Vec::new(), BTreeMap::new());
        Self { server, key, kind, axes, has_limits, now: Instant::ZERO, entropy, guests, authentic, remembered, inside }
    }

    fn act(&mut self, action: u8, guest: usize, input: &mut Input<'_>) {
        let from = self.guests[guest].address;
        match action {
            0 => {
                let length = usize::from(input.byte());
                let datagram = input.take(length).to_vec();
                self.send(from, &datagram);
            }
            1 => self.hello(guest),
            2 => {
                let datagram = self.sample(guest, input);
                self.send(from, &datagram);
            }
            3 => {
                let mut datagram = self.sample(guest, input);
                let at = usize::from(input.byte()) % datagram.len();
                datagram[at] ^= input.byte();
                self.send(from, &datagram);
            }
            4 => self.now = self.now.saturating_add(Duration::from_millis(input.byte().into())),
            5 => self.answer(guest, input),
            6 => {
                let Some(datagram) = self.remembered.get(input.below(REMEMBERED)).cloned() else { return };
                self.send(from, &datagram);
            }
            _ => {
                let mut datagram = self.sample(guest, input);
                datagram.resize(usize::from(input.byte()), 0);
                self.send(from, &datagram);
            }
        }
    }

    /// Says hello, and takes the welcome.
    fn hello(&mut self, guest: usize) {
        let Guest { address, place, .. } = self.guests[guest];
        let key = self.key.clone().unwrap_or_else(|| SessionKey::from_bytes([0; 32]));
        let joining = Joining::draw(SESSION, place, &key, &mut self.entropy).unwrap().with_kind(self.kind);
        let hello = joining.hello();
        self.remember(&hello);
        match self.server.handle_datagram(self.now, address, &hello) {
            Admission::Reply { to, bytes } => {
                assert!(self.key.is_some() && to == address);
                let joined = joining.handle_welcome(&bytes).unwrap();
                assert_eq!((joined.welcome().peers, usize::from(joined.welcome().axes), joined.kind()), (3, self.axes, self.kind));
                self.guests[guest].joined = Some(joined);
            }
            // A session with a key answers every hello with a right tag.
            Admission::Refused(cause) => assert!(self.key.is_none() && cause == Refusal::Keyless, "{cause:?}"),
            Admission::Sample { .. } => panic!("a hello is no sample"),
        }
    }

    /// A sample as the guest makes it, sealed if it was welcomed.
    fn sample(&mut self, guest: usize, input: &mut Input<'_>) -> Vec<u8> {
        let step = i64::from(input.byte().cast_signed());
        let Guest { address, place, joined, sequence } = &mut self.guests[guest];
        *sequence = if step == -128 { 1 << 40 } else { sequence.saturating_add_signed(step) };
        let mut number = || f64::from(input.word().cast_signed()) / 512.0;
        let state = State { position: [number(), number(), number()], velocity: [number(), 1.0, -1.0] };
        let sample = Sample { session: SESSION, sender: place.0, sequence: *sequence, sent: self.now, state };
        let receiver = if self.kind.is_personal() { 1 } else { 0 };
        let extra = Extra { receiver, numbers: [0.5; 3], attitude: Attitude::REST };
        let mut plain = [0; MAX_LEN];
        let length = sample.encode_as(self.kind, &extra, self.axes, &mut plain);
        let plain = plain[..length].to_vec();
        let Some(joined) = joined else { return plain };
        let mut sealed = [0; MAX_DATAGRAM];
        let length = joined.seal(&plain, &mut sealed).unwrap();
        let sealed = sealed[..length].to_vec();
        self.authentic.insert((*address, sealed.clone()));
        sealed
    }

    fn remember(&mut self, datagram: &[u8]) {
        if self.remembered.len() == REMEMBERED {
            self.remembered.remove(0);
        }
        self.remembered.push(datagram.to_vec());
    }

    fn send(&mut self, from: SocketAddr, datagram: &[u8]) {
        self.remember(datagram);
        let handled = self.server.stats().handled;
        let admission = self.server.handle_datagram(self.now, from, datagram);
        assert_eq!(self.server.stats().handled, handled + 1);
        match admission {
            Admission::Sample { place, joined, sample } => self.let_in(from, datagram, place, joined, sample.bytes()),
            Admission::Reply { to, bytes } => {
                assert!(to == from && bytes.len() <= datagram.len() && self.remembered.iter().any(|sent| sent == datagram))
            }
            Admission::Refused(_) => {}
        }
    }

    fn let_in(&mut self, from: SocketAddr, datagram: &[u8], place: Place, joined: bool, sample: &[u8]) {
        assert!(self.key.is_none() || self.authentic.contains(&(from, datagram.to_vec())), "nobody with the key has made this datagram");
        let (sample, _) = Sample::<3>::decode_as(sample, self.kind, self.axes).unwrap();
        assert_eq!((sample.session, sample.sender), (SESSION, place.0));
        let inside = self.inside.entry(place).or_default();
        assert!(!joined || inside.last().is_none_or(|last| *last < sample.sequence), "a program that joins again is older than it was");
        assert!(inside.insert(sample.sequence), "let in twice");
        let State { position, velocity } = sample.state;
        let is_within = |numbers: [f64; 3], limit: f64| numbers.iter().all(|number| number.abs() <= limit);
        assert!(!self.has_limits || is_within(position, LIMITS.position) && is_within(velocity, LIMITS.velocity));
        let seat = self.server.seat(self.now, place).unwrap();
        assert!(seat.present && seat.address == Some(from));
    }

    /// The session speaks to a seat, and a guest hears something.
    fn answer(&mut self, guest: usize, input: &mut Input<'_>) {
        let length = usize::from(input.byte());
        let plain = input.take(length);
        let mut out = [0; MAX_DATAGRAM];
        let Guest { place, address, joined, .. } = &self.guests[guest];
        let sealed = self.server.seal(self.now, *place, plain, &mut out);
        let seat = self.server.seat(self.now, *place).unwrap();
        assert_eq!(sealed.is_some(), seat.present && plain.len() <= MAX_LEN);
        let Some((to, length)) = sealed else { return };
        assert_eq!(Some(to), seat.address);
        if self.key.is_none() {
            assert_eq!(&out[..length], plain);
        } else if let Some(joined) = joined {
            match joined.open(&out[..length]) {
                Ok(opened) => assert!(to == *address && opened == plain),
                // For the other guest of the seat, for an earlier joining, or no sample at all.
                Err(_) => assert!(to != *address || length != self.kind.datagram_len(self.axes) + 32 || joined.open(plain).is_err()),
            }
        }
    }
}
