//! State of one run: the hosts, their sockets and timers, and the network between the hosts, as one state machine. The machine reads no clock: the caller
//! passes the time in.

mod bound;
mod elsewhere;
mod ends;
#[cfg(any(feature = "quinn", feature = "tcp"))]
mod entropy;
mod face;
mod forwarding;
#[cfg(feature = "facade")]
mod holds;
mod multicast;
mod passing;
mod shared;
mod socket_name;
mod socket_state;
mod sockets;
#[cfg(feature = "tcp")]
mod tcp;
mod timers;
#[cfg(feature = "facade")]
mod unix;
mod waking;

use std::sync::Arc;

use cohaptic_units::Instant;
use cohaptic_wan::{LinkModel, NodeId, Path};

use crate::address::{self, AddressPlan};
use crate::current;
use crate::groups::Group;
use crate::link::LinkChange;
use crate::middlebox::Topology;
use crate::names::Names;
use crate::settings::Settings;
use crate::trace::Happening;
use crate::wire::{self, Recorded, Wire};
use bound::Bound;
pub(crate) use bound::SocketId;
use ends::{Ends, Kind};
pub(crate) use ends::{mapped, unmapped};
use face::Face;
use forwarding::Forwarding;
pub(crate) use forwarding::shown;
pub(crate) use multicast::{Interface, MulticastSettings};
use sockets::Sockets;
use waking::Woken;

pub(crate) use passing::Outgoing;
pub(crate) use shared::{Clock, Shared, counted_now};
pub(crate) use socket_name::SocketName;
#[cfg(feature = "tcp")]
pub(crate) use tcp::{ConnId, HoldId, Inherited, ListenId, Sharing};
pub(crate) use timers::{TimerId, Timers};
#[cfg(feature = "facade")]
pub(crate) use unix::UnixId;
pub(crate) use waking::{Registered, registered};

pub(crate) struct Core {
    pub(crate) plan: AddressPlan,
    pub(crate) settings: Settings,
    pub(crate) wire: Wire<Ends>,
    pub(crate) timers: Timers,
    #[cfg(any(feature = "facade", feature = "quinn"))]
    entropy: entropy::ByHost,
    hosts: Vec<HostState>,
    sockets: Sockets,
    spare: wire::Spare<Ends>,
    #[cfg(feature = "tcp")]
    tcp: tcp::Tcp,
    #[cfg(feature = "facade")]
    unix: unix::Unix,
    pub(crate) woken: Woken,
    /// NATs, firewalls and interfaces; `None` without any.
    forwarding: Option<Box<Forwarding>>,
    face: Arc<Face>,
    /// Number of the run whose state this is. 0 until [`Shared`] gives the number.
    run: u64,
    /// Number of the run while the state lies with the thread of the run, at the time of the run's clock; otherwise 0.
    at_hand: u64,
}

pub(crate) type Parcel = wire::Parcel<Ends>;

impl Core {
    pub(crate) fn new(
        names: &Arc<Names>,
        seed: u64,
        settings: Settings,
        changes: Vec<LinkChange>,
        link: impl Fn(NodeId, NodeId) -> LinkModel + Send + Sync + 'static,
    ) -> Self {
        let mut topology = Topology::new(names.len(), &settings.middleboxes);
        let mut addresses = topology.addresses(&settings.middleboxes);
        // An address that the test chooses comes before the address that a network gives.
        addresses.extend(&settings.addresses);
        let mut plan = AddressPlan::new(Arc::clone(names), &addresses);
        settings.interfaces.iter().for_each(|interfaces| plan.add_interfaces(interfaces.host, &interfaces.nodes));
        Self {
            forwarding: Forwarding::new(&settings, topology, names, seed),
            wire: Wire::new(names, seed, &settings, changes, link),
            face: Arc::new(Face::new(settings.patience, &plan)),
            plan,
            settings,
            timers: Timers::default(),
            #[cfg(any(feature = "facade", feature = "quinn"))]
            entropy: entropy::ByHost::of_programs(seed),
            hosts: names.iter().map(|_| HostState::default()).collect(),
            sockets: Sockets::default(),
            spare: wire::Spare::default(),
            #[cfg(feature = "tcp")]
            tcp: tcp::Tcp::new(seed, names.len()),
            #[cfg(feature = "facade")]
            unix: unix::Unix::default(),
            woken: Woken::default(),
            run: 0,
            at_hand: 0,
        }
    }

