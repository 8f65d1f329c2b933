//! Table of the flows of UDP beyond the link.

use core::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};
use core::time::Duration;
use std::collections::BTreeMap;
use std::io;
use std::net::UdpSocket;

use cohaptic_linkfile::router::Protocol;
use cohaptic_router::{Content, Packet};
use cohaptic_units::Instant;

use super::{Ends, HOST, Owner, Sockets, address, unreachable};

/// Silence after which a flow is forgotten: the least that RFC 4787 recommends.
const IDLE: Duration = Duration::from_secs(300);

/// Flows at most. A new flow then takes the place of the flow with the longest silence.
const MOST: usize = 4096;

/// Longest packet to the program inside \[bytes\]: the MTU of its device.
const MTU: usize = 1500;

/// Flows by their ends, and ports with a way inside.
#[derive(Debug, Default)]
pub(super) struct UdpTable {
    flows: BTreeMap<Ends, Flow>,
    ports: Vec<(UdpSocket, u16)>,
    /// Ends of the clients of ports, by port and address.
    clients: BTreeMap<(usize, SocketAddr), Ends>,
    /// Next search for silent flows.
    search_at: Option<Instant>,
}

#[derive(Debug)]
struct Flow {
    way: Way,
    /// Instant of the latest datagram in either direction.
    used_at: Instant,
}

/// Way of the datagrams of a flow from inside.
#[derive(Debug)]
enum Way {
    /// Connected socket of a flow from inside.
    Own { socket: UdpSocket, token: u64 },
    /// Client of the port at the index `port`.
    Client { port: usize, client: SocketAddr },
}

impl UdpTable {
    pub(super) fn listen(&mut self, sockets: &mut Sockets, address: SocketAddr) -> io::Result<()> {
        let socket = UdpSocket::bind(address)?;
        socket.set_nonblocking(true)?;
        sockets.watch(&socket, Owner::Port(self.ports.len()))?;
        self.ports.push((socket, address.port()));
        Ok(())
    }

    /// Handles a packet of UDP from inside. Returns `false` for a damaged packet.
    pub(super) fn handle_packet(&mut self, sockets: &mut Sockets, now: Instant, packet: &Packet) -> bool {
        let (Content::Ip { headers, .. }, Some(data)) = (packet.content(), packet.datagram_data()) else { return false };
        let Some([from, to]) = headers.ports else { return false };
        let ends = Ends { inside: SocketAddr::new(headers.source, from), outside: SocketAddr::new(headers.destination, to) };
        if !self.flows.contains_key(&ends)
            && let Err(error) = self.open(sockets, now, ends)
        {
            tell(sockets, ends, &error);
            return true;
        }
        let Some(flow) = self.flows.get_mut(&ends) else { return true };
        flow.used_at = now;
        match &flow.way {
            Way::Own { socket, .. } => {
                // The first call may report that an earlier datagram was refused. The system then has not sent the datagram.
                if let Err(error) = socket.send(data) {
                    tell(sockets, ends, &error);
                    let _ = socket.send(data);
                }
            }
            Way::Client { port, client } => {
                // A refused datagram is lost, as on a line.
                let _ = self.ports[*port].0.send_to(data, client);
            }
        }
        true
    }

    fn open(&mut self, sockets: &mut Sockets, now: Instant, ends: Ends) -> io::Result<()> {
        let real = address::real(ends.outside, sockets.names).ok_or(io::ErrorKind::ConnectionRefused)?;
        let any = if real.is_ipv4() { IpAddr::V4(Ipv4Addr::UNSPECIFIED) } else { IpAddr::V6(Ipv6Addr::UNSPECIFIED) };
        let socket = UdpSocket::bind((any, 0))?;
        socket.set_nonblocking(true)?;
        // A connected socket takes answers from the asked address alone, and reports a closed port.
        socket.connect(real)?;
        let token = sockets.watch(&socket, Owner::Udp(ends))?;
        self.insert(sockets, now, ends, Way::Own { socket, token });
        Ok(())
    }

    fn insert(&mut self, sockets: &mut Sockets, now: Instant, ends: Ends, way: Way) {
        if self.flows.len() >= MOST
            && let Some(oldest) = self.flows.iter().min_by_key(|(_, flow)| flow.used_at).map(|(ends, _)| *ends)
        {
            self.remove(sockets, oldest);
        }
        self.flows.insert(ends, Flow { way, used_at: now });
        // A planned search stays: no new flow can be silent for long enough before this search.
        self.search_at.get_or_insert_with(|| now.saturating_add(IDLE));
    }

