//! Host of a running test bed.

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

/// Host of a running test bed. The tasks and sockets of a host end when the host crashes.
#[derive(Clone)]
pub struct Host {
    shared: Arc<Shared>,
    node: NodeId,
}

impl Host {
    pub(crate) const fn new(shared: Arc<Shared>, node: NodeId) -> Self {
        Self { shared, node }
    }

    /// Returns the name of the host.
    #[must_use]
    pub fn name(&self) -> String {
        self.shared.names()[self.node.index()].clone()
    }

    /// Returns the present addresses of the host.
    #[must_use]
    pub fn addresses(&self) -> Addresses {
        self.shared.with(|core| core.plan.of(self.node))
    }

    /// Returns the present IPv4 address of the host.
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

    /// Starts a task on this host. Sockets bound by the task are bound on this host. When the host crashes, the task is dropped at the point at which the task
    /// waits.
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

    /// Starts a program on this host and keeps the program, so that [`Host::restart`] can start it anew.
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

    /// Binds a UDP socket on this host.
    ///
    /// # Errors
    ///
    /// As [`UdpSocket::bind`]; [`io::ErrorKind::NetworkDown`] if the host is down.
    pub fn bind(&self, address: impl ToSocketAddrs) -> io::Result<UdpSocket> {
        UdpSocket::bind_on(Arc::clone(&self.shared), self.node, address)
    }

    /// Binds a TCP listener on this host.
    ///
    /// # Errors
    ///
    /// As [`TcpListener::bind`](crate::TcpListener::bind); [`io::ErrorKind::NetworkDown`] if the host is down.
    #[cfg(feature = "tcp")]
    pub fn listen(&self, address: impl ToSocketAddrs) -> io::Result<crate::TcpListener> {
        crate::TcpListener::bind_on(Arc::clone(&self.shared), self.node, address)
    }

    /// Opens a connection from this host, and waits until the connection is established.
    ///
    /// # Errors
    ///
    /// As [`TcpStream::connect`](crate::TcpStream::connect); [`io::ErrorKind::NetworkDown`] if the host is down.
    #[cfg(feature = "tcp")]
    pub async fn connect(&self, address: impl ToSocketAddrs) -> io::Result<crate::TcpStream> {
        self.shared.check_open(self.node, "a connection")?;
        crate::TcpStream::connect_to(&self.shared, self.node, current::on_host(Some(self.node), || address.to_socket_addrs())?).await
    }

    /// Runs a future as a task of this host: sockets made by the future belong to this host. Needed for tasks started with `tokio::spawn`, because such tasks
    /// live on no host. A crash of the host does not drop such a task.
    pub fn scope<F: Future>(&self, future: F) -> impl Future<Output = F::Output> + use<F> {
        let node = self.node;
        async move {
            let mut future = pin!(future);
            poll_fn(|cx| current::on_host(Some(node), || future.as_mut().poll(cx))).await
        }
    }

    /// Crashes the host at once: each task is dropped at the point at which the task waits, and all sockets are closed. Packets from the host stay under way;
    /// packets to the host are lost. Tasks that were not spawned by [`Host::spawn`] or [`Host::start`] (but by `tokio::spawn`, for example) go on, and their
    /// sockets return errors.
    ///
    /// # Panics
    ///
    /// Outside the run.
    pub fn crash(&self) {
        let running = self.running("hosts crash");
        // The sockets die first, so that packets sent by destructors of the tasks reach nobody.
        self.shared.with(|core| core.crash(self.node));
        running.tasks.stop_all_of(self.node);
    }

    /// Kills the program of the host at once, as a process is killed; the host itself stays up. Each task is dropped at the point at which the task waits, and
    /// the sockets are closed as if the program had dropped the sockets, so that peers are told. [`Host::restart`] starts the program anew. Nothing happens to
    /// a host that is down.
    ///
    /// # Panics
    ///
    /// Outside the run.
    pub fn kill(&self) {
        let running = self.running("programs are killed");
        if self.is_up() {
            // Tasks are stopped first, and drop their sockets. Sockets of this host in the hands of other tasks are closed afterwards.
            running.tasks.stop_all_of(self.node);
            self.shared.with(|core| core.kill(self.node));
        }
    }

