//! Runtime for quinn: tasks of a host, and timers in virtual time.

use std::fmt;
use std::future::Future;
use std::io;
use std::panic::Location;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Instant as StdInstant;

use ::quinn::{AsyncTimer, AsyncUdpSocket, Runtime};

use super::time::{from_std, to_std};
use cohaptic_wan::NodeId;

use crate::context;
use crate::core::Shared;
use crate::host::Host;
use crate::time::Sleep;

/// Runtime of an endpoint that lives on a host.
pub(super) struct OnHost {
    shared: Arc<Shared>,
    node: NodeId,
    /// Place where the endpoint was made. Messages name the tasks of the endpoint by this place.
    origin: &'static Location<'static>,
}

impl OnHost {
    pub(super) fn new(host: &Host, origin: &'static Location<'static>) -> Self {
        Self { shared: Arc::clone(host.shared()), node: host.node(), origin }
    }
}

impl Runtime for OnHost {
    fn new_timer(&self, at: StdInstant) -> Pin<Box<dyn AsyncTimer>> {
        Box::pin(Timer(Sleep::of(Arc::clone(&self.shared), from_std(at))))
    }

    /// Spawns a task. Called only while the test bed runs: an endpoint without its test bed or host has no driver and spawns nothing.
    fn spawn(&self, future: Pin<Box<dyn Future<Output = ()> + Send>>) {
        let running = context::expect_running("an endpoint works");
        // A task that is started while its host crashes ends with the host.
        if self.shared.with(|core| core.is_up(self.node)) {
            drop(running.tasks.spawn(Some(self.node), self.origin, future));
        }
    }

    fn wrap_udp_socket(&self, _socket: std::net::UdpSocket) -> io::Result<Arc<dyn AsyncUdpSocket>> {
        let text = "a test bed cannot use a socket of the system; `cohaptic_testkit::quinn::endpoint` makes endpoints on hosts";
        Err(io::Error::new(io::ErrorKind::Unsupported, text))
    }

    fn now(&self) -> StdInstant {
        to_std(self.shared.now())
    }
}

impl fmt::Debug for OnHost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("OnHost").field("node", &self.node).finish_non_exhaustive()
    }
}

/// Timer for quinn.
#[derive(Debug)]
struct Timer(Sleep);

impl AsyncTimer for Timer {
    fn reset(mut self: Pin<&mut Self>, at: StdInstant) {
        self.0.reset(from_std(at));
    }

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<()> {
        Pin::new(&mut self.0).poll(cx)
    }
}
