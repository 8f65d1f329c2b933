//! Handle of the test bed for a running program.

use std::fmt;
use std::future::Future;
use std::net::IpAddr;
use std::panic::Location;
use std::sync::Arc;

use cohaptic_units::Instant;
use cohaptic_wan::{LinkStats, NodeId, Path};

use crate::access::AccessStats;
use crate::address::AddressPlan;
use crate::context;
use crate::core::Shared;
use crate::host::Host;
use crate::link::ToLink;
use crate::names::Names;
use crate::setup::no_link;
use crate::task::JoinHandle;
use crate::trace::{Happening, Trace};

/// Handle of the test bed for a running program: access to hosts, links, faults and the record.
#[derive(Clone)]
pub struct Bed {
    pub(super) shared: Arc<Shared>,
}

impl Bed {
    pub(crate) const fn new(shared: Arc<Shared>) -> Self {
        Self { shared }
    }

    /// Returns the host named `name`.
    ///
    /// # Panics
    ///
    /// If no host has the name, or a NAT or a firewall has the name.
    #[must_use]
    pub fn host(&self, name: &str) -> Host {
        let node = self.names().node(name);
        let (is_middlebox, host) = self.shared.with(|core| (core.is_middlebox(node), core.plan.host_of(node)));
        assert!(!is_middlebox, "`{name}` is a NAT or a firewall, and runs no programs: `Bed::nat` returns it");
        assert!(host == node, "`{name}` is an interface of host `{}`: take the host", self.names()[host.index()]);
        Host::new(Arc::clone(&self.shared), node)
    }

    /// Returns all hosts, in the order of naming.
    #[must_use]
    pub fn hosts(&self) -> Vec<Host> {
        let hosts = self.shared.with(|core| core.hosts());
        (0..hosts).map(|host| Host::new(Arc::clone(&self.shared), NodeId::new(host))).collect()
    }

    /// Returns the present addresses of all hosts.
    #[must_use]
    pub fn addresses(&self) -> AddressPlan {
        self.shared.with(|core| core.plan.clone())
    }

    /// Returns the name of the host that has this address now.
    #[must_use]
    pub fn owner(&self, address: IpAddr) -> Option<String> {
        self.shared.with(|core| core.plan.owner(address).map(str::to_owned))
    }

