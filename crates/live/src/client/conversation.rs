//! State machine of a client: the datagrams of a program to the session and from the session, from the first hello to the end.

use core::time::Duration;
use std::collections::BTreeMap;

use cohaptic_peer::wire::{Extra, Sample, SampleKind};
use cohaptic_units::Instant;

use super::{Joined, Joining};
use crate::handshake::{HANDSHAKE_LEN, Taken, Welcome};
use crate::{Entropy, EntropyError, Label, MAX_DATAGRAM, Place, SessionKey};

/// Time between two hellos while no welcome comes.
pub(crate) const HELLO_EVERY: Duration = Duration::from_millis(250);
/// Time without a new sample from any peer after which a client begins anew: the session may have been restarted.
pub(crate) const SILENCE: Duration = Duration::from_secs(1);

/// Identity of a client, and the way of joining.
#[derive(Clone, Debug)]
pub enum ClientConfig {
    /// For a session without a key. The parameters of the session must be known beforehand.
    Keyless {
        /// Number of the session.
        session: u64,
        /// Place of the client's seat.
        place: Place,
        /// Parameters of the session: no welcome tells the parameters.
        info: SessionInfo,
    },
    /// For a session with a key. The welcome tells the parameters of the session.
    Keyed {
        /// Number of the session.
        session: u64,
        /// Place of the client's seat.
        place: Place,
        /// Session key.
        key: SessionKey,
    },
}

/// Parameters of a session for a peer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SessionInfo {
    /// Number of axes of a sample, 1 to 3.
    pub axes: usize,
    /// Number of peers of the scene, this peer included.
    pub peers: u32,
    /// Control tick Tc of the client's peer.
    pub tick: Duration,
    /// Period of sending Tn.
    pub update: Duration,
}

/// Meaning of a received datagram.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Heard {
    /// Newest sample of the sender, to be held from now on. Axes beyond the axes of the session are zero.
    Newest(Sample<3>),
    /// Sample not newer than an earlier sample of the sender.
    Late(Sample<3>),
    /// Welcome for the hello of this client. The client may now seal samples.
    Welcome,
    /// Notice that another program has the seat: the session refused a sample of this client.
    Taken,
    /// Invalid datagram, or a datagram for another program.
    Ignored,
}

/// Client side of the protocol as a state machine. Received datagrams go in through [`Client::handle_datagram`]. Hellos come out of [`Client::poll_hello`], and
/// samples out of [`Client::seal`].
///
/// Call [`Client::poll_hello`] at every tick, or at the instant of [`Client::poll_timeout`]. The instant may change with each call of `handle_datagram` or
/// `poll_hello`. A late call delays a hello and has no other effect.
#[derive(Debug)]
pub struct Client {
    session: u64,
    place: Place,
    /// `None` in a session without a key.
    key: Option<SessionKey>,
    /// Parameters of the session. `None` before the first welcome.
    info: Option<SessionInfo>,
    /// Fingerprint of the client's scene, and the label of the client's device, for hellos.
    introduction: (u64, Label),
    /// Kind of the samples, until a welcome says otherwise.
    kind: SampleKind,
    /// Data beyond position and velocity in the sample opened last.
    extra: Extra<3>,
    /// Present joining. `None` before the first welcome, and in a session without a key.
    joined: Option<Joined>,
    /// Joining whose hellos are sent. `None` while no hello needs an answer. Every repeated hello is the same datagram.
    joining: Option<Joining>,
    /// Earliest instant of the next hello.
    next_hello: Instant,
    /// Instant of the latest new sample, or of the latest new beginning.
    heard: Instant,
    /// Highest sequence number received, by sender. Has at most as many entries as the scene has peers, because `open` refuses further senders.
    newest: BTreeMap<u32, u64>,
    /// Number of welcomes taken.
    joinings: u64,
}

impl Client {
    /// Returns a client before the first datagram, for a session with samples of states.
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
            introduction: (0, Label::NONE),
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

    /// Returns the client, for a session with samples of the kind `kind`.
    #[must_use]
    pub fn with_kind(self, kind: SampleKind) -> Self {
        Self { kind, ..self }
    }

    /// Returns the client, with hellos that tell the fingerprint of the client's scene (0: not told) and the label of the client's device.
    #[must_use]
    pub fn introduced(self, scene: u64, label: Label) -> Self {
        Self { introduction: (scene, label), ..self }
    }

    /// Returns the data beyond position and velocity of the sample returned last by [`Client::handle_datagram`].
    #[must_use]
    pub const fn extra(&self) -> &Extra<3> {
        &self.extra
    }

    /// Returns the kind of the session's samples. With a key, a welcome can change the kind to attitudes.
    #[must_use]
    pub const fn kind(&self) -> SampleKind {
        self.kind
    }

    /// Returns the parameters of the session. `None` before the first welcome.
    #[must_use]
    pub const fn info(&self) -> Option<&SessionInfo> {
        self.info.as_ref()
    }

    /// Returns the latest welcome. `None` before the first welcome, and in a session without a key.
    #[must_use]
    pub fn welcome(&self) -> Option<&Welcome> {
        self.joined.as_ref().map(Joined::welcome)
    }

