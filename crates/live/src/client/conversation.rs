//! What a program says to the session, and what it makes of what it hears, from the first hello to the end.

use core::time::Duration;
use std::collections::BTreeMap;

use cohaptic_peer::wire::{Extra, Sample, SampleKind};
use cohaptic_units::Instant;

use super::{Joined, Joining};
use crate::handshake::HANDSHAKE_LEN;
use crate::{Entropy, EntropyError, MAX_DATAGRAM, Place, SessionKey};

/// How long to wait for a welcome before saying hello again.
pub const HELLO_EVERY: Duration = Duration::from_millis(250);
/// Without anything new from anybody for so long, a client begins anew: the session may have been started again.
pub const SILENCE: Duration = Duration::from_secs(1);

/// The identity of a client, and how it is to join.
#[derive(Clone, Debug)]
pub enum ClientConfig {
    /// In a session without a key, of which everything is known beforehand.
    Keyless {
        /// The session.
        session: u64,
        /// The seat.
        place: Place,
        /// What a welcome would tell.
        info: SessionInfo,
    },
    /// In a session with a key.
    Keyed {
        /// The session.
        session: u64,
        /// The seat.
        place: Place,
        /// Its key.
        key: SessionKey,
    },
}

/// What a peer must know of a session.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SessionInfo {
    /// How many axes a sample has, 1 to 3.
    pub axes: usize,
    /// How many peers the scene has.
    pub peers: u32,
    /// Tc.
    pub tick: Duration,
    /// Tn.
    pub update: Duration,
}

/// What a datagram was.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Heard {
    /// The newest sample of its sender: to be held from now on. Axes that the session does not have are zero.
    Newest(Sample<3>),
    /// A sample that is late or repeated.
    Late(Sample<3>),
    /// The welcome that was waited for.
    Welcome,
    /// Nothing for this client.
    Ignored,
}

/// A program's part of the protocol, as a state machine: datagrams in with [`Client::handle_datagram`], hellos out with [`Client::poll_hello`], samples
/// out with [`Client::seal`].
///
/// Call [`Client::poll_hello`] at every tick, or when [`Client::poll_timeout`] says. The answer of `poll_timeout` may change after `handle_datagram`
/// and `poll_hello`. A late call makes a hello late and nothing else.
#[derive(Debug)]
pub struct Client {
    session: u64,
    place: Place,
    key: Option<SessionKey>,
    info: Option<SessionInfo>,
    kind: SampleKind,
    /// What the sample that was heard last says beyond position and velocity.
    extra: Extra<3>,
    /// The present joining, with a key and after the first welcome.
    joined: Option<Joined>,
    /// The one that is asked for.
    joining: Option<Joining>,
    next_hello: Instant,
    /// When something new was heard last, or the client began anew.
    heard: Instant,
    /// The highest number by sender: at most as many as there are peers.
    newest: BTreeMap<u32, u64>,
    joinings: u64,
}

impl Client {
    /// A client that has said nothing yet, of a session whose samples are states.
    #[must_use]
    pub fn new(config: ClientConfig, now: Instant) -> Self {
        let (session, place, key, info) = match config {
            ClientConfig::Keyless { session, place, info } => (session, place, None, Some(info)),
            ClientConfig::Keyed { session, place, key } => (session, place, Some(key), None),
        };
        let newest = BTreeMap::new();
        Self {
            session,
            place,
            key,
            info,
            kind: SampleKind::State,
            extra: Extra::NONE,
            joined: None,
            joining: None,
            next_hello: now,
            heard: now,
            newest,
            joinings: 0,
        }
    }

    /// For a session whose samples are of that kind.
    #[must_use]
    pub fn with_kind(self, kind: SampleKind) -> Self {
        Self { kind, ..self }
    }

    /// What the sample that [`Client::handle_datagram`] gave last says beyond position and velocity.
    #[must_use]
    pub const fn extra(&self) -> &Extra<3> {
        &self.extra
    }

    /// What samples of the session carry beyond the state; with a key, as the welcome says.
    #[must_use]
    pub const fn kind(&self) -> SampleKind {
        self.kind
    }

