//! Client of an Inverse Service: a state machine without sockets and clock.
//!
//! The owner reports what happens to the connection ([`Client::connected`], [`Client::receive`], [`Client::closed`]), carries out each [`Action`] of
//! [`Client::poll_action`], and calls [`Client::handle_timeout`] at the instant of [`Client::poll_timeout`]. A session gives forces by [`Client::hold`] and
//! reads [`Client::snapshot`].
//!
//! Every force passes a gate here, also if the session has a gate: only the client knows the age of the newest reply.

mod arming;
mod config;
mod exchanges;
mod messages;
mod readings;
mod status;

use core::time::Duration;
use std::collections::VecDeque;

use cohaptic_device::{Gate, GatedForce, Reading, Stopper};
use cohaptic_units::Instant;
use serde_json::Value;

use crate::axes::Triple;
use crate::protocol::{Device, Event, Format, Reply, Version};
use arming::Arming;
use exchanges::{Exchanges, Form};

pub use config::{ClientConfig, ClientConfigError, MOST_FORCE, Which};
pub use exchanges::Report;
pub use status::{Phase, Refusal, Snapshot};

/// Time between two looks at the configuration of the device.
const LOOK: Duration = Duration::from_secs(1);
/// Time between two looks at the list of devices, while the device is not in the list.
const SEARCH: Duration = Duration::from_millis(100);
/// Time after which the replies count as lost to messages that went out although another reply was outstanding.
const LOST: Duration = Duration::from_millis(100);
/// Time without any text of the service after which the connection counts as dead.
const SILENCE: Duration = Duration::from_secs(1);
/// First and longest pause before a new connection.
const PAUSES: [Duration; 2] = [Duration::from_millis(250), Duration::from_secs(4)];
/// Dropped replies in a row after which the connection is closed.
const FLAWS_IN_A_ROW: u32 = 10;
/// Time that a stop waits for the reply to its zero force.
const FAREWELL: Duration = Duration::from_millis(50);
/// Tolerance before a change of position counts as a jump, as time at 20 m/s: replies arrive less evenly than the service makes replies.
const JITTER: Duration = Duration::from_millis(1);

/// Step that the owner of a client carries out.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Action {
    /// Connect to the service, then call [`Client::connected`] or [`Client::closed`].
    Connect,
    /// Send this text frame.
    Send(String),
    /// Close the connection with status 1000. [`Client::closed`] is not expected.
    Close,
}

/// State of the connection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Link {
    /// Waits until the instant before the next attempt.
    Waiting(Instant),
    /// The owner connects.
    Connecting,
    /// Connected. The latest text of the service came at `heard`.
    Open { heard: Instant },
    /// A stop waits for its reply until the instant.
    Leaving(Instant),
    /// No more attempts.
    Over,
}

/// Knowledge about the device of a connection.
#[derive(Clone, PartialEq, Debug, Default)]
struct Known {
    /// Instant of the first message with the preset.
    asked: Option<Instant>,
    /// `true` once the origin of the coordinates is certain.
    is_placed: bool,
    /// Mounting at the look that made the origin certain.
    mount: Option<Value>,
    /// `true` if the latest look found the axes unchanged.
    is_straight: bool,
    /// Instant of the latest look at the configuration.
    looked: Option<Instant>,
}

/// Client of a service, for one device.
#[derive(Debug)]
pub struct Client {
    config: ClientConfig,
    gate: Gate,
    link: Link,
    actions: VecDeque<Action>,
    /// Pause before the next attempt to connect.
    pause: Duration,
    version: Option<Version>,
    format: Format,
    /// Id of the chosen device.
    device: Option<String>,
    known: Known,
    /// `true` while the latest list has the device.
    is_listed: bool,
    is_ready: bool,
    /// `true` while the coordinates of the session are transformed.
    is_transformed: bool,
    /// `true` from an emergency brake until its release.
    is_braked: bool,
    arming: Arming,
    /// Newest reading and the instant of its message.
    reading: Option<(Reading, Instant)>,
    /// Position in the coordinates of the device of the newest accepted reply \[m\], for jumps.
    place: Option<(Triple, Instant)>,
    exchanges: Exchanges,
    /// `true` after a message that went out because a reply did not come in time, until the newest reply comes.
    is_doubtful: bool,
    flaws_in_a_row: u32,
    /// Newest force of the session, in the axes of a scene \[N\], and its instant.
    wanted: Option<(Triple, Instant)>,
    /// `true` if the session has given a force since the latest message.
    is_pending: bool,
    /// Force of the latest message, in the axes of a scene \[N\].
    sent_force: Triple,
    refusal: Option<Refusal>,
}