    /// Returns the number of hosts. NATs, firewalls and interfaces have the last numbers, and do not count.
    pub(crate) fn hosts(&self) -> usize {
        self.hosts.len() - self.settings.devices()
    }

    /// Returns whether other threads read the state while a task runs: a record of the run, or the counters of laws.
    fn is_looked_at(&self) -> bool {
        self.settings.traces || self.settings.keeps_packets || self.settings.laws.iter().next().is_some()
    }

    /// Returns the next instant at which the network or a timer has an event, or `None` if nothing is under way.
    // With tokio the function is passed as a value, and the linter then takes its type as given.
    #[cfg_attr(
        not(any(feature = "tcp", feature = "tokio")),
        expect(clippy::needless_pass_by_ref_mut, reason = "timers of TCP need the exclusive borrow")
    )]
    pub(crate) fn next_event(&mut self) -> Option<Instant> {
        let next = wire::earlier(self.wire.next(), self.timers.next());
        let next = if self.forwarding.is_some() { wire::earlier(next, self.next_answer()) } else { next };
        #[cfg(feature = "tcp")]
        let next = self.with_tcp_timers(next);
        next
    }

    #[inline]
    pub(crate) const fn now(&self) -> Instant {
        self.wire.now()
    }

    /// Lets time pass until `now`, in one step. Packets arrive first, then timers go off.
    pub(crate) fn pass(&mut self, now: Instant) {
        if self.wire.set_now(now) {
            self.face.pass(now);
        }
        // Packets that come out of the links up to a change are handed over before the next change.
        while self.wire.change_next() {
            self.take_arrivals();
        }
        if self.wire.pass() {
            self.take_arrivals();
        }
        #[cfg(feature = "tcp")]
        if self.forwarding.is_some() {
            self.answer_unexpected();
        }
        #[cfg(feature = "tcp")]
        self.fire_tcp_timers();
        self.timers.fire(self.wire.now(), &mut self.woken);
    }

    /// Lets time pass until `now`, event by event. Does nothing if `now` has passed: tokio's clock may have jumped over several events.
    #[cfg(feature = "tokio")]
    fn pass_until(&mut self, now: Instant) {
        if now <= self.now() {
            return;
        }
        while let Some(next) = self.next_event().filter(|next| *next < now) {
            self.pass(next);
        }
        self.pass(now);
    }

    /// Counts a call of a socket by a program. A call takes no time.
    ///
    /// # Panics
    ///
    /// If programs have called so often since time last passed that a task seems to wait for time without letting time pass. The message names the host and the
    /// socket.
    #[inline]
    pub(crate) fn note_call(&self, socket: impl FnOnce(&Self) -> SocketName) {
        if !self.face.count_call() {
            self.lose_patience(socket(self));
        }
    }

    #[cold]
    fn lose_patience(&self, socket: SocketName) -> ! {
        self.face.lose_patience(Some(&socket.words(&self.plan)))
    }

    /// Fails the run, which holds too many bytes. `socket` is the socket that sent last.
    #[cold]
    fn fail_for(&self, socket: SocketName) {
        let task = current::task().map_or_else(String::new, |task| format!(", used by {task}"));
        self.wire.held.fail(format_args!("{}{task}", socket.words(&self.plan)), self.sockets.held());
    }

    /// Returns the source of random bytes for the programs of `host`, or for programs of no host.
    #[cfg(any(feature = "facade", feature = "quinn"))]
    pub(crate) fn entropy(&mut self, host: Option<NodeId>) -> &mut entropy::Entropy {
        self.entropy.of(host, self.plan.names())
    }

    /// Returns the record of the run so far.
    pub(crate) fn recorded(&self) -> Recorded {
        let mut recorded = self.wire.recorded();
        recorded.drawn.has_drawn |= self.forwarding.as_ref().is_some_and(|forwarding| forwarding.has_drawn());
        #[cfg(any(feature = "facade", feature = "quinn"))]
        let () = recorded.drawn.has_drawn |= self.entropy.was_asked();
        #[cfg(feature = "tcp")]
        let () = recorded.drawn.has_drawn |= self.tcp.has_drawn();
        recorded
    }

    pub(crate) fn set_link(&mut self, path: Path, link: LinkModel) {
        self.wire.set_link(self.now(), path, link);
        // Packets that the new link lets go at once arrive before the caller continues.
        self.take_arrivals();
    }
}

