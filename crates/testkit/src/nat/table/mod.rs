//! Mappings of a NAT, and the sessions of a firewall.

#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use cohaptic_units::Instant;
use cohaptic_wan::random::{Purpose, Stream};

use super::session::{Session, Way};
use super::{Behaviour, Dependence, Ports, Protocol, Signs};
use crate::trace::Lost;

/// Address in the short form of [`Addresses`](crate::Addresses), and port.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Endpoint {
    pub(crate) address: u32,
    pub(crate) port: u16,
}

/// Packet between two endpoints, as a NAT sees it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Flow {
    pub(crate) protocol: Protocol,
    /// `true` if both addresses are of IPv6. IPv6 is never translated.
    pub(crate) is_six: bool,
    pub(crate) source: Endpoint,
    pub(crate) destination: Endpoint,
    pub(crate) signs: Signs,
}

/// Identity of a mapping: the endpoint inside, and the remote endpoint as far as the mapping depends on the remote endpoint.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Key {
    protocol: Protocol,
    is_six: bool,
    inside: Endpoint,
    remote: Option<(u32, Option<u16>)>,
}

/// Endpoint of a mapping as outsiders see it, with protocol and version of IP.
type External = (Protocol, bool, Endpoint);

#[derive(Clone, Debug)]
struct Mapping {
    external: Endpoint,
    /// Sessions by remote endpoint.
    sessions: BTreeMap<Endpoint, Session>,
}

/// State of a NAT or a firewall.
#[derive(Clone, Debug)]
pub(crate) struct Table {
    pub(crate) behaviour: Behaviour,
    /// `true` for a NAT, with translation of IPv4; `false` for a firewall.
    translates: bool,
    mappings: BTreeMap<Key, Mapping>,
    externals: BTreeMap<External, Key>,
    /// Number of mappings. Beyond this number, ended mappings are removed.
    most: usize,
    /// Random stream of ports.
    stream: Stream,
    /// Number of ports drawn so far.
    drawn: u64,
    /// Number of dropped packets from outside.
    pub(crate) filtered: u64,
}

/// Mapping of a NAT, in the form for programs: short addresses inside and outside.
pub(crate) type Listed = (Protocol, bool, Endpoint, Endpoint, Vec<Endpoint>);

/// First random port: lower ports are for services (RFC 6335).
const FIRST: u16 = 1024;

/// Number of mappings without any removal of ended mappings.
const FEW: usize = 64;

impl Table {
    pub(crate) fn new(behaviour: Behaviour, translates: bool, seed: u64, name: &str) -> Self {
        // Names contain no blanks, so no link has this label.
        let stream = Stream::new(seed, format!("ports of {name}").as_bytes());
        Self { behaviour, translates, mappings: BTreeMap::new(), externals: BTreeMap::new(), most: FEW, stream, drawn: 0, filtered: 0 }
    }

    /// Returns whether packets of a version of IP are translated.
    pub(crate) const fn translates(&self, is_six: bool) -> bool {
        self.translates && !is_six
    }

    /// Returns whether a random port was drawn.
    pub(crate) const fn has_drawn(&self) -> bool {
        self.drawn > 0
    }

    /// Removes all mappings, as after a restart.
    pub(crate) fn forget(&mut self) {
        self.mappings.clear();
        self.externals.clear();
    }