impl Client {
    /// Returns a client that connects at once. `stopper` stops the client, from any thread: after [`Stopper::stop`] call [`Client::stop`].
    ///
    /// # Errors
    ///
    /// [`ClientConfigError`] for a number out of range.
    pub fn new(config: ClientConfig, stopper: Stopper) -> Result<Self, ClientConfigError> {
        let config = config.checked()?;
        Ok(Self {
            gate: Gate::new(config.limits, stopper)?,
            device: if let Which::Id(id) = &config.which { Some(id.clone()) } else { None },
            config,
            link: Link::Waiting(Instant::ZERO),
            actions: VecDeque::new(),
            pause: PAUSES[0],
            version: None,
            format: Format::V35,
            known: Known::default(),
            is_listed: false,
            is_ready: false,
            is_transformed: false,
            is_braked: false,
            arming: Arming::default(),
            reading: None,
            place: None,
            exchanges: Exchanges::new(),
            is_doubtful: false,
            flaws_in_a_row: 0,
            wanted: None,
            is_pending: false,
            sent_force: [0.0; 3],
            refusal: None,
        })
    }

    /// Returns the next step for the owner.
    pub fn poll_action(&mut self, now: Instant) -> Option<Action> {
        if matches!(self.link, Link::Waiting(until) if until <= now) {
            self.link = Link::Connecting;
            self.actions.push_back(Action::Connect);
        }
        self.actions.pop_front()
    }

