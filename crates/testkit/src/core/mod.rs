//! The hosts, their sockets and the network between them, as one state machine: it is told the time.

mod arrival;
#[cfg(feature = "quinn")]
mod entropy;
mod hosts;
mod recording;
mod sending;
mod sockets;
mod timers;

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::task::Waker;

use bytes::Bytes;
use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;
use cohaptic_wan::{LinkModel, Network, NetworkConfig, NodeId};

pub(crate) use recording::{Recording, Seen, follow_to_the_end, seen};
pub(crate) use sending::Outgoing;
pub(crate) use sockets::{Datagram, SocketId};
pub(crate) use timers::TimerId;

use crate::address::AddressPlan;
use crate::file::LinkChange;
use crate::trace::{Happening, Trace};
use hosts::HostState;
use sockets::Sockets;
use timers::Timers;

/// What can be said of a test bed before it runs.
#[derive(Clone, Debug)]
pub(crate) struct Settings {
    /// How many bytes of datagrams a socket holds that have not been read.
    pub(crate) receive_buffer: usize,
    /// Whether what happens is recorded.
    pub(crate) traces: bool,
    /// Whether what packets carry is part of that.
    pub(crate) digests: bool,
    /// Whether packets are recorded, with what they carry.
    pub(crate) keeps_packets: bool,
    /// How often tasks may be polled, or the time asked, at one instant.
    pub(crate) patience: u64,
}

pub(crate) struct Core {
    pub(crate) now: Instant,
    pub(crate) plan: AddressPlan,
    pub(crate) settings: Settings,
    pub(crate) recording: Recording,
    pub(crate) timers: Timers,
    /// Links that become other ones, in order of time.
    pub(crate) changes: VecDeque<LinkChange>,
    #[cfg(feature = "quinn")]
    pub(crate) entropy: entropy::Entropy,
    network: Network<Parcel>,
    hosts: Vec<HostState>,
    sockets: Sockets,
    /// By sender, then receiver: whether the way is cut.
    cut: Vec<bool>,
    /// By sender, then receiver: how many packets were offered.
    offered: Vec<u64>,
    /// Who is to be woken when nobody holds this any more.
    pub(crate) woken: Vec<Waker>,
    /// How often the program asked for what takes no time since it last passed.
    asked: u64,
    /// How often tasks were polled since it last passed, as far as they are counted here.
    #[cfg(feature = "tokio")]
    polled: u64,
}

/// What travels.
#[derive(Clone, Debug)]
pub(crate) struct Parcel {
    from: std::net::SocketAddr,
    to: std::net::SocketAddr,
    bytes: Bytes,
    /// Whether its sender understands marks.
    ecn_capable: bool,
    kind: Kind,
}

/// What a packet is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Datagram,
    /// "There is no socket at that port", which IP tells a sender.
    Unreachable,
}

impl Core {
    pub(crate) fn new(names: &[String], seed: u64, settings: Settings, link: impl Fn(usize, usize) -> LinkModel) -> Self {
        let config = NetworkConfig { seed, nodes: names.to_vec(), general: false };
        Self {
            now: Instant::ZERO,
            plan: AddressPlan::new(names.to_vec()),
            recording: Recording::new(names.to_vec(), &settings),
            settings,
            timers: Timers::default(),
            changes: VecDeque::new(),
            #[cfg(feature = "quinn")]
            entropy: entropy::Entropy::new(seed),
            network: Network::new(config, |from, to| link(from.index(), to.index())),
            hosts: names.iter().map(|_| HostState::default()).collect(),
            sockets: Sockets::default(),
            cut: vec![false; names.len() * names.len()],
            offered: vec![0; names.len() * names.len()],
            woken: Vec::new(),
            asked: 0,
            #[cfg(feature = "tokio")]
            polled: 0,
        }
    }

    /// When the network or a timer wants to be woken.
    pub(crate) fn next_event(&self) -> Option<Instant> {
        let change = self.changes.front().map(|change| change.at);
        [self.network.poll_timeout(), self.timers.next(), change].into_iter().flatten().min()
    }

    /// Lets time pass: what arrives until then arrives, and then timers go off.
    pub(crate) fn pass(&mut self, now: Instant) {
        if now > self.now {
            self.now = now;
            self.asked = 0;
            #[cfg(feature = "tokio")]
            {
                self.polled = 0;
            }
        }
        while self.changes.front().is_some_and(|change| change.at <= now) {
            if let Some(change) = self.changes.pop_front() {
                self.change_link(change);
            }
        }
        if self.network.poll_timeout().is_some_and(|at| at <= self.now) {
            let passed = self.network.handle_timeout(self.now);
            debug_assert_eq!(passed, Ok(()), "time does not go back");
            self.take_arrivals();
        }
        self.timers.fire(self.now, &mut self.woken);
    }

