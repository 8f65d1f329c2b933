//! Falcon with a thread of its own.

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

/// Memory shared by peer and thread.
#[derive(Debug)]
struct Shared {
    /// Force on the grip \[N\], written by the peer.
    wanted: Mailbox<Triple>,
    /// Device after the newest exchange, written by the thread.
    snapshot: Mailbox<Snapshot>,
    /// `true` if the thread is to stop the device and end.
    stop: AtomicBool,
    /// End of the thread, set once.
    ended: OnceLock<Ended>,
}

/// Reason for the end of the thread.
#[derive(Clone, Copy, PartialEq, Debug, Error)]
pub enum Ended {
    /// The thread was told to stop, and has stopped the device.
    #[error("stopped")]
    Stopped,
    /// The driver has failed.
    #[error(transparent)]
    Failed(DriverError),
}

/// A Falcon in a user's hand, driven by a thread.
///
/// The thread exchanges packets every period with the newest force of the peer. If the peer gives no new force for longer than the [age of a
/// setpoint](crate::safety::Limits::setpoint_age), the force becomes zero. A drop of this value makes the thread stop the device and end.
///
/// [`Device::state`] is read at the first call after a tick, and stays the same until the next [`Device::advance`].
#[derive(Debug)]
pub struct FalconDevice<const A: usize> {
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    config: DeviceConfig<A>,
    /// State of the present tick; `None` before the first call of [`Device::state`] in the tick.
    latched: Cell<Option<State<A>>>,
    /// Last state read, for a device that is no longer homed.
    last: Cell<State<A>>,
}

impl<const A: usize> FalconDevice<A> {
    /// Opens the driver and starts the thread. Until the device is homed, its state is rest at the origin.
    ///
    /// # Errors
    ///
    /// [`StartError`] if the configuration is refused, the driver cannot be opened, or no thread can be started.
    pub fn start<T: Transport + Send + 'static>(transport: T, config: DeviceConfig<A>) -> Result<Self, StartError> {
        Self::start_with(transport, config, || {})
    }

    /// Like [`start`](Self::start), but the thread calls `first` before its first exchange, for example to ask for a real-time priority.
    ///
    /// # Errors
    ///
    /// [`StartError`] if the configuration is refused, the driver cannot be opened, or no thread can be started.
    pub fn start_with<T: Transport + Send + 'static>(
        transport: T,
        config: DeviceConfig<A>,
        first: impl FnOnce() + Send + 'static,
    ) -> Result<Self, StartError> {
        let config = config.checked()?;
        // Opened here, not in the thread, so that the caller gets the error.
        let turns = Turns::open(transport, config)?;
        let shared = Arc::new(Shared { wanted: Mailbox::new(), snapshot: Mailbox::new(), stop: AtomicBool::new(false), ended: OnceLock::new() });
        let theirs = Arc::clone(&shared);
        let work = move || {
            first();
            let ended = run(turns, &theirs);
            // The cell is empty before this line, because no other code sets it.
            let _ = theirs.ended.set(ended);
        };
        let thread = Builder::new().name("falcon".to_owned()).spawn(work).map_err(StartError::Thread)?;
        Ok(Self { shared, thread: Some(thread), config, latched: Cell::new(None), last: Cell::new(State::REST) })
    }

    /// Returns the device after its last exchange; `None` before the first exchange.
    #[must_use]
    pub fn snapshot(&self) -> Option<Snapshot> {
        self.shared.snapshot.read_newer(0).map(|(snapshot, _)| snapshot)
    }

    /// Returns the reason for the end of the thread; `None` while the thread runs.
    #[must_use]
    pub fn ended(&self) -> Option<Ended> {
        self.shared.ended.get().copied()
    }

    /// Returns a handle that stops the device from another thread, for example from a handler of signals.
    #[must_use]
    pub fn stopper(&self) -> Stopper {
        Stopper(Arc::clone(&self.shared))
    }

    /// Stops the device, waits for the end of the thread, and returns the reason of the end. `None` if the thread panicked; the drop of its driver has then
    /// switched the force off.
    pub fn stop(&mut self) -> Option<Ended> {
        self.stopper().stop();
        if let Some(thread) = self.thread.take() {
            // The panic hook has printed the message of a panic in the thread.
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
        // Between the start and the first exchange there is no snapshot.
        let state = self.snapshot().map_or_else(|| self.last.get(), |snapshot| state(&snapshot, &self.config, self.last.get()));
        self.latched.set(Some(state));
        self.last.set(state);
        state
    }

    fn advance(&mut self, _now: Instant, _span: Duration, coupling_force: [f64; A]) {
        // The coupling force acts on the copy, and with the opposite sign on the grip.
        self.shared.wanted.write(self.config.axes.to_device(coupling_force.map(|part| -part)));
        self.latched.set(None);
    }
}

/// A handle that stops a device from another thread.
#[derive(Clone, Debug)]
pub struct Stopper(Arc<Shared>);

impl Stopper {
    /// Tells the thread to stop the device, and returns without waiting.
    pub fn stop(&self) {
        self.0.stop.store(true, Ordering::Release);
    }
}

/// Exchanges packets until the device is stopped or the driver fails.
fn run<T: Transport, const A: usize>(mut turns: Turns<T, A>, shared: &Shared) -> Ended {
    let mut seen = 0;
    let ended = loop {
        // The stop comes first, so that no force follows a stop that was asked before this turn.
        if shared.stop.load(Ordering::Acquire) {
            turns.driver.stop();
            break Ended::Stopped;
        }
        // Without a new force the old setpoint stays and ages, and the gate zeroes it in the end.
        if let Some((wanted, number)) = shared.wanted.read_newer(seen) {
            seen = number;
            turns.want(wanted);
        }
        if let Err(error) = turns.exchange() {
            // The device may still hear packets: zero force for it.
            turns.driver.stop();
            break Ended::Failed(error);
        }
        shared.snapshot.write(turns.snapshot());
        turns.pace();
    };
    // The last snapshot shows the stop.
    shared.snapshot.write(turns.snapshot());
    ended
}

/// Error of the start of a device.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum StartError {
    /// A number of the configuration is out of range.
    #[error(transparent)]
    Config(#[from] DeviceConfigError),
    /// The driver could not be opened.
    #[error(transparent)]
    Driver(#[from] DriverError),
    /// No thread could be started.
    #[error("no thread for the device: {0}")]
    Thread(io::Error),
}
