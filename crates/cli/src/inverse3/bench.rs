//! The loop of `probe` and `watch`: a device by the wall clock, one turn per millisecond, until the task ends the loop.

use std::net::{Ipv4Addr, SocketAddr};
use std::time::Duration;

use cohaptic_device::{Device as _, Gate, Limits, Moment};
use cohaptic_inverse3::client::{ClientConfig, Snapshot, Which};
use cohaptic_inverse3::service::{Service, ServiceConfig, SwayingHand};
use cohaptic_inverse3::socket::{Inverse3, ServiceThread, StartError, Summary};
use cohaptic_realtime::{Clock as _, MonotonicClock};

use crate::arguments::WhichInverse3;
use crate::device_text::Triple;
use crate::failure::Failure;
use crate::interrupt;

/// Time between two turns.
pub(super) const PERIOD: Duration = Duration::from_millis(1);
/// Amplitudes \[m\] and frequency \[Hz\] of the swaying simulated hand.
pub(super) const SWAY: SwayingHand = SwayingHand { amplitude: [0.020, 0.015, 0.010], frequency: 0.5 };

/// The work of a command on a device, called once per turn.
pub(super) trait Task {
    /// Returns the force to put on the hand \[N\], or `None` to ask for no force.
    fn wants(&self, snapshot: &Snapshot) -> Option<Triple>;

    /// Reads the device. `at` is the time since the loop began.
    fn look(&mut self, at: Duration, snapshot: &Snapshot) -> Result<(), Failure>;
}

/// Reason for the end of the loop.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum End {
    /// The time limit has passed.
    Over,
    /// The user interrupted the command.
    Interrupted,
    /// The driver has given the device up.
    Failed,
}

impl End {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Over => "complete",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
        }
    }
}

/// Runs the loop. The device is stopped afterwards in every case. Returns the facts about the whole run.
pub(super) fn run(which: &WhichInverse3, limit: f64, most: Option<Duration>, task: &mut impl Task) -> Result<(End, Summary), Failure> {
    let failed = |error: StartError| match error {
        StartError::Remote(_) | StartError::Config(_) => Failure::Input(error.to_string()),
        StartError::Listen(..) | StartError::Thread(_) | _ => Failure::System(error.to_string()),
    };
    // Dropped after the device, because the device sends a last zero force to the service.
    let simulated = if which.simulated {
        let service = Service::new(ServiceConfig::default(), SWAY);
        Some(ServiceThread::start(service, SocketAddr::from((Ipv4Addr::LOCALHOST, 0))).map_err(failed)?)
    } else {
        None
    };
    let address = simulated.as_ref().map_or(which.service, ServiceThread::address);
    let limits = Limits { force: limit, ..Limits::DEFAULT };
    let config = ClientConfig {
        which: which.device.clone().map_or(Which::FIRST, Which::Id),
        origin: which.origin.map(|origin| origin.0),
        limits,
        ..ClientConfig::DEFAULT
    };
    let mut device = Inverse3::start(address, config, PERIOD, || {}).map_err(failed)?;
    let stopper = device.stopper();
    interrupt::before_exit(move || stopper.stop());
    let mut gate = Gate::new(limits, device.stopper()).map_err(|error| Failure::Input(error.to_string()))?;
    // Readings of the device are a result, and the loop looks for a signal before each turn.
    interrupt::has_results();
    let clock = MonotonicClock::start();
    let end = loop {
        let now = clock.now();
        let at = Duration::from_nanos(now.as_nanos());
        if interrupt::requested() {
            break End::Interrupted;
        }
        if most.is_some_and(|most| at >= most) {
            break End::Over;
        }
        if !device.is_running() {
            break End::Failed;
        }
        if let Some(snapshot) = device.snapshot() {
            let seen = snapshot.for_peer().map(|_| now);
            let wanted = task.wants(&snapshot).filter(|_| seen.is_some());
            let moment = Moment { now, ready: seen.is_some(), armed: seen.is_some(), reading_at: seen, setpoint_at: wanted.map(|_| now) };
            device.hold(now, PERIOD, gate.admit(wanted.unwrap_or_default(), &moment).force);
            task.look(at, &snapshot)?;
        }
        // A late turn is not made up for.
        let _ = clock.block(Some(now.saturating_add(PERIOD)), &[]);
    };
    Ok((end, device.finish()))
}