    /// Returns the instant of the next call of [`Client::handle_timeout`]; `None` while the owner connects, and after the end.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        match self.link {
            Link::Waiting(until) | Link::Leaving(until) => Some(until),
            Link::Connecting | Link::Over => None,
            Link::Open { heard } => {
                let silent = heard.saturating_add(SILENCE);
                Some(self.next_message().map_or(silent, |at| at.min(silent)))
            }
        }
    }

    /// Does what is due at `now`.
    pub fn handle_timeout(&mut self, now: Instant) {
        match self.link {
            Link::Leaving(until) if until <= now => self.leave(),
            Link::Open { heard } if now.saturating_duration_since(heard) >= SILENCE => self.drop_connection(now),
            Link::Open { .. } if self.next_message().is_some_and(|at| at <= now) => {
                // The time for a doubtful reply is over as well: the replies count as lost, and the exchanges begin anew.
                if self.is_doubtful {
                    self.exchanges.give_up();
                }
                self.is_doubtful = self.exchanges.is_outstanding();
                self.message(now);
            }
            Link::Waiting(_) | Link::Connecting | Link::Open { .. } | Link::Leaving(_) | Link::Over => {}
        }
    }

    /// Tells that the connection is open. `version`: answer to `GET /version`, if the service gave one.
    pub fn connected(&mut self, now: Instant, version: Option<Version>) {
        if self.link != Link::Connecting {
            return;
        }
        self.link = Link::Open { heard: now };
        self.exchanges.report.connections += 1;
        self.version = version;
        self.format = version.map_or(Format::V35, Version::format);
        self.exchanges.begin(now);
        self.known = Known::default();
        self.flaws_in_a_row = 0;
    }

    /// Tells that the connection has ended or could not be opened.
    pub fn closed(&mut self, now: Instant) {
        self.forget(now);
        // A message to a connection that has ended must not go to the next connection.
        self.actions.retain(|action| *action == Action::Close);
        match self.link {
            Link::Open { .. } | Link::Connecting => {
                self.link = Link::Waiting(now.saturating_add(self.pause));
                self.pause = (self.pause * 2).min(PAUSES[1]);
            }
            Link::Leaving(_) => self.link = Link::Over,
            Link::Waiting(_) | Link::Over => {}
        }
    }

    /// Takes a text frame of the service.
    pub fn receive(&mut self, now: Instant, text: &str) {
        match &mut self.link {
            Link::Open { heard } => *heard = now,
            Link::Leaving(_) => {
                // The reply to the zero force comes after all other replies.
                if self.exchanges.answer(Form::Unknown).is_some() {
                    self.leave();
                }
                return;
            }
            Link::Waiting(_) | Link::Connecting | Link::Over => return,
        }
        let reply = Reply::read(text);
        let own = reply.as_ref().ok().and_then(|reply| self.choose(&reply.devices));
        let form = match own {
            Some(Device { config: Some(_), .. }) => Form::Full,
            Some(_) => Form::Plain,
            None => Form::Unknown,
        };
        let answered = self.exchanges.answer(form);
        // Only the reply to the latest message ends a doubt: any other reply may belong to an earlier message.
        self.is_doubtful &= answered.is_none();
        let flaw = match &reply {
            Ok(_) => self.take(now, own, answered),
            Err(flaw) => Some(*flaw),
        };
        if let Some(flaw) = flaw {
            self.exchanges.report.flaws[flaw.index()] += 1;
            self.flaws_in_a_row += 1;
            if self.flaws_in_a_row >= FLAWS_IN_A_ROW {
                return self.drop_connection(now);
            }
        } else {
            self.flaws_in_a_row = 0;
        }
        // The first message asks for the preset. Later a force may have waited for the reply. A refusal has closed the connection, and no message follows the
        // close.
        let is_open = matches!(self.link, Link::Open { .. });
        if is_open && !self.exchanges.is_outstanding() && self.device_is_there() && (self.is_pending || self.known.asked.is_none()) {
            self.message(now);
        }
    }

    /// Takes an event of the service. An event of another device has no effect.
    pub fn receive_event(&mut self, now: Instant, event: &Event) {
        if self.device.as_deref() != Some(event.device()) {
            return;
        }
        match event {
            Event::Disconnected(_) => self.is_listed = false,
            Event::Braked(_) => self.is_braked = true,
            Event::Released(_) => self.is_braked = false,
            // The device gives force again when its user has armed it again.
            Event::Stalled(_) => {}
        }
        self.disarm(now);
    }

    /// Tells that no more events of the service arrive. Nobody would hear of the release of a brake, so that a brake ends here; the device must be armed anew.
    pub fn events_ended(&mut self, now: Instant) {
        self.is_braked = false;
        self.disarm(now);
    }

    /// Disarms the device. Zero goes out at once, although a reply may be outstanding, and also to a device that the service has lost.
    fn disarm(&mut self, now: Instant) {
        self.lose();
        if matches!(self.link, Link::Open { .. }) {
            self.message(now);
        }
    }

    /// Sets the force on the hand until the next call. Sends the force at once if no reply is outstanding, and else with the next reply.
    pub fn hold(&mut self, now: Instant, force: GatedForce) {
        self.wanted = Some((force.newtons(), now));
        self.is_pending = true;
        if matches!(self.link, Link::Open { .. }) && !self.exchanges.is_outstanding() && self.device_is_there() {
            self.message(now);
        }
    }

    /// Sends zero force, waits at most 50 ms for the reply, and closes the connection. A stopped client stays stopped.
    pub fn stop(&mut self, now: Instant) {
        self.gate.stop();
        match self.link {
            Link::Open { .. } if self.device_is_there() => {
                self.message(now);
                self.link = Link::Leaving(now.saturating_add(FAREWELL));
            }
            Link::Open { .. } => self.leave(),
            Link::Waiting(_) | Link::Connecting => self.link = Link::Over,
            Link::Leaving(_) | Link::Over => {}
        }
    }

    /// Returns whether the client has stopped, or has given up the device for good.
    #[must_use]
    pub fn is_over(&self) -> bool {
        self.link == Link::Over && self.actions.is_empty()
    }

    /// Returns the reason why the device cannot be used; `None` while it may be.
    #[must_use]
    pub const fn refusal(&self) -> Option<Refusal> {
        self.refusal
    }

    /// Returns the id of the chosen device; `None` before the first list with a device.
    #[must_use]
    pub fn device(&self) -> Option<&str> {
        self.device.as_deref()
    }

    /// Returns the version that the service told.
    #[must_use]
    pub const fn version(&self) -> Option<Version> {
        self.version
    }

    /// Returns the state at `now`.
    #[must_use]
    pub fn snapshot(&self, now: Instant) -> Snapshot {
        let is_fresh = self.reading.is_some_and(|(_, at)| now.saturating_duration_since(at) <= self.config.limits.reading_age);
        Snapshot { at: now, phase: self.phase(), reading: self.reading, is_fresh, force: self.sent_force }
    }

    /// Returns the report of exchanges up to now.
    #[must_use]
    pub fn report(&self) -> Report {
        self.exchanges.report()
    }

    fn phase(&self) -> Phase {
        match self.link {
            _ if self.refusal.is_some() => self.refusal.map_or(Phase::Stopped, Phase::Refused),
            _ if self.gate.is_stopped() => Phase::Stopped,
            Link::Leaving(_) | Link::Over => Phase::Stopped,
            Link::Waiting(_) | Link::Connecting => Phase::Connecting,
            Link::Open { .. } if self.exchanges.sent.is_none() => Phase::Connecting,
            Link::Open { .. } if self.is_braked => Phase::Braked,
            Link::Open { .. } if !self.is_listed => Phase::NoDevice,
            Link::Open { .. } if !self.known.is_placed => Phase::Connecting,
            Link::Open { .. } if !self.is_ready => Phase::NotReady,
            Link::Open { .. } if self.is_transformed || (self.known.looked.is_some() && !self.known.is_straight) => Phase::Turned,
            Link::Open { .. } if self.arming.is_armed() => Phase::Active,
            Link::Open { .. } => Phase::Disarmed,
        }
    }
}

#[cfg(test)]
mod tests;
