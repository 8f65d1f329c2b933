//! A socket in the words of messages.

use std::net::SocketAddr;

use cohaptic_wan::NodeId;

use super::Core;
use crate::address::AddressPlan;
use crate::context;

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

impl Core {
    /// Fails the run, which holds too many bytes: that socket has sent last.
    #[cold]
    #[inline(never)]
    pub(super) fn fail_for(&self, socket: SocketName) {
        let task = context::task().map_or_else(String::new, |task| format!(", used by {task},"));
        self.wire.held.fail(format_args!("{}{task}", socket.words(&self.plan)));
    }
}