    /// The session's parameters; `None` before the first welcome.
    #[must_use]
    pub const fn info(&self) -> Option<&SessionInfo> {
        self.info.as_ref()
    }

    /// How many welcomes were taken.
    #[must_use]
    pub const fn joinings(&self) -> u64 {
        self.joinings
    }

    /// The hello that is to be sent now, if one is. With a key: before the first welcome, and while nothing new is heard. Without one it is never
    /// any, but the numbers of the others are forgotten in their silence.
    ///
    /// # Errors
    ///
    /// [`EntropyError`] if a nonce is needed and there are no random bytes. It is tried again at the next call.
    pub fn poll_hello(&mut self, now: Instant, entropy: &mut impl Entropy) -> Result<Option<[u8; HANDSHAKE_LEN]>, EntropyError> {
        let silent = now >= self.silent_from();
        let Some(key) = &self.key else {
            if silent {
                self.begin_anew(now);
            }
            return Ok(None);
        };
        if self.joined.is_some() && !silent {
            self.joining = None;
            return Ok(None);
        }
        if now < self.next_hello {
            return Ok(None);
        }
        let joining = match self.joining.take() {
            Some(joining) => joining,
            None => Joining::draw(self.session, self.place, key, entropy)?.with_kind(self.kind),
        };
        self.next_hello = now.saturating_add(HELLO_EVERY);
        Ok(Some(self.joining.insert(joining).hello()))
    }

    /// When [`Client::poll_hello`] has something to do next.
    #[must_use]
    pub fn poll_timeout(&self) -> Instant {
        if self.key.is_some() && self.joined.is_none() { self.next_hello } else { self.silent_from().max(self.next_hello) }
    }

    /// Takes in a datagram from the session. Never panics; a datagram for somebody else changes nothing.
    pub fn handle_datagram(&mut self, now: Instant, datagram: &[u8]) -> Heard {
        if let Some(joining) = &self.joining
            && let Ok(joined) = joining.handle_welcome(datagram)
        {
            let welcome = joined.welcome();
            let (axes, peers, tick, update) = (usize::from(welcome.axes), welcome.peers, welcome.tick, welcome.update);
            self.info = Some(SessionInfo { axes, peers, tick, update });
            self.kind = joined.kind();
            self.joined = Some(joined);
            self.joining = None;
            self.joinings += 1;
            self.begin_anew(now);
            return Heard::Welcome;
        }
        let Some((sample, extra)) = self.open(datagram) else { return Heard::Ignored };
        self.extra = extra;
        self.take(now, sample)
    }

    /// Writes a sample for the session, sealed if there is a key, and gives its length. `None` before the first welcome, where there is a key, and if
    /// `sample` is longer than a sample.
    pub fn seal(&self, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<usize> {
        match (&self.key, &self.joined) {
            (Some(_), joined) => joined.as_ref()?.seal(sample, out),
            (None, _) => {
                out.get_mut(..sample.len()).filter(|_| sample.len() <= cohaptic_peer::wire::MAX_LEN)?.copy_from_slice(sample);
                Some(sample.len())
            }
        }
    }

    fn open(&self, datagram: &[u8]) -> Option<(Sample<3>, Extra<3>)> {
        let info = self.info?;
        let plain = match (&self.key, &self.joined) {
            (Some(_), joined) => joined.as_ref()?.open(datagram).ok()?,
            (None, _) => datagram,
        };
        let (sample, extra) = Sample::decode_as(plain, self.kind, info.axes).ok()?;
        let other = sample.sender < info.peers && sample.sender != self.place.0;
        let mine = !self.kind.is_personal() || extra.receiver == self.place.0;
        (sample.session == self.session && other && mine).then_some((sample, extra))
    }

    fn take(&mut self, now: Instant, sample: Sample<3>) -> Heard {
        if self.newest.get(&sample.sender).is_some_and(|&newest| sample.sequence <= newest) {
            return Heard::Late(sample);
        }
        self.newest.insert(sample.sender, sample.sequence);
        self.heard = now;
        Heard::Newest(sample)
    }

    fn begin_anew(&mut self, now: Instant) {
        self.newest.clear();
        self.heard = now;
    }

    fn silent_from(&self) -> Instant {
        self.heard.saturating_add(SILENCE)
    }
}
