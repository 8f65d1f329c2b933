//! An Inverse3 in a user's hand, driven by a thread.

use std::io::{self, Read as _, Write as _};
use std::net::SocketAddr;
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::Duration;

use cohaptic_device::{Description, Device, GatedForce, Mailbox, Reading, Stopper};
use cohaptic_realtime::{Clock as _, MonotonicClock};
use cohaptic_units::Instant;

use super::wire::{Wire, ask_version};
use super::{StartError, events_of, local};
use crate::client::{Action, Client, ClientConfig, Refusal, Report, Snapshot};
use crate::protocol::{Event, Version};
use crate::stepped::NAME;

/// Longest wait of the thread, after which the thread looks for a stop.
const LONGEST_WAIT: Duration = Duration::from_millis(20);
/// Time between two summaries. A summary takes some 10 µs and is for people, who read slowly.
const SUMMARY: Duration = Duration::from_millis(100);

/// Memory shared by the device and its thread.
#[derive(Debug)]
struct Shared {
    /// Force on the hand, written by the session.
    wanted: Mailbox<GatedForce>,
    /// Device after the newest step of the thread, written by the thread.
    snapshot: Mailbox<Snapshot>,
    summary: Mutex<Summary>,
}

/// Facts about a device for people. At most 100 ms old while the device is used, and whole after [`Inverse3::finish`].
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Summary {
    /// Report of exchanges.
    pub report: Report,
    /// Id of the device; `None` before the first list of devices.
    pub device: Option<String>,
    /// Version of the service, if the service told one.
    pub version: Option<Version>,
    /// `true` if events of the service can arrive. Without events, nobody hears of an emergency brake.
    pub hears_events: bool,
    /// Reason why the device cannot be used.
    pub refusal: Option<Refusal>,
    /// Latest error of the connection.
    pub error: Option<String>,
}

/// Handle to the facts about a device, which stays valid after a session has taken the device.
#[derive(Clone, Debug)]
pub struct Facts(Arc<Shared>);

