//! What a relay does.

use core::time::Duration;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};

use cohaptic_linkfile::{LinkTable, RelayFile, RelayLimits};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{LinkModel, NodeId};

/// What a relay does, checked by [`Engine::new`](crate::Engine::new).
#[derive(Clone, Debug)]
pub struct RelayConfig {
    /// The seed of every random stream.
    pub seed: u64,
    /// The topology: which programs talk to each other.
    pub form: Form,
    /// What it may take.
    pub limits: Limits,
    /// Links that become other ones, in order of time.
    pub changes: Vec<Change>,
}

/// The topology: which programs talk to each other.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one")]
pub enum Form {
    /// N programs, each with a port that stands for it.
    Mesh(Mesh),
    /// Clients on one side, one address on the other.
    Proxy(Proxy),
}

/// N programs and the links between them.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// The programs, as the nodes of the network: at least two.
    pub programs: Vec<Program>,
    /// The links between them, by their places.
    pub links: LinkTable,
}

/// A program.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Program {
    /// Its name: with the seed, the address of the random numbers of its links.
    pub name: String,
    /// The port that stands for it.
    pub port: SocketAddr,
    /// Where it sends from and listens; `None`: learnt.
    pub address: Option<SocketAddr>,
}

/// Clients that talk to one address. Node 0 of the network, `client`, is all of them; node 1, `server`, is that address.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Where clients send to.
    pub listen: SocketAddr,
    /// The program that they speak to.
    pub to: SocketAddr,
    /// The link from the clients to that address, shared by all of them.
    pub forth: LinkModel,
    /// The link back.
    pub back: LinkModel,
    /// The most clients at once; each has a socket. What others send is dropped and counted.
    pub most_clients: u32,
}

/// What a relay may take.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Limits {
    /// The most datagrams in flight at once; those beyond are dropped. Copies that a link makes count, but are not refused.
    pub packets: u64,
    /// The most bytes of them, headers not counted.
    pub bytes: Bytes,
    /// An address that was learnt, and a client, is forgotten when it has been silent for so long.
    pub forget_after: Duration,
}

/// A link that becomes another one.
#[derive(Clone, Debug)]
pub struct Change {
    /// When.
    pub at: Instant,
    /// Its sender.
    pub from: NodeId,
    /// Its receiver.
    pub to: NodeId,
    /// What it is from then on.
    pub model: LinkModel,
}

/// Why there is no such relay.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// Fewer than two programs, or a table of links for another number of them.
    #[error("{programs} programs and links between {links}: expected at least two programs, and links between as many")]
    Programs {
        /// How many programs.
        programs: usize,
        /// How many programs the table of links is for.
        links: usize,
    },
    /// A change of a link that is not there.
    #[error("there is no link from node {} to node {} to change", from.0, to.0)]
    NoLink {
        /// The sender.
        from: NodeId,
        /// The receiver.
        to: NodeId,
    },
    /// The relay would send to a port of its own: each datagram would pass the link again and again.
    #[error("{to} is a port of the relay itself, {port}, to which each datagram would come back again and again: expected the address of a program")]
    ToItself {
        /// Where the relay would send to.
        to: SocketAddr,
        /// The port of the relay.
        port: SocketAddr,
    },
}

impl From<RelayLimits> for Limits {
    fn from(limits: RelayLimits) -> Self {
        Self { packets: limits.packets, bytes: limits.bytes, forget_after: limits.forget_after }
    }
}

impl Default for Limits {
    /// Those of a relay file: 262,144 datagrams, 64 MB, 30 s.
    fn default() -> Self {
        RelayLimits::default().into()
    }
}

impl From<RelayFile> for RelayConfig {
    fn from(file: RelayFile) -> Self {
        let programs = file.programs.into_iter().map(|program| Program { name: program.name, port: program.port, address: program.address });
        let changes = file.timeline.into_iter().map(|change| {
            let link = change.link;
            Change { at: change.at, from: NodeId::new(link.from), to: NodeId::new(link.to), model: (*link.config).clone() }
        });
        Self {
            seed: file.seed,
            form: Form::Mesh(Mesh { programs: programs.collect(), links: file.links }),
            limits: file.limits.into(),
            changes: changes.collect(),
        }
    }
}

impl Proxy {
    /// The most clients unless said otherwise.
    pub const MOST_CLIENTS: u32 = 256;
}

impl RelayConfig {
    /// The names of the nodes.
    pub(crate) fn names(&self) -> Vec<String> {
        match &self.form {
            Form::Mesh(mesh) => mesh.programs.iter().map(|program| program.name.clone()).collect(),
            Form::Proxy(_) => vec!["client".to_owned(), "server".to_owned()],
        }
    }

