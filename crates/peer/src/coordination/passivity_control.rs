//! Average-position coordination behind a passivity controller: time-domain passivity over networks, for any number of peers.
//!
//! Ryu, Artigas & Preusche (2010) for two ports: each peer counts the energy that its coordination force takes from its copy, tells the others, and gives
//! its copy no more than it has heard of. Each axis is by itself. With d the motion of the copy in a tick and F the force that equation (8) subtracts,
//! F·d above zero adds to Ein, below zero to Eout, and A = E0 + mean Êin − Eout is what may be given, where Êin is the newest Ein heard from each of the
//! others. Since d = d0 − c·F is known before F acts, F is held to −F·d ≤ A by F± = (d0 ± √(d0² + 4·c·A))/(2·c). In the publication F·v·h stands for F·d
//! and is corrected afterwards, which gives energy away at every tick.

use alloc::vec;
use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters, hear_energy};
use super::{Command, Context, LawForm, LawParameter, LawValues, Strategy};
use crate::tick::coordinate;
use crate::wire::SampleKind;
use crate::{Gains, Held, State};

/// The average-position law with its force limited to the energy at hand.
#[derive(Clone, Debug)]
pub struct PassivityControl<const A: usize> {
    /// KT and BT.
    gains: Gains,
    /// N − 1.
    others: f64,
    /// The reserve of each axis \[J\].
    reserve: f64,
    /// E0 with the reserve \[J\].
    initial: [f64; A],
    /// Ein \[J\].
    taken: [f64; A],
    /// Eout \[J\].
    given: [f64; A],
    /// The sum of Êin over the others \[J\].
    heard: [f64; A],
    /// The newest energy of each of the others \[J\].
    newest: Vec<[f64; A]>,
    /// Where the copy was and what force acted since the tick before.
    before: Option<([f64; A], [f64; A])>,
}

impl<const A: usize> ControllerKind<A> for PassivityControl<A> {
    const KIND: SampleKind = SampleKind::Energy;
    const PARAMETERS: &[LawParameter] = &[LawParameter {
        key: "reserve",
        form: LawForm::Energy,
        default: "0",
        about: "Energy that each peer may give on each axis beyond what the springs between the copies hold at the beginning",
        can_change: true,
    }];

    fn new(session: &SessionParameters<A>) -> Self {
        let gains = session.law.gains;
        let reserve = session.law.own.number(0);
        let others = session.others();
        let own = &session.initial[session.place];
        let springs = |axis: usize| -> f64 {
            let squares = session.initial.iter().map(|other| own.position[axis] - other.position[axis]).map(|apart| apart * apart);
            0.25 * gains.stiffness / others * squares.sum::<f64>()
        };
        Self {
            gains,
            others,
            reserve,
            initial: core::array::from_fn(|axis| springs(axis) + reserve),
            taken: [0.0; A],
            given: [0.0; A],
            heard: [0.0; A],
            newest: vec![[0.0; A]; session.initial.len() - 1],
            before: None,
        }
    }
}

impl<const A: usize> PassivityControl<A> {
    /// Counts the energy of the tick just over, once.
    fn settle(&mut self, own: &State<A>) {
        let Some((position, force)) = self.before.take() else { return };
        for axis in 0..A {
            let work = force[axis] * (own.position[axis] - position[axis]);
            if work > 0.0 {
                self.taken[axis] += work;
            } else {
                self.given[axis] -= work;
            }
        }
    }
}

impl<const A: usize> Strategy<A> for PassivityControl<A> {
    #[inline]
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let (own, mean) = (context.own, context.held.mean());
        self.settle(own);
        let limited = |axis: usize| {
            let wanted = coordinate(&self.gains, own.along(axis).relative_to(mean.along(axis)));
            let available = self.initial[axis] + self.heard[axis] / self.others - self.given[axis];
            let (free, compliance) = (context.ahead.free[axis], context.ahead.compliance);
            // −F·d = (c·F − d0)·F: most forces stay below what may be given, and need no root.
            if (compliance * wanted - free) * wanted <= available {
                return wanted;
            }
            let root = libm::sqrt((free * free + 4.0 * compliance * available).max(0.0));
            let (least, most) = ((free - root) / (2.0 * compliance), (free + root) / (2.0 * compliance));
            wanted.max(least).min(most)
        };
        let force = core::array::from_fn(limited);
        self.before = Some((own.position, force));
        Command { force, target: *mean }
    }

    fn needs_prediction(&self) -> bool {
        true
    }

    fn kind(&self) -> SampleKind {
        Self::KIND
    }

    /// Ein with the tick just over.
    fn extra(&mut self, _receiver: usize, own: &State<A>, _held: &Held<A>) -> [f64; A] {
        self.settle(own);
        self.taken
    }

    fn accept(&mut self, other: usize, numbers: &[f64; A]) {
        hear_energy(&mut self.heard, &mut self.newest[other], numbers);
    }

    fn set_gains(&mut self, gains: Gains) {
        self.gains = gains;
    }
    /// A reserve that has grown can be given from now on; one that has shrunk is missed.
    fn set_parameters(&mut self, own: &LawValues) {
        let more = own.number(0) - core::mem::replace(&mut self.reserve, own.number(0));
        self.initial = self.initial.map(|initial| initial + more);
    }
}
