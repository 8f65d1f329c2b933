//! The wire between the hosts of a run: one network with its faults, its changes, and the record of its packets.
//!
//! Sockets ([`core`](crate::core)) and state machines ([`node`](crate::node)) hand packets in with [`Wire::offer`] and take those that arrive with
//! [`Wire::poll`], until it gives `None`, after each packet and whenever time has passed.

mod exits;
mod held;
mod hitting;
mod parcel;
mod recording;

use std::collections::{BTreeSet, VecDeque};
use std::sync::Arc;

use cohaptic_units::Instant;
use cohaptic_wan::{DropCause, Fate, LinkModel, LinkStats, Network, NetworkConfig, NodeId, PacketInfo, Path};

use exits::{Out, counted};
pub(crate) use held::{BYTE_LIMIT, Held, Where};
pub(crate) use hitting::HitCount;
use hitting::Hitting;
pub(crate) use parcel::{Arrival, Octets, Parcel, Spare};
pub(crate) use recording::{Recorded, Recording, Seen};

use crate::again::{Drawn, MOST_LOST};
use crate::hit::Verdict;
use crate::link::LinkChange;
use crate::names::Names;
use crate::seed::hash;
use crate::settings::Settings;
use crate::trace::{Happening, Lost, PacketName};

/// The earlier of two instants that may not be there.
#[inline]
pub(crate) fn earlier(one: Option<Instant>, other: Option<Instant>) -> Option<Instant> {
    match (one, other) {
        (Some(one), Some(other)) => Some(one.min(other)),
        (one, other) => one.or(other),
    }
}

pub(crate) struct Wire<A> {
    now: Instant,
    network: Network<Box<Parcel<A>>>,
    /// Links that become other ones, in order of time.
    changes: VecDeque<LinkChange>,
    /// The ways that are cut.
    cut: BTreeSet<Path>,
    /// Bytes that the run holds, on links and with sockets and nodes.
    pub(crate) held: Held,
    /// Whether packets are hit or recorded.
    is_watched: bool,
    /// Where packets are hit.
    hitting: Option<Box<Hitting<A>>>,
    recording: Recording,
    /// Effects of chance so far.
    drawn: Drawn,
}

impl<A: Clone + Send + Sync + 'static> Wire<A> {
    pub(crate) fn new(
        names: &Arc<Names>,
        seed: u64,
        settings: &Settings,
        changes: impl Into<VecDeque<LinkChange>>,
        link: impl Fn(NodeId, NodeId) -> LinkModel + Send + Sync + 'static,
    ) -> Self {
        let config = NetworkConfig { seed, nodes: names.to_vec(), general: false };
        let (hitting, network) = Hitting::new(&settings.laws, names, seed, Network::on_demand(config, link));
        let recording = Recording::new(Arc::clone(names), settings);
        let is_watched = hitting.is_some() || recording.is_on();
        Self {
            now: Instant::ZERO,
            network,
            hitting,
            changes: changes.into(),
            cut: BTreeSet::new(),
            held: Held::new(settings.byte_limit),
            is_watched,
            recording,
            drawn: Drawn::default(),
        }
    }
}

impl<A: Clone> Wire<A> {
    #[inline]
    pub(crate) const fn now(&self) -> Instant {
        self.now
    }

    /// Sets the time, which does not go back, and says whether it has moved.
    pub(crate) fn set_now(&mut self, now: Instant) -> bool {
        let has_moved = now > self.now;
        self.now = self.now.max(now);
        has_moved
    }

    /// When the network must be woken, or a link changes.
    pub(crate) fn next(&self) -> Option<Instant> {
        let change = self.changes.front().map(|change| change.at);
        let late = self.hitting.as_ref().and_then(|hitting| hitting.exits.next());
        earlier(earlier(self.network.poll_timeout(), change), late)
    }

    /// Changes the next link that is to change by now, and says whether there was one.
    pub(crate) fn change_next(&mut self) -> bool {
        if self.changes.front().is_none_or(|change| change.at > self.now) {
            return false;
        }
        let Some(change) = self.changes.pop_front() else { return false };
        self.set_link(change.at, Path { from: NodeId::new(change.from), to: NodeId::new(change.to) }, change.link);
        true
    }

