//! Mappings of a NAT, and the sessions of a firewall.

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
    /// `true` if both addresses are of IPv6, which nobody translates.
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
    /// `true` for a NAT, which translates IPv4; `false` for a firewall.
    translates: bool,
    mappings: BTreeMap<Key, Mapping>,
    externals: BTreeMap<External, Key>,
    /// Number of mappings beyond which ended mappings are removed.
    most: usize,
    /// Random stream of ports.
    stream: Stream,
    /// Number of ports drawn so far.
    drawn: u64,
    /// Number of packets from outside that were dropped.
    pub(crate) filtered: u64,
}

/// Mapping of a NAT, in the form for programs: short addresses inside and outside.
pub(crate) type Listed = (Protocol, bool, Endpoint, Endpoint, Vec<Endpoint>);

/// First port that is drawn at random: lower ports are for services (RFC 6335).
const FIRST: u16 = 1024;

/// Number of mappings up to which ended mappings may stay.
const FEW: usize = 64;

impl Table {
    pub(crate) fn new(behaviour: Behaviour, translates: bool, seed: u64, name: &str) -> Self {
        // Names contain no blanks, so that no link has this label.
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

    /// Handles a packet from inside, and returns its source as outsiders see it. `outer` is the address of the NAT.
    ///
    /// # Errors
    ///
    /// [`Lost::NoMapping`] for a segment that opens no connection and belongs to none, or if all ports are taken.
    pub(crate) fn outbound(&mut self, now: Instant, flow: &Flow, outer: u32) -> Result<Endpoint, Lost> {
        let key = self.key(flow, flow.source, flow.destination);
        let is_known = self.session(now, &key, flow.destination).is_some();
        // A connection that was forgotten is gone: its segments are dropped without an answer.
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
        // A mapping may talk to ever new endpoints. Ended sessions go whenever their number has doubled.
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

    /// Handles a packet from outside, and returns its destination inside.
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
            // A connection from outside, which the filter permits, needs a session for the answers from inside.
            None if flow.signs.syn => {
                let mut session = Session::new(now);
                session.note(now, Way::In, flow.signs);
                mapping.sessions.insert(flow.source, session);
            }
            None => {}
        }
        Ok(key.inside)
    }

    /// Handles an error message of IP from inside, about a packet from outside. Returns the source of the message as outsiders see it. Such a message makes no
    /// mapping, and refreshes none (RFC 4787, requirement 12).
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

    /// Returns whether a segment from outside belongs to a connection of which a SYN has come from inside.
    #[cfg(feature = "tcp")]
    pub(crate) fn is_permitted(&self, now: Instant, flow: &Flow) -> bool {
        self.permitted(now, flow).is_ok()
    }

    /// Returns the mapping to which a packet from outside goes, if the filter permits the packet.
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

    /// Returns all mappings that are alive, sorted by protocol and endpoint inside, with the remote endpoints of their sessions.
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
            // Without translation an endpoint has one external endpoint, itself.
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

    /// Returns whether a mapping exists and has a session that is alive.
    fn lives(&self, now: Instant, key: &Key) -> bool {
        let lives = |session: &Session| session.lives(now, key.protocol, &self.behaviour.timeouts);
        self.mappings.get(key).is_some_and(|mapping| mapping.sessions.values().any(lives))
    }

    fn remove(&mut self, key: &Key) {
        if let Some(mapping) = self.mappings.remove(key) {
            self.externals.remove(&(key.protocol, key.is_six, mapping.external));
        }
    }

    /// Returns whether no living mapping has the external port. A mapping that has ended gives its port up.
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
        // After the drawn port the next free port is taken, so that the search ends also with few free ports.
        let ports = (0..count).map(|step| FIRST + u16::try_from((first + step) % count).unwrap_or(0));
        ports.into_iter().find(|port| self.is_free(now, key, outer, *port))
    }

    /// Removes ended mappings and sessions when there are many, so that memory follows the living ones.
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

#[cfg(test)]
mod tests {
    use super::super::parse_words;
    use super::*;

    const OUTER: u32 = 4;

