//! Description of a socket for messages.

use std::net::SocketAddr;

use cohaptic_wan::NodeId;

use crate::address::AddressPlan;

/// Socket as named in messages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SocketName {
    /// Protocol, and in some messages the role of the socket.
    pub(crate) kind: &'static str,
    pub(crate) host: NodeId,
    pub(crate) local: SocketAddr,
    /// Peer of a stream; `None` for sockets without a peer.
    pub(crate) peer: Option<SocketAddr>,
}

impl SocketName {
    /// Returns the description, such as ``the UDP socket 0.0.0.0:7 of host `a` ``.
    pub(super) fn words(&self, plan: &AddressPlan) -> String {
        let Self { kind, host, local, peer } = self;
        let to = peer.map_or_else(String::new, |peer| format!(" to {peer}"));
        format!("the {kind} socket {local}{to} of host `{}`", plan.names()[host.index()])
    }
}
