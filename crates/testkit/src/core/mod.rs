//! The hosts, their sockets and the network between them, as one state machine: it is told the time.

mod bound;
mod elsewhere;
mod ends;
#[cfg(any(feature = "quinn", feature = "tcp"))]
mod entropy;
mod face;
mod passing;
mod shared;
mod socket_name;
mod sockets;
#[cfg(feature = "tcp")]
mod tcp;
mod timers;
mod waking;

use std::sync::Arc;

use cohaptic_units::Instant;
use cohaptic_wan::{LinkModel, NodeId, Path};

use crate::address::{self, AddressPlan};
use crate::current;
use crate::link::LinkChange;
use crate::names::Names;
use crate::settings::Settings;
use crate::trace::Happening;
use crate::wire::{self, Recorded, Wire};
use bound::Bound;
pub(crate) use bound::SocketId;
use ends::{Ends, Kind};
use face::Face;
use sockets::Sockets;
use waking::Woken;

pub(crate) use passing::Outgoing;
pub(crate) use shared::{Clock, Shared};
pub(crate) use socket_name::SocketName;
#[cfg(feature = "tcp")]
pub(crate) use tcp::{ConnId, HoldId, Inherited, ListenId};
pub(crate) use timers::{TimerId, Timers};
pub(crate) use waking::{Registered, registered};

pub(crate) struct Core {
    pub(crate) plan: AddressPlan,
    pub(crate) settings: Settings,
    pub(crate) wire: Wire<Ends>,
    pub(crate) timers: Timers,
    #[cfg(feature = "quinn")]
    entropy: entropy::ByHost,
    hosts: Vec<HostState>,
    sockets: Sockets,
    spare: wire::Spare<Ends>,
    #[cfg(feature = "tcp")]
    tcp: tcp::Tcp,
    pub(crate) woken: Woken,
    face: Arc<Face>,
    /// Which run it is the state of.
    run: u64,
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
        Self {
            plan: AddressPlan::new(Arc::clone(names)),
            wire: Wire::new(names, seed, &settings, changes, link),
            face: Arc::new(Face::new(settings.patience)),
            settings,
            timers: Timers::default(),
            #[cfg(feature = "quinn")]
            entropy: entropy::ByHost::of_programs(seed),
            hosts: names.iter().map(|_| HostState::default()).collect(),
            sockets: Sockets::default(),
            spare: wire::Spare::default(),
            #[cfg(feature = "tcp")]
            tcp: tcp::Tcp::new(seed, names.len()),
            woken: Woken::default(),
            run: 0,
        }
    }

    /// Whether other threads look at it while a task has its own: at a record, or at what laws did.
    fn is_looked_at(&self) -> bool {
        self.settings.traces || self.settings.keeps_packets || self.settings.laws.iter().next().is_some()
    }

    /// When the network or a timer wants to be woken.
    #[cfg_attr(not(feature = "tcp"), expect(clippy::needless_pass_by_ref_mut, reason = "only connections that are stuck are looked at twice"))]
    pub(crate) fn next_event(&mut self) -> Option<Instant> {
        let next = wire::earlier(self.wire.next(), self.timers.next());
        #[cfg(feature = "tcp")]
        let next = self.with_tcp_timers(next);
        next
    }

    #[inline]
    pub(crate) const fn now(&self) -> Instant {
        self.wire.now()
    }

    /// Lets time pass: what arrives until then arrives, and then timers go off.
    pub(crate) fn pass(&mut self, now: Instant) {
        if self.wire.set_now(now) {
            self.face.pass(now);
        }
        while self.wire.change_next() {
            self.take_arrivals();
        }
        if self.wire.pass() {
            self.take_arrivals();
        }
        #[cfg(feature = "tcp")]
        self.fire_tcp_timers();
        self.timers.fire(self.wire.now(), &mut self.woken);
    }

    /// Lets time pass until then, event by event, unless it has: tokio's clock may have jumped over some.
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

    /// A program calls a socket, which takes no time.
    ///
    /// # Panics
    ///
    /// If it has done so for so often since time last passed that it seems to wait for time without letting it pass, with the host and the socket.
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

    /// Fails the run, which holds too many bytes: that socket has sent last.
    #[cold]
    #[inline(never)]
    fn fail_for(&self, socket: SocketName) {
        let task = current::task().map_or_else(String::new, |task| format!(", used by {task},"));
        self.wire.held.fail(format_args!("{}{task}", socket.words(&self.plan)));
    }

    /// Random bytes for a program of a host.
    #[cfg(feature = "quinn")]
    pub(crate) fn entropy(&mut self, host: Option<NodeId>) -> &mut entropy::Entropy {
        self.entropy.of(host, self.plan.names())
    }

    /// Returns the record of the run so far.
    pub(crate) fn recorded(&self) -> Recorded {
        #[cfg_attr(not(any(feature = "quinn", feature = "tcp")), expect(unused_mut, reason = "nothing but links draws"))]
        let mut recorded = self.wire.recorded();
        #[cfg(feature = "quinn")]
        let () = recorded.drawn.has_drawn |= self.entropy.was_asked();
        #[cfg(feature = "tcp")]
        let () = recorded.drawn.has_drawn |= self.tcp.has_drawn();
        recorded
    }

    pub(crate) fn set_link(&mut self, path: Path, link: LinkModel) {
        self.wire.set_link(self.now(), path, link);
        self.take_arrivals();
    }
}

