//! Ports of TCP. They are independent of the ports of UDP.

use std::collections::BTreeMap;
use std::io;
use std::net::{IpAddr, SocketAddr};

use cohaptic_wan::NodeId;

use super::{Core, ListenId, route};
use crate::core::sockets::FIRST_DYNAMIC;

/// Number of dynamic ports.
const COUNT: u16 = u16::MAX - FIRST_DYNAMIC + 1;

/// Port to which a socket is bound, until the port is released. Several sockets may share a port, so `number` tells the sockets apart.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct HoldId {
    key: (NodeId, bool, u16),
    number: u64,
}

/// Binding of a socket to a port.
#[derive(Debug)]
struct Hold {
    number: u64,
    ip: IpAddr,
    /// `true` if the socket has set `SO_REUSEADDR`.
    is_shared: bool,
    /// Listener of the socket, once the socket listens.
    listener: Option<ListenId>,
}

impl Hold {
    fn overlaps(&self, ip: IpAddr) -> bool {
        self.ip == ip || self.ip.is_unspecified() || ip.is_unspecified()
    }
}

/// Bound ports of all hosts.
#[derive(Debug)]
pub(super) struct Ports {
    /// Bindings, by host, version of IP (true for 6) and port. No list is empty.
    holds: BTreeMap<(NodeId, bool, u16), Vec<Hold>>,
    /// Number of bindings made so far.
    numbers: u64,
    /// Offset from [`FIRST_DYNAMIC`] of the dynamic port to try next, indexed by host.
    next: Vec<u16>,
}

impl Ports {
    pub(super) fn new(hosts: usize) -> Self {
        Self { holds: BTreeMap::new(), numbers: 0, next: vec![0; hosts] }
    }

    fn at(&self, host: NodeId, ip: IpAddr, port: u16) -> &[Hold] {
        self.holds.get(&(host, ip.is_ipv6(), port)).map_or(&[], Vec::as_slice)
    }

    fn hold(&mut self, host: NodeId, address: SocketAddr, is_shared: bool) -> HoldId {
        let (key, number) = ((host, address.is_ipv6(), address.port()), self.numbers);
        self.numbers += 1;
        self.holds.entry(key).or_default().push(Hold { number, ip: address.ip(), is_shared, listener: None });
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

    /// Returns the dynamic ports in the order in which they are tried. Ports given longest ago come first.
    fn turn(&self, host: NodeId) -> impl Iterator<Item = u16> + use<> {
        let first = self.next[host.index()];
        (0..COUNT).map(move |step| FIRST_DYNAMIC + (first + step) % COUNT)
    }

    fn given(&mut self, host: NodeId, port: u16) {
        self.next[host.index()] = (port - FIRST_DYNAMIC + 1) % COUNT;
    }
}

impl Core {
    /// Binds a socket to a port of a host, which must be up. `is_shared` is the option `SO_REUSEADDR`: other sockets with the option may be bound to the port
    /// as well. The socket does not listen yet.
    pub(crate) fn hold_port(&mut self, host: NodeId, wanted: SocketAddr, is_shared: bool) -> io::Result<(HoldId, SocketAddr)> {
        self.check_owned(host, wanted.ip())?;
        let (ip, port) = (wanted.ip(), wanted.port());
        let port = if port == 0 {
            let free = self.tcp.ports.turn(host).find(|port| self.tcp.ports.at(host, ip, *port).is_empty() && !self.has_connections(host, *port));
            free.ok_or_else(|| self.no_port(host, io::ErrorKind::AddrInUse))?
        } else {
            // A listener excludes every other socket, even if both share the port.
            let is_taken =
                self.tcp.ports.at(host, ip, port).iter().any(|hold| hold.overlaps(ip) && (hold.listener.is_some() || !(hold.is_shared && is_shared)));
            if is_taken || (!is_shared && self.has_connections(host, port)) {
                return Err(self.taken(host, wanted));
            }
            port
        };
        if wanted.port() == 0 {
            self.tcp.ports.given(host, port);
        }
        let address = SocketAddr::new(ip, port);
        Ok((self.tcp.ports.hold(host, address, is_shared), address))
    }

    pub(crate) fn release_port(&mut self, hold: HoldId) {
        self.tcp.ports.release(hold);
    }

    /// Checks that no socket other than `id` listens at `address`.
    pub(super) fn check_alone(&self, host: NodeId, address: SocketAddr, id: HoldId) -> io::Result<()> {
        let holds = self.tcp.ports.at(host, address.ip(), address.port());
        let is_taken = holds.iter().any(|hold| hold.number != id.number && hold.listener.is_some() && hold.overlaps(address.ip()));
        if is_taken { Err(self.taken(host, address)) } else { Ok(()) }
    }

    /// Notes that the socket of a held port listens from now on.
    pub(super) fn listen_at(&mut self, id: HoldId, listener: ListenId) {
        let holds = self.tcp.ports.holds.get_mut(&id.key).into_iter().flatten();
        holds.filter(|hold| hold.number == id.number).for_each(|hold| hold.listener = Some(listener));
    }

    /// Returns the listener of `host` for connections to `address`. A listener bound to the address comes before a listener bound to all addresses.
    pub(super) fn listener_at(&self, host: NodeId, address: SocketAddr) -> Option<ListenId> {
        let holds = self.tcp.ports.at(host, address.ip(), address.port()).iter().filter(|hold| hold.listener.is_some());
        holds.filter(|hold| hold.overlaps(address.ip())).max_by_key(|hold| !hold.ip.is_unspecified())?.listener
    }

    /// Returns a free dynamic port from which a connection to `remote` can be opened.
    pub(super) fn port_to(&mut self, host: NodeId, from: IpAddr, remote: SocketAddr) -> io::Result<u16> {
        let is_free = |port: &u16| {
            self.tcp.ports.at(host, from, *port).is_empty() && !self.tcp.routes.contains_key(&route(host, SocketAddr::new(from, *port), remote))
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

    fn taken(&self, host: NodeId, wanted: SocketAddr) -> io::Error {
        let text = format!("{wanted} is taken on host `{}`", self.plan.names()[host.index()]);
        io::Error::new(io::ErrorKind::AddrInUse, text)
    }

    fn no_port(&self, host: NodeId, kind: io::ErrorKind) -> io::Error {
        io::Error::new(kind, format!("all {COUNT} dynamic ports of host `{}` are taken", self.plan.names()[host.index()]))
    }
}