    /// Sends a signal to the program of the host, such as 15 for `SIGTERM`. A program that listens for the signal, by `tokio::signal` of the package written by
    /// `cohaptic tokio`, receives the signal. Otherwise the signal has the default effect of Linux: 17, 18, 23 and 28 do nothing, and every other signal kills
    /// the program, as [`Host::kill`] does. Nothing happens to a host that is down.
    ///
    /// # Panics
    ///
    /// Outside of the run. If no program can receive the signal: the numbers are 1 to 31, without 9, for which there is [`Host::kill`], and without 19 to 22,
    /// which stop a program.
    #[cfg(feature = "facade")]
    pub fn signal(&self, number: i32) {
        assert!(
            matches!(number, 1..=8 | 10..=18 | 23..=31),
            "host `{}` cannot get the signal {number}: expected 1 to 8, 10 to 18 or 23 to 31. `Host::kill` stands for 9; a test bed cannot stop a program, as \
             19 to 22 do",
            self.name()
        );
        let running = self.running("signals are sent");
        let is_ignored = matches!(number, 17 | 18 | 23 | 28);
        // The handlers are asked first: a program that listens for a signal survives the signal.
        if self.is_up() && !running.tasks.others.signals.send(self.node, number) && !is_ignored {
            self.kill();
        }
    }

    /// Brings the host up again. The program of [`Host::start`] starts anew, if the host has a program. Nothing happens to a host that is up, unless the
    /// program was killed.
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

    /// Returns whether the host is up.
    #[must_use]
    pub fn is_up(&self) -> bool {
        self.shared.with(|core| core.is_up(self.node))
    }

    /// Gives the host addresses that no host has had, like a phone that changes its network. The former addresses belong to no host from now on: packets to a
    /// former address are lost, packets under way included. Sockets bound to `0.0.0.0` or `[::]` go on with the new addresses; other sockets cannot send any
    /// more.
    pub fn change_addresses(&self) -> Addresses {
        self.shared.with(|core| core.change_addresses(self.node))
    }

    /// Makes one of the interfaces of [`Testbed::interfaces`](crate::Testbed::interfaces) the uplink of the host, like a phone that leaves the reach of a
    /// wireless network. Returns the addresses that the host has from now on. As with [`Host::change_addresses`], sockets bound to `0.0.0.0` or `[::]` go on
    /// with the new addresses. The former interface stays: sockets bound to its address, and connections of TCP from there, still use it, unless its links are
    /// cut.
    ///
    /// # Panics
    ///
    /// If the host has no such interface.
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub fn uplink(&self, interface: &str) -> Addresses {
        let addresses = self.shared.with(|core| {
            let node = self.shared.names().find(interface).filter(|node| core.plan.nodes_of(self.node).contains(node))?;
            Some(core.set_uplink(self.node, node))
        });
        addresses.unwrap_or_else(|| panic!("host `{}` has no interface `{interface}`; `Testbed::interfaces` gives a host interfaces", self.name()))
    }

    /// Returns the run of this host.
    ///
    /// # Panics
    ///
    /// Outside of the run of this host, or on another thread.
    fn running(&self, what: &str) -> Running {
        let running = context::expect_running(what);
        let is_own = Arc::ptr_eq(&running.shared, &self.shared);
        assert!(is_own, "host `{}` belongs to the test bed of another run: take a host of the `Bed` of this run", self.name());
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
    fn to_socket_addrs(&self) -> io::Result<Vec<std::net::SocketAddr>> {
        let (host, port) = self;
        let (Addresses { v4, v6 }, six_first) =
            host.shared.open(host.node, "the address", |core| (core.plan.of(host.node), core.settings.six_first))?;
        let mut both = vec![(v4, *port).into(), (v6, *port).into()];
        if six_first {
            both.reverse();
        }
        Ok(both)
    }
}