    /// Handles a packet from inside, and returns the source as outsiders see the packet. `outer` is the address of the NAT.
    ///
    /// # Errors
    ///
    /// [`Lost::NoMapping`] for a segment of no known connection, unless the segment opens a connection, or if all ports are taken.
    pub(crate) fn outbound(&mut self, now: Instant, flow: &Flow, outer: u32) -> Result<Endpoint, Lost> {
        let key = self.key(flow, flow.source, flow.destination);
        let is_known = self.session(now, &key, flow.destination).is_some();
        // Segments of a forgotten connection are dropped without an answer.
        if flow.protocol == Protocol::Tcp && !flow.signs.syn && !is_known {
            return Err(Lost::NoMapping);
        }
        if !is_known && !self.lives(now, &key) {
            self.remove(&key);
            self.forget_ended(now);
            let external = if self.translates(flow.is_six) {
                Endpoint { address: outer, port: self.free_port(now, &key, outer).ok_or(Lost::NoMapping)? }
            } else {
                flow.source
            };
            self.externals.insert((key.protocol, key.is_six, external), key);
            self.mappings.insert(key, Mapping { external, sessions: BTreeMap::new() });
        }
        let timeouts = self.behaviour.timeouts;
        let mapping = self.mappings.get_mut(&key).ok_or(Lost::NoMapping)?;
        // A mapping may talk to ever new endpoints. Ended sessions go whenever the number of sessions has doubled.
        if !is_known && mapping.sessions.len() >= FEW && mapping.sessions.len().is_power_of_two() {
            mapping.sessions.retain(|_, session| session.lives(now, key.protocol, &timeouts));
        }
        let session = mapping.sessions.entry(flow.destination).or_insert_with(|| Session::new(now));
        if !is_known {
            *session = Session::new(now);
        }
        session.note(now, Way::Out, flow.signs);
        Ok(mapping.external)
    }

    /// Handles a packet from outside, and returns the destination inside.
    ///
    /// # Errors
    ///
    /// [`Lost::NoMapping`] if the destination is no mapping, [`Lost::Filtered`] if the source may not send there.
    pub(crate) fn inbound(&mut self, now: Instant, flow: &Flow) -> Result<Endpoint, Lost> {
        let key = self.permitted(now, flow).inspect_err(|_| self.filtered += 1)?;
        let timeouts = &self.behaviour.timeouts;
        let Some(mapping) = self.mappings.get_mut(&key) else { return Err(Lost::NoMapping) };
        match mapping.sessions.get_mut(&flow.source).filter(|session| session.lives(now, key.protocol, timeouts)) {
            Some(session) => session.note(now, Way::In, flow.signs),
            // A permitted connection from outside needs a session for the answers from inside.
            None if flow.signs.syn => {
                let mut session = Session::new(now);
                session.note(now, Way::In, flow.signs);
                mapping.sessions.insert(flow.source, session);
            }
            None => {}
        }
        Ok(key.inside)
    }

    /// Handles an error message of IP from inside, about a packet from outside. Returns the source of the message as outsiders see the message. Such a message
    /// neither makes nor refreshes a mapping (RFC 4787, requirement 12).
    ///
    /// # Errors
    ///
    /// [`Lost::NoMapping`] if the message belongs to no mapping.
    pub(crate) fn error_out(&self, now: Instant, flow: &Flow) -> Result<Endpoint, Lost> {
        let key = self.key(flow, flow.source, flow.destination);
        if !self.lives(now, &key) {
            return Err(Lost::NoMapping);
        }
        self.mappings.get(&key).map(|mapping| mapping.external).ok_or(Lost::NoMapping)
    }

    /// Handles an error message of IP from outside, about a packet from inside. Returns the destination inside.
    ///
    /// # Errors
    ///
    /// As [`Table::inbound`].
    pub(crate) fn error_in(&mut self, now: Instant, flow: &Flow) -> Result<Endpoint, Lost> {
        self.permitted(now, flow).map(|key| key.inside).inspect_err(|_| self.filtered += 1)
    }

    /// Returns whether a segment from outside belongs to a connection with a SYN from inside.
    #[cfg(feature = "tcp")]
    pub(crate) fn is_permitted(&self, now: Instant, flow: &Flow) -> bool {
        self.permitted(now, flow).is_ok()
    }

    /// Returns the mapping of a packet from outside, if the filter permits the packet.
    fn permitted(&self, now: Instant, flow: &Flow) -> Result<Key, Lost> {
        let key = *self.externals.get(&(flow.protocol, flow.is_six, flow.destination)).ok_or(Lost::NoMapping)?;
        let mapping = self.mappings.get(&key).ok_or(Lost::NoMapping)?;
        let lives = |(_, session): (&Endpoint, &Session)| session.lives(now, key.protocol, &self.behaviour.timeouts);
        let Endpoint { address, .. } = flow.source;
        let from = match self.behaviour.filter {
            Dependence::Endpoint => Endpoint { address: 0, port: 0 }..=Endpoint { address: u32::MAX, port: u16::MAX },
            Dependence::Address => Endpoint { address, port: 0 }..=Endpoint { address, port: u16::MAX },
            Dependence::AddressAndPort => flow.source..=flow.source,
        };
        if mapping.sessions.range(from).any(lives) {
            return Ok(key);
        }
        Err(if self.lives(now, &key) { Lost::Filtered } else { Lost::NoMapping })
    }