    /// Returns the number of welcomes taken.
    #[must_use]
    pub const fn joinings(&self) -> u64 {
        self.joinings
    }

    /// Returns the next hello, if a hello is due now. With a key, hellos are sent before the first welcome and while no new sample comes. Without a key there
    /// are no hellos, but after a silence the client forgets the sequence numbers of all peers.
    ///
    /// # Errors
    ///
    /// [`EntropyError`] if a nonce is needed and the source has no random bytes. The next call tries again.
    pub fn poll_hello(&mut self, now: Instant, entropy: &mut impl Entropy) -> Result<Option<[u8; HANDSHAKE_LEN]>, EntropyError> {
        // A client without a key has nothing to ask, but after a silence the peers may count from 0 again.
        let silent = now >= self.silent_from();
        let Some(key) = &self.key else {
            if silent {
                self.begin_anew(now);
            }
            return Ok(None);
        };
        if self.joined.is_some() && !silent {
            // New samples have come again without a welcome: the session still has this joining.
            self.joining = None;
            return Ok(None);
        }
        if now < self.next_hello {
            return Ok(None);
        }
        // A repeated hello has the same nonce, so that a late welcome for an earlier hello still fits.
        let joining = match self.joining.take() {
            Some(joining) => joining,
            None => {
                let (scene, label) = self.introduction;
                Joining::draw(self.session, self.place, key, entropy)?.with_kind(self.kind).introduced(scene, label)
            }
        };
        // The time counts from this call and not from the last deadline, so that a late call does not cause two hellos in a row.
        self.next_hello = now.saturating_add(HELLO_EVERY);
        Ok(Some(self.joining.insert(joining).hello()))
    }

    /// Returns the instant at which [`Client::poll_hello`] has to be called next.
    #[must_use]
    pub fn poll_timeout(&self) -> Instant {
        if self.key.is_some() && self.joined.is_none() { self.next_hello } else { self.silent_from().max(self.next_hello) }
    }

    /// Handles a datagram from the session, received at `now`. Never panics. An invalid datagram, or a datagram for another program, changes nothing.
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
            // The session may have been restarted, and the peers of the session may count from 0 again.
            self.begin_anew(now);
            return Heard::Welcome;
        }
        let seal = self.key.as_ref().zip(self.welcome().map(|welcome| welcome.client_nonce));
        // A client with a key has sent no sample before its first welcome, so that no notice can be for the client.
        if self.key.is_some() == seal.is_some() && (Taken { session: self.session, place: self.place, seal }).is(datagram) {
            return Heard::Taken;
        }
        let Some((sample, extra)) = self.open(datagram) else { return Heard::Ignored };
        self.extra = extra;
        self.take(now, sample)
    }

    /// Writes the datagram with `sample` for the session, sealed if there is a key, and returns the length of the datagram. Returns `None` if `sample` is too
    /// long for a sample, and, with a key, before the first welcome.
    pub fn seal(&self, sample: &[u8], out: &mut [u8; MAX_DATAGRAM]) -> Option<usize> {
        match (&self.key, &self.joined) {
            (Some(_), joined) => joined.as_ref()?.seal(sample, out),
            (None, _) => {
                out.get_mut(..sample.len()).filter(|_| sample.len() <= cohaptic_peer::wire::MAX_LEN)?.copy_from_slice(sample);
                Some(sample.len())
            }
        }
    }

    /// Returns the sample in a datagram, if the seal is right and the sample comes from another peer of this session. A personal sample must also be for this
    /// client.
    fn open(&self, datagram: &[u8]) -> Option<(Sample<3>, Extra<3>)> {
        let info = self.info?;
        let plain = match (&self.key, &self.joined) {
            (Some(_), joined) => joined.as_ref()?.open(datagram).ok()?,
            (None, _) => datagram,
        };
        let (sample, extra) = Sample::decode_as(plain, self.kind, info.axes).ok()?;
        // The client's own samples can come back only from a stranger.
        let other = sample.sender < info.peers && sample.sender != self.place.0;
        let mine = !self.kind.is_personal() || extra.receiver == self.place.0;
        (sample.session == self.session && other && mine).then_some((sample, extra))
    }

    /// Decides whether a sample is newer than all earlier samples of the sender. Only a newer sample ends a silence: a recorded sample must not.
    fn take(&mut self, now: Instant, sample: Sample<3>) -> Heard {
        if self.newest.get(&sample.sender).is_some_and(|&newest| sample.sequence <= newest) {
            return Heard::Late(sample);
        }
        self.newest.insert(sample.sender, sample.sequence);
        self.heard = now;
        Heard::Newest(sample)
    }

    /// Forgets the sequence numbers of all peers, and begins a new silence at `now`.
    fn begin_anew(&mut self, now: Instant) {
        self.newest.clear();
        self.heard = now;
    }

    /// Returns the instant from which on the session counts as silent.
    fn silent_from(&self) -> Instant {
        self.heard.saturating_add(SILENCE)
    }
}
