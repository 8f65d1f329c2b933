//! A simulated device pulled by a pointer.

use std::time::Duration;

use cohaptic_peer::{Device, Hand, Signal, SimulatedDevice, State};
use cohaptic_scene::PointerSpec;
use cohaptic_units::Instant;

/// A simulated device at the end of an arm with a pointer at the opposite end. The force of the arm is constant over a tick, like the force of every hand.
#[derive(Clone, Debug)]
pub(crate) struct PulledDevice<const A: usize> {
    body: SimulatedDevice<A>,
    arm: PointerSpec,
    /// Weight of the arm's force, from 0 to 1.
    weight: f64,
}

impl<const A: usize> PulledDevice<A> {
    pub(crate) const fn new(body: SimulatedDevice<A>, arm: PointerSpec) -> Self {
        Self { body, arm, weight: 0.0 }
    }

    pub(crate) fn state(&self) -> State<A> {
        self.body.state()
    }

    pub(crate) const fn set_weight(&mut self, weight: f64) {
        self.weight = weight;
    }

    /// Moves the device to the next tick, with the pointer at `wanted`.
    pub(crate) fn advance(&mut self, now: Instant, span: Duration, wanted: &State<A>, coupling_force: [f64; A]) {
        // The pull counts as the force of a hand, so the device moves by the same equations as in a simulation.
        let force = self.pull(wanted);
        let padded = core::array::from_fn(|axis| force.get(axis).copied().unwrap_or(0.0));
        self.body.set_hand(Some(&Hand::Force(Signal::Constant(padded))));
        self.body.advance(now, span, coupling_force);
    }

    /// Returns w·(stiffness·(x_wanted − x_device) + damping·(v_wanted − v_device)) \[N\], at most w times the force limit in length.
    fn pull(&self, wanted: &State<A>) -> [f64; A] {
        let State { position, velocity } = self.body.state();
        let PointerSpec { stiffness, damping, force_limit, .. } = self.arm;
        let whole: [f64; A] =
            core::array::from_fn(|axis| stiffness * (wanted.position[axis] - position[axis]) + damping * (wanted.velocity[axis] - velocity[axis]));
        let length = whole.iter().map(|force| force * force).sum::<f64>().sqrt();
        // The limit applies to the whole force, so its direction stays.
        let factor = if length > force_limit { self.weight * (force_limit / length) } else { self.weight };
        whole.map(|force| factor * force)
    }
}

#[cfg(test)]
mod tests {
    use cohaptic_peer::{Clock, DeviceConfig, Drift, Integrator};

    use super::*;

    const TICK: Duration = Duration::from_millis(1);

    fn pulled(arm: PointerSpec) -> PulledDevice<2> {
        let clock = Clock { tick: TICK, offset: Duration::ZERO, drift: Drift::default() };
        let device = DeviceConfig { mass: 0.1, damping: 5.0 };
        PulledDevice::new(SimulatedDevice::new(device, None, State::REST, Integrator::Exact, &clock), arm)
    }

    #[test]
    fn the_arm_pulls_with_its_share_of_spring_and_damper_and_never_beyond_the_limit() {
        let mut device = pulled(PointerSpec::default());
        let wanted = State { position: [0.01, 0.0], velocity: [0.0, 0.1] };
        assert!(device.pull(&wanted).iter().all(|force| *force == 0.0), "nobody holds it");
        device.set_weight(0.5);
        // Half of 400 N/m over 10 mm, and half of 20 N·s/m at 0.1 m/s.
        let force = device.pull(&wanted);
        assert!((force[0] - 2.0).abs() < 1e-12 && (force[1] - 1.0).abs() < 1e-12, "{force:?}");
        device.set_weight(1.0);
        let force = device.pull(&State { position: [3.0, 4.0], velocity: [0.0; 2] });
        assert!((force[0] - 12.0).abs() < 1e-12 && (force[1] - 16.0).abs() < 1e-12, "20 N towards the pointer: {force:?}");
    }

    /// Without coupling the device comes to rest at the pointer. 0.1·s² + (5 + 20)·s + 400 = 0 has the roots −17.2 and −232.8 per second. After a second,
    /// 232.8/(232.8 − 17.2)·e^(−17.2) of 30 mm is left: 1.1 nm.
    #[test]
    fn a_device_comes_to_its_pointer_without_overshoot() {
        let mut device = pulled(PointerSpec::default());
        device.set_weight(1.0);
        let wanted = State { position: [0.03, -0.01], velocity: [0.0; 2] };
        let mut before = 0.0;
        for tick in 0..1000 {
            device.advance(Instant::from_nanos(tick * 1_000_000), TICK, &wanted, [0.0; 2]);
            let x = device.state().position[0];
            assert!(x >= before && x <= 0.03 + 1e-12, "{x} after {before}");
            before = x;
        }
        let apart = [device.state().position[0] - 0.03, device.state().position[1] + 0.01];
        assert!(apart.iter().all(|apart| apart.abs() < 1.2e-9), "{apart:?}");
    }
}
