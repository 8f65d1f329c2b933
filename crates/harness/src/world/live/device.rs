//! Devices in a person's hand.

use std::time::Duration;

use cohaptic_device::Reading;
use cohaptic_peer::{Age, Device, RestingDevice, State};
use cohaptic_units::Instant;

use super::gated::{GateStats, GatedDevice};
use super::pulled::PulledDevice;

/// Device without a simulation.
#[derive(Debug)]
pub(crate) enum UnsimulatedDevice<const A: usize> {
    /// The device rests.
    Resting(RestingDevice<A>),
    /// The device follows a hand.
    InHand(Box<HandDevice<A>>),
}

impl<const A: usize> From<RestingDevice<A>> for UnsimulatedDevice<A> {
    fn from(device: RestingDevice<A>) -> Self {
        Self::Resting(device)
    }
}

impl<const A: usize> Device<A> for UnsimulatedDevice<A> {
    fn state(&self) -> State<A> {
        match self {
            Self::Resting(device) => device.state(),
            Self::InHand(device) => device.state(),
        }
    }

    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; A]) {
        match self {
            Self::Resting(device) => device.advance(now, span, coupling_force),
            Self::InHand(device) => device.advance(now, span, coupling_force),
        }
    }
}

/// Device of a peer, at the state read last.
pub(crate) struct HandDevice<const A: usize> {
    device: Option<GatedDevice>,
    /// State read last.
    read: State<A>,
    /// Shown state at the return of the device. The shown state moves from `before` to `read`.
    before: State<A>,
    /// Share of the way from `before` to `read`, from 0 to 1.
    share: f64,
    /// Simulated device at the pointer's arm. `None` if `device` is a real device.
    pulled: Option<PulledDevice<A>>,
}

impl<const A: usize> HandDevice<A> {
    /// Returns a device at rest at `state`. `None` for a never present device.
    pub(crate) const fn new(device: Option<GatedDevice>, state: State<A>) -> Self {
        Self { device, read: state, before: state, share: 1.0, pulled: None }
    }

    /// Returns a simulated device pulled by a pointer. `None` for a pointer without readings.
    pub(crate) fn pulling(pointer: Option<GatedDevice>, pulled: PulledDevice<A>) -> Self {
        let state = pulled.state();
        Self { pulled: Some(pulled), ..Self::new(pointer, state) }
    }

    /// Reads the device along the axes of the scene, at the time `clock` of the clock of the session. Returns `None` if there is no reading, or if a number is
    /// not finite.
    pub(crate) fn read(&mut self, now: Instant, clock: Instant, axes: usize) -> Option<State<A>> {
        // A scene of two axes is simulated along three, and the third axis rests.
        let first = |values: [f64; 3]| core::array::from_fn(|axis| values.get(axis).copied().filter(|_| axis < axes).unwrap_or(0.0));
        self.device.as_mut()?.read(now, clock, |Reading { position, velocity }| {
            Some(State { position: first(position), velocity: first(velocity) }).filter(State::is_finite)
        })
    }

    /// Stores a reading.
    pub(crate) const fn set(&mut self, state: State<A>) {
        self.read = state;
    }

    /// Makes the shown state the start of the way to later readings.
    pub(crate) fn keep(&mut self) {
        self.before = self.shown();
    }

    /// Sets the share of the way to the reading and the weight of the hand. Returns the factor of the coupling.
    pub(crate) const fn set_age(&mut self, age: Age) -> f64 {
        self.share = age.share;
        match &mut self.pulled {
            // The simulated device stays coupled: only the arm lets go.
            Some(pulled) => {
                pulled.set_weight(age.weight);
                1.0
            }
            None => age.weight,
        }
    }

    /// Returns the state between `before` and `read`, at `share` of the way.
    fn shown(&self) -> State<A> {
        if self.share < 1.0 {
            // Position and velocity go the same share of the way, so the shown state moves without a jump.
            let mix = |from: [f64; A], to: [f64; A]| core::array::from_fn(|axis| from[axis] + self.share * (to[axis] - from[axis]));
            State { position: mix(self.before.position, self.read.position), velocity: mix(self.before.velocity, self.read.velocity) }
        } else {
            self.read
        }
    }

    /// Stops the device at the end of the session.
    pub(crate) fn stop(&mut self, now: Instant) {
        if let Some(device) = &mut self.device {
            device.stop(now);
        }
    }

    /// Returns the counts of the gate; `None` for a never present device.
    pub(crate) fn gate_stats(&self) -> Option<&GateStats> {
        self.device.as_ref().map(GatedDevice::stats)
    }
}

impl<const A: usize> Device<A> for HandDevice<A> {
    fn state(&self) -> State<A> {
        self.pulled.as_ref().map_or_else(|| self.shown(), PulledDevice::state)
    }

    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; A]) {
        // The state is taken before the tick moves anything: it is the state that the forces of the tick have used.
        let wanted = self.shown();
        if let Some(pulled) = &mut self.pulled {
            pulled.advance(now, span, &wanted, coupling_force);
        }
        if let Some(device) = &mut self.device {
            // The coupling force acts on the copy, and with the opposite sign on the hand.
            device.hold(now, span, core::array::from_fn(|axis| -coupling_force.get(axis).copied().unwrap_or(0.0)));
        }
    }
}

impl<const A: usize> core::fmt::Debug for HandDevice<A> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("HandDevice").field("there", &self.device.is_some()).field("read", &self.read).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_device::{Description, GatedForce, Stopper};

    use super::*;

    /// A device with a constant reading.
    struct Fixed(Reading);

    impl cohaptic_device::Device for Fixed {
        fn description(&self) -> Description {
            Description { name: "fixed".to_owned(), motions: 0, force: 0.0, period: Duration::from_millis(1) }
        }

        fn stopper(&self) -> Stopper {
            Stopper::default()
        }

        fn read(&mut self, _now: Instant) -> Option<Reading> {
            Some(self.0)
        }

        fn hold(&mut self, _now: Instant, _span: Duration, _force: GatedForce) {}
    }

    /// A scene of two axes is simulated along three. A moving third axis would change the run, but has no column in the record.
    #[test]
    fn components_beyond_the_axes_of_the_scene_are_not_looked_at() {
        for beyond in [3.0, f64::NAN] {
            let shown = Reading { position: [1.0, 2.0, beyond], velocity: [4.0, 5.0, beyond] };
            let fixed = GatedDevice::new(Box::new(Fixed(shown)), Duration::from_millis(1));
            let mut device = HandDevice::<3>::new(Some(fixed), State::REST);
            let expected = Some(State { position: [1.0, 2.0, 0.0], velocity: [4.0, 5.0, 0.0] });
            assert_eq!(device.read(Instant::ZERO, Instant::ZERO, 2), expected);
            assert_eq!(device.read(Instant::ZERO, Instant::ZERO, 3).is_some(), beyond.is_finite());
        }
    }
}
