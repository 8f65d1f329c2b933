//! What a relay does.

use core::time::Duration;
use std::net::SocketAddr;

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
