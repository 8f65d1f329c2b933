//! Configuration of a relay: topology, limits and timed changes of links. The checks here need neither a socket of the relay nor a clock.

use core::time::Duration;
use std::net::SocketAddr;

use cohaptic_linkfile::{LinkTable, RelayFile, RelayLimits};
use cohaptic_realtime::own::reaches;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{LinkModel, NodeId};

/// Configuration of a relay. [`Engine::new`](crate::Engine::new) checks the topology and the changes, [`Relay::bind`](crate::Relay::bind) also the targets.
#[derive(Clone, Debug)]
pub struct RelayConfig {
    /// Seed of every random stream of the network.
    pub seed: u64,
    /// Topology: the programs or clients that talk to each other, and the links between them.
    pub form: Form,
    /// Bounds on datagrams in flight, and the silence before an address is forgotten.
    pub limits: Limits,
    /// Changes of links during the run. [`Engine::new`](crate::Engine::new) sorts them by instant; changes at the same instant keep their order.
    pub changes: Vec<Change>,
}

/// Topology of a relay.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one")]
pub enum Form {
    /// N programs, each with a port of the relay standing for the program.
    Mesh(Mesh),
    /// Clients on one side, one server address on the other.
    Proxy(Proxy),
}

/// N programs and the directed links between them.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Programs, at least two. Program number n is node n of the network.
    pub programs: Vec<Program>,
    /// Links between the programs, indexed by the numbers of sender and receiver. The table is for as many peers as there are programs.
    pub links: LinkTable,
}

/// Program of a mesh.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Program {
    /// Name of the program. The seed and the names of sender and receiver select the random stream of a link.
    pub name: String,
    /// Port of the relay standing for the program: other programs send to this port, and receive from this port.
    pub port: SocketAddr,
    /// Address at which the program sends and listens. `None`: the relay learns the address from the program's first datagram.
    pub address: Option<SocketAddr>,
}

/// Clients that talk to one server address. Node 0 of the network, `client`, stands for all clients together; node 1, `server`, is the server.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Port of the relay for clients.
    pub listen: SocketAddr,
    /// Address of the server.
    pub to: SocketAddr,
    /// Link from the clients to the server, shared by all clients.
    pub forth: LinkModel,
    /// Link from the server back to the clients, shared by all clients.
    pub back: LinkModel,
    /// Largest number of clients at once; each client takes a socket. Datagrams of further clients are dropped and counted.
    pub most_clients: u32,
}

/// Bounds of a relay.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Limits {
    /// Largest number of datagrams in flight. A datagram beyond this bound is dropped on arrival. Copies made by a link count, but are never refused.
    pub packets: u64,
    /// Bytes of the datagrams in flight, at most, without headers.
    pub bytes: Bytes,
    /// Silence before a client of a proxy is forgotten. In a mesh, a learnt address gives way to the next stranger after this silence.
    pub forget_after: Duration,
}

/// Change of one link's configuration during the run.
#[derive(Clone, Debug)]
pub struct Change {
    /// Instant of the change, since the start of the relay.
    pub at: Instant,
    /// Sending node of the link.
    pub from: NodeId,
    /// Receiving node of the link.
    pub to: NodeId,
    /// Model of the link from this instant on.
    pub model: LinkModel,
}

/// Reason why a configuration is refused.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigError {
    /// The mesh has fewer than two programs, or its table of links is for another number of programs.
    #[error("{programs} programs and links between {links}: expected at least two programs, and links between as many")]
    Programs {
        /// Number of programs in the mesh.
        programs: usize,
        /// Number of programs in the table of links.
        links: usize,
    },
    /// A change names a link between equal nodes, or a node outside of the network.
    #[error("there is no link from node {} to node {} to change", from.0, to.0)]
    NoLink {
        /// Sender in the change.
        from: NodeId,
        /// Receiver in the change.
        to: NodeId,
    },
    /// The relay would send to a port of its own, and each datagram would pass the link again and again.
    #[error("{to} is a port of the relay itself, {port}, to which each datagram would come back again and again: expected the address of a program")]
    ToItself {
        /// Address of a program or of the server, to which the relay would send.
        to: SocketAddr,
        /// Port of the relay at which a datagram to the target arrives.
        port: SocketAddr,
    },
}