impl Facts {
    /// Returns the newest facts; whole once the device was dropped or finished.
    #[must_use]
    pub fn summary(&self) -> Summary {
        self.0.summary.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// An Inverse3 at a service of this machine.
///
/// The thread connects, connects anew when the connection ends, and sends forces of the session as fast as the service replies. If the session gives no force
/// for longer than the [age of a setpoint](cohaptic_device::Limits::setpoint_age), the force becomes zero. A drop of this value makes the thread stop the
/// device and end.
#[derive(Debug)]
pub struct Inverse3 {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    /// Wakes the thread: a byte in this pipe makes the other end readable.
    wake: UnixStream,
    stopper: Stopper,
    limit: f64,
    period: Duration,
    /// Time after which a snapshot is too old, although the thread called the snapshot fresh.
    age: Duration,
    clock: MonotonicClock,
}

impl Inverse3 {
    /// Starts the thread. `period`: time between two forces of the session. The thread calls `first` before its first step, for example to ask for a real-time
    /// priority. The service need not run yet.
    ///
    /// # Errors
    ///
    /// [`StartError`] for a configuration or an address that is refused, or if no thread can be started.
    pub fn start(service: SocketAddr, config: ClientConfig, period: Duration, first: impl FnOnce() + Send + 'static) -> Result<Self, StartError> {
        let (service, stopper, limits) = (local(service)?, Stopper::default(), config.limits);
        let client = Client::new(config, stopper.clone())?;
        let (wake, woken) = UnixStream::pair().map_err(StartError::Thread)?;
        for end in [&wake, &woken] {
            end.set_nonblocking(true).map_err(StartError::Thread)?;
        }
        let shared = Arc::new(Shared { wanted: Mailbox::new(), snapshot: Mailbox::new(), summary: Mutex::default() });
        let clock = MonotonicClock::start();
        let driving = Driving {
            client,
            stopper: stopper.clone(),
            shared: Arc::clone(&shared),
            clock,
            service,
            wire: None,
            events: None,
            hears_events: false,
            woken,
            seen: 0,
            is_stopping: false,
            error: None,
            told: Instant::ZERO,
        };
        let work = move || {
            first();
            driving.run();
        };
        let thread = Builder::new().name(NAME.to_owned()).spawn(work).map_err(StartError::Thread)?;
        Ok(Self { shared, thread: Some(thread), wake, stopper, limit: limits.force, period, age: limits.reading_age, clock })
    }

    /// Returns the device after the newest step of the thread; `None` before the first.
    #[must_use]
    pub fn snapshot(&self) -> Option<Snapshot> {
        let (snapshot, _) = self.shared.snapshot.read_newer(0)?;
        // A thread that hangs leaves its last snapshot behind.
        let is_fresh = snapshot.is_fresh && self.clock.now().saturating_duration_since(snapshot.at) <= self.age;
        Some(Snapshot { is_fresh, ..snapshot })
    }

    /// Returns a handle to the facts about the device.
    #[must_use]
    pub fn facts(&self) -> Facts {
        Facts(Arc::clone(&self.shared))
    }

    /// Returns whether the thread runs. A thread that has ended gives the device up for good.
    #[must_use]
    pub fn is_running(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Stops the device, waits for the end of the thread, and returns the facts about the whole run.
    pub fn finish(&mut self) -> Summary {
        self.stopper.stop();
        self.wake();
        if let Some(thread) = self.thread.take() {
            // The panic hook has printed the message of a panic in the thread.
            let _ = thread.join();
        }
        self.facts().summary()
    }

    fn wake(&self) {
        // A full pipe wakes the thread too.
        let _ = (&self.wake).write(&[0]);
    }
}

impl Drop for Inverse3 {
    fn drop(&mut self) {
        self.finish();
    }
}

impl Device for Inverse3 {
    fn description(&self) -> Description {
        Description { name: NAME.to_owned(), motions: 3, force: self.limit, period: self.period }
    }

    fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    fn read(&mut self, _now: Instant) -> Option<Reading> {
        self.snapshot()?.for_peer()
    }

    fn hold(&mut self, _now: Instant, _span: Duration, force: GatedForce) {
        self.shared.wanted.write(force);
        self.wake();
    }

    fn stop(&mut self) {
        self.stopper.stop();
        self.wake();
    }
}

/// State of the thread.
struct Driving {
    client: Client,
    stopper: Stopper,
    shared: Arc<Shared>,
    clock: MonotonicClock,
    service: SocketAddr,
    wire: Option<Wire>,
    events: Option<Wire>,
    /// `true` if events could arrive up to the end of the latest connection.
    hears_events: bool,
    woken: UnixStream,
    /// Number of the newest force taken from the session.
    seen: u64,
    is_stopping: bool,
    error: Option<String>,
    /// Instant of the latest summary.
    told: Instant,
}

impl Driving {
    fn run(mut self) {
        while !self.client.is_over() {
            self.step();
            let now = self.clock.now();
            let latest = now.saturating_add(LONGEST_WAIT);
            let until = self.client.poll_timeout().map_or(latest, |until| until.min(latest));
            let wires = [&self.wire, &self.events].into_iter().flatten().map(|wire| wire.as_fd());
            let readable: Vec<_> = wires.chain([self.woken.as_fd()]).collect();
            if let Err(error) = self.clock.block(Some(until), &readable) {
                // Without waiting, the thread would take a whole processor: it ends, and its drop stops the device.
                self.error = Some(format!("waiting for the service failed: {error}"));
                return;
            }
        }
    }

    /// Takes everything that has come, and does everything that is due.
    fn step(&mut self) {
        let now = self.clock.now();
        let mut bytes = [0; 64];
        while matches!((&self.woken).read(&mut bytes), Ok(1..)) {}
        if self.stopper.is_stopped() && !self.is_stopping {
            self.is_stopping = true;
            self.client.stop(now);
        }
        self.read(now);
        self.client.handle_timeout(now);
        // After the replies: a force goes out with its own reply still to come.
        if let Some((force, number)) = self.shared.wanted.read_newer(self.seen) {
            self.seen = number;
            self.client.hold(now, force);
        }
        while let Some(action) = self.client.poll_action(now) {
            self.carry_out(action);
        }
        let now = self.clock.now();
        self.shared.snapshot.write(self.client.snapshot(now));
        if now.saturating_duration_since(self.told) >= SUMMARY {
            self.told = now;
            self.tell();
        }
    }

    fn read(&mut self, now: Instant) {
        while let Some(wire) = &mut self.wire {
            match wire.receive() {
                Ok(Some(text)) => {
                    self.client.receive(now, &text);
                    // The actions of a text come first: a close must not be overtaken by the next text.
                    while let Some(action) = self.client.poll_action(now) {
                        self.carry_out(action);
                    }
                }
                Ok(None) => break,
                Err(error) => self.lost(now, &error),
            }
        }
        while let Some(events) = &mut self.events {
            match events.receive() {
                Ok(Some(text)) => {
                    if let Some(event) = Event::read(&text) {
                        self.client.receive_event(now, &event);
                    }
                }
                Ok(None) => break,
                Err(_) => {
                    self.events = None;
                    self.hears_events = false;
                    self.client.events_ended(now);
                }
            }
        }
    }

    fn carry_out(&mut self, action: Action) {
        match action {
            Action::Connect => {
                let connected = ask_version(self.service).and_then(|version| Ok((version, Wire::connect(self.service)?)));
                let now = self.clock.now();
                match connected {
                    Ok((version, wire)) => {
                        self.wire = Some(wire);
                        self.error = None;
                        // A service without events is used without.
                        self.events = events_of(self.service).and_then(|address| Wire::connect(address).ok());
                        self.hears_events = self.events.is_some();
                        self.client.connected(self.clock.now(), version);
                    }
                    Err(error) => {
                        self.error = Some(error.to_string());
                        self.client.closed(now);
                    }
                }
            }
            Action::Send(text) => {
                if let Some(wire) = &mut self.wire
                    && let Err(error) = wire.send(text)
                {
                    let now = self.clock.now();
                    self.lost(now, &error);
                }
            }
            Action::Close => {
                if let Some(wire) = self.wire.take() {
                    wire.close();
                }
                self.events = None;
            }
        }
    }

    fn lost(&mut self, now: Instant, error: &io::Error) {
        self.error = Some(error.to_string());
        (self.wire, self.events) = (None, None);
        self.client.closed(now);
    }

    fn tell(&self) {
        let summary = Summary {
            report: self.client.report(),
            device: self.client.device().map(str::to_owned),
            version: self.client.version(),
            hears_events: self.hears_events,
            refusal: self.client.refusal(),
            error: self.error.clone(),
        };
        *self.shared.summary.lock().unwrap_or_else(PoisonError::into_inner) = summary;
    }
}

impl Drop for Driving {
    /// Sends zero force at every end of the thread, also after a panic, and leaves the last facts behind.
    fn drop(&mut self) {
        self.stopper.stop();
        let now = self.clock.now();
        self.client.stop(now);
        while let Some(action) = self.client.poll_action(now) {
            if action != Action::Connect {
                self.carry_out(action);
            }
        }
        self.shared.snapshot.write(self.client.snapshot(now));
        self.tell();
    }
}