    /// Returns all living mappings, sorted by protocol and endpoint inside, with the remote endpoints of the sessions.
    pub(crate) fn listed(&self, now: Instant) -> Vec<Listed> {
        let of = |(key, mapping): (&Key, &Mapping)| {
            let lives = |session: &Session| session.lives(now, key.protocol, &self.behaviour.timeouts);
            let remotes: Vec<Endpoint> = mapping.sessions.iter().filter(|(_, session)| lives(session)).map(|(remote, _)| *remote).collect();
            (!remotes.is_empty()).then_some((key.protocol, key.is_six, key.inside, mapping.external, remotes))
        };
        self.mappings.iter().filter_map(of).collect()
    }

    fn key(&self, flow: &Flow, inside: Endpoint, remote: Endpoint) -> Key {
        let remote = match self.behaviour.mapping {
            // Without translation an endpoint is the only external endpoint of itself.
            _ if !self.translates(flow.is_six) => None,
            Dependence::Endpoint => None,
            Dependence::Address => Some((remote.address, None)),
            Dependence::AddressAndPort => Some((remote.address, Some(remote.port))),
        };
        Key { protocol: flow.protocol, is_six: flow.is_six, inside, remote }
    }

    /// Returns the session of a mapping with a remote endpoint, if the session is alive.
    fn session(&self, now: Instant, key: &Key, remote: Endpoint) -> Option<&Session> {
        let session = self.mappings.get(key)?.sessions.get(&remote)?;
        session.lives(now, key.protocol, &self.behaviour.timeouts).then_some(session)
    }

    /// Returns whether a mapping exists and has a living session.
    fn lives(&self, now: Instant, key: &Key) -> bool {
        let lives = |session: &Session| session.lives(now, key.protocol, &self.behaviour.timeouts);
        self.mappings.get(key).is_some_and(|mapping| mapping.sessions.values().any(lives))
    }

    fn remove(&mut self, key: &Key) {
        if let Some(mapping) = self.mappings.remove(key) {
            self.externals.remove(&(key.protocol, key.is_six, mapping.external));
        }
    }

    /// Returns whether no living mapping has the external port. An ended mapping gives the port up.
    fn is_free(&mut self, now: Instant, of: &Key, outer: u32, port: u16) -> bool {
        let external = (of.protocol, of.is_six, Endpoint { address: outer, port });
        let Some(holder) = self.externals.get(&external).copied() else { return true };
        if self.lives(now, &holder) {
            return false;
        }
        self.remove(&holder);
        true
    }

    /// Returns an external port for a new mapping, or `None` if all are taken.
    fn free_port(&mut self, now: Instant, key: &Key, outer: u32) -> Option<u16> {
        if self.behaviour.ports == Ports::Kept && self.is_free(now, key, outer, key.inside.port) {
            return Some(key.inside.port);
        }
        let count = u64::from(u16::MAX - FIRST) + 1;
        let first = self.stream.packet(self.drawn).first(Purpose::Loss) % count;
        self.drawn += 1;
        // The search takes the next free port from the drawn port on, and so ends also with few free ports.
        let ports = (0..count).map(|step| FIRST + u16::try_from((first + step) % count).unwrap_or(0));
        ports.into_iter().find(|port| self.is_free(now, key, outer, *port))
    }

    /// Removes ended mappings and sessions beyond a number, so memory follows the living mappings.
    fn forget_ended(&mut self, now: Instant) {
        if self.mappings.len() <= self.most {
            return;
        }
        let timeouts = self.behaviour.timeouts;
        self.mappings.retain(|key, mapping| {
            mapping.sessions.retain(|_, session| session.lives(now, key.protocol, &timeouts));
            !mapping.sessions.is_empty()
        });
        let mappings = &self.mappings;
        self.externals.retain(|_, key| mappings.contains_key(key));
        self.most = FEW.max(2 * self.mappings.len());
    }
}
