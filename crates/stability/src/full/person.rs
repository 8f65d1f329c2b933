//! Persons on the general path: the operators that the simulator steps, with what an operator remembers as states.

use cohaptic_peer::operator::{Operator, Seen, View};
use cohaptic_peer::{ArmConfig, State};
use cohaptic_scene::Scene;

use crate::operators::Crossover;

/// A person who holds the device of a peer and tracks a target. The target is at the origin, because its motion moves no disturbance.
pub(super) struct Person<const A: usize> {
    operator: Operator<A>,
    /// Arm of the person.
    pub(super) arm: ArmConfig,
    /// Copy of the object that the person sees.
    pub(super) sees: Seen,
    /// Visual delay in ticks.
    lag: usize,
}

impl<const A: usize> Person<A> {
    /// Returns the person who holds the device of a peer; `None` without an operator, or with one whose law is not linear.
    pub(super) fn of(scene: &Scene, peer: usize) -> Option<Self> {
        let Crossover { arm, lag, sees, .. } = Crossover::of(scene, peer)?;
        let (config, tick) = (scene.operator(peer)?, scene.peers[peer].clock.tick);
        Some(Self { operator: Operator::new(config, tick, scene.expected_delay(peer), [0.0; A]), arm, sees, lag })
    }

    /// Returns the number of states of a person: the wanted place, and the seen places that have not come to the hand.
    pub(super) const fn states(&self) -> usize {
        A * (1 + self.lag)
    }

    /// Tells whether the wanted place moves nothing: a hand without a spring feels its velocity alone.
    pub(super) fn is_limp(&self) -> bool {
        self.arm.stiffness <= 0.0
    }

    /// Lets the person remember the states `z`: the wanted place, then the seen places, the newest first.
    pub(super) fn restore(&mut self, z: &[f64]) {
        let place = |number: usize| core::array::from_fn(|axis| z[A * number + axis]);
        let seen = (1..=self.lag).map(|age| View { position: place(age), target: [0.0; A], radius: 0.0 });
        self.operator.set_tracking(place(0), seen);
    }

    /// Writes what the person remembers to `z`, in the order of [`Person::restore`].
    pub(super) fn read(&self, z: &mut [f64]) {
        let Some((wanted, seen)) = self.operator.tracking() else { return };
        for (entry, place) in z.chunks_exact_mut(A).zip(std::iter::once(wanted).chain(seen.map(|view| view.position))) {
            entry.copy_from_slice(&place);
        }
    }

    /// Makes a tick of the person, who sees the object at `position`. Returns the wanted motion over the tick.
    pub(super) fn tick(&mut self, position: [f64; A]) -> State<A> {
        self.operator.tick(&View { position, target: [0.0; A], radius: 0.0 }, |_| [0.0; A])
    }
}
