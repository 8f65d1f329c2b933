//! The network between the hosts of a run, with its faults, its changes, and the record of its packets.
//!
//! Sockets ([`core`](crate::core)) and state machines ([`node`](crate::node)) hand packets in with [`Wire::offer`]. Both take arrived packets with
//! [`Wire::poll`] after each packet and whenever time has passed, until the result is `None`.

mod exits;
mod held;
mod hitting;
mod parcel;
mod recording;
#[cfg(feature = "tcp")]
mod train;

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::ops::ControlFlow;
use std::sync::Arc;

use cohaptic_units::Instant;
use cohaptic_wan::{AccessLine, DropCause, Fate, LinkModel, LinkStats, Network, NetworkConfig, NodeId, PacketEvent, PacketInfo, Path};

use exits::{Out, counted};
pub(crate) use held::{BYTE_LIMIT, Held};
pub(crate) use hitting::HitCount;
use hitting::Hitting;
#[cfg(feature = "tcp")]
pub(crate) use parcel::Octets;
pub(crate) use parcel::{Arrival, Form, HasFlow, Parcel, Spare};
pub(crate) use recording::{Recorded, Recording, Seen};

use crate::access::AccessStats;
use crate::again::{Drawn, MOST_LOST, Said};
use crate::hit::Verdict;
use crate::link::LinkChange;
use crate::names::Names;
use crate::seed::hash;
use crate::settings::Settings;
use crate::trace::{Happening, Lost, PacketName};

/// Returns the earlier of two optional instants.
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
    /// Changes of links that are still to come, sorted by time.
    changes: VecDeque<LinkChange>,
    /// Paths that are cut.
    cut: BTreeSet<Path>,
    /// Packets that have come out of the links of paths on hold, in the order of arrival.
    on_hold: BTreeMap<Path, Vec<Box<Parcel<A>>>>,
    /// Bytes that the run holds, on links and at sockets and nodes.
    pub(crate) held: Held,
    /// `true` if packets are hit by laws, recorded, stopped by cuts, or pass NATs or firewalls.
    is_watched: bool,
    /// Number of NATs, firewalls and interfaces. With any, each packet is looked at.
    devices: usize,
    /// State of the laws; `None` without laws.
    hitting: Option<Box<Hitting<A>>>,
    recording: Recording,
    /// Effects of chance so far.
    drawn: Drawn,
    /// Description of the network as the test gave it, for the record.
    said: Arc<Said>,
}

impl<A: HasFlow + Clone + Send + Sync + 'static> Wire<A> {
    pub(crate) fn new(
        names: &Arc<Names>,
        seed: u64,
        settings: &Settings,
        changes: impl Into<VecDeque<LinkChange>>,
        link: impl Fn(NodeId, NodeId) -> LinkModel + Send + Sync + 'static,
    ) -> Self {
        let config = NetworkConfig { seed, nodes: names.to_vec(), general: false };
        let mut network: Network<Box<Parcel<A>>> = Network::on_demand(config, link).with_flows(|path, parcel| parcel.addresses.flow(path));
        for (host, lines) in &settings.access {
            let lines = [(AccessLine::Uplink(*host), &lines.uplink), (AccessLine::Downlink(*host), &lines.downlink)];
            for (line, model) in lines.into_iter().filter_map(|(line, model)| Some((line, model.clone()?))) {
                network = network.with_access_line(line, model).expect("the hosts of access lines are checked");
            }
        }
        let (hitting, network) = Hitting::new(&settings.laws, names, seed, network);
        let recording = Recording::new(Arc::clone(names), settings);
        let mut wire = Self {
            now: Instant::ZERO,
            network,
            hitting,
            changes: changes.into(),
            cut: BTreeSet::new(),
            on_hold: BTreeMap::new(),
            held: Held::new(settings.byte_limit),
            is_watched: false,
            devices: settings.devices(),
            recording,
            drawn: Drawn::default(),
            said: Arc::clone(&settings.said),
        };
        wire.watch();
        wire
    }
}

impl<A: HasFlow + Clone> Wire<A> {
    pub(crate) const fn now(&self) -> Instant {
        self.now
    }