/// State of a host.
#[derive(Debug, Default)]
struct HostState {
    /// `true` if the host has crashed and has not been restarted.
    is_down: bool,
    /// `true` if the program of the host was killed and has not been restarted.
    is_idle: bool,
    /// Sockets of the host, by port.
    bound: Bound,
    /// Multicast groups that sockets of the host have joined. A group stands here once for each membership of a socket.
    groups: Vec<Group>,
    /// Offset from [`FIRST_DYNAMIC`](sockets::FIRST_DYNAMIC) of the port to try next for a socket that asks for no particular port.
    next_port: u16,
}

impl Core {
    pub(crate) fn is_up(&self, host: NodeId) -> bool {
        !self.hosts[host.index()].is_down
    }

    /// Checks that the host is up. A host that is down cannot bind sockets.
    pub(crate) fn check_up(&self, host: NodeId) -> std::io::Result<()> {
        if self.is_up(host) {
            return Ok(());
        }
        let text = format!("host `{}` is down; `Host::restart` brings it back", self.plan.names()[host.index()]);
        Err(std::io::Error::new(std::io::ErrorKind::NetworkDown, text))
    }

    /// Crashes the host: all its sockets die. Packets that the host has sent stay under way. Does nothing if the host is down.
    pub(crate) fn crash(&mut self, host: NodeId) {
        let state = &mut self.hosts[host.index()];
        if std::mem::replace(&mut state.is_down, true) {
            return;
        }
        (state.bound, state.groups) = (Bound::default(), Vec::new());
        let now = self.now();
        // A dead socket stays in memory until its handle is dropped, so that the next call of the program returns the error.
        for socket in self.sockets.all_of(host) {
            socket.die(now, &mut self.wire.held, &mut self.woken);
        }
        #[cfg(feature = "tcp")]
        self.crash_tcp(host);
        #[cfg(feature = "facade")]
        self.end_unix(host, tcp::Gone { at: now, is_killed: false });
        self.wire.note(Happening::Crashed(host));
    }

    /// Kills the program of the host. The host stays up, and its sockets are closed as if the program had dropped the sockets. Does nothing if the host is
    /// down.
    pub(crate) fn kill(&mut self, host: NodeId) {
        if !self.is_up(host) {
            return;
        }
        // Noted before the sockets are closed: the record has the kill before the segments that the closing sends.
        self.wire.note(Happening::Killed(host));
        let state = &mut self.hosts[host.index()];
        // For `restart`, which starts the program anew only if the program is gone.
        state.is_idle = true;
        (state.bound, state.groups) = (Bound::default(), Vec::new());
        let now = self.now();
        for socket in self.sockets.all_of(host) {
            socket.die(now, &mut self.wire.held, &mut self.woken);
        }
        #[cfg(feature = "tcp")]
        self.kill_tcp(host);
        #[cfg(feature = "facade")]
        self.end_unix(host, tcp::Gone { at: now, is_killed: true });
    }

    /// Brings the host up again. Returns whether its program must start anew.
    pub(crate) fn restart(&mut self, host: NodeId) -> bool {
        let state = &mut self.hosts[host.index()];
        let (was_down, was_idle) = (std::mem::take(&mut state.is_down), std::mem::take(&mut state.is_idle));
        if was_down {
            self.wire.note(Happening::Restarted(host));
        }
        was_down || was_idle
    }

    /// Gives the host new addresses, and returns the new addresses.
    pub(crate) fn change_addresses(&mut self, host: NodeId) -> address::Addresses {
        self.wire.note(Happening::Readdressed(host));
        let uplink = self.plan.uplink(host);
        let inside = self.forwarding.as_mut().and_then(|forwarding| forwarding.topology_mut().fresh(uplink));
        let addresses = self.plan.change(host, inside);
        #[cfg(feature = "facade")]
        self.face.publish(&self.plan);
        addresses
    }

    /// Makes an interface the uplink of its host, and returns the addresses that the host has now.
    pub(crate) fn set_uplink(&mut self, host: NodeId, node: NodeId) -> address::Addresses {
        self.wire.note(Happening::Readdressed(host));
        self.plan.set_uplink(host, node);
        #[cfg(feature = "facade")]
        self.face.publish(&self.plan);
        self.plan.of(host)
    }
}