    /// Lets the events happen that are due on the links, and says whether there were any.
    pub(crate) fn pass(&mut self) -> bool {
        let is_due = self.network.poll_timeout().is_some_and(|at| at <= self.now);
        if is_due {
            let passed = self.network.handle_timeout(self.now);
            debug_assert_eq!(passed, Ok(()), "time does not go back");
        }
        is_due || self.hitting.as_ref().and_then(|hitting| hitting.exits.next()).is_some_and(|at| at <= self.now)
    }

    /// The name of the next packet that is offered to a link.
    pub(crate) fn next_packet(&self, path: Path) -> PacketName {
        PacketName { path, sequence: self.network.offered(path.from, path.to).unwrap_or(0), copy: 0 }
    }

    /// Hands a packet to its link, and says whether [`Wire::poll`] may give something. It fails if the way is cut.
    #[inline(always)]
    pub(crate) fn offer(&mut self, path: Path, parcel: Box<Parcel<A>>) -> Result<bool, Lost> {
        if self.is_watched || !self.cut.is_empty() {
            self.note_offer(path, &parcel)?;
        }
        self.held.add(Where::Links, Held::cost(parcel.bytes.len()));
        let info = PacketInfo { size: cohaptic_units::Bytes::new(parcel.bytes.len() as u64), ecn_capable: parcel.ecn_capable };
        let offered = self.network.handle_packet_timed(self.now, path, info, parcel);
        debug_assert!(offered.is_ok(), "hosts are checked, and time does not go back");
        // All that was due has been polled: only this packet may have come out.
        Ok(self.is_watched || !matches!(offered, Ok(Some(at)) if at > self.now))
    }

    /// Notes that a packet is offered to its link, and judges it. It fails if its way is cut.
    #[inline(never)]
    fn note_offer(&mut self, path: Path, parcel: &Parcel<A>) -> Result<(), Lost> {
        let packet = self.next_packet(path);
        if self.cut.contains(&path) {
            // It does not reach the link, so that it uses up none of the link's numbers.
            self.note(Happening::Lost { packet, why: Lost::Cut });
            return Err(Lost::Cut);
        }
        if self.recording.traces {
            let digest = if self.recording.digests { hash(&parcel.bytes) } else { 0 };
            self.note(Happening::Sent { packet, len: parcel.bytes.len(), digest });
        }
        if let Some(hitting) = &mut self.hitting {
            let verdict = hitting.judge(packet, self.now, &parcel.bytes);
            if verdict != Verdict::Pass {
                self.note(Happening::Hit { packet, verdict });
            }
        }
        Ok(())
    }

    /// The next packet that has arrived. What becomes of it is told by [`Wire::ends`].
    #[inline(always)]
    pub(crate) fn poll(&mut self) -> Option<Box<Parcel<A>>> {
        if !self.is_watched {
            // Of a packet that can only arrive its network tells less, and faster: what else it tells of each takes a fifth of the time of a datagram.
            let Self { network, cut, held, .. } = self;
            let arrived = network.take_mere_arrival(|event| {
                let (path, sequence, at, mut parcel) = (event.path, event.sequence, event.at, event.payload);
                held.remove(Where::Links, Held::cost(parcel.bytes.len()));
                let is_cut = !cut.is_empty() && cut.contains(&path);
                parcel.arrival = Arrival { packet: PacketName { path, sequence, copy: 0 }, at, marked: false, is_cut };
                parcel
            });
            if arrived.is_some() || !self.network.may_have_events(self.now) {
                return arrived;
            }
        }
        self.poll_event()
    }

