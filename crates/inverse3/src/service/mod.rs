//! Simulated Inverse Service with one device: a state machine without sockets and clock.
//!
//! The owner reports connections and messages with their instants, and sends [`Transmit`]s to programs when they are due. The same service answers over sockets
//! ([`crate::socket`]) and in virtual time ([`crate::stepped`]).
//!
//! Message forms follow Haply's documentation. The mass of the grip, the time of a reply and the time after which the device idles are made up.

mod config;
mod faults;
mod grip;
mod text;

use core::time::Duration;
use std::collections::{BTreeMap, VecDeque};

use cohaptic_device::Dice;
use cohaptic_units::Instant;

use crate::axes::{Triple, to_scene};
use crate::protocol::{Event, Format, Request};
use grip::Grip;
use text::Text;

pub use config::ServiceConfig;
pub use faults::{Fault, FaultKind, When};
pub use grip::{Hand, SwayingHand};
pub use text::MIDDLE;

/// Delay of a late reply.
const LATE: Duration = Duration::from_millis(20);
/// Error of a jumping position \[m\], along x.
const JUMP: f64 = 0.05;
/// Time without a force after which the device idles. Made up: the time of the real device is not published.
const IDLE: Duration = Duration::from_millis(100);
/// Id of the device while the fault `Renamed` holds.
const OTHER: &str = "0BAD";

/// Frame of the service to a program.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Frame {
    /// Text frame.
    Text(String),
    /// End of the connection.
    Close,
}

/// Frame that is due.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Transmit {
    /// Number of the connection, from [`Service::connect`].
    pub session: u64,
    /// Frame to send.
    pub frame: Frame,
}

/// State of a connection.
#[derive(Clone, Copy, Debug)]
struct Session {
    /// Instant at which the latest frame is due. Frames of a connection stay in order.
    due: Instant,
    /// `true` after the program has asked for coordinates from the middle.
    is_centred: bool,
}

/// Simulated service with one device.
pub struct Service {
    config: ServiceConfig,
    hand: Box<dyn Hand>,
    grip: Grip,
    dice: Dice,
    now: Instant,
    /// Force of the motors \[N\], in the axes of a scene, and the instant of its message.
    force: (Triple, Instant),
    sessions: BTreeMap<u64, Session>,
    /// Connections so far.
    connections: u64,
    /// Frames on the way, by the instant at which a frame is due, then by order.
    queue: BTreeMap<(Instant, u64), Transmit>,
    /// Frames so far, which orders frames of the same instant.
    frames: u64,
    /// Beginnings and ends of faults that change the service or make an event, the next last.
    edges: Vec<(Instant, Edge)>,
    events: VecDeque<Event>,
    /// Position shown while the fault `Frozen` holds, in the axes of a scene \[m\].
    frozen: Option<Triple>,
    observed: Observed,
}

#[derive(Clone, Copy, Debug)]
enum Edge {
    Begins(FaultKind),
    Ends(FaultKind),
}

/// Counts of a simulated service, which the program at the other end does not see.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Observed {
    /// Messages of programs.
    pub messages: u64,
    /// Messages that were not JSON.
    pub unreadable: u64,
    /// Messages with a force for the device.
    pub forces: u64,
    /// Length of the largest force \[N\].
    pub largest_force: f64,
    /// Times at which the device began to idle, because no force came for 100 ms.
    pub idled: u64,
}

impl Service {
    /// Returns a service without connections, with the grip at rest in the middle. Instants count from zero.
    #[must_use]
    pub fn new(config: ServiceConfig, hand: impl Hand + 'static) -> Self {
        let mut edges = Vec::new();
        for fault in &config.faults {
            if let When::During { from, length } = fault.when {
                edges.push((from, Edge::Begins(fault.kind)));
                edges.push((from.saturating_add(length), Edge::Ends(fault.kind)));
            }
        }
        // Stable, and the next edge last: of edges at one instant the earlier fault comes first.
        edges.reverse();
        edges.sort_by(|(one, _), (other, _)| other.cmp(one));
        Self {
            grip: Grip::new(config.mass, config.damping),
            dice: Dice::new(config.seed),
            config,
            hand: Box::new(hand),
            now: Instant::ZERO,
            force: ([0.0; 3], Instant::ZERO),
            sessions: BTreeMap::new(),
            connections: 0,
            queue: BTreeMap::new(),
            frames: 0,
            edges,
            events: VecDeque::new(),
            frozen: None,
            observed: Observed::default(),
        }
    }

