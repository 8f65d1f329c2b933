//! Sessions of a mapping: a remote endpoint in conversation with a host inside, and the lifetime of the session.

use std::time::Duration;

use cohaptic_units::Instant;

use super::Timeouts;

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) enum Protocol {
    Udp,
    Tcp,
}

/// Flags of a segment with a meaning for a NAT. All are `false` for a datagram.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub(crate) struct Signs {
    pub(crate) syn: bool,
    pub(crate) ack: bool,
    pub(crate) fin: bool,
    pub(crate) rst: bool,
}

/// Direction of a packet, as an index of [`Session::seen`].
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Way {
    Out,
    In,
}

/// Session between an endpoint inside and a remote endpoint.
#[derive(Clone, Debug)]
pub(super) struct Session {
    /// Instant of the last outbound packet, or of the SYN from outside at the beginning of the session.
    last: Instant,
    /// `true` if a packet has come in since the session began.
    is_answered: bool,
    /// SYN and FIN of a connection of TCP, indexed by [`Way`].
    seen: [Signs; 2],
}

impl Session {
    pub(super) fn new(now: Instant) -> Self {
        Self { last: now, is_answered: false, seen: [Signs::default(); 2] }
    }

    /// Notes a packet. Only an outbound packet makes the session live longer (RFC 4787, requirement 6).
    pub(super) fn note(&mut self, now: Instant, way: Way, signs: Signs) {
        // A SYN after the end of a connection opens a new connection of the same ports.
        if signs.syn && !signs.ack && self.is_closing() {
            *self = Self::new(now);
        }
        match way {
            Way::Out => self.last = now,
            Way::In => self.is_answered = true,
        }
        let seen = &mut self.seen[way as usize];
        seen.syn |= signs.syn;
        seen.fin |= signs.fin;
        seen.rst |= signs.rst;
    }

    /// Returns whether both FINs or a reset have passed.
    fn is_closing(&self) -> bool {
        let [out, back] = self.seen;
        out.rst || back.rst || out.fin && back.fin
    }

    /// Returns whether the session is alive.
    pub(super) fn lives(&self, now: Instant, protocol: Protocol, timeouts: &Timeouts) -> bool {
        now < self.last.saturating_add(self.timeout(protocol, timeouts))
    }

    fn timeout(&self, protocol: Protocol, timeouts: &Timeouts) -> Duration {
        let [out, back] = self.seen;
        match protocol {
            Protocol::Udp if self.is_answered => timeouts.udp,
            Protocol::Udp => timeouts.udp_unanswered,
            Protocol::Tcp if out.syn && back.syn && !self.is_closing() => timeouts.tcp,
            Protocol::Tcp => timeouts.tcp_transitory,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Behaviour;
    use super::*;

    #[test]
    fn a_connection_lives_long_only_while_it_is_established() {
        let timeouts = Behaviour::default().timeouts;
        let at = |seconds: u64| Instant::from_nanos(seconds * 1_000_000_000);
        let syn = Signs { syn: true, ..Signs::default() };
        let [syn_ack, fin] = [Signs { ack: true, ..syn }, Signs { fin: true, ack: true, ..Signs::default() }];
        let mut session = Session::new(at(0));
        let lives = |session: &Session, second| session.lives(at(second), Protocol::Tcp, &timeouts);
        session.note(at(0), Way::Out, syn);
        assert_eq!([239, 240].map(|second| lives(&session, second)), [true, false]);
        session.note(at(1), Way::In, syn_ack);
        assert_eq!([7439, 7440].map(|second| lives(&session, second)), [true, false]);
        session.note(at(10), Way::Out, fin);
        assert!(lives(&session, 7449));
        session.note(at(11), Way::In, fin);
        assert_eq!([249, 250].map(|second| lives(&session, second)), [true, false]);
        // A further SYN begins a new connection.
        session.note(at(20), Way::Out, syn);
        session.note(at(20), Way::In, syn_ack);
        assert!(lives(&session, 7459));
        session.note(at(30), Way::In, Signs { rst: true, ..Signs::default() });
        assert_eq!([259, 260].map(|second| lives(&session, second)), [true, false]);
        // A late SYN with ACK belongs to the connection that has ended.
        session.note(at(40), Way::In, syn_ack);
        assert!(!lives(&session, 260));
    }

    #[test]
    fn a_datagram_lives_longer_once_it_is_answered() {
        let timeouts = Behaviour::default().timeouts;
        let at = |seconds: u64| Instant::from_nanos(seconds * 1_000_000_000);
        let mut session = Session::new(at(0));
        session.note(at(0), Way::Out, Signs::default());
        let lives = |session: &Session, second| session.lives(at(second), Protocol::Udp, &timeouts);
        assert_eq!([29, 30].map(|second| lives(&session, second)), [true, false]);
        // The answer itself refreshes nothing.
        session.note(at(20), Way::In, Signs::default());
        assert_eq!([299, 300].map(|second| lives(&session, second)), [true, false]);
    }
}