    /// Returns whether packets are hit by laws, recorded, stopped by cuts, or pass NATs. If not, no arriving packet is cut, every packet goes from its sender
    /// to its receiver over one link, and the ends of packets are not recorded.
    #[inline]
    pub(crate) const fn is_watched(&self) -> bool {
        self.is_watched
    }

    /// Notes whether packets must be looked at one by one.
    fn watch(&mut self) {
        self.is_watched = self.devices > 0 || self.hitting.is_some() || self.recording.is_on() || !self.cut.is_empty() || !self.on_hold.is_empty();
    }

    /// Sets the time, which never goes back. Returns whether the time has moved.
    pub(crate) fn set_now(&mut self, now: Instant) -> bool {
        let has_moved = now > self.now;
        self.now = self.now.max(now);
        has_moved
    }

    /// Returns the next instant at which the network has an event, a link changes, or a delayed packet arrives.
    pub(crate) fn next(&self) -> Option<Instant> {
        let change = self.changes.front().map(|change| change.at);
        let late = self.hitting.as_ref().and_then(|hitting| hitting.exits.next());
        earlier(earlier(self.network.poll_timeout(), change), late)
    }

    /// Performs the next due change of a link. Returns whether a change was due.
    pub(crate) fn change_next(&mut self) -> bool {
        if self.changes.front().is_none_or(|change| change.at > self.now) {
            return false;
        }
        let Some(change) = self.changes.pop_front() else { return false };
        self.set_link(change.at, Path { from: NodeId::new(change.from), to: NodeId::new(change.to) }, change.link);
        true
    }

    /// Lets the due events of the links happen. Returns whether there were any, or delayed packets are due.
    pub(crate) fn pass(&mut self) -> bool {
        let is_due = self.network.poll_timeout().is_some_and(|at| at <= self.now);
        if is_due {
            let passed = self.network.handle_timeout(self.now);
            debug_assert_eq!(passed, Ok(()), "time does not go back");
        }
        // A packet delayed by a law arrives without an event of the network, and must be polled as well.
        is_due || self.hitting.as_ref().and_then(|hitting| hitting.exits.next()).is_some_and(|at| at <= self.now)
    }

    /// Returns the name that the next packet sent on `path` will have.
    pub(crate) fn next_packet(&self, path: Path) -> PacketName {
        PacketName { path, sequence: self.network.sent(path.from, path.to).unwrap_or(0), copy: 0 }
    }

    /// Hands a packet to its path. Returns whether [`Wire::poll`] may have a packet now. Fails if the path is cut.
    #[inline(always)]
    pub(crate) fn offer(&mut self, path: Path, mut parcel: Box<Parcel<A>>) -> Result<bool, Lost> {
        if self.is_watched {
            self.note_offer(path, &mut parcel)?;
        }
        let (now, len) = (self.now, parcel.bytes.len());
        self.held.add(Held::cost(len));
        let info = PacketInfo { size: cohaptic_units::Bytes::new(len as u64), ecn: parcel.ecn };
        let offered = self.network.handle_packet_timed(now, path, info, parcel);
        debug_assert!(offered.is_ok(), "hosts are checked, and time does not go back");
        // All events due before have been polled, so only this packet can have come out of its link.
        Ok(!matches!(offered, Ok(Some(at)) if at > now) || self.is_watched)
    }

    /// Records that a packet is offered to its path, and asks the laws about the packet. Fails if the path is cut.
    #[inline(never)]
    fn note_offer(&mut self, path: Path, parcel: &mut Parcel<A>) -> Result<(), Lost> {
        let packet = self.next_packet(path);
        if self.cut.contains(&path) {
            // The packet does not reach the link, and so uses up no sequence number of the link.
            self.note(Happening::Lost { packet, why: Lost::Cut });
            return Err(Lost::Cut);
        }
        if self.recording.traces {
            let digest = if self.recording.digests { hash(&parcel.bytes) } else { 0 };
            self.note(Happening::Sent { packet, len: parcel.bytes.len(), digest });
        }
        if let Some(hitting) = &mut self.hitting {
            let verdict = hitting.judge(packet, self.now, &parcel.bytes);
            parcel.is_hit = verdict == Verdict::Drop;
            if verdict != Verdict::Pass {
                self.note(Happening::Hit { packet, verdict });
            }
        }
        Ok(())
    }

