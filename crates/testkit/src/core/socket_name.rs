//! A socket in the words of messages.

use std::net::SocketAddr;

use cohaptic_wan::NodeId;

use crate::address::AddressPlan;

/// Name of a socket in messages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SocketName {
    /// The protocol, and perhaps what the socket does.
    pub(crate) kind: &'static str,
    pub(crate) host: NodeId,
    pub(crate) local: SocketAddr,
    /// The other end of a stream.
    pub(crate) peer: Option<SocketAddr>,
}

impl SocketName {
    /// In words: ``the UDP socket 0.0.0.0:7 of host `a` ``.
    pub(super) fn words(&self, plan: &AddressPlan) -> String {
        let Self { kind, host, local, peer } = self;
        let to = peer.map_or_else(String::new, |peer| format!(" to {peer}"));
        format!("the {kind} socket {local}{to} of host `{}`", plan.names()[host.index()])
    }
}