    /// The link from one node to another.
    pub(crate) fn link(&self, from: NodeId, to: NodeId) -> LinkModel {
        match &self.form {
            Form::Mesh(mesh) => mesh.links.between(from.index(), to.index()).clone(),
            Form::Proxy(proxy) => if from.0 == 0 { &proxy.forth } else { &proxy.back }.clone(),
        }
    }

    /// The ports of the relay as configured: 0 is a port that the system chooses.
    pub(crate) fn ports(&self) -> Vec<SocketAddr> {
        match &self.form {
            Form::Mesh(mesh) => mesh.programs.iter().map(|program| program.port).collect(),
            Form::Proxy(proxy) => vec![proxy.listen],
        }
    }

    /// Refuses a relay that sends to one of `ports`, its own ones, by whatever name. Addresses that are learnt are not known yet; the relay drops what a
    /// program sends to the port that stands for the program itself.
    pub(crate) fn check_targets(&self, ports: &[SocketAddr]) -> Result<(), ConfigError> {
        let targets: Vec<SocketAddr> = match &self.form {
            Form::Mesh(mesh) => mesh.programs.iter().filter_map(|program| program.address).collect(),
            Form::Proxy(proxy) => vec![proxy.to],
        };
        let own = |to: SocketAddr| ports.iter().find(|port| reaches(to, **port)).map(|port| ConfigError::ToItself { to, port: *port });
        targets.into_iter().find_map(own).map_or(Ok(()), Err)
    }

    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let nodes = match &self.form {
            Form::Mesh(mesh) if mesh.programs.len() < 2 || mesh.links.peers() != mesh.programs.len() => {
                return Err(ConfigError::Programs { programs: mesh.programs.len(), links: mesh.links.peers() });
            }
            Form::Mesh(mesh) => mesh.programs.len(),
            Form::Proxy(_) => 2,
        };
        let is_link = |from: NodeId, to: NodeId| from != to && (from.index()) < nodes && (to.index()) < nodes;
        match self.changes.iter().find(|change| !is_link(change.from, change.to)) {
            Some(Change { from, to, .. }) => Err(ConfigError::NoLink { from: *from, to: *to }),
            None => Ok(()),
        }
    }
}

/// Whether a datagram to that address arrives at a socket that is bound to `port` on this machine.
fn reaches(to: SocketAddr, port: SocketAddr) -> bool {
    // The kernel sends datagrams for the unspecified address to the loopback address.
    let target = match (to.ip().to_canonical(), to.ip().is_ipv4()) {
        (target, _) if !target.is_unspecified() => target,
        (_, true) => IpAddr::V4(Ipv4Addr::LOCALHOST),
        (_, false) => IpAddr::V6(Ipv6Addr::LOCALHOST),
    };
    // A port of IPv6 takes IPv6 alone: [::]:7000 and 127.0.0.1:7000 are two ports.
    let own = port.ip().to_canonical();
    let is_here = || if own.is_unspecified() { own.is_ipv4() == target.is_ipv4() && is_of_this_machine(target) } else { own == target };
    to.port() == port.port() && port.port() != 0 && is_here()
}

/// Whether this machine has that address: the system lets a socket be bound to its own addresses alone.
fn is_of_this_machine(ip: IpAddr) -> bool {
    ip.is_loopback() || UdpSocket::bind((ip, 0)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 192.0.2.1 is an address of documentation (RFC 5737): no machine has it.
    #[test]
    fn a_port_is_known_by_each_of_its_names() {
        let address = |text: &str| text.parse::<SocketAddr>().unwrap();
        for (to, port) in [
            ("127.0.0.1:7000", "127.0.0.1:7000"),
            ("127.0.0.1:7000", "0.0.0.0:7000"),
            ("127.0.0.2:7000", "0.0.0.0:7000"),
            ("0.0.0.0:7000", "127.0.0.1:7000"),
            ("0.0.0.0:7000", "0.0.0.0:7000"),
            ("[::1]:7000", "[::]:7000"),
            ("[::]:7000", "[::1]:7000"),
            ("[::ffff:127.0.0.1]:7000", "127.0.0.1:7000"),
        ] {
            assert!(reaches(address(to), address(port)), "{to} {port}");
        }
        for (to, port) in [
            ("127.0.0.1:7001", "127.0.0.1:7000"),
            ("127.0.0.2:7000", "127.0.0.1:7000"),
            ("127.0.0.1:7000", "[::]:7000"),
            ("[::1]:7000", "0.0.0.0:7000"),
            ("192.0.2.1:7000", "0.0.0.0:7000"),
            ("127.0.0.1:0", "127.0.0.1:0"),
        ] {
            assert!(!reaches(address(to), address(port)), "{to} {port}");
        }
    }
}
