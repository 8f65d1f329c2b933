//! Passive set-position modulation: a spring to a set-position that jumps to the mean of the others only as far as there is energy for the jump.
//!
//! Lee & Huang (2010), with a switch at each tick. Each axis is by itself. The copy has the damping bO + β, of whose work an energy tank E gets what the
//! held force does not lose by being held, (β/h − KT/2)·d² a tick with d the motion of the copy in it. At a tick the spring KT to the set-position y
//! becomes one to the mean of the others as far as S = E + KT/2·(x − y)² allows: y is the mean within r = √(2·S/KT) of x, and E is the rest. Above
//! its ceiling the tank flows over into an energy e that samples carry, and that each of the others gets a share of.

use alloc::vec;
use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters, hear_energy};
use super::{Command, Context, LawForm, LawParameter, LawParameters, LawValues, Strategy, UsedGains};
use crate::wire::SampleKind;
use crate::{Gains, Held, State};

/// The spring, its set-position and its energy tank.
#[derive(Clone, Debug)]
pub struct SetPosition<const A: usize> {
    /// KT.
    stiffness: f64,
    /// h \[s\].
    period: f64,
    /// β/h − KT/2 [N/m] in the tick just over and in the one that comes.
    gain: f64,
    next_gain: f64,
    /// N − 1.
    others: f64,
    /// The most that a tank holds \[J\].
    ceiling: f64,
    /// y \[m\].
    set: [f64; A],
    /// E \[J\].
    tank: [f64; A],
    /// e, what has flown over \[J\].
    surplus: [f64; A],
    /// The sum of ê over the others \[J\], and the part of its mean that the tank has got.
    heard: [f64; A],
    got: [f64; A],
    /// The newest energy of each of the others \[J\].
    newest: Vec<[f64; A]>,
    /// Where the copy was at the tick before.
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
            about: "The most energy that a tank holds; the rest goes to the others",
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

/// β/h − KT/2: what the tank gets for the square of a motion [N/m].
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
            let moved = self.before.map_or(0.0, |before| x - before[axis]);
            let heard = self.heard[axis] / self.others;
            let stored = self.tank[axis] + (self.gain * (moved * moved) + (heard - self.got[axis]));
            self.got[axis] = heard;
            let apart = x - self.set[axis];
            let all = stored + half * (apart * apart);
            let wanted = x - mean.position[axis];
            // Most of the time there is energy for the whole way, and no need of a root.
            let set = if half * (wanted * wanted) <= all {
                mean.position[axis]
            } else {
                let reach = libm::sqrt(2.0 * all.max(0.0) / self.stiffness);
                mean.position[axis].max(x - reach).min(x + reach)
            };
            let apart = x - set;
            let left = all - half * (apart * apart);
            let over = (left - self.ceiling).max(0.0);
            self.surplus[axis] += over;
            self.tank[axis] = left - over;
            self.set[axis] = set;
            command.force[axis] = self.stiffness * apart;
            command.target.position[axis] = set;
        }
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

    /// Scenes in which the timeline changes gains are refused: a jump of the stiffness is a jump of the energy.
    fn set_gains(&mut self, _gains: Gains) {}
    /// What the tank holds above a ceiling that has fallen goes to the others at the next tick.
    fn set_parameters(&mut self, own: &LawValues) {
        self.next_gain = gain(own.number(0), self.period, self.stiffness);
        self.ceiling = own.number(2);
    }
}