    fn endpoint(address: u32, port: u16) -> Endpoint {
        Endpoint { address, port }
    }

    fn flow(source: Endpoint, destination: Endpoint) -> Flow {
        Flow { protocol: Protocol::Udp, is_six: false, source, destination, signs: Signs::default() }
    }

    fn at(seconds: u64) -> Instant {
        Instant::from_nanos(seconds * 1_000_000_000)
    }

    fn table(words: &str) -> Table {
        Table::new(parse_words(words, Behaviour::default(), true).unwrap(), true, 7, "nat")
    }

    #[test]
    fn a_filter_lets_in_the_endpoints_of_its_dependence() {
        let [inside, remote] = [endpoint(100, 5000), endpoint(1, 7)];
        for (words, expected) in [
            ("filter endpoint-independent", [true, true, true]),
            ("filter address-dependent", [true, true, false]),
            ("filter address-and-port-dependent", [true, false, false]),
        ] {
            let mut table = table(words);
            let external = table.outbound(at(0), &flow(inside, remote), OUTER).unwrap();
            assert_eq!(external, endpoint(OUTER, 5000));
            let passes = [remote, endpoint(1, 8), endpoint(2, 7)].map(|from| table.inbound(at(1), &flow(from, external)) == Ok(inside));
            assert_eq!(passes, expected, "{words}");
            assert_eq!(table.inbound(at(1), &flow(remote, endpoint(OUTER, 5001))), Err(Lost::NoMapping));
            assert_eq!(table.filtered, 1 + expected.iter().filter(|passes| !**passes).count() as u64);
        }
    }

    #[test]
    fn a_mapping_is_shared_by_the_endpoints_of_its_dependence() {
        let inside = endpoint(100, 5000);
        for (words, expected) in [
            ("mapping endpoint-independent", [true, true, true]),
            ("mapping address-dependent", [true, true, false]),
            ("mapping address-and-port-dependent", [true, false, false]),
        ] {
            for ports in ["kept", "random"] {
                let mut table = table(&format!("{words} ports {ports}"));
                let mut to = |remote| table.outbound(at(0), &flow(inside, remote), OUTER).unwrap();
                let first = to(endpoint(1, 7));
                assert_eq!(first == endpoint(OUTER, 5000), ports == "kept");
                let same = [endpoint(1, 7), endpoint(1, 8), endpoint(2, 7)].map(|remote| to(remote) == first);
                assert_eq!(same, expected, "{words}");
            }
        }
    }

    #[test]
    fn a_port_is_free_again_when_its_mapping_has_ended() {
        let mut table = table("home");
        let remote = endpoint(1, 7);
        let kept = table.outbound(at(0), &flow(endpoint(100, 5000), remote), OUTER).unwrap();
        let other = table.outbound(at(1), &flow(endpoint(101, 5000), remote), OUTER).unwrap();
        assert_eq!((kept.port, table.has_drawn()), (5000, true));
        assert!(other.port >= FIRST && other.port != 5000);
        // Thirty seconds without an answer end a mapping.
        assert_eq!(table.inbound(at(30), &flow(remote, kept)), Err(Lost::NoMapping));
        assert_eq!(table.inbound(at(30), &flow(remote, other)), Ok(endpoint(101, 5000)));
        let later = table.outbound(at(30), &flow(endpoint(102, 5000), remote), OUTER).unwrap();
        assert_eq!(later.port, 5000);
        assert_eq!(table.listed(at(30)).len(), 2);
        table.forget();
        assert!(table.listed(at(30)).is_empty());
        assert_eq!(table.inbound(at(30), &flow(remote, other)), Err(Lost::NoMapping));
    }

