//! A device with a thread of its own.

use core::cell::Cell;
use core::sync::atomic::{AtomicBool, Ordering};
use core::time::Duration;
use std::io;
use std::sync::{Arc, OnceLock};
use std::thread::{Builder, JoinHandle};

use cohaptic_peer::{Device, State};
use cohaptic_units::Instant;
use thiserror::Error;

use super::mailbox::Mailbox;
use super::turn::{Turns, state};
use super::{DeviceConfig, DeviceConfigError, Snapshot};
use crate::driver::DriverError;
use crate::kinematics::Triple;
use crate::transport::Transport;

/// What peer and thread share.
#[derive(Debug)]
struct Shared {
    /// From the peer: the force on the grip \[N\].
    wanted: Mailbox<Triple>,
    /// From the thread.
    snapshot: Mailbox<Snapshot>,
    stop: AtomicBool,
    ended: OnceLock<Ended>,
}

/// How the thread ended.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
pub enum Ended {
    /// It was told to stop, and did so in good order.
    #[error("stopped")]
    Stopped,
    /// The driver could not go on.
    #[error(transparent)]
    Failed(DriverError),
}

/// A Falcon that somebody's hand moves, driven by a thread.
///
/// The thread exchanges packets every period and reads what the peer last wanted; if the peer wants nothing new for longer than the
/// [age of a setpoint](crate::safety::Limits::setpoint_age), force goes to zero. When this is dropped, the thread stops the device in good order and ends.
///
/// [`Device::state`] is taken when it is first asked for after a tick, and stays the same until the next [`Device::advance`].
#[derive(Debug)]
pub struct FalconDevice<const A: usize> {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    config: DeviceConfig<A>,
    latched: Cell<Option<State<A>>>,
    last: Cell<State<A>>,
}

impl<const A: usize> FalconDevice<A> {
    /// Opens the driver and starts the thread. The device begins at the origin, at rest, until it is homed.
    ///
    /// # Errors
    ///
    /// [`StartError`].
    pub fn start<T: Transport + Send + 'static>(transport: T, config: DeviceConfig<A>) -> Result<Self, StartError> {
        Self::start_with(transport, config, || {})
    }

    /// The same; the thread does `first` before anything else: to ask for a real-time priority, say.
    ///
    /// # Errors
    ///
    /// [`StartError`].
    pub fn start_with<T: Transport + Send + 'static>(
        transport: T,
        config: DeviceConfig<A>,
        first: impl FnOnce() + Send + 'static,
    ) -> Result<Self, StartError> {
        let config = config.checked()?;
        let turns = Turns::open(transport, config)?;
        let shared = Arc::new(Shared { wanted: Mailbox::new(), snapshot: Mailbox::new(), stop: AtomicBool::new(false), ended: OnceLock::new() });
        let theirs = Arc::clone(&shared);
        let work = move || {
            first();
            let ended = run(turns, &theirs);
            // It is set only here.
            let _ = theirs.ended.set(ended);
        };
        let thread = Builder::new().name("falcon".to_owned()).spawn(work).map_err(StartError::Thread)?;
        Ok(Self { shared, thread: Some(thread), config, latched: Cell::new(None), last: Cell::new(State::REST) })
    }

    /// The device after its last exchange; `None` before the first.
    #[must_use]
    pub fn snapshot(&self) -> Option<Snapshot> {
        self.shared.snapshot.read_newer(0).map(|(snapshot, _)| snapshot)
    }

    /// How the thread ended; `None` while it runs.
    #[must_use]
    pub fn ended(&self) -> Option<Ended> {
        self.shared.ended.get().copied()
    }

    /// Something that stops the device from elsewhere: for a handler of signals.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        Stopper(Arc::clone(&self.shared))
    }

    /// Stops the device in good order, waits until that is done, and says how the thread ended. `None` if it panicked; force was switched off then too.
    pub fn stop(&mut self) -> Option<Ended> {
        self.stopper().stop();
        if let Some(thread) = self.thread.take() {
            // What a panic said was printed by the thread.
            let _ = thread.join();
        }
        self.ended()
    }
}

impl<const A: usize> Drop for FalconDevice<A> {
    fn drop(&mut self) {
        self.stop();
    }
}

impl<const A: usize> Device<A> for FalconDevice<A> {
    fn state(&self) -> State<A> {
        if let Some(state) = self.latched.get() {
            return state;
        }
        let state = self.snapshot().map_or_else(|| self.last.get(), |snapshot| state(&snapshot, &self.config, self.last.get()));
        self.latched.set(Some(state));
        self.last.set(state);
        state
    }

    fn advance(&mut self, _now: Instant, _span: Duration, coupling_force: [f64; A]) {
        self.shared.wanted.write(self.config.axes.to_device(coupling_force.map(|part| -part)));
        self.latched.set(None);
    }
}

/// Stops a device from elsewhere.
#[derive(Clone, Debug)]
pub struct Stopper(Arc<Shared>);

impl Stopper {
    /// Tells the thread to stop the device in good order, and does not wait for it.
    pub fn stop(&self) {
        self.0.stop.store(true, Ordering::Release);
    }
}

fn run<T: Transport, const A: usize>(mut turns: Turns<T, A>, shared: &Shared) -> Ended {
    let mut seen = 0;
    let ended = loop {
        if shared.stop.load(Ordering::Acquire) {
            turns.driver.stop();
            break Ended::Stopped;
        }
        if let Some((wanted, number)) = shared.wanted.read_newer(seen) {
            seen = number;
            turns.want(wanted);
        }
        if let Err(error) = turns.exchange() {
            // Zero force to whatever still listens.
            turns.driver.stop();
            break Ended::Failed(error);
        }
        shared.snapshot.write(turns.snapshot());
        turns.pace();
    };
    shared.snapshot.write(turns.snapshot());
    ended
}

/// The device could not be started.
#[derive(Debug, Error)]
pub enum StartError {
    /// A number of the configuration makes no sense.
    #[error(transparent)]
    Config(#[from] DeviceConfigError),
    /// The driver could not be opened.
    #[error(transparent)]
    Driver(#[from] DriverError),
    /// There is no thread for it.
    #[error("no thread for the device: {0}")]
    Thread(io::Error),
}