    /// Returns the time since the run began.
    ///
    /// # Panics
    ///
    /// As [`time::now`](crate::time::now): if a task asks again and again without letting time pass.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.shared.note_call();
        self.shared.now()
    }

    /// Starts a task that lives on no host. Such a task survives all crashes, and binds sockets with [`Host::bind`].
    ///
    /// # Panics
    ///
    /// Outside the run, also within the run of another test bed.
    #[track_caller]
    pub fn spawn<F>(&self, future: F) -> JoinHandle<F::Output>
    where
        F: Future + 'static,
        F::Output: 'static,
    {
        let running = context::expect_running("tasks can be spawned");
        assert!(Arc::ptr_eq(&running.shared, &self.shared), "the run of this `Bed` has ended: spawn the task with the `Bed` of the present run");
        running.tasks.spawn(None, Location::caller(), future)
    }

    /// Cuts the path from a host to another host: packets that are sent or would arrive from now on are lost. The path back is not changed.
    ///
    /// # Panics
    ///
    /// If there is no such host.
    pub fn cut(&self, from: &str, to: &str) {
        self.set_cut(from, to, true);
    }

    /// Ends the cut of the path from a host to another host.
    ///
    /// # Panics
    ///
    /// If there is no such host.
    pub fn mend(&self, from: &str, to: &str) {
        self.set_cut(from, to, false);
    }

    /// Cuts all paths, in both directions, between the hosts of one group and the hosts of another group.
    ///
    /// # Panics
    ///
    /// If there is no such host.
    pub fn partition(&self, one: &[&str], other: &[&str]) {
        for (from, to) in one.iter().flat_map(|from| other.iter().map(move |to| (from, to))) {
            self.cut(from, to);
            self.cut(to, from);
        }
    }

    /// Ends the cuts of all paths.
    pub fn mend_all(&self) {
        self.shared.with(|core| core.wire.mend_all());
    }

    /// Puts the path from a host to another host on hold: packets that are under way or sent from now on wait at the end of the link, until [`Bed::release`]
    /// lets them arrive. Nothing is lost, and nothing overtakes. The path back is not changed. The fates in the record tell when a packet came out of the link,
    /// and the trace when it arrived.
    ///
    /// ```
    /// use std::time::Duration;
    /// use cohaptic_testkit::{Instant, Testbed, time};
    ///
    /// Testbed::new(["client", "server"]).links("delay 20ms").run(|bed| async move {
    ///     let server = bed.host("server").bind("0.0.0.0:7").unwrap();
    ///     let client = bed.host("client").bind("0.0.0.0:0").unwrap();
    ///     bed.hold("client", "server");
    ///     client.send_to(b"hello", "server:7").await.unwrap();
    ///     time::sleep(Duration::from_secs(5)).await;
    ///     bed.release("client", "server");
    ///     server.recv(&mut [0; 5]).await.unwrap();
    ///     assert_eq!(bed.now(), Instant::from_nanos(5_000_000_000));
    /// });
    /// ```
    ///
    /// # Panics
    ///
    /// If there is no such host, or a NAT or a firewall is between the hosts.
    pub fn hold(&self, from: &str, to: &str) {
        let path = self.link_path(from, to);
        self.shared.with(|core| core.wire.hold(path));
    }

    /// Ends the hold of the path from a host to another host. The packets that have waited arrive now, in their order. Does nothing if the path is not on hold.
    ///
    /// # Panics
    ///
    /// As [`Bed::hold`].
    pub fn release(&self, from: &str, to: &str) {
        let path = self.link_path(from, to);
        self.shared.with(|core| core.release(path));
    }

    /// Replaces the link from a host to another host. Packets inside the link follow the rules of [`cohaptic_wan::Link::set_model`].
    ///
    /// # Panics
    ///
    /// If there is no such host, if both hosts are the same, or if the words describe no link.
    pub fn set_link(&self, from: &str, to: &str, link: impl ToLink) {
        let path = self.link_path(from, to);
        assert!(path.from != path.to, "host `{from}` has no link to itself; name two hosts");
        let link = link.to_link();
        self.shared.with(|core| core.set_link(path, link));
    }

    /// Returns the statistics of the link from a host to another host so far. Packets that an uplink before the link has lost do not count.
    ///
    /// # Panics
    ///
    /// If there is no such link.
    #[must_use]
    pub fn link_stats(&self, from: &str, to: &str) -> LinkStats {
        let path = self.link_path(from, to);
        self.shared.with(|core| core.wire.link_stats(path)).unwrap_or_else(|| unreachable_link(from))
    }

    /// Returns the statistics of the access lines (`Testbed::access`) of a host so far, or `None` if the host has none.
    ///
    /// # Panics
    ///
    /// If there is no such host.
    #[must_use]
    pub fn access_stats(&self, host: &str) -> Option<AccessStats> {
        let host = self.names().node(host);
        self.shared.with(|core| core.wire.access_stats(host))
    }

    /// Returns how many packets from a host to another host were [hit](crate::hit) so far.
    ///
    /// # Panics
    ///
    /// If there is no such host.
    #[must_use]
    pub fn hits(&self, from: &str, to: &str) -> u64 {
        let path = self.link_path(from, to);
        self.shared.with(|core| core.wire.hits(path))
    }

    /// Returns all ends of TCP connections that are not over, sorted by host, port and peer. Ends are included that no program holds any more.
    #[cfg(feature = "tcp")]
    #[must_use]
    pub fn connections(&self) -> Vec<crate::tcp::ConnectionInfo> {
        let end = |(host, connection): (NodeId, &cohaptic_tcp::Connection)| crate::tcp::ConnectionInfo {
            host: self.names()[host.index()].clone(),
            local: connection.local_addr(),
            peer: connection.peer_addr(),
            info: connection.info(),
        };
        self.shared.with(|core| core.connections().map(end).collect())
    }

    /// Adds a note to the trace, such as a result of the program. [`Testbed::run_twice`](crate::Testbed::run_twice) compares notes as well.
    pub fn note(&self, text: impl fmt::Display) {
        let text = text.to_string();
        self.shared.with(|core| core.wire.note(Happening::Note(text)));
    }

    /// Returns the trace so far. Empty unless the run is recorded, as in [`Testbed::run_twice`](crate::Testbed::run_twice) and with
    /// [`Testbed::traced`](crate::Testbed::traced).
    #[must_use]
    pub fn trace(&self) -> Trace {
        self.shared.with(|core| core.wire.recording().trace().clone())
    }

    fn set_cut(&self, from: &str, to: &str, cut: bool) {
        let path = self.link_path(from, to);
        self.shared.with(|core| core.wire.set_cut(path, cut));
    }

    /// Returns the path of a link.
    ///
    /// # Panics
    ///
    /// If there is no such host, or a NAT or a firewall is between the hosts.
    fn link_path(&self, from: &str, to: &str) -> Path {
        let path = self.names().path(from, to);
        assert!(self.shared.with(|core| core.is_link(path)), "{}", no_link(self.names(), path));
        path
    }

    pub(super) fn names(&self) -> &Names {
        self.shared.names()
    }
}

#[expect(clippy::panic, reason = "a misuse, and the way out")]
fn unreachable_link(host: &str) -> LinkStats {
    panic!("host `{host}` has no link to itself; name two hosts")
}

impl fmt::Debug for Bed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Bed").field("now", &self.now()).finish_non_exhaustive()
    }
}