    /// Returns the body of a response to `GET /version`.
    #[must_use]
    pub fn version(&self) -> &'static str {
        match self.config.format {
            Format::V31 => "{\"project_version\":\"3.1.0\"}",
            Format::V35 => "{\"project_version\":\"3.5.0\"}",
        }
    }

    /// Opens a connection and returns its number, or `None` while the service restarts. The inventory is due as a reply is.
    pub fn connect(&mut self, now: Instant) -> Option<u64> {
        self.advance(now);
        if self.holds(FaultKind::Restart) {
            return None;
        }
        self.connections += 1;
        let session = self.connections;
        self.sessions.insert(session, Session { due: now, is_centred: false });
        let inventory = self.text(session, true, &[]);
        self.send(session, Frame::Text(inventory), Duration::ZERO);
        Some(session)
    }

    /// Closes a connection from the side of the program.
    pub fn disconnect(&mut self, now: Instant, session: u64) {
        self.advance(now);
        self.sessions.remove(&session);
        self.queue.retain(|_, transmit| transmit.session != session);
    }

    /// Takes a text frame of a program. A frame of a closed connection has no effect.
    pub fn receive(&mut self, now: Instant, session: u64, text: &str) {
        self.advance(now);
        if !self.sessions.contains_key(&session) {
            return;
        }
        self.observed.messages += 1;
        let Some(request) = Request::read(text, self.config.format) else {
            self.observed.unreadable += 1;
            // Every message is answered, also an unreadable one.
            return self.reply(session, false);
        };
        let is_own = request.device.is_some() && request.device.as_deref() == self.device();
        if let Some(force) = request.force.filter(|_| is_own) {
            self.force = (to_scene(force), now);
            self.observed.forces += 1;
            self.observed.largest_force = self.observed.largest_force.max(crate::axes::length(force));
        }
        if request.centred
            && is_own
            && let Some(session) = self.sessions.get_mut(&session)
        {
            session.is_centred = true;
        }
        self.reply(session, request.full);
    }

    /// Returns the next frame that is due at `now`.
    pub fn poll_transmit(&mut self, now: Instant) -> Option<Transmit> {
        self.advance(now);
        let entry = self.queue.first_entry().filter(|entry| entry.key().0 <= now)?;
        Some(entry.remove())
    }

    /// Returns the next event. Events are for all programs that listen.
    pub fn poll_event(&mut self) -> Option<Event> {
        self.events.pop_front()
    }

    /// Returns the instant at which the next frame is due, or the next fault begins or ends.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let due = self.queue.first_key_value().map(|((due, _), _)| *due);
        due.into_iter().chain(self.edges.last().map(|(at, _)| *at)).min()
    }

    /// Returns the position of the grip from the middle of the workspace, in the axes of a scene \[m\].
    #[must_use]
    pub const fn position(&self) -> Triple {
        self.grip.position
    }

    /// Returns the force of the motors on the grip, in the axes of a scene \[N\].
    #[must_use]
    pub fn motor_force(&self) -> Triple {
        let (force, at) = self.force;
        let is_idle = self.now.saturating_duration_since(at) > IDLE;
        if is_idle
            || [FaultKind::Brake, FaultKind::Stall, FaultKind::Gone, FaultKind::Renamed, FaultKind::Restart].into_iter().any(|kind| self.holds(kind))
        {
            return [0.0; 3];
        }
        force
    }

    /// Returns the counts so far.
    #[must_use]
    pub const fn observed(&self) -> &Observed {
        &self.observed
    }

    /// Moves the grip to `now`, and begins and ends faults on the way.
    pub fn advance(&mut self, now: Instant) {
        while let Some((at, edge)) = self.edges.last().copied().filter(|(at, _)| *at <= now) {
            self.move_to(at);
            self.edges.pop();
            self.cross(edge);
        }
        self.move_to(now);
    }

    fn move_to(&mut self, now: Instant) {
        // Two steps, because the force of the motors ends in between.
        let idle = self.force.1.saturating_add(IDLE);
        if self.now <= idle && idle < now {
            self.grip.advance(idle, self.motor_force(), &mut *self.hand);
            self.observed.idled += 1;
            self.now = now;
        }
        let motors = self.motor_force();
        self.grip.advance(now, motors, &mut *self.hand);
        self.now = self.now.max(now);
    }

    fn cross(&mut self, edge: Edge) {
        let id = self.config.device.clone();
        match edge {
            Edge::Begins(FaultKind::Gone) => self.events.push_back(Event::Disconnected(id)),
            Edge::Begins(FaultKind::Brake) => self.events.push_back(Event::Braked(id)),
            Edge::Ends(FaultKind::Brake) => self.events.push_back(Event::Released(id)),
            Edge::Begins(FaultKind::Stall) => self.events.push_back(Event::Stalled(id)),
            Edge::Begins(FaultKind::Frozen) => self.frozen = Some(self.grip.position),
            Edge::Ends(FaultKind::Frozen) => self.frozen = None,
            Edge::Begins(FaultKind::Restart) => {
                let now = self.now;
                // Frames on the way are lost with their connections.
                self.queue.clear();
                for session in core::mem::take(&mut self.sessions).into_keys() {
                    self.frames += 1;
                    self.queue.insert((now, self.frames), Transmit { session, frame: Frame::Close });
                }
                // A service that starts again commands no device.
                self.force = ([0.0; 3], now);
            }
            Edge::Begins(_) | Edge::Ends(_) => {}
        }
    }

    /// Returns the present id of the device; `None` while the device is gone.
    fn device(&self) -> Option<&str> {
        let id = if self.holds(FaultKind::Renamed) { OTHER } else { &self.config.device };
        (!self.holds(FaultKind::Gone)).then_some(id)
    }

    /// Returns whether a fault holds now by its span.
    fn holds(&self, kind: FaultKind) -> bool {
        self.config.faults.iter().any(|fault| fault.kind == kind && fault.holds(self.now))
    }

    /// Draws the faults of a reply.
    fn draw(&mut self) -> Vec<FaultKind> {
        let Self { config, dice, now, .. } = self;
        let hits = |fault: &&Fault| match fault.when {
            When::Chance(chance) => fault.kind.hits_replies() && dice.happens(chance),
            When::During { .. } => fault.holds(*now),
        };
        config.faults.iter().filter(hits).map(|fault| fault.kind).collect()
    }

    fn reply(&mut self, session: u64, full: bool) {
        let faults = self.draw();
        let has = |kind| faults.contains(&kind);
        if has(FaultKind::Missing) {
            return;
        }
        let mut text = self.text(session, full, &faults);
        let later = if has(FaultKind::Late) { LATE } else { Duration::ZERO };
        let half = text.len() / 2;
        if has(FaultKind::Malformed) {
            text.truncate(half);
        }
        if has(FaultKind::Split) {
            // The text is ASCII, because ids are: every byte begins a character.
            let rest = text.split_off(text.len() / 2);
            self.send(session, Frame::Text(text), later);
            return self.send(session, Frame::Text(rest), later);
        }
        if has(FaultKind::Doubled) {
            self.send(session, Frame::Text(text.clone()), later);
        }
        self.send(session, Frame::Text(text), later);
    }

    fn text(&mut self, session: u64, is_full: bool, faults: &[FaultKind]) -> String {
        let has = |kind| faults.contains(&kind);
        let is_centred = self.sessions.get(&session).is_some_and(|session| session.is_centred);
        let mut position = self.frozen.unwrap_or(self.grip.position);
        if has(FaultKind::Jumping) {
            position[0] += JUMP;
        }
        // Position and velocity are missing in turn by chance.
        let lacks_position = has(FaultKind::FieldMissing) && self.dice.happens(0.5);
        let lacks_velocity = has(FaultKind::FieldMissing) && !lacks_position;
        let device = if has(FaultKind::Gone) || self.holds(FaultKind::Gone) {
            None
        } else if has(FaultKind::Renamed) {
            Some(OTHER)
        } else {
            self.device()
        };
        let text = Text {
            format: self.config.format,
            session,
            device,
            position: (!lacks_position).then_some(position),
            velocity: (!lacks_velocity).then_some(self.grip.velocity),
            force: self.motor_force(),
            is_centred,
            is_turned: self.holds(FaultKind::Turned),
            is_transformed: has(FaultKind::Transformed),
            is_ready: !(has(FaultKind::NotReady) || self.holds(FaultKind::NotReady)),
            is_full,
        };
        text.write()
    }

    /// Queues a frame, `later` than a reply usually is.
    fn send(&mut self, session: u64, frame: Frame, later: Duration) {
        let Some(state) = self.sessions.get_mut(&session) else { return };
        let due = state.due.max(self.now.saturating_add(self.config.reply_after).saturating_add(later));
        state.due = due;
        self.frames += 1;
        self.queue.insert((due, self.frames), Transmit { session, frame });
    }
}

impl core::fmt::Debug for Service {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Service").field("now", &self.now).field("grip", &self.grip).field("sessions", &self.sessions).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
