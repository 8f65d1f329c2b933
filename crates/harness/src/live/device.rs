//! A device in somebody's hand.

use std::time::Duration;

use cohaptic_peer::{Age, Device, RestingDevice, State};
use cohaptic_units::Instant;

use super::pulled::PulledDevice;

/// What a live session needs of a device, or of the pointer that pulls a simulated one. Components beyond the axes of the scene are zero, and are not looked at.
pub trait LiveDevice: Send {
    /// Position and velocity in the coordinates of the scene, at the tick at `now`; called once a tick. For a peer of kind `pointer` those of the pointer. `None` if that cannot be told: there is no device, it
    /// does not answer, it is not homed. A peer whose device is silent for long lets go of the object, and takes it up again, little by little.
    fn read(&mut self, now: Instant) -> Option<State<3>>;

    /// Holds a force until the next tick, `span` after `now`: FC \[N\], which the hand feels with the opposite sign. Called once a tick, after
    /// [`LiveDevice::read`], and with zero forces when the session ends.
    fn hold(&mut self, now: Instant, span: Duration, coupling_force: [f64; 3]);
}

/// A device that nobody simulates.
#[derive(Debug)]
pub(crate) enum UnsimulatedDevice<const A: usize> {
    /// It stays where it is.
    Resting(RestingDevice<A>),
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

/// The device of a peer, where it was when it was last read.
pub(crate) struct HandDevice<const A: usize> {
    device: Option<Box<dyn LiveDevice>>,
    read: State<A>,
    /// What was felt when it came back, and how far it has come from there.
    before: State<A>,
    share: f64,
    /// The device that a pointer pulls, if a pointer is read.
    pulled: Option<PulledDevice<A>>,
}

impl<const A: usize> HandDevice<A> {
    /// `None` is a device that is never there.
    pub(crate) const fn new(device: Option<Box<dyn LiveDevice>>, state: State<A>) -> Self {
        Self { device, read: state, before: state, share: 1.0, pulled: None }
    }

    /// A pointer that pulls a simulated device; `None` is one that is never there.
    pub(crate) fn pulling(pointer: Option<Box<dyn LiveDevice>>, pulled: PulledDevice<A>) -> Self {
        let state = pulled.state();
        Self { pulled: Some(pulled), ..Self::new(pointer, state) }
    }

    /// Reads the device along the axes of the scene, and says whether that could be done. A scene of two axes is simulated along three, of which the third rests.
    pub(crate) fn read(&mut self, now: Instant, axes: usize) -> Option<State<A>> {
        let State { position, velocity } = self.device.as_mut()?.read(now)?;
        let first = |values: [f64; 3]| core::array::from_fn(|axis| values.get(axis).copied().filter(|_| axis < axes).unwrap_or(0.0));
        Some(State { position: first(position), velocity: first(velocity) }).filter(State::is_finite)
    }

    /// Takes what was read.
    pub(crate) const fn set(&mut self, state: State<A>) {
        self.read = state;
    }

    /// The share counts from the force felt until now.
    pub(crate) fn keep(&mut self) {
        self.before = self.shown();
    }

    /// How far the way to what was read is gone, and how much of the hand is felt. Gives what the coupling is to be multiplied by.
    pub(crate) const fn set_age(&mut self, age: Age) -> f64 {
        self.share = age.share;
        match &mut self.pulled {
            // The device lives here and stays coupled: it is the arm that lets go.
            Some(pulled) => {
                pulled.set_weight(age.weight);
                1.0
            }
            None => age.weight,
        }
    }

    /// What was read, after the way there from what was felt before.
    fn shown(&self) -> State<A> {
        if self.share < 1.0 {
            let mix = |from: [f64; A], to: [f64; A]| core::array::from_fn(|axis| from[axis] + self.share * (to[axis] - from[axis]));
            State { position: mix(self.before.position, self.read.position), velocity: mix(self.before.velocity, self.read.velocity) }
        } else {
            self.read
        }
    }

    pub(crate) fn let_go(&mut self, now: Instant) {
        if let Some(device) = &mut self.device {
            device.hold(now, Duration::ZERO, [0.0; 3]);
        }
    }
}

impl<const A: usize> Device<A> for HandDevice<A> {
    fn state(&self) -> State<A> {
        self.pulled.as_ref().map_or_else(|| self.shown(), PulledDevice::state)
    }

    fn advance(&mut self, now: Instant, span: Duration, coupling_force: [f64; A]) {
        let wanted = self.shown();
        if let Some(pulled) = &mut self.pulled {
            pulled.advance(now, span, &wanted, coupling_force);
        }
        if let Some(device) = &mut self.device {
            device.hold(now, span, core::array::from_fn(|axis| coupling_force.get(axis).copied().unwrap_or(0.0)));
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
    use super::*;

    /// A device that always shows this state.
    struct Fixed(State<3>);

    impl LiveDevice for Fixed {
        fn read(&mut self, _now: Instant) -> Option<State<3>> {
            Some(self.0)
        }

        fn hold(&mut self, _now: Instant, _span: Duration, _coupling_force: [f64; 3]) {}
    }

    /// A scene of two axes is simulated along three: its record has two, so that a third that moved would make another session of it.
    #[test]
    fn components_beyond_the_axes_of_the_scene_are_not_looked_at() {
        for beyond in [3.0, f64::NAN] {
            let shown = State { position: [1.0, 2.0, beyond], velocity: [4.0, 5.0, beyond] };
            let mut device = HandDevice::<3>::new(Some(Box::new(Fixed(shown))), State::REST);
            assert_eq!(device.read(Instant::ZERO, 2), Some(State { position: [1.0, 2.0, 0.0], velocity: [4.0, 5.0, 0.0] }));
            assert_eq!(device.read(Instant::ZERO, 3).is_some(), beyond.is_finite());
        }
    }
}