    /// Returns the next arrived packet. The caller reports the end of the packet with [`Wire::ends`], and removes a packet that is not kept from `held`.
    #[inline(always)]
    pub(crate) fn poll(&mut self) -> Option<Box<Parcel<A>>> {
        if !self.is_watched {
            // Nothing is watched, so a packet that can only arrive needs no full event. A full event costs more to make.
            let arrived = self.network.take_mere_arrivals(|event: PacketEvent<Box<Parcel<A>>, Path>| {
                let (path, at, mut parcel) = (event.path, event.at, event.payload);
                let Arrival { packet, .. } = &mut parcel.arrival;
                packet.path = path;
                (parcel.arrival.at, parcel.arrival.marked, parcel.arrival.is_cut) = (at, false, false);
                ControlFlow::Break(parcel)
            });
            // The next event may be a loss or a copy. `take_mere_arrivals` stops there, and only `poll_event` handles such events.
            if arrived.is_some() || !self.network.may_have_events(self.now) {
                return arrived;
            }
        }
        self.poll_event()
    }

    /// Like [`Wire::poll`], for recorded packets, and for packets with fates other than an arrival.
    #[inline(never)]
    fn poll_event(&mut self) -> Option<Box<Parcel<A>>> {
        loop {
            let event = self.poll_out()?;
            let packet = PacketName { path: event.path, sequence: event.sequence, copy: event.copy };
            self.recording.keep(&event);
            let cost = Held::cost(event.payload.bytes.len());
            match event.fate {
                Fate::Delivered(at) => {
                    if let Some(hitting) = &mut self.hitting {
                        hitting.exits.arrived(event.path, at);
                    }
                    let (marked, is_cut) = (event.marked, self.cut.contains(&event.path));
                    let mut parcel = event.payload;
                    if let Some(damage) = &event.damage {
                        // A copy with the same memory may still be under way, undamaged.
                        let mut bytes = Vec::from(std::mem::take(&mut parcel.bytes));
                        damage.apply(&mut bytes);
                        parcel.bytes = bytes.into();
                    }
                    parcel.arrival = Arrival { packet, at, marked, is_cut };
                    return Some(parcel);
                }
                Fate::Dropped(cause) => {
                    self.held.remove(cost);
                    // Only losses by chance are noted: a printed test names them in place of the seed.
                    if cause == DropCause::Loss && self.drawn.lost.len() < MOST_LOST {
                        self.drawn.lost.push(packet);
                    }
                    self.recording.note(event.at, Happening::Lost { packet, why: Lost::on(event.part, cause) });
                }
                Fate::Duplicated => {
                    // The run holds the copy as a further packet.
                    self.held.add(cost);
                    self.recording.note(event.at, Happening::Copied { packet });
                }
            }
        }
    }

    /// Returns the next event of the links, or of the packets kept after their links.
    #[inline]
    fn poll_out(&mut self) -> Option<Out<A>> {
        let Some(hitting) = &mut self.hitting else { return self.network.poll_event().map(counted) };
        hitting.exits.poll_with(&mut self.network, self.now)
    }

    /// Records whether a packet delivered by its link has reached a program.
    pub(crate) fn ends(&mut self, packet: PacketName, at: Instant, end: Result<(), Lost>) {
        let what = match end {
            Ok(()) => Happening::Arrived { packet },
            Err(why) => Happening::Lost { packet, why },
        };
        self.recording.note(at, what);
    }

    /// Replaces the link of `path` from the instant `at` on.
    pub(crate) fn set_link(&mut self, at: Instant, path: Path, link: LinkModel) {
        let changed = self.network.set_link(at, path.from, path.to, link);
        debug_assert_eq!(changed, Ok(()), "hosts are checked, and time does not go back");
        // The new link draws random numbers that the words at the beginning of the run do not describe.
        self.drawn.has_drawn = true;
        self.recording.note(at, Happening::Relinked(path));
    }