/// A host.
#[derive(Debug, Default)]
struct HostState {
    is_down: bool,
    /// Its program was killed, and not begun again.
    is_idle: bool,
    /// The sockets of its ports.
    bound: Bound,
    /// The port that is given next to a socket that asks for none.
    next_port: u16,
}

impl Core {
    pub(crate) fn is_up(&self, host: NodeId) -> bool {
        !self.hosts[host.index()].is_down
    }

    /// Fails if the host is down, so that nothing can be bound there.
    pub(crate) fn check_up(&self, host: NodeId) -> std::io::Result<()> {
        if self.is_up(host) {
            return Ok(());
        }
        let text = format!("host `{}` is down; `Host::restart` brings it back", self.plan.names()[host.index()]);
        Err(std::io::Error::new(std::io::ErrorKind::NetworkDown, text))
    }

    /// The host is gone with all its sockets. What it has sent is on its way still.
    pub(crate) fn crash(&mut self, host: NodeId) {
        let state = &mut self.hosts[host.index()];
        if std::mem::replace(&mut state.is_down, true) {
            return;
        }
        state.bound = Bound::default();
        let now = self.now();
        for socket in self.sockets.all_of(host) {
            socket.die(now, &mut self.wire.held, &mut self.woken);
        }
        #[cfg(feature = "tcp")]
        self.crash_tcp(host);
        self.wire.note(Happening::Crashed(host));
    }

    /// The program of the host is gone, and the host is not: its sockets are closed, as when the program drops them.
    pub(crate) fn kill(&mut self, host: NodeId) {
        if !self.is_up(host) {
            return;
        }
        self.wire.note(Happening::Killed(host));
        let state = &mut self.hosts[host.index()];
        state.is_idle = true;
        state.bound = Bound::default();
        let now = self.now();
        for socket in self.sockets.all_of(host) {
            socket.die(now, &mut self.wire.held, &mut self.woken);
        }
        #[cfg(feature = "tcp")]
        self.kill_tcp(host);
    }

    /// The host is up again; says whether its program is to begin anew.
    pub(crate) fn restart(&mut self, host: NodeId) -> bool {
        let state = &mut self.hosts[host.index()];
        let (was_down, was_idle) = (std::mem::take(&mut state.is_down), std::mem::take(&mut state.is_idle));
        if was_down {
            self.wire.note(Happening::Restarted(host));
        }
        was_down || was_idle
    }

    /// The host has other addresses from now on.
    pub(crate) fn change_addresses(&mut self, host: NodeId) -> address::Addresses {
        self.wire.note(Happening::Readdressed(host));
        self.plan.change(host)
    }
}
