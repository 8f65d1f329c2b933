//! Falcon with a thread of its own.

use core::time::Duration;
use std::io;
use std::sync::{Arc, OnceLock};
use std::thread::{Builder, JoinHandle};

use cohaptic_device::{Description, Device, GatedForce, Mailbox, Reading, Stopper};
use cohaptic_units::Instant;
use thiserror::Error;

use super::turn::{Turns, description, reading};
use super::{DeviceConfig, DeviceConfigError, Snapshot};
use crate::driver::DriverError;
use crate::transport::Transport;

/// Time without a new snapshot after which a device counts as absent. The driver of the device has switched the force off long before.
const OLD: Duration = Duration::from_millis(20);

/// Memory shared by session and thread.
#[derive(Debug)]
struct Shared {
    /// Force on the hand in the axes of the peer, written by the session.
    wanted: Mailbox<GatedForce>,
    /// Device after the newest exchange, written by the thread.
    snapshot: Mailbox<Snapshot>,
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
/// The thread exchanges packets every period with the newest force of the session. If the session gives no new force for longer than the [age of a
/// setpoint](crate::safety::Limits::setpoint_age), the force becomes zero. A drop of this value makes the thread stop the device and end.
#[derive(Debug)]
pub struct FalconDevice<const A: usize> {
    shared: Arc<Shared>,
    /// Stopper of the driver's gate.
    stopper: Stopper,
    thread: Option<JoinHandle<()>>,
    config: DeviceConfig<A>,
    /// Newest snapshot that was read, and the instant of the first look at the snapshot on the clock of the reader.
    newest: Option<(Snapshot, Instant)>,
}

impl<const A: usize> FalconDevice<A> {
    /// Opens the driver and starts the thread.
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
        let stopper = turns.driver.stopper().clone();
        let shared = Arc::new(Shared { wanted: Mailbox::new(), snapshot: Mailbox::new(), ended: OnceLock::new() });
        let theirs = Arc::clone(&shared);
        let work = move || {
            first();
            let ended = run(turns, &theirs);
            // The cell is empty before this line, because no other code sets it.
            let _ = theirs.ended.set(ended);
        };
        let thread = Builder::new().name("falcon".to_owned()).spawn(work).map_err(StartError::Thread)?;
        Ok(Self { shared, stopper, thread: Some(thread), config, newest: None })
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

    /// Stops the device, waits for the end of the thread, and returns the reason of the end. `None` if the thread panicked; the drop of its driver has then
    /// switched the force off.
    pub fn stop_and_wait(&mut self) -> Option<Ended> {
        self.stopper.stop();
        if let Some(thread) = self.thread.take() {
            // The panic hook has printed the message of a panic in the thread.
            let _ = thread.join();
        }
        self.ended()
    }
}

impl<const A: usize> Drop for FalconDevice<A> {
    fn drop(&mut self) {
        self.stop_and_wait();
    }
}

impl<const A: usize> Device for FalconDevice<A> {
    fn description(&self) -> Description {
        description(&self.config)
    }

    fn stopper(&self) -> Stopper {
        self.stopper.clone()
    }

    fn read(&mut self, now: Instant) -> Option<Reading> {
        // While the thread replaces the snapshot, the snapshot before counts.
        if let Some(snapshot) = self.snapshot() {
            // A repeated time stamp is a repeated snapshot, and keeps the instant of the first appearance.
            let came = self.newest.filter(|(newest, _)| newest.at == snapshot.at).map_or(now, |(_, came)| came);
            self.newest = Some((snapshot, came));
        }
        let (snapshot, came) = self.newest.as_ref()?;
        // A device with an ended thread keeps the last snapshot, which may say that the device is ready.
        let takes_part = self.ended().is_none() && now.saturating_duration_since(*came) <= OLD;
        reading(snapshot, &self.config).filter(|_| takes_part)
    }

    fn hold(&mut self, _now: Instant, _span: Duration, force: GatedForce) {
        self.shared.wanted.write(force);
    }
}

/// Exchanges packets until the device is stopped or the driver fails.
fn run<T: Transport, const A: usize>(mut turns: Turns<T, A>, shared: &Shared) -> Ended {
    let mut seen = 0;
    let ended = loop {
        // The stop comes first, so that no force follows a stop that was asked before this turn.
        if turns.driver.stopper().is_stopped() {
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
