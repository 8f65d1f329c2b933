//! The router without devices and without a clock. Packets from a side come in at an instant, and leave at the other side at their logical departure.
//!
//! ```text
//!             ┌ rules ─┬─ link "wan",  left → right ─┐
//!   left ─────┤        ├─ link "mess", left → right ─┼──▶ departures, in order of instants ──▶ right
//!             └        └─ pass ──────────────────────┘
//! ```
//!
//! A name of the file, such as `wan`, stands for two links, one in each direction. Each link is a state machine with a queue and random numbers of its own,
//! whose streams are named `wan.left->wan.right` and `wan.right->wan.left`. Rules with the same name share these links.

mod lane;
mod snapshot;

use core::time::Duration;
use std::collections::VecDeque;
use std::sync::Arc;

use cohaptic_linkfile::router::{Memory, RouterFile, Side, Target};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::LinkModel;

use crate::packet::{Content, Packet};
use crate::rules::{Decided, Rules};
use lane::Lane;
pub use snapshot::{Count, Counters, LaneSnapshot, Received};

/// State machine of a router.
///
/// The driver passes packets with [`Engine::handle_packet`], asks [`Engine::poll_timeout`] for the next deadline, calls [`Engine::handle_timeout`] at that
/// instant, and drains [`Engine::poll_departure`] after each call until the result is `None`. A late driver changes no fate, because every departure carries
/// the instant at which the packet left its link. An instant before the latest instant counts as the latest instant.
#[derive(Clone, Debug)]
pub struct Engine {
    /// Latest instant given by the driver.
    now: Instant,
    /// Latest instant up to which the cross packets of all links are computed.
    caught_up: Instant,
    rules: Rules,
    /// Names of the links, indexed by link.
    names: Vec<String>,
    /// Lanes, two per link at the indices of [`lane_of`]: packets from the left, then packets from the right.
    lanes: Vec<Lane>,
    /// Bounds on packets and bytes inside all links.
    memory: Memory,
    /// Packets and bytes inside all links now.
    held: Memory,
    /// Packets delivered by their links and not polled yet, in the order of instants.
    departures: VecDeque<Departure>,
    /// Arrived packets, indexed by side.
    received: [Received; 2],
    /// Packets for which a rule decided, indexed by rule.
    by_rule: Vec<Count>,
    /// Packets for which a default decided, indexed by side.
    by_default: [Count; 2],
}

/// Time after which cross packets are computed without a packet that meets them. The loop of the router turns at least every 50 ms, also in a silence, so the
/// first packet after any silence waits for the cross packets of 50 ms at most, 0.1 ms at 10,000 packets a second.
const CATCH_UP: Duration = Duration::from_millis(10);

/// Packet leaving the router.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Departure {
    /// Logical departure.
    pub at: Instant,
    /// Side at which the packet leaves.
    pub to: Side,
    /// Packet, with the marks and bit errors of its link.
    pub packet: Arc<Packet>,
}

/// No link has the given name.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("there is no link {name:?}: expected one of {}", known.join(", "))]
pub struct NoSuchLink {
    /// Name asked for.
    pub name: String,
    /// Names of all links, in the order of the file.
    pub known: Vec<String>,
}

impl Engine {
    /// Returns a router without packets.
    #[must_use]
    pub fn new(file: &RouterFile) -> Self {
        let lanes = file.links.iter().flat_map(|link| Side::BOTH.map(|from| Lane::new(file.seed, link, from))).collect();
        Self {
            now: Instant::ZERO,
            caught_up: Instant::ZERO,
            rules: Rules::new(file),
            names: file.links.iter().map(|link| link.name.clone()).collect(),
            lanes,
            memory: file.memory,
            held: Memory { packets: 0, bytes: Bytes::new(0) },
            departures: VecDeque::new(),
            received: [Received::default(); 2],
            by_rule: vec![Count::default(); file.rules.len()],
            by_default: [Count::default(); 2],
        }
    }

    /// Passes a packet from a side.
    ///
    /// A frame without IP leaves at the other side at once. A malformed packet is dropped and counted.
    pub fn handle_packet(&mut self, now: Instant, from: Side, packet: Packet) {
        // Earlier packets leave their links first, so that departures stay in the order of instants.
        self.handle_timeout(now);
        let now = self.now;
        let received = &mut self.received[from.index()];
        let info = packet.info();
        received.all.add(info.size);
        let headers = match packet.content() {
            Content::Ip { headers, .. } => headers,
            Content::NotIp => {
                received.not_ip += 1;
                return self.departures.push_back(Departure { at: now, to: from.opposite(), packet: Arc::new(packet) });
            }
            Content::Malformed(_) => {
                received.malformed += 1;
                return;
            }
        };
        let (decided, target) = self.rules.choose(from, headers);
        match decided {
            Decided::Rule(place) => self.by_rule[place].add(info.size),
            Decided::Default => self.by_default[from.index()].add(info.size),
        }
        let link = match target {
            Target::Pass => {
                received.passed += 1;
                return self.departures.push_back(Departure { at: now, to: from.opposite(), packet: Arc::new(packet) });
            }
            Target::Drop => {
                received.dropped += 1;
                return;
            }
            Target::Link(link) => link,
        };
        let place = lane_of(link, from);
        // The bound holds for all links together. Copies made by a link are not refused, so `held` can exceed the bound.
        if self.held.packets >= self.memory.packets || self.held.bytes.get().saturating_add(info.size.get()) > self.memory.bytes.get() {
            self.lanes[place].overload += 1;
            return;
        }
        self.held.packets += 1;
        self.held.bytes = Bytes::new(self.held.bytes.get() + info.size.get());
        // A link can deliver at once, for example without a delay, so its events are collected right after the offer.
        self.lanes[place].offer(now, info, packet);
        self.drain(place);
    }

