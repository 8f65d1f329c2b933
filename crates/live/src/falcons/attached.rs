//! A Falcon as the device of a peer in a session.

use std::time::Duration;

use cohaptic_falcon::device::{FalconDevice, Snapshot, Stopper};
use cohaptic_falcon::driver::Phase;
use cohaptic_harness::live::LiveDevice;
use cohaptic_peer::{Device as _, State};
use cohaptic_units::Instant;

use super::hand::Beginning;

/// A device that has said nothing new for so long does not answer. Its own driver has switched its force off long before.
const OLD: Duration = Duration::from_millis(20);

/// How far a Falcon is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Readiness {
    /// Whether it takes part: homed, and its user has switched forces on.
    pub is_ready: bool,
    /// Whether it is simulated.
    pub is_simulated: bool,
    /// Where it stands.
    pub phase: Phase,
}

#[derive(Debug)]
pub(super) struct Attached<const A: usize> {
    device: FalconDevice<A>,
    /// Of a simulated one, when the session begins for its hand.
    beginning: Option<Beginning>,
    /// The time on the device's clock of its newest snapshot, and when that came.
    newest: Option<(Instant, Instant)>,
}

impl<const A: usize> Attached<A> {
    pub(super) const fn new(device: FalconDevice<A>, beginning: Option<Beginning>) -> Self {
        Self { device, beginning, newest: None }
    }

    pub(super) fn readiness(&self) -> Readiness {
        // Its light is green only when somebody asks for force, which nobody does before the session begins.
        let (phase, is_ready) = self.device.snapshot().map_or((Phase::Silent, false), |snapshot| (snapshot.phase, snapshot.is_ready()));
        Readiness { is_ready, is_simulated: self.beginning.is_some(), phase }
    }

    pub(super) fn stopper(&self) -> Stopper {
        self.device.stopper()
    }

    /// The newest snapshot, if the device takes part and goes on saying so.
    fn answer(&mut self, now: Instant) -> Option<Snapshot> {
        let snapshot = self.device.snapshot()?;
        let came = match self.newest {
            Some((at, came)) if at == snapshot.at => came,
            _ => now,
        };
        self.newest = Some((snapshot.at, came));
        let takes_part = snapshot.is_ready() && self.device.ended().is_none();
        (takes_part && now.saturating_duration_since(came) <= OLD).then_some(snapshot)
    }
}

impl<const A: usize> LiveDevice for Attached<A> {
    fn read(&mut self, now: Instant) -> Option<State<3>> {
        let snapshot = self.answer(now);
        if let (Some(beginning), Some(snapshot)) = (&self.beginning, &snapshot) {
            beginning.begin(snapshot.at);
        }
        snapshot.map(|_| {
            let State { position, velocity } = self.device.state();
            let widen = |values: [f64; A]| core::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0));
            State { position: widen(position), velocity: widen(velocity) }
        })
    }

    fn hold(&mut self, now: Instant, span: Duration, coupling_force: [f64; 3]) {
        self.device.advance(now, span, core::array::from_fn(|axis| coupling_force.get(axis).copied().unwrap_or(0.0)));
    }
}