impl From<RelayLimits> for Limits {
    fn from(limits: RelayLimits) -> Self {
        Self { packets: limits.packets, bytes: limits.bytes, forget_after: limits.forget_after }
    }
}

impl Default for Limits {
    /// Returns the default limits of a relay file: 262,144 datagrams, 64 MB, 30 s.
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
    /// Default of [`Proxy::most_clients`].
    pub const MOST_CLIENTS: u32 = 256;
}

impl RelayConfig {
    /// Returns the names of the nodes, indexed by node.
    pub(crate) fn names(&self) -> Vec<String> {
        match &self.form {
            Form::Mesh(mesh) => mesh.programs.iter().map(|program| program.name.clone()).collect(),
            Form::Proxy(_) => vec!["client".to_owned(), "server".to_owned()],
        }
    }

    /// Returns the model of the link between two nodes. Of a proxy, node 0 is the client and node 1 the server.
    pub(crate) fn link(&self, from: NodeId, to: NodeId) -> LinkModel {
        match &self.form {
            Form::Mesh(mesh) => mesh.links.between(from.index(), to.index()).clone(),
            Form::Proxy(proxy) => if from.0 == 0 { &proxy.forth } else { &proxy.back }.clone(),
        }
    }

    /// Returns the configured ports of the relay, in the order of the programs; for a proxy, the listening port alone. Port number 0 lets the system choose.
    pub(crate) fn ports(&self) -> Vec<SocketAddr> {
        match &self.form {
            Form::Mesh(mesh) => mesh.programs.iter().map(|program| program.port).collect(),
            Form::Proxy(proxy) => vec![proxy.listen],
        }
    }

    /// Refuses a relay that would send to one of `ports`, the relay's own ports. Recognises further names of an address, such as an unspecified address. Learnt
    /// addresses are unknown at this time; the engine drops a datagram from a program to the port standing for the same program.
    pub(crate) fn check_targets(&self, ports: &[SocketAddr]) -> Result<(), ConfigError> {
        let targets: Vec<SocketAddr> = match &self.form {
            Form::Mesh(mesh) => mesh.programs.iter().filter_map(|program| program.address).collect(),
            Form::Proxy(proxy) => vec![proxy.to],
        };
        // A socket of IPv6 of the relay takes IPv6 alone: [::]:7000 and 127.0.0.1:7000 are different ports.
        let own = |to: SocketAddr| ports.iter().find(|port| reaches(to, **port, false)).map(|port| ConfigError::ToItself { to, port: *port });
        targets.into_iter().find_map(own).map_or(Ok(()), Err)
    }

    /// Checks the number of programs, and refuses a change of a link outside of the network.
    pub(crate) fn check(&self) -> Result<(), ConfigError> {
        let nodes = match &self.form {
            Form::Mesh(mesh) if mesh.programs.len() < 2 || mesh.links.peers() != mesh.programs.len() => {
                return Err(ConfigError::Programs { programs: mesh.programs.len(), links: mesh.links.peers() });
            }
            Form::Mesh(mesh) => mesh.programs.len(),
            Form::Proxy(_) => 2,
        };
        // The network has a link between any two different nodes, and no link from a node to itself.
        let is_link = |from: NodeId, to: NodeId| from != to && (from.index()) < nodes && (to.index()) < nodes;
        match self.changes.iter().find(|change| !is_link(change.from, change.to)) {
            Some(Change { from, to, .. }) => Err(ConfigError::NoLink { from: *from, to: *to }),
            None => Ok(()),
        }
    }
}