    #[test]
    fn all_ports_can_be_given_and_no_more() {
        let mut table = table("home");
        let remote = endpoint(1, 7);
        let ports = (FIRST..=u16::MAX - 1).map(|port| table.outbound(at(0), &flow(endpoint(100, port), remote), OUTER).unwrap().port);
        assert!(ports.eq(FIRST..=u16::MAX - 1));
        // One port is left for the first that has to draw, and none for the second.
        let drawn = table.outbound(at(0), &flow(endpoint(101, FIRST), remote), OUTER).unwrap();
        assert_eq!((drawn.port, table.has_drawn()), (u16::MAX, true));
        assert_eq!(table.outbound(at(0), &flow(endpoint(102, FIRST), remote), OUTER), Err(Lost::NoMapping));
        table.outbound(at(30), &flow(endpoint(70_000, 1), remote), OUTER).unwrap();
        assert_eq!(table.listed(at(30)).len(), 1);
    }

    #[test]
    fn memory_follows_the_mappings_that_are_alive() {
        let mut table = table("home udp-unanswered-timeout 1s");
        for host in 0..1000 {
            table.outbound(at(host.into()), &flow(endpoint(host, 1), endpoint(1, 7)), OUTER).unwrap();
        }
        assert!(table.mappings.len() <= FEW + 1 && table.externals.len() == table.mappings.len());
        // The sessions of one mapping as well.
        for port in 0..1000 {
            table.outbound(at((1000 + port).into()), &flow(endpoint(1, 1), endpoint(1, port)), OUTER).unwrap();
        }
        let most = table.mappings.values().map(|mapping| mapping.sessions.len()).max().unwrap();
        assert!(most <= FEW + 1, "{most}");
    }

    #[test]
    fn a_firewall_and_version_6_translate_nothing() {
        let [inside, remote] = [endpoint(100, 5000), endpoint(1, 7)];
        let mut nat = table("strict");
        let six = Flow { is_six: true, ..flow(inside, remote) };
        assert_eq!(nat.outbound(at(0), &six, OUTER), Ok(inside));
        assert_eq!(nat.inbound(at(1), &Flow { is_six: true, ..flow(remote, inside) }), Ok(inside));
        assert_eq!(nat.inbound(at(1), &Flow { is_six: true, ..flow(endpoint(1, 8), inside) }), Err(Lost::Filtered));
        let mut wall = Table::new(Behaviour::default(), false, 7, "wall");
        assert_eq!(wall.outbound(at(0), &flow(inside, remote), OUTER), Ok(inside));
        assert_eq!(wall.inbound(at(1), &flow(remote, inside)), Ok(inside));
        assert_eq!(wall.inbound(at(1), &flow(remote, endpoint(101, 5000))), Err(Lost::NoMapping));
    }

    #[test]
    fn an_error_message_refreshes_nothing() {
        let [inside, remote] = [endpoint(100, 5000), endpoint(1, 7)];
        let mut table = table("udp-timeout 10s");
        let external = table.outbound(at(0), &flow(inside, remote), OUTER).unwrap();
        assert_eq!(table.error_in(at(9), &flow(remote, external)), Ok(inside));
        assert_eq!(table.error_out(at(9), &flow(inside, remote)), Ok(external));
        assert_eq!(table.error_in(at(10), &flow(remote, external)), Err(Lost::NoMapping));
        assert_eq!(table.error_out(at(10), &flow(inside, remote)), Err(Lost::NoMapping));
    }

    #[test]
    fn a_segment_of_no_connection_is_dropped() {
        let [inside, remote] = [endpoint(100, 5000), endpoint(1, 7)];
        let mut table = table("home");
        let segment =
            |source, destination, syn| Flow { protocol: Protocol::Tcp, signs: Signs { syn, ..Signs::default() }, ..flow(source, destination) };
        assert_eq!(table.outbound(at(0), &segment(inside, remote, false), OUTER), Err(Lost::NoMapping));
        let external = table.outbound(at(0), &segment(inside, remote, true), OUTER).unwrap();
        assert_eq!(table.inbound(at(1), &segment(remote, external, true)), Ok(inside));
        // The connection is established, and lives for 7440 s.
        assert_eq!(table.outbound(at(7439), &segment(inside, remote, false), OUTER), Ok(external));
        assert_eq!(table.inbound(at(7439 + 7440), &segment(remote, external, false)), Err(Lost::NoMapping));
        assert_eq!(table.outbound(at(7439 + 7440), &segment(inside, remote, false), OUTER), Err(Lost::NoMapping));
    }
}