    pub(crate) fn set_cut(&mut self, path: Path, cut: bool) {
        // A partition may name one host in both groups. The host still reaches itself.
        let has_changed = if cut { path.from != path.to && self.cut.insert(path) } else { self.cut.remove(&path) };
        self.watch();
        if has_changed {
            self.note(if cut { Happening::Cut(path) } else { Happening::Mended(path) });
        }
    }

    /// Puts a path on hold: its packets go on over the link, and wait at its end.
    pub(crate) fn hold(&mut self, path: Path) {
        // A host has no link to itself, so nothing of its own would ever wait.
        if path.from != path.to && !self.on_hold.contains_key(&path) {
            self.on_hold.insert(path, Vec::new());
            self.watch();
            self.note(Happening::Held(path));
        }
    }

    /// Keeps a packet that has come out of the link of a path on hold. Returns the packet if its path is not on hold.
    pub(crate) fn keep_back(&mut self, parcel: Box<Parcel<A>>) -> Option<Box<Parcel<A>>> {
        match self.on_hold.get_mut(&parcel.arrival.packet.path) {
            None => Some(parcel),
            Some(waiting) => {
                waiting.push(parcel);
                None
            }
        }
    }

    /// Ends the hold of a path. Returns the packets that have waited, which arrive now.
    pub(crate) fn release(&mut self, path: Path) -> Vec<Box<Parcel<A>>> {
        let Some(mut waiting) = self.on_hold.remove(&path) else { return Vec::new() };
        self.note(Happening::Released(path));
        self.watch();
        for parcel in &mut waiting {
            (parcel.arrival.at, parcel.arrival.is_cut) = (self.now, self.cut.contains(&path));
        }
        waiting
    }

    pub(crate) fn mend_all(&mut self) {
        std::mem::take(&mut self.cut).into_iter().for_each(|path| self.note(Happening::Mended(path)));
        self.watch();
    }

    /// Returns the statistics of a link, or `None` if both ends are the same host.
    pub(crate) fn link_stats(&self, path: Path) -> Option<LinkStats> {
        self.network.link_stats(path.from, path.to)
    }

    /// Returns the statistics of the access lines of a host, or `None` without an access line.
    pub(crate) fn access_stats(&self, host: NodeId) -> Option<AccessStats> {
        let [uplink, downlink] = [AccessLine::Uplink(host), AccessLine::Downlink(host)].map(|line| self.network.access_stats(line));
        (uplink.is_some() || downlink.is_some()).then(|| AccessStats { uplink: uplink.unwrap_or_default(), downlink: downlink.unwrap_or_default() })
    }

    #[inline]
    pub(crate) fn note(&mut self, what: Happening) {
        self.recording.note(self.now, what);
    }

    pub(crate) const fn recording(&self) -> &Recording {
        &self.recording
    }

    /// Returns how many packets of `path` were hit by laws.
    pub(crate) fn hits(&self, path: Path) -> u64 {
        self.hitting.as_ref().map_or(0, |hitting| hitting.hits(path))
    }

    /// Returns the record of the run so far. Packets under way are followed to their end, for the fates only, as if nothing more were sent.
    pub(crate) fn recorded(&self) -> Recorded {
        // Clones are followed to the end, so that the run itself stays at the present instant.
        let exits = self.hitting.as_ref().map(|hitting| hitting.exits.clone()).unwrap_or_default();
        let (packets, ended) = (self.recording.followed_through(&self.network, exits, self.now), self.now);
        Recorded {
            trace: self.recording.trace().clone(),
            packets,
            ended,
            hits: self.hit_counts(),
            drawn: self.drawn.clone(),
            said: Arc::clone(&self.said),
            devices: self.devices,
        }
    }

    /// Returns what each law has done so far.
    pub(crate) fn hit_counts(&self) -> Vec<HitCount> {
        self.hitting.as_ref().map(|hitting| hitting.counts()).unwrap_or_default()
    }
}
