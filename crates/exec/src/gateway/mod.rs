//! Gateway to the real world: packets that a program inside sends to addresses outside of its network leave as data through sockets of the real machine.
//!
//! ```text
//!   program ── TUN ── link ──▶ Gateway ── sockets ──▶ the machine's loopback, name server, networks
//! ```
//!
//! The gateway ends TCP: inside stands a [`cohaptic_tcp::Connection`], outside a socket of the system, and data passes between both. So the link carries real
//! segments, with losses and retransmissions, and no right over the machine's network is needed. Each pair of ends of UDP has a connected socket. Echo
//! requests to the gateway are answered. All other packets are dropped and counted.
//!
//! Time is an argument, but the sockets are real: [`Gateway::poll`] asks the system without waiting.

mod address;
mod fragments;
mod relay;
mod tcp;
#[cfg(test)]
mod tests;
mod udp;

use core::net::SocketAddr;
use std::collections::{BTreeMap, VecDeque};
use std::io;
use std::os::fd::{AsFd, BorrowedFd, OwnedFd};

use cohaptic_linkfile::router::Protocol;
use cohaptic_router::{Content, Packet, Unreachable};
use cohaptic_units::Instant;
use rustix::event::{Timespec, epoll};

use address::HOST;
pub use address::{DNS, GATEWAY, NAMES, PREFIX, host};
use fragments::Fragments;
use relay::PIECE;
use tcp::TcpTable;
use udp::UdpTable;

/// Gateway between the packets of a host and the sockets of the real machine.
#[derive(Debug)]
pub struct Gateway {
    sockets: Sockets,
    tcp: TcpTable,
    udp: UdpTable,
    fragments: Fragments,
    /// Latest instant given by the driver.
    now: Instant,
    /// Damaged packets, and packets of kinds without a way through the gateway.
    dropped: u64,
}

/// Both ends of a flow, as the program inside names them.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Ends {
    inside: SocketAddr,
    outside: SocketAddr,
}

/// Owner of a socket.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Owner {
    /// Connection of TCP.
    Tcp(Ends),
    /// Listener of TCP, by its index.
    Listener(usize),
    /// Flow of UDP from inside.
    Udp(Ends),
    /// Port of UDP with a way inside, by its index.
    Port(usize),
}

/// Real sockets with their events, and the shared parts of the tables of TCP and UDP: packets to the program inside, and memory.
#[derive(Debug)]
struct Sockets {
    epoll: OwnedFd,
    /// Owners of the sockets, by token. A token is never used again, so that a late event finds no wrong owner.
    owners: BTreeMap<u64, Owner>,
    next_token: u64,
    /// Identification of the latest datagram from outside.
    identification: u32,
    /// Name server of the machine.
    names: Option<SocketAddr>,
    /// Packets to the program inside.
    out: VecDeque<Packet>,
    buffer: Vec<u8>,
}

impl Sockets {
    /// Watches a socket for data and for room. Each change is reported once.
    fn watch(&mut self, socket: impl AsFd, owner: Owner) -> io::Result<u64> {
        use epoll::EventFlags;
        let token = self.next_token;
        // Edge-triggered, because a socket with room is nearly always writable and would wake the loop without end.
        let all = EventFlags::IN | EventFlags::OUT | EventFlags::RDHUP | EventFlags::ET;
        epoll::add(&self.epoll, socket, epoll::EventData::new_u64(token), all)?;
        self.next_token += 1;
        self.owners.insert(token, owner);
        Ok(token)
    }

    fn forget(&mut self, token: u64) {
        self.owners.remove(&token);
    }
}

/// Returns the reason if an error of the system reports an unreachable destination, or `None` for all remaining errors.
fn unreachable(error: &io::Error) -> Option<Unreachable> {
    const REASONS: [(io::ErrorKind, Unreachable); 3] = [
        (io::ErrorKind::NetworkUnreachable, Unreachable::Network),
        (io::ErrorKind::HostUnreachable, Unreachable::Host),
        (io::ErrorKind::ConnectionRefused, Unreachable::Port),
    ];
    REASONS.into_iter().find_map(|(kind, why)| (kind == error.kind()).then_some(why))
}

