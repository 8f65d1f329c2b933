//! Messages of a client: when a message is due, and what the message says.

use core::time::Duration;

use cohaptic_device::Moment;
use cohaptic_units::Instant;

use super::{Action, Client, LOOK, LOST, Link, SEARCH};
use crate::axes::to_haply;
use crate::protocol::{Format, Request};

impl Client {
    /// Returns whether messages can command the device.
    pub(super) const fn device_is_there(&self) -> bool {
        self.is_listed && self.device.is_some()
    }

    /// Returns the instant of the next message without a force of the session: a question for a missing device, or a zero force for a reading that is too old.
    pub(super) fn next_message(&self) -> Option<Instant> {
        let age = self.config.limits.reading_age;
        let Some(sent) = self.exchanges.sent else {
            // After the connection the service speaks first.
            return None;
        };
        if !self.device_is_there() {
            return Some(sent.saturating_add(SEARCH));
        }
        // With a reply outstanding, zero goes out when the reading is too old. Without, a message keeps the readings young: the session may have paused.
        let span = match (self.exchanges.is_outstanding(), self.is_doubtful) {
            (false, _) => age / 2,
            (true, false) => age.saturating_add(Duration::from_nanos(1)),
            (true, true) => LOST,
        };
        Some(sent.saturating_add(span))
    }

    /// Sends a message: the first one of a connection, a force, or a question for the list of devices.
    pub(super) fn message(&mut self, now: Instant) {
        let Some(device) = self.device.clone().filter(|_| self.is_listed) else {
            self.exchanges.send(now, [0.0; 3], None, false);
            self.sent_force = [0.0; 3];
            self.gate.withdraw(now);
            // A device that the list leaves out may still be there: zero goes to its id all the same.
            let request = Request { device: self.device.clone(), force: self.device.is_some().then_some([0.0; 3]), ..Request::INVENTORY };
            return self.actions.push_back(Action::Send(request.write(self.format)));
        };
        self.known.asked.get_or_insert(now);
        let moment = Moment {
            now,
            ready: self.is_ready && self.known.is_placed,
            armed: self.may_arm() && self.arming.is_armed(),
            reading_at: self.reading.map(|(_, at)| at),
            setpoint_at: self.wanted.map(|(_, at)| at),
        };
        let admitted = self.gate.admit(self.wanted.map_or([0.0; 3], |(force, _)| force), &moment);
        self.sent_force = admitted.force.newtons();
        // The negative of zero would be written as `-0`.
        let force = to_haply(self.sent_force).map(|part| part + 0.0);
        // Other programs may change the axes at any time, so the configuration is asked for again after a while. A service before 3.5 shows the configuration
        // only once.
        let is_due = self.known.looked.is_none_or(|looked| now.saturating_duration_since(looked) >= LOOK);
        let is_new = self.format == Format::V35 && !self.known.is_placed;
        let full = self.format == Format::V35 && (is_new || is_due || self.is_doubtful);
        let request = Request { device: Some(device), force: Some(force), centred: is_new, full };
        self.exchanges.send(now, self.sent_force, Some(admitted.verdict), self.format == Format::V35 && self.is_doubtful);
        self.is_pending = false;
        self.actions.push_back(Action::Send(request.write(self.format)));
        // A service before 3.5 has no preset to wait for: the configured origin counts from the first message on.
        if self.format == Format::V31 && !self.known.is_placed {
            self.place_device(false);
        }
    }

    /// Disarms the device, and counts the loss of an armed device.
    pub(super) fn lose(&mut self) {
        self.exchanges.report.losses += u64::from(self.arming.lose());
    }

    /// Forgets everything that a connection told.
    pub(super) fn forget(&mut self, now: Instant) {
        self.lose();
        self.exchanges.give_up();
        self.exchanges.sent = None;
        self.is_doubtful = false;
        (self.is_listed, self.is_ready, self.is_transformed, self.is_braked) = (false, false, false, false);
        (self.reading, self.place, self.sent_force) = (None, None, [0.0; 3]);
        self.gate.withdraw(now);
    }

    /// Closes the connection, to open another one. A zero force goes first: else the device would keep the latest force until it idles.
    pub(super) fn drop_connection(&mut self, now: Instant) {
        let device = self.device.clone().filter(|_| self.is_listed);
        self.closed(now);
        if device.is_some() {
            let zero = Request { device, force: Some([0.0; 3]), centred: false, full: false };
            self.actions.push_back(Action::Send(zero.write(self.format)));
        }
        self.actions.push_back(Action::Close);
    }

    pub(super) fn leave(&mut self) {
        self.actions.push_back(Action::Close);
        self.link = Link::Over;
        self.sent_force = [0.0; 3];
    }
}