    /// As [`Wire::poll`], of packets to which more may happen than that they arrive, or of which more is recorded.
    #[inline(never)]
    fn poll_event(&mut self) -> Option<Box<Parcel<A>>> {
        loop {
            let event = self.poll_out()?;
            let packet = PacketName { path: event.path, sequence: event.sequence, copy: event.copy };
            self.recording.keep(&event);
            let cost = Held::cost(event.payload.bytes.len());
            if event.fate.is_end() {
                self.held.remove(Where::Links, cost)
            } else {
                self.held.add(Where::Links, cost)
            }
            match event.fate {
                Fate::Delivered(at) => {
                    if let Some(hitting) = &mut self.hitting {
                        hitting.exits.arrived(event.path, at);
                    }
                    let (marked, is_cut) = (event.marked, self.cut.contains(&event.path));
                    let mut parcel = event.payload;
                    if let Some(damage) = &event.damage {
                        // A copy of it may be on its way still, undamaged.
                        let mut bytes = Vec::from(std::mem::take(&mut parcel.bytes));
                        damage.apply(&mut bytes);
                        parcel.bytes = Octets::Own(bytes);
                    }
                    parcel.arrival = Arrival { packet, at, marked, is_cut };
                    return Some(parcel);
                }
                Fate::Dropped(cause) => {
                    if cause == DropCause::Loss && self.drawn.lost.len() < MOST_LOST {
                        self.drawn.lost.push(packet);
                    }
                    self.recording.note(event.at, Happening::Lost { packet, why: Lost::Link(cause) });
                }
                Fate::Duplicated => self.recording.note(event.at, Happening::Copied { packet }),
            }
        }
    }

    /// What comes out next of the links, and of what was kept behind them.
    #[inline]
    fn poll_out(&mut self) -> Option<Out<A>> {
        let Some(hitting) = &mut self.hitting else { return self.network.poll_event().map(counted) };
        hitting.exits.poll_with(&mut self.network, self.now)
    }

    /// Notes whether a packet that its link has delivered has reached a program.
    pub(crate) fn ends(&mut self, packet: PacketName, at: Instant, end: Result<(), Lost>) {
        let what = match end {
            Ok(()) => Happening::Arrived { packet },
            Err(why) => Happening::Lost { packet, why },
        };
        self.recording.note(at, what);
    }

    /// Makes a link another one.
    pub(crate) fn set_link(&mut self, at: Instant, path: Path, link: LinkModel) {
        let changed = self.network.set_link(at, path.from, path.to, link);
        debug_assert_eq!(changed, Ok(()), "hosts are checked, and time does not go back");
        // Random numbers of the new link are not in the words with which the run began.
        self.drawn.has_drawn = true;
        self.recording.note(at, Happening::Relinked(path));
    }

    pub(crate) fn set_cut(&mut self, path: Path, cut: bool) {
        let has_changed = if cut { path.from != path.to && self.cut.insert(path) } else { self.cut.remove(&path) };
        if has_changed {
            self.note(if cut { Happening::Cut(path) } else { Happening::Mended(path) });
        }
    }

    pub(crate) fn mend_all(&mut self) {
        std::mem::take(&mut self.cut).into_iter().for_each(|path| self.note(Happening::Mended(path)));
    }

    /// `None` if both are one host.
    pub(crate) fn link_stats(&self, path: Path) -> Option<LinkStats> {
        self.network.link_stats(path.from, path.to)
    }

    #[inline]
    pub(crate) fn note(&mut self, what: Happening) {
        self.recording.note(self.now, what);
    }

    pub(crate) const fn recording(&self) -> &Recording {
        &self.recording
    }

    /// How many packets of a path were hit.
    pub(crate) fn hits(&self, path: Path) -> u64 {
        self.hitting.as_ref().map_or(0, |hitting| hitting.hits(path))
    }

    /// What was recorded so far. Packets that are on their way are followed to their end, in the fates alone, as if nothing more were sent.
    pub(crate) fn recorded(&self) -> Recorded {
        let exits = self.hitting.as_ref().map(|hitting| hitting.exits.clone()).unwrap_or_default();
        let (packets, ended) = (self.recording.followed_through(&self.network, exits, self.now), self.now);
        Recorded { trace: self.recording.trace().clone(), packets, ended, hits: self.hit_counts(), drawn: self.drawn.clone() }
    }

    /// What each law did.
    pub(crate) fn hit_counts(&self) -> Vec<HitCount> {
        self.hitting.as_ref().map(|hitting| hitting.counts()).unwrap_or_default()
    }
}
