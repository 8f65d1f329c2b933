//! Ports of TCP, independent of the ports of UDP.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, Ipv6Addr, SocketAddr};

use cohaptic_wan::NodeId;

use super::{Core, ListenId, route};
use crate::core::sockets::FIRST_DYNAMIC;
use crate::errno::Errno;

/// Number of dynamic ports.
const COUNT: u16 = u16::MAX - FIRST_DYNAMIC + 1;

/// Port to which a socket is bound, until the port is released. Several sockets may share a port, so `number` tells the sockets apart.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct HoldId {
    key: (NodeId, u16),
    number: u64,
}

/// Binding of a socket to a port.
#[derive(Debug)]
struct Hold {
    number: u64,
    ip: IpAddr,
    /// `true` if the socket has set `IPV6_V6ONLY`.
    is_only_six: bool,
    /// `true` if the socket has set `SO_REUSEADDR`.
    is_shared: bool,
    /// Listener of the socket, once the socket listens.
    listener: Option<ListenId>,
}

/// Options of a socket that binds a port.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sharing {
    /// `SO_REUSEADDR`: other sockets with the option may be bound to the port as well.
    pub(crate) is_shared: bool,
    /// `IPV6_V6ONLY`: a socket at `[::]` has nothing to do with IPv4.
    pub(crate) is_only_six: bool,
}

impl Hold {
    /// Returns whether the socket hears packets of the version of IP of `ip`.
    fn hears(&self, ip: IpAddr) -> bool {
        self.ip.is_ipv6() == ip.is_ipv6() || is_dual(self.ip, self.is_only_six)
    }

    /// Returns whether a packet to `ip` reaches the socket.
    fn covers(&self, ip: IpAddr) -> bool {
        self.hears(ip) && (self.ip == ip || self.ip.is_unspecified())
    }

    /// Returns whether the socket, and one at `ip` with the option `is_only_six`, have an address in common.
    fn overlaps(&self, ip: IpAddr, is_only_six: bool) -> bool {
        // Either of the two bindings may be the binding to all addresses.
        self.covers(ip) || ip.is_unspecified() && (ip.is_ipv6() == self.ip.is_ipv6() || is_dual(ip, is_only_six))
    }
}

/// Returns whether a socket at `ip` hears both versions of IP.
fn is_dual(ip: IpAddr, is_only_six: bool) -> bool {
    ip == IpAddr::V6(Ipv6Addr::UNSPECIFIED) && !is_only_six
}

/// Bound ports of all hosts.
#[derive(Debug)]
pub(super) struct Ports {
    /// Bindings, by host and port. No list is empty.
    holds: BTreeMap<(NodeId, u16), Vec<Hold>>,
    /// Number of bindings made so far.
    numbers: u64,
    /// Offset from [`FIRST_DYNAMIC`] of the dynamic port to try next, indexed by host.
    next: Vec<u16>,
}

impl Ports {
    pub(super) fn new(hosts: usize) -> Self {
        Self { holds: BTreeMap::new(), numbers: 0, next: vec![0; hosts] }
    }

    fn at(&self, host: NodeId, port: u16) -> &[Hold] {
        self.holds.get(&(host, port)).map_or(&[], Vec::as_slice)
    }

    fn hold(&mut self, host: NodeId, address: SocketAddr, Sharing { is_shared, is_only_six }: Sharing) -> HoldId {
        let (key, number) = ((host, address.port()), self.numbers);
        self.numbers += 1;
        self.holds.entry(key).or_default().push(Hold { number, ip: address.ip(), is_only_six, is_shared, listener: None });
        HoldId { key, number }
    }

    pub(super) fn release(&mut self, id: HoldId) {
        if let Some(holds) = self.holds.get_mut(&id.key) {
            holds.retain(|hold| hold.number != id.number);
            if holds.is_empty() {
                self.holds.remove(&id.key);
            }
        }
    }

    /// Returns the dynamic ports in the order of trial. Ports given longest ago come first.
    fn turn(&self, host: NodeId) -> impl Iterator<Item = u16> + use<> {
        let first = self.next[host.index()];
        (0..COUNT).map(move |step| FIRST_DYNAMIC + (first + step) % COUNT)
    }

    fn given(&mut self, host: NodeId, port: u16) {
        self.next[host.index()] = (port - FIRST_DYNAMIC + 1) % COUNT;
    }
}