    /// Lets logical time pass until `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        // One lane at a time, always the earliest: departures of different links are queued in the order of instants.
        while let Some((at, place)) = self.next_lane().filter(|(at, _)| *at <= now) {
            self.lanes[place].pass(at);
            self.drain(place);
        }
        self.now = self.now.max(now);
        if self.now.saturating_duration_since(self.caught_up) >= CATCH_UP {
            self.caught_up = self.now;
            // All due events have happened, so no packet leaves a link here.
            self.lanes.iter_mut().for_each(|lane| lane.catch_up(self.now));
        }
    }

    /// Returns the instant of the next necessary call of [`Engine::handle_timeout`], or `None` if no packet is inside a link. Never before the latest instant
    /// given, once all departures are polled. Can change with every call.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.next_lane().map(|(at, _)| at)
    }

    /// Returns the next packet that leaves, in the order of instants; for equal instants, in the order of the links in the file. Returns `None` when all have
    /// been polled.
    #[must_use]
    pub fn poll_departure(&mut self) -> Option<Departure> {
        self.departures.pop_front()
    }

    /// Changes the model of a named link from `now` on, in one direction or, with `None`, in both: see [`cohaptic_wan::Link::set_model`]. `from` is the side
    /// from which the packets of the direction come.
    ///
    /// # Errors
    ///
    /// [`NoSuchLink`]; nothing was changed.
    pub fn set_link(&mut self, now: Instant, name: &str, from: Option<Side>, model: &LinkModel) -> Result<(), NoSuchLink> {
        let Some(link) = self.names.iter().position(|known| known == name) else {
            return Err(NoSuchLink { name: name.to_owned(), known: self.names.clone() });
        };
        self.handle_timeout(now);
        for side in Side::BOTH.into_iter().filter(|side| from.is_none_or(|from| from == *side)) {
            let place = lane_of(link, side);
            self.lanes[place].change(self.now, model);
            self.drain(place);
        }
        Ok(())
    }

    /// Returns all counters. The recent delays ([`LaneSnapshot::recent_delay`]) begin anew with each call.
    pub fn counters(&mut self) -> Counters {
        let names = self.names.iter().flat_map(|name| Side::BOTH.map(|from| (name, from)));
        Counters {
            received: self.received,
            by_rule: self.by_rule.clone(),
            by_default: self.by_default,
            lanes: names.zip(&mut self.lanes).map(|((name, from), lane)| lane.snapshot(name, from)).collect(),
            held: self.held,
        }
    }

    /// Returns the latest instant given.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Returns the lane with the earliest next event, and the instant. Of several lanes with the same instant, the first in the order of the file.
    fn next_lane(&self) -> Option<(Instant, usize)> {
        // The minimum of pairs compares the lane second, so the first lane wins a tie.
        let due = self.lanes.iter().enumerate().filter_map(|(place, lane)| lane.next_at().map(|at| (at, place)));
        due.min()
    }

    /// Collects the events of a lane: deliveries become departures, and every end frees room.
    fn drain(&mut self, place: usize) {
        while let Some(event) = self.lanes[place].link.poll_event() {
            let size = event.size.get();
            // A copy was made: the copy takes room, and has an end of its own.
            if !event.fate.is_end() {
                self.held.packets += 1;
                self.held.bytes = Bytes::new(self.held.bytes.get() + size);
                continue;
            }
            self.held.packets -= 1;
            self.held.bytes = Bytes::new(self.held.bytes.get() - size);
            if let Some((at, packet)) = self.lanes[place].arrived(event) {
                self.departures.push_back(Departure { at, to: side_of(place).opposite(), packet });
            }
        }
    }
}

/// Returns the index of the lane of a link for packets from the side `from`.
const fn lane_of(link: usize, from: Side) -> usize {
    2 * link + from.index()
}

/// Returns the side from which the packets of a lane come.
const fn side_of(lane: usize) -> Side {
    Side::BOTH[lane % 2]
}
