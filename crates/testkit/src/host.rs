//! A host of a running test bed.

use std::fmt;
use std::future::{Future, poll_fn};
use std::io;
use std::net::IpAddr;
use std::panic::Location;
use std::pin::pin;
use std::rc::Rc;
use std::sync::Arc;

use cohaptic_wan::NodeId;

use crate::address::Addresses;
use crate::context::{self, Running};
use crate::core::Shared;
use crate::current;
use crate::resolve::ToSocketAddrs;
use crate::socket::UdpSocket;
use crate::task::JoinHandle;

/// A host of a running test bed: its tasks and sockets live and die with it.
#[derive(Clone)]
pub struct Host {
    shared: Arc<Shared>,
    node: NodeId,
}

impl Host {
    pub(crate) const fn new(shared: Arc<Shared>, node: NodeId) -> Self {
        Self { shared, node }
    }

    /// Its name.
    #[must_use]
    pub fn name(&self) -> String {
        self.shared.names()[self.node.index()].clone()
    }

    /// The addresses that it has now.
    #[must_use]
    pub fn addresses(&self) -> Addresses {
        self.shared.with(|core| core.plan.of(self.node))
    }

    /// Its address of version 4.
    #[must_use]
    pub fn ip(&self) -> IpAddr {
        IpAddr::from(self.addresses().v4)
    }

    #[cfg(feature = "quinn")]
    pub(crate) const fn node(&self) -> NodeId {
        self.node
    }

    #[cfg(feature = "quinn")]
    pub(crate) const fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    /// Starts a task that lives on this host: what it binds is bound here, and when the host crashes it is dropped where it waits.
    ///
    /// # Panics
    ///
    /// Outside the run, or if the host is down.
    #[track_caller]
    pub fn spawn<F>(&self, future: F) -> JoinHandle<F::Output>
    where
        F: Future + 'static,
        F::Output: 'static,
    {
        let running = self.running("tasks can be spawned");
        self.expect_up("spawn a task");
        running.tasks.spawn(Some(self.node), Location::caller(), future)
    }

    /// Starts a program on this host, and keeps it: [`Host::restart`] starts it anew.
    ///
    /// # Panics
    ///
    /// Outside the run, or if the host is down.
    #[track_caller]
    pub fn start<F>(&self, program: impl Fn() -> F + 'static)
    where
        F: Future<Output = ()> + 'static,
    {
        let running = self.running("programs can be started");
        self.expect_up("start a program");
        running.tasks.set_program(self.node, Location::caller(), Rc::new(move || Box::pin(program())));
    }

    /// Binds a socket on this host.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::bind`]; [`io::ErrorKind::NetworkDown`] if the host is down.
    pub fn bind(&self, address: impl ToSocketAddrs) -> io::Result<UdpSocket> {
        UdpSocket::bind_on(Arc::clone(&self.shared), self.node, address)
    }

    /// Listens on this host.
    ///
    /// # Errors
    ///
    /// As [`TcpListener::bind`](crate::TcpListener::bind); [`io::ErrorKind::NetworkDown`] if the host is down.
    #[cfg(feature = "tcp")]
    pub fn listen(&self, address: impl ToSocketAddrs) -> io::Result<crate::TcpListener> {
        crate::TcpListener::bind_on(Arc::clone(&self.shared), self.node, address)
    }

    /// Opens a connection from this host, and waits until it is there.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::connect`](crate::TcpStream::connect); [`io::ErrorKind::NetworkDown`] if the host is down.
    #[cfg(feature = "tcp")]
    pub async fn connect(&self, address: impl ToSocketAddrs) -> io::Result<crate::TcpStream> {
        self.shared.check_open(self.node, "a connection")?;
        let address = address.to_socket_addr()?;
        let config = self.shared.with(|core| core.tcp_config(self.node).clone());
        crate::TcpStream::connect_on(Arc::clone(&self.shared), self.node, None, address, config)?.established().await
    }

    /// Runs a future as a task of this host does: what it binds and connects, it does here. For tasks that `tokio::spawn` has started, which live on no host.
    /// A crash does not drop them.
    pub fn scope<F: Future>(&self, future: F) -> impl Future<Output = F::Output> + use<F> {
        let node = self.node;
        async move {
            let mut future = pin!(future);
            poll_fn(|cx| current::on_host(Some(node), || future.as_mut().poll(cx))).await
        }
    }

    /// The host is gone, at once: its tasks are dropped where they wait, its sockets closed. Packets that it has sent are on their way still, those sent to it are
    /// lost. Tasks that were not spawned by [`Host::spawn`] or [`Host::start`] (by `tokio::spawn`, say) go on, and their sockets give errors.
    ///
    /// # Panics
    ///
    /// Outside the run.
    pub fn crash(&self) {
        let running = self.running("hosts crash");
        // First the sockets: what the tasks do while they are dropped does not reach anybody.
        self.shared.with(|core| core.crash(self.node));
        running.tasks.stop_all_of(self.node);
    }

    /// The program of the host is gone, at once, and the host is not, as when a process is killed: its tasks are dropped where they wait, and its sockets are closed
    /// as if the program had dropped them, so that peers hear of it. [`Host::restart`] begins the program anew. Nothing happens to a host that is down.
    ///
    /// # Panics
    ///
    /// Outside the run.
    pub fn kill(&self) {
        let running = self.running("programs are killed");
        if self.is_up() {
            // First the tasks, which drop what they hold; then what others hold of this host's.
            running.tasks.stop_all_of(self.node);
            self.shared.with(|core| core.kill(self.node));
        }
    }

    /// The host is back, with the program of [`Host::start`] begun anew if it has one. Nothing happens to a host that is up, unless its program was killed.
    ///
    /// # Panics
    ///
    /// Outside the run.
    pub fn restart(&self) {
        let running = self.running("hosts restart");
        let begins = self.shared.with(|core| core.restart(self.node));
        if begins {
            running.tasks.restart(self.node);
        }
    }

    /// Whether it is up.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.shared.with(|core| core.is_up(self.node))
    }

    /// Gives the host addresses that nobody has had, as a phone gets that leaves its network. Those before belong to nobody: packets to them, also those on their way, are
    /// lost. Sockets bound to `0.0.0.0` or `[::]` go on with the new ones, others cannot send any more.
    pub fn change_addresses(&self) -> Addresses {
        self.shared.with(|core| core.change_addresses(self.node))
    }

    /// The run of this host, on its thread.
    ///
    /// # Panics
    ///
    /// Outside of that run.
    fn running(&self, what: &str) -> Running {
        let running = context::expect_running(what);
        let is_own = Arc::ptr_eq(&running.shared, &self.shared);
        assert!(is_own, "host `{}` belongs to another test bed than the one that runs: take a host of the `Bed` of this run", self.name());
        running
    }

    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    #[track_caller]
    fn expect_up(&self, what: &str) {
        if !self.is_up() {
            panic!("host `{}` is down and cannot {what}; `Host::restart` brings it back", self.name());
        }
    }
}

impl fmt::Debug for Host {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let addresses = self.shared.try_with(|core| core.plan.of(self.node));
        f.debug_struct("Host").field("name", &self.name()).field("addresses", &addresses).finish_non_exhaustive()
    }
}

impl From<&Host> for IpAddr {
    fn from(host: &Host) -> Self {
        host.ip()
    }
}

impl ToSocketAddrs for (&Host, u16) {
    fn to_socket_addr(&self) -> io::Result<std::net::SocketAddr> {
        let (host, port) = self;
        let addresses = host.shared.open(host.node, "the address", |core| core.plan.of(host.node))?;
        Ok((addresses.v4, *port).into())
    }
}
