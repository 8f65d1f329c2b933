//! The router without devices and without a clock: packets in at an instant from a side, packets out to the other side at their logical departure.
//!
//! ```text
//!             ┌ rules ─┬─ link "wan",  left → right ─┐
//!   left ─────┤        ├─ link "mess", left → right ─┼──▶ departures, in order of instants ──▶ right
//!             └        └─ pass ──────────────────────┘
//! ```
//!
//! Every link has a state machine for each direction, with a queue and random numbers of its own: its stream is called `wan.left->wan.right` and
//! `wan.right->wan.left`. Rules that name the same link share it.

mod lane;
mod snapshot;

use std::collections::VecDeque;
use std::sync::Arc;

use cohaptic_linkfile::router::{Memory, RouterFile, Side, Target};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::LinkModel;

use crate::packet::{Content, Packet};
use crate::rules::{Decided, Rules};
use lane::Lane;
pub use snapshot::{Count, Counters, LaneSnapshot, Received};

/// The router as a state machine.
///
/// The driver hands packets in with [`Engine::handle_packet`], asks with [`Engine::poll_timeout`] when to come back, calls [`Engine::handle_timeout`] then,
/// and drains [`Engine::poll_departure`] after each call until it gives `None`. Being late costs nothing but lateness: every departure carries the instant
/// at which it happened. An instant before the last one given counts as that one.
#[derive(Clone, Debug)]
pub struct Engine {
    now: Instant,
    rules: Rules,
    names: Vec<String>,
    /// Two for each link, one after the other: from the left, from the right.
    lanes: Vec<Lane>,
    memory: Memory,
    /// The packets inside all links.
    held: Memory,
    departures: VecDeque<Departure>,
    received: [Received; 2],
    by_rule: Vec<Count>,
    by_default: [Count; 2],
}

/// A packet that leaves the router.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Departure {
    /// When.
    pub at: Instant,
    /// To which side.
    pub to: Side,
    /// The packet, with what its link did to it.
    pub packet: Arc<Packet>,
}

/// There is no link of that name.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("there is no link {name:?}: expected one of {}", known.join(", "))]
pub struct NoSuchLink {
    /// What was asked for.
    pub name: String,
    /// Those that there are.
    pub known: Vec<String>,
}

impl Engine {
    /// A router without packets.
    #[must_use]
    pub fn new(file: &RouterFile) -> Self {
        let lanes = file.links.iter().flat_map(|link| Side::BOTH.map(|from| Lane::new(file.seed, link, from))).collect();
        Self {
            now: Instant::ZERO,
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

    /// Takes a packet that came from a side.
    ///
    /// A frame without a packet of IP goes to the other side at once; a malformed packet goes nowhere.
    pub fn handle_packet(&mut self, now: Instant, from: Side, packet: Packet) {
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
        if self.held.packets >= self.memory.packets || self.held.bytes.get().saturating_add(info.size.get()) > self.memory.bytes.get() {
            self.lanes[place].overload += 1;
            return;
        }
        self.held.packets += 1;
        self.held.bytes = Bytes::new(self.held.bytes.get() + info.size.get());
        self.lanes[place].offer(now, info, packet);
        self.drain(place);
    }

    /// Lets time pass until `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        while let Some((at, place)) = self.next_lane().filter(|(at, _)| *at <= now) {
            self.lanes[place].pass(at);
            self.drain(place);
        }
        self.now = self.now.max(now);
    }

    /// When [`Engine::handle_timeout`] must be called next; `None` if nothing is on the way. Never before the last instant given, once all departures are
    /// polled. May change after every call.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        self.next_lane().map(|(at, _)| at)
    }

    /// The next packet that leaves, in the order of instants; of equal ones, in the order of the links in the file. `None` when all have been polled.
    #[must_use]
    pub fn poll_departure(&mut self) -> Option<Departure> {
        self.departures.pop_front()
    }

    /// Changes a link from `now` on, in one direction or (`None`) in both: see [`cohaptic_wan::Link::set_model`]. `from` is the side from which its packets
    /// come.
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

    /// What was counted so far. The delays of late ([`LaneSnapshot::recent_delay`]) are those since the last call.
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

    /// The last instant given.
    #[must_use]
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// The lane to which something happens next; of several at the same instant the first.
    fn next_lane(&self) -> Option<(Instant, usize)> {
        let due = self.lanes.iter().enumerate().filter_map(|(place, lane)| lane.next_at().map(|at| (at, place)));
        due.min()
    }

    /// Takes what has come out of a lane.
    fn drain(&mut self, place: usize) {
        while let Some(event) = self.lanes[place].link.poll_event() {
            let size = event.size.get();
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

/// The place of a link's lane for what comes from that side.
const fn lane_of(link: usize, from: Side) -> usize {
    2 * link + from.index()
}

/// The side from which the packets of a lane come.
const fn side_of(lane: usize) -> Side {
    Side::BOTH[lane % 2]
}