impl Gateway {
    /// Returns a gateway without flows. `names` is the name server of the machine.
    ///
    /// # Errors
    ///
    /// If the system gives no more descriptors.
    pub fn new(names: Option<SocketAddr>) -> io::Result<Self> {
        let sockets = Sockets {
            epoll: epoll::create(epoll::CreateFlags::CLOEXEC)?,
            owners: BTreeMap::new(),
            next_token: 0,
            identification: 0,
            names,
            out: VecDeque::new(),
            buffer: vec![0; PIECE],
        };
        Ok(Self { sockets, tcp: TcpTable::default(), udp: UdpTable::default(), fragments: Fragments::default(), now: Instant::ZERO, dropped: 0 })
    }

    /// Leads connections and datagrams from `address` of the real machine to the same port of the host inside.
    ///
    /// # Errors
    ///
    /// If this machine does not have the address, or the port is taken.
    pub fn listen(&mut self, address: SocketAddr) -> io::Result<()> {
        self.tcp.listen(&mut self.sockets, address)?;
        self.udp.listen(&mut self.sockets, address)
    }

    /// Returns a descriptor, readable when a socket has an event.
    #[must_use]
    pub fn readable(&self) -> BorrowedFd<'_> {
        self.sockets.epoll.as_fd()
    }

    /// Handles the events of all sockets, without waiting. Returns the number of events.
    ///
    /// # Errors
    ///
    /// The error of the system.
    pub fn poll(&mut self, now: Instant) -> io::Result<usize> {
        const AT_ONCE: usize = 64;
        self.now = self.now.max(now);
        let mut events = Vec::with_capacity(AT_ONCE);
        match epoll::wait(&self.sockets.epoll, rustix::buffer::spare_capacity(&mut events), Some(&Timespec { tv_sec: 0, tv_nsec: 0 })) {
            Ok(_) => {}
            Err(rustix::io::Errno::INTR) => return Ok(0),
            Err(error) => return Err(error.into()),
        }
        for event in &events {
            let epoll::Event { flags, data } = *event;
            // An earlier event of the same batch may have closed the socket of this event.
            let Some(owner) = self.sockets.owners.get(&data.u64()).copied() else { continue };
            match owner {
                Owner::Tcp(ends) => self.tcp.handle_event(&mut self.sockets, self.now, ends, flags),
                Owner::Listener(place) => self.tcp.handle_clients(&mut self.sockets, self.now, place),
                Owner::Udp(ends) => self.udp.handle_answers(&mut self.sockets, self.now, ends),
                Owner::Port(place) => self.udp.handle_clients(&mut self.sockets, self.now, place),
            }
        }
        Ok(events.len())
    }

    /// Handles a packet of the program inside.
    pub fn handle_packet(&mut self, now: Instant, packet: &Packet) {
        self.now = self.now.max(now);
        let Content::Ip { headers, .. } = packet.content() else {
            self.dropped += 1;
            return;
        };
        if !headers.is_whole {
            // A fragment of a never completed packet is lost without a count, as on a line.
            if let Some(whole) = self.fragments.take(self.now, packet) {
                self.handle_packet(now, &whole);
            }
            return;
        }
        let is_handled = match headers.protocol {
            Protocol::TCP => self.tcp.handle_packet(&mut self.sockets, self.now, packet.bytes()),
            Protocol::UDP => self.udp.handle_packet(&mut self.sockets, self.now, packet),
            Protocol::ICMP | Protocol::ICMPV6 if GATEWAY.contains(&headers.destination) || NAMES.contains(&headers.destination) => {
                let answer = packet.echo_reply();
                let is_request = answer.is_some();
                self.sockets.out.extend(answer);
                is_request
            }
            _ => false,
        };
        self.dropped += u64::from(!is_handled);
    }

    /// Returns the instant of the next necessary call of [`Gateway::handle_timeout`].
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        [self.tcp.poll_timeout(), self.udp.poll_timeout()].into_iter().flatten().min()
    }

    /// Handles all deadlines up to `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        self.now = self.now.max(now);
        self.tcp.handle_timeout(&mut self.sockets, self.now);
        self.udp.handle_timeout(&mut self.sockets, self.now);
    }

    /// Returns the next packet to the program inside, or `None` when all have been polled.
    #[must_use]
    pub fn poll_packet(&mut self) -> Option<Packet> {
        self.sockets.out.pop_front()
    }

    /// Returns whether all data from inside has gone out, and every connection from inside has ended its data.
    #[must_use]
    pub fn is_delivered(&self) -> bool {
        self.tcp.is_delivered()
    }

    /// Returns the number of dropped packets from inside: damaged packets, and packets of further protocols.
    #[must_use]
    pub const fn dropped(&self) -> u64 {
        self.dropped
    }
}