    fn remove(&mut self, sockets: &mut Sockets, ends: Ends) {
        match self.flows.remove(&ends).map(|flow| flow.way) {
            Some(Way::Own { token, .. }) => sockets.forget(token),
            Some(Way::Client { port, client }) => {
                self.clients.remove(&(port, client));
            }
            None => {}
        }
    }

    /// Passes the answers to a flow inside.
    pub(super) fn handle_answers(&mut self, sockets: &mut Sockets, now: Instant, ends: Ends) {
        let Some(Flow { way: Way::Own { socket, .. }, used_at }) = self.flows.get_mut(&ends) else { return };
        loop {
            match socket.recv(&mut sockets.buffer) {
                Ok(length) => {
                    *used_at = now;
                    deliver(sockets, ends, length);
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                // The call reports the error of an earlier datagram. The next call receives a datagram.
                Err(error) => tell(sockets, ends, &error),
            }
        }
    }

    /// Passes the datagrams of clients at a port inside.
    pub(super) fn handle_clients(&mut self, sockets: &mut Sockets, now: Instant, place: usize) {
        while let Some((received, port)) = self.ports.get(place).map(|(socket, port)| (socket.recv_from(&mut sockets.buffer), *port)) {
            let (length, client) = match received {
                Ok(received) => received,
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return,
                // The call reports the error of an earlier answer, to a departed client.
                Err(_) => continue,
            };
            let known = self.clients.get(&(place, client)).copied().filter(|ends| self.flows.contains_key(ends));
            let Some(ends) = known.or_else(|| self.meet(sockets, now, place, port, client)) else { continue };
            if let Some(flow) = self.flows.get_mut(&ends) {
                flow.used_at = now;
            }
            deliver(sockets, ends, length);
        }
    }

    /// Gives a new client a port of the gateway: the client's own port, or the next free port.
    fn meet(&mut self, sockets: &mut Sockets, now: Instant, place: usize, port: u16, client: SocketAddr) -> Option<Ends> {
        let inside = SocketAddr::new(HOST[0], port);
        let ports = (client.port()..=u16::MAX).chain(1..client.port());
        let mut ends = ports.map(|port| Ends { inside, outside: SocketAddr::new(address::gateway(inside.ip()), port) });
        let ends = ends.find(|ends| !self.flows.contains_key(ends))?;
        self.insert(sockets, now, ends, Way::Client { port: place, client });
        self.clients.insert((place, client), ends);
        Some(ends)
    }

    pub(super) const fn poll_timeout(&self) -> Option<Instant> {
        self.search_at
    }

    /// Forgets silent flows.
    pub(super) fn handle_timeout(&mut self, sockets: &mut Sockets, now: Instant) {
        if self.search_at.is_none_or(|at| now < at) {
            return;
        }
        let silent = |flow: &Flow| now.saturating_duration_since(flow.used_at) >= IDLE;
        let ended: Vec<Ends> = self.flows.iter().filter(|(_, flow)| silent(flow)).map(|(ends, _)| *ends).collect();
        ended.into_iter().for_each(|ends| self.remove(sockets, ends));
        // A flow used since the last search is silent at the earliest when its time is over.
        self.search_at = self.flows.values().map(|flow| flow.used_at.saturating_add(IDLE)).min();
    }
}

/// Sends the first `length` bytes of the buffer inside, as a datagram, in fragments if the datagram is longer than a packet may be.
fn deliver(sockets: &mut Sockets, ends: Ends, length: usize) {
    let packet = Packet::datagram(ends.outside, ends.inside, &sockets.buffer[..length]);
    // Fragments of two datagrams must differ while both are on the way; a counter repeats after 65,536 datagrams at the earliest.
    sockets.identification = sockets.identification.wrapping_add(1);
    sockets.out.extend(packet.into_iter().flat_map(|packet| packet.cut(MTU, sockets.identification)));
}

/// Tells the program inside why its datagrams do not arrive, as the network would.
fn tell(sockets: &mut Sockets, ends: Ends, error: &io::Error) {
    // Other errors, such as a full buffer, only lose the datagram.
    let Some(why) = unreachable(error) else { return };
    sockets.out.extend(Packet::unreachable(address::gateway(ends.inside.ip()), Protocol::UDP, [ends.inside, ends.outside], 0, why));
}
