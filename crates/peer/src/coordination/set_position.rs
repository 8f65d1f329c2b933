//! Passive set-position modulation: a spring to a set-position, which jumps towards the mean of the other copies as far as the energy for the jump is
//! available.
//!
//! The method is that of Lee & Huang (2010), with a switch at each tick. Axes are independent. The copy has the damping bO + β. Of the work of the damper, an
//! energy tank E gets the part that the held force does not lose by being held: (β/h − KT/2)·d² per tick, where d is the motion of the copy in the tick. At a
//! tick the spring KT to the set-position y moves towards the mean of the other copies as far as S = E + KT/2·(x − y)² allows: the new y is the mean, limited
//! to the distance r = √(2·S/KT) from x, and E is the rest of S. Above its ceiling the tank flows over into an energy e, which samples carry and which is
//! shared among the other peers.

use alloc::vec;
use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters, hear_energy};
use super::{Command, Context, LawForm, LawParameter, LawParameters, LawValues, Strategy, UsedGains};
use crate::sample_kind::SampleKind;
use crate::{Gains, Held, State};

/// Spring, set-position and energy tank of a copy. Arrays are indexed by axis.
#[derive(Clone, Debug)]
pub struct SetPosition<const A: usize> {
    /// Gain KT [N/m].
    stiffness: f64,
    /// Period h of the tick \[s\].
    period: f64,
    /// β/h − KT/2 [N/m] in the tick that has ended.
    gain: f64,
    /// β/h − KT/2 [N/m] in the next tick.
    next_gain: f64,
    /// N − 1, the number of other peers.
    others: f64,
    /// Greatest energy in a tank \[J\].
    ceiling: f64,
    /// Set-position y \[m\].
    set: [f64; A],
    /// Energy E in the tank \[J\].
    tank: [f64; A],
    /// Sum e of the energy above the ceiling so far \[J\]; never falls.
    surplus: [f64; A],
    /// Sum of ê over the other peers \[J\].
    heard: [f64; A],
    /// Part of the mean of ê that the tank has already got \[J\].
    got: [f64; A],
    /// Newest energy heard from each other peer \[J\].
    newest: Vec<[f64; A]>,
    /// Position of the copy at the tick before \[m\]; `None` before the first tick.
    before: Option<[f64; A]>,
}

impl<const A: usize> ControllerKind<A> for SetPosition<A> {
    const GAINS: UsedGains = UsedGains::Stiffness;
    const KIND: SampleKind = SampleKind::Energy;
    const PARAMETERS: &[LawParameter] = &[
        LawParameter {
            key: "damping",
            form: LawForm::Damping,
            default: "10",
            about: "Damping of each copy towards ground, beta, which fills the tank",
            can_change: true,
        },
        LawParameter {
            key: "tank",
            form: LawForm::Energy,
            default: "0.01",
            about: "Energy in the tank of each axis at the beginning",
            can_change: false,
        },
        LawParameter {
            key: "ceiling",
            form: LawForm::Energy,
            default: "0.01",
            about: "Largest energy that a tank holds; energy beyond goes to the other peers",
            can_change: true,
        },
    ];

    fn damping(parameters: &LawParameters) -> f64 {
        parameters.own.number(0)
    }

    fn new(session: &SessionParameters<A>) -> Self {
        let energy = |place: usize| session.law.own.number(place);
        let (stiffness, others) = (session.law.gains.stiffness, session.others());
        let mean = |axis: usize| {
            // Before the first samples arrive, the set-position is the mean of the other initial positions.
            let rest = session.initial.iter().enumerate().filter(|(place, _)| *place != session.place);
            rest.map(|(_, other)| other.position[axis]).sum::<f64>() / others
        };
        let period = session.law.tick.as_secs_f64();
        let gain = gain(Self::damping(&session.law), period, stiffness);
        Self {
            stiffness,
            period,
            gain,
            next_gain: gain,
            others,
            ceiling: energy(2),
            set: core::array::from_fn(mean),
            tank: [energy(1); A],
            surplus: [0.0; A],
            heard: [0.0; A],
            got: [0.0; A],
            newest: vec![[0.0; A]; session.initial.len() - 1],
            before: None,
        }
    }
}

/// Returns β/h − KT/2, the energy of the tank per square of a motion [N/m].
fn gain(damping: f64, period: f64, stiffness: f64) -> f64 {
    damping / period - 0.5 * stiffness
}

impl<const A: usize> Strategy<A> for SetPosition<A> {
    #[inline]
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let (own, mean) = (context.own, context.held.mean());
        let half = 0.5 * self.stiffness;
        let mut command = Command { force: [0.0; A], target: *mean };
        for axis in 0..A {
            let x = own.position[axis];
            // Income of the tank since the tick before: the damper's share, and the growth of the mean surplus.
            let moved = self.before.map_or(0.0, |before| x - before[axis]);
            let heard = self.heard[axis] / self.others;
            let stored = self.tank[axis] + (self.gain * (moved * moved) + (heard - self.got[axis]));
            self.got[axis] = heard;
            // The whole energy of the spring is available for the new set-position.
            let apart = x - self.set[axis];
            let all = stored + half * (apart * apart);
            let wanted = x - mean.position[axis];
            // Most of the time the energy is enough for the whole way, and no root is needed.
            let set = if half * (wanted * wanted) <= all {
                mean.position[axis]
            } else {
                let reach = libm::sqrt(2.0 * all.max(0.0) / self.stiffness);
                mean.position[axis].max(x - reach).min(x + reach)
            };
            let apart = x - set;
            let left = all - half * (apart * apart);
            // Energy above the ceiling leaves the tank, so that a long rest does not store energy for a jump.
            let over = (left - self.ceiling).max(0.0);
            self.surplus[axis] += over;
            self.tank[axis] = left - over;
            self.set[axis] = set;
            command.force[axis] = self.stiffness * apart;
            command.target.position[axis] = set;
        }
        // A new β acts in the body from this tick on, so it counts for the motion that the next tick measures.
        self.before = Some(own.position);
        self.gain = self.next_gain;
        command
    }

    fn kind(&self) -> SampleKind {
        Self::KIND
    }

    fn extra(&mut self, _receiver: usize, _own: &State<A>, _held: &Held<A>) -> [f64; A] {
        self.surplus
    }

    fn accept(&mut self, other: usize, numbers: &[f64; A]) {
        hear_energy(&mut self.heard, &mut self.newest[other], numbers);
    }

    /// No effect. Scenes whose timeline changes gains are refused for this strategy, because a jump of the stiffness is a jump of the energy.
    fn set_gains(&mut self, _gains: Gains) {}
    /// Sets β and the ceiling. Energy above a lowered ceiling goes to the other peers at the next tick.
    fn set_parameters(&mut self, own: &LawValues) {
        self.next_gain = gain(own.number(0), self.period, self.stiffness);
        self.ceiling = own.number(2);
    }
}