impl Core {
    /// Binds a socket to a port of a host, which must be up. The socket does not listen yet.
    pub(crate) fn hold_port(&mut self, host: NodeId, wanted: SocketAddr, sharing: Sharing) -> io::Result<(HoldId, SocketAddr)> {
        self.check_owned(host, wanted.ip())?;
        let Sharing { is_shared, is_only_six } = sharing;
        let (ip, port) = (wanted.ip(), wanted.port());
        let port = if port == 0 {
            // A socket that hears both versions of IP needs a port that is free in both.
            let is_held = |port: u16| self.tcp.ports.at(host, port).iter().any(|hold| hold.hears(ip) || is_dual(ip, is_only_six));
            // Accepted connections and connections in TIME-WAIT use a port without a binding.
            let free = self.tcp.ports.turn(host).find(|port| !is_held(*port) && !self.has_connections(host, *port));
            free.ok_or_else(|| self.no_port(host, io::ErrorKind::AddrInUse))?
        } else {
            // A listener excludes every other socket, even if both share the port.
            let holds = self.tcp.ports.at(host, port);
            let is_taken = holds.iter().any(|hold| hold.overlaps(ip, is_only_six) && (hold.listener.is_some() || !(hold.is_shared && is_shared)));
            if is_taken || (!is_shared && self.has_connections(host, port)) {
                return Errno::AddrInUse.fail();
            }
            port
        };
        if wanted.port() == 0 {
            self.tcp.ports.given(host, port);
        }
        let address = SocketAddr::new(ip, port);
        Ok((self.tcp.ports.hold(host, address, sharing), address))
    }

    pub(crate) fn release_port(&mut self, hold: HoldId) {
        self.tcp.ports.release(hold);
    }

    /// Checks that no further socket than `id` listens at `address`.
    pub(super) fn check_alone(&self, host: NodeId, address: SocketAddr, id: HoldId) -> io::Result<()> {
        let holds = self.tcp.ports.at(host, address.port());
        let is_only_six = holds.iter().any(|hold| hold.number == id.number && hold.is_only_six);
        // A shared port may have several bound sockets, but one listener per address.
        let is_taken = holds.iter().any(|hold| hold.number != id.number && hold.listener.is_some() && hold.overlaps(address.ip(), is_only_six));
        if is_taken { Errno::AddrInUse.fail() } else { Ok(()) }
    }

    /// Notes that the socket of a held port listens from now on.
    pub(super) fn listen_at(&mut self, id: HoldId, listener: ListenId) {
        let holds = self.tcp.ports.holds.get_mut(&id.key).into_iter().flatten();
        holds.filter(|hold| hold.number == id.number).for_each(|hold| hold.listener = Some(listener));
    }

    /// Returns the listener of `host` for connections to `address`. A listener bound to the address comes before a listener bound to all addresses.
    pub(super) fn listener_at(&self, host: NodeId, address: SocketAddr) -> Option<ListenId> {
        let holds = self.tcp.ports.at(host, address.port()).iter().filter(|hold| hold.listener.is_some());
        holds.filter(|hold| hold.covers(address.ip())).max_by_key(|hold| !hold.ip.is_unspecified())?.listener
    }

    /// Returns a free dynamic port from which a connection to `remote` can be opened.
    pub(super) fn port_to(&mut self, host: NodeId, from: IpAddr, remote: SocketAddr) -> io::Result<u16> {
        let is_free = |port: &u16| {
            !self.tcp.ports.at(host, *port).iter().any(|hold| hold.hears(from))
                && !self.tcp.routes.contains_key(&route(host, SocketAddr::new(from, *port), remote))
        };
        let port = self.tcp.ports.turn(host).find(is_free);
        let port = port.ok_or_else(|| self.no_port(host, io::ErrorKind::AddrNotAvailable))?;
        self.tcp.ports.given(host, port);
        Ok(port)
    }

    // Routes are sorted by host, then by port: the first route from the smallest address of the port on tells whether there is any.
    fn has_connections(&self, host: NodeId, port: u16) -> bool {
        self.tcp
            .routes
            .range((host, port, IpAddr::from([0; 4]), SocketAddr::from(([0; 4], 0)))..)
            .next()
            .is_some_and(|(key, _)| (key.0, key.1) == (host, port))
    }

    fn no_port(&self, host: NodeId, kind: io::ErrorKind) -> io::Error {
        io::Error::new(
            kind,
            format!("all {COUNT} dynamic ports of host `{}` are taken; drop sockets that are no longer used", self.plan.names()[host.index()]),
        )
    }
}
