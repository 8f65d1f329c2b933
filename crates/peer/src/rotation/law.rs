//! Coordination laws on rotations.
//!
//! The torque towards the mean of the other copies has a part of the springs and a part of the dampers, about each axis of the body. A law with gains of 1
//! takes these two parts in place of a difference of positions and a difference of velocities. The function that smooths a force, or makes it from a state of
//! the past, then does the same with a torque.
//!
//! A law remembers torques in body axes and attitudes, and both are independent of the axes of the world. A torque made from an earlier attitude acts about
//! the present body axes, as do a torque held over a tick and a torque applied one tick late.

use alloc::collections::VecDeque;
use alloc::vec;
use alloc::vec::Vec;
use core::array::from_fn;

use super::alignment::aligning_parts;
use super::{Matrix3, Triple};
use crate::coordination::{BuiltIn, Law, Observation};
use crate::{Gains, Motion};

/// A law with a memory or a lag, and its state.
#[derive(Clone, Debug)]
pub(super) struct TurnLaw {
    law: BuiltIn,
    /// Memory of the law about each axis, one axis after another.
    memory: Vec<f64>,
    /// L, the age of the own attitude that the law uses \[ticks\].
    lag: usize,
    /// R and ω at the latest ticks, the oldest first. Before the first tick, the attitude of the first tick counts.
    past: VecDeque<(Matrix3, Triple)>,
}

impl TurnLaw {
    /// Returns a law with gains of 1 and an empty memory.
    pub(super) fn new(law: BuiltIn) -> Self {
        Self { memory: vec![0.0; 3 * Law::<f64>::memory(&law)], lag: Law::<f64>::lag(&law), past: VecDeque::new(), law }
    }

    /// Returns whether the law is more than the sum of spring and damper.
    pub(super) fn is_needed(law: &BuiltIn) -> bool {
        Law::<f64>::memory(law) > 0 || Law::<f64>::lag(law) > 0
    }

    /// Sets the parameters of the law. The latest attitudes and torques stay.
    pub(super) fn set(&mut self, law: BuiltIn) {
        self.memory.resize(3 * Law::<f64>::memory(&law), 0.0);
        (self.law, self.lag) = (law, Law::<f64>::lag(&law));
        self.forget();
    }

    /// Returns τT of a tick \[N·m\]. `own`: R and ω. `mean`: M̄ and w̄.
    pub(super) fn torque(&mut self, own: (&Matrix3, Triple), mean: (&Matrix3, Triple), gains: &Gains<Triple>) -> Triple {
        self.past.push_back((*own.0, own.1));
        // The oldest kept attitude is L ticks old, or younger while fewer ticks have passed.
        let (matrix, rate) = self.past.front().copied().unwrap_or((*own.0, own.1));
        self.forget();
        let parts = |own| {
            let [spring, damper] = aligning_parts(own, mean, gains);
            from_fn(|axis| Motion { position: spring[axis], velocity: damper[axis] })
        };
        let now: Triple<Motion> = parts(own);
        // Without a lag the past equals the present, and one evaluation is enough.
        let past = if self.lag > 0 { parts((&matrix, rate)) } else { now };
        let remembered = self.memory.len() / 3;
        // The parts are already differences, so the law sees a mean at rest at zero.
        let rest = Motion { position: 0.0, velocity: 0.0 };
        from_fn(|axis| {
            let seen = Observation { own: now[axis], past: past[axis], mean: rest, lead: 0.0 };
            self.law.force(&seen, &mut self.memory[axis * remembered..(axis + 1) * remembered])
        })
    }

    /// Drops attitudes that are older than the lag.
    fn forget(&mut self) {
        while self.past.len() > self.lag {
            self.past.pop_front();
        }
    }
}

#[cfg(test)]
mod tests {
    use core::time::Duration;

    use super::*;
    use crate::Coordination;
    use crate::coordination::{LawParameters, LawValue, LawValues};
    use crate::rotation::{Attitude, aligning_torque};

    const GAINS: Gains<Triple> = Gains { stiffness: [0.3, 0.4, 0.5], damping: [0.01, 0.02, 0.0] };

    fn law(coordination: Coordination, span: Duration) -> BuiltIn {
        let mut own = LawValues::defaults(coordination.parameters());
        if !coordination.parameters().is_empty() {
            own.set(0, LawValue::Duration(span));
        }
        let (gains, tick) = (Gains { stiffness: 1.0, damping: 1.0 }, Duration::from_millis(1));
        coordination.law(&LawParameters { gains, peers: 2, tick, oldest: None, middle: None, own }).unwrap()
    }

    /// Returns the attitude of a moving body, and a mean of other bodies.
    fn seen(tick: u32) -> [(Matrix3, Triple); 2] {
        let turned = |angle: f64| {
            let mut attitude = Attitude { rate: [0.1 * angle, -1.0, angle], ..Attitude::REST };
            attitude.turn([0.2 * angle, angle, -0.4]);
            (attitude.matrix(), attitude.rate)
        };
        [turned(0.1 * f64::from(tick)), turned(1.0 - 0.03 * f64::from(tick))]
    }

    fn plain(own: u32, mean: u32) -> Triple {
        let ([(matrix, rate), _], [_, (others, turning)]) = (seen(own), seen(mean));
        aligning_torque((&matrix, rate), (&others, turning), &GAINS)
    }

    fn at(law: &mut TurnLaw, tick: u32) -> Triple {
        let [(matrix, rate), (others, turning)] = seen(tick);
        law.torque((&matrix, rate), (&others, turning), &GAINS)
    }

    #[test]
    fn a_law_that_remembers_nothing_gives_the_torque_to_the_bit() {
        for coordination in [Coordination::AveragePosition, Coordination::ProportionalDerivative, Coordination::Extrapolated, Coordination::LocalLag]
        {
            let law = law(coordination, Duration::ZERO);
            assert!(!TurnLaw::is_needed(&law));
            let mut law = TurnLaw::new(law);
            (0..9).for_each(|tick| assert_eq!(at(&mut law, tick), plain(tick, tick)));
        }
    }

    #[test]
    fn a_torque_is_made_from_the_attitude_of_the_past_also_when_the_lag_changes() {
        let mut turn = TurnLaw::new(law(Coordination::LocalLag, Duration::from_millis(3)));
        for tick in 0..20_u32 {
            assert_eq!(at(&mut turn, tick), plain(tick.saturating_sub(3), tick), "{tick}");
        }
        turn.set(law(Coordination::LocalLag, Duration::from_millis(5)));
        // Three ticks before the change are known.
        for tick in 20..30_u32 {
            assert_eq!(at(&mut turn, tick), plain((tick - 5).max(17), tick), "{tick}");
        }
        turn.set(law(Coordination::LocalLag, Duration::from_millis(1)));
        assert_eq!(at(&mut turn, 30), plain(29, 30));
    }

    /// The smoothed torque is T(k) = a·T(k − 1) + (1 − a)·τ(k) with a = e^(−Tc/lag).
    #[test]
    fn a_torque_is_smoothed_in_body_axes() {
        let mut turn = TurnLaw::new(law(Coordination::SmoothedAveragePosition, Duration::from_millis(4)));
        let (kept, mut expected) = (libm::exp(-0.25), [0.0; 3]);
        for tick in 0..50 {
            let torque = plain(tick, tick);
            expected = from_fn(|axis| kept * expected[axis] + (1.0 - kept) * torque[axis]);
            let found = at(&mut turn, tick);
            assert!((0..3).all(|axis| (found[axis] - expected[axis]).abs() < 1e-15), "{tick}: {found:?} {expected:?}");
        }
    }
}