    /// The program asks for something that takes no time.
    ///
    /// # Panics
    ///
    /// If it has done so for so often since time last passed that it seems to wait for time without letting it pass.
    #[inline]
    pub(crate) fn note_call(&mut self) {
        self.asked += 1;
        if self.asked > self.settings.patience.saturating_mul(10) {
            self.lose_patience();
        }
    }

    #[cold]
    #[expect(clippy::panic, reason = "time cannot pass; says why, and the way out")]
    fn lose_patience(&mut self) -> ! {
        // What is dropped while it unwinds may ask again.
        self.asked = 0;
        panic!(
            "time stands still at {} s: a task asks for the time, sends or tries to receive again and again and never waits; `sleep(..).await` lets it pass",
            Seconds(self.now)
        );
    }

    /// A task is polled; says whether time has stood still for too long.
    #[cfg(feature = "tokio")]
    pub(crate) const fn count_poll(&mut self) -> bool {
        self.polled += 1;
        self.polled > self.settings.patience
    }

    pub(crate) fn set_link(&mut self, from: usize, to: usize, link: LinkModel) {
        self.change_link(LinkChange { at: self.now, from, to, link });
    }

    fn change_link(&mut self, change: LinkChange) {
        let LinkChange { at, from, to, link } = change;
        let changed = self.network.set_link(at, node(from), node(to), link);
        debug_assert_eq!(changed, Ok(()), "hosts are checked, and time does not go back");
        self.recording.note(at, Happening::Relinked(from, to));
        self.take_arrivals();
    }

    /// What was recorded. Packets that are on their way are followed to their end, in the fates alone.
    pub(crate) fn take_recording(&mut self) -> (Trace, Vec<Seen>, Instant) {
        let (trace, mut packets) = self.recording.take();
        if self.settings.keeps_packets {
            follow_to_the_end(&mut self.network.clone(), |event| packets.push(seen(event, event.payload.bytes.clone())));
        }
        (trace, packets, self.now)
    }

    pub(crate) fn link_stats(&self, from: usize, to: usize) -> Option<cohaptic_wan::LinkStats> {
        self.network.link_stats(node(from), node(to))
    }

    pub(crate) fn set_cut(&mut self, from: usize, to: usize, cut: bool) {
        let place = self.pair(from, to);
        if from != to && std::mem::replace(&mut self.cut[place], cut) != cut {
            self.recording.note(self.now, if cut { Happening::Cut(from, to) } else { Happening::Mended(from, to) });
        }
    }

    fn is_cut(&self, from: usize, to: usize) -> bool {
        self.cut[self.pair(from, to)]
    }

    const fn pair(&self, from: usize, to: usize) -> usize {
        from * self.hosts.len() + to
    }
}

pub(crate) use node as network_node;

pub(crate) fn node(place: usize) -> NodeId {
    NodeId::new(place)
}

/// The state machine, and how what belongs to tasks gets at it.
pub(crate) struct Shared {
    core: Mutex<Core>,
    clock: Clock,
}

/// Who tells the time.
pub(crate) enum Clock {
    /// The executor of this crate, by [`Core::pass`].
    Own,
    /// Tokio's paused clock.
    #[cfg(feature = "tokio")]
    Tokio {
        /// Its time at [`Instant::ZERO`].
        origin: tokio::time::Instant,
    },
}

impl Shared {
    pub(crate) const fn new(core: Core, clock: Clock) -> Self {
        Self { core: Mutex::new(core), clock }
    }

    /// The state at this instant. Whoever is to be woken is woken when the guard is gone.
    pub(crate) fn lock(&self) -> Guard<'_> {
        #[cfg_attr(not(feature = "tokio"), expect(unused_mut, reason = "only tokio's clock moves by itself"))]
        let mut core = self.core.lock().unwrap_or_else(PoisonError::into_inner);
        match self.clock {
            Clock::Own => {}
            #[cfg(feature = "tokio")]
            Clock::Tokio { origin } => {
                // Once the run is over, tokio's clock is that of the machine.
                if tokio::runtime::Handle::try_current().is_ok() {
                    let now = Instant::ZERO + origin.elapsed();
                    if now > core.now {
                        core.pass(now);
                    }
                }
            }
        }
        Guard { core: Some(core) }
    }
}

/// The state, as long as it is held.
pub(crate) struct Guard<'a> {
    core: Option<MutexGuard<'a, Core>>,
}

impl std::ops::Deref for Guard<'_> {
    type Target = Core;

    fn deref(&self) -> &Core {
        self.core.as_ref().expect("it is there until the guard is dropped")
    }
}

impl std::ops::DerefMut for Guard<'_> {
    fn deref_mut(&mut self) -> &mut Core {
        self.core.as_mut().expect("it is there until the guard is dropped")
    }
}

impl Drop for Guard<'_> {
    fn drop(&mut self) {
        let Some(mut core) = self.core.take() else { return };
        if core.woken.is_empty() {
            return;
        }
        // A waker may run anything, what asks for this state included: nobody may hold it then.
        let woken = std::mem::take(&mut core.woken);
        drop(core);
        woken.into_iter().for_each(Waker::wake);
    }
}
