//! Device in virtual time: a client and a simulated service without sockets, thread and clock.

use core::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Reading, Stopper};
use cohaptic_units::Instant;

use crate::client::{Action, Client, ClientConfig, ClientConfigError, Report, Snapshot};
use crate::protocol::Version;
use crate::service::{Frame, Service};

/// Name of the device in messages and records.
pub(crate) const NAME: &str = "inverse3";

/// A simulated Inverse3 that the ticks of its peer drive: each [`Device::hold`] passes the time of a tick. A whole session is deterministic.
#[derive(Debug)]
pub struct SteppedInverse3 {
    client: Client,
    service: Service,
    limit: f64,
    stopper: Stopper,
    /// Number of the open connection.
    session: Option<u64>,
    /// Time that has passed for client and service.
    now: Instant,
    /// End of the last tick.
    reached: Instant,
    /// `true` after the client was told to stop.
    is_stopping: bool,
}

impl SteppedInverse3 {
    /// Returns a device before its first tick.
    ///
    /// # Errors
    ///
    /// [`ClientConfigError`] for a number out of range.
    pub fn new(service: Service, config: ClientConfig) -> Result<Self, ClientConfigError> {
        let (stopper, limit) = (Stopper::default(), config.limits.force);
        let client = Client::new(config, stopper.clone())?;
        Ok(Self { client, service, limit, stopper, session: None, now: Instant::ZERO, reached: Instant::ZERO, is_stopping: false })
    }

    /// Passes `span` with the force given last, for example to arm the device before a peer uses it.
    pub fn wait(&mut self, span: Duration) {
        // Ticks add up from the end of the last tick, so that no time is lost between two ticks.
        self.reached = self.reached.saturating_add(span);
        loop {
            self.act();
            let due = [self.client.poll_timeout(), self.service.poll_timeout()].into_iter().flatten().min();
            match due.filter(|due| *due <= self.reached) {
                Some(due) => self.now = self.now.max(due),
                None => break,
            }
            self.client.handle_timeout(self.now);
        }
        self.now = self.reached;
        self.service.advance(self.now);
    }

    /// Returns the device as the client sees the device.
    #[must_use]
    pub fn snapshot(&self) -> Snapshot {
        self.client.snapshot(self.now)
    }

    /// Returns the report of exchanges so far.
    #[must_use]
    pub fn report(&self) -> Report {
        self.client.report()
    }

    /// Returns the client.
    #[must_use]
    pub const fn client(&self) -> &Client {
        &self.client
    }

    /// Returns the simulated service, with the true state of the grip.
    #[must_use]
    pub const fn service(&self) -> &Service {
        &self.service
    }

    /// Carries frames, events and actions until nobody has anything to say at this instant.
    fn act(&mut self) {
        if self.stopper.is_stopped() && !self.is_stopping {
            self.is_stopping = true;
            self.client.stop(self.now);
        }
        loop {
            let mut is_quiet = true;
            while let Some(action) = self.client.poll_action(self.now) {
                is_quiet = false;
                self.carry_out(action);
            }
            while let Some(event) = self.service.poll_event() {
                is_quiet = false;
                self.client.receive_event(self.now, &event);
            }
            while let Some(transmit) = self.service.poll_transmit(self.now) {
                is_quiet = false;
                if self.session == Some(transmit.session) {
                    match transmit.frame {
                        Frame::Text(text) => self.client.receive(self.now, &text),
                        Frame::Close => {
                            self.session = None;
                            self.client.closed(self.now);
                        }
                    }
                }
            }
            if is_quiet {
                return;
            }
        }
    }

    fn carry_out(&mut self, action: Action) {
        match action {
            Action::Connect => {
                self.session = self.service.connect(self.now);
                if self.session.is_some() {
                    self.client.connected(self.now, Version::of_response(self.service.version()));
                } else {
                    self.client.closed(self.now);
                }
            }
            Action::Send(text) => {
                if let Some(session) = self.session {
                    self.service.receive(self.now, session, &text);
                }
            }
            Action::Close => {
                if let Some(session) = self.session.take() {
                    self.service.disconnect(self.now, session);
                }
            }
        }
    }
}

impl Device for SteppedInverse3 {
    fn description(&self) -> Description {
        Description { name: NAME.to_owned(), motions: 3, force: self.limit, period: Duration::from_millis(1) }
    }

    fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    fn read(&mut self, _now: Instant) -> Option<Reading> {
        self.snapshot().for_peer()
    }

    fn hold(&mut self, _now: Instant, span: Duration, force: GatedForce) {
        self.client.hold(self.now, force);
        self.wait(span);
    }

    /// Stops the device, and passes the time in which the zero force reaches the service.
    fn stop(&mut self) {
        self.stopper.stop();
        self.wait(Duration::from_millis(50));
    }
}
