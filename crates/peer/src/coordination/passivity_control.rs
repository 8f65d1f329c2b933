//! Average-position coordination with a passivity controller: time-domain passivity over networks, for any number of peers.
//!
//! The method is that of Ryu, Artigas & Preusche (2010) for two ports. Each peer counts the energy that its coordination force takes from its copy, sends
//! this count to the other peers, and gives its copy no more energy than it has heard of. Axes are independent. Let d be the motion of the copy in a tick,
//! and F the force that equation (8) subtracts. F·d above zero adds to Ein, F·d below zero adds to Eout, and A = E0 + mean Êin − Eout is the available
//! energy, where Êin is the newest Ein heard from a peer. Since d = d0 − c·F is known before F acts, F is limited to −F·d ≤ A by F± = (d0 ± √(d0² +
//! 4·c·A))/(2·c). The publication uses F·v·h instead of F·d and corrects it afterwards, which gives energy away at every tick.

use alloc::vec;
use alloc::vec::Vec;

use super::session::{ControllerKind, SessionParameters, hear_energy};
use super::{Command, Context, LawForm, LawParameter, LawValues, Strategy};
use crate::gains::coordinate;
use crate::sample_kind::SampleKind;
use crate::{Gains, Held, State};

/// The average-position law, with its force limited to the available energy.
#[derive(Clone, Debug)]
pub struct PassivityControl<const A: usize> {
    /// Gains KT [N/m] and BT [N·s/m].
    gains: Gains,
    /// N − 1, the number of other peers.
    others: f64,
    /// Reserve of each axis \[J\].
    reserve: f64,
    /// E0 with the reserve \[J\], indexed by axis.
    initial: [f64; A],
    /// Ein \[J\], indexed by axis.
    taken: [f64; A],
    /// Eout \[J\], indexed by axis.
    given: [f64; A],
    /// Sum of Êin over the other peers \[J\], indexed by axis.
    heard: [f64; A],
    /// Newest energy heard from each other peer \[J\].
    newest: Vec<[f64; A]>,
    /// Position of the copy at the tick before, and the force since then; `None` once this energy is counted.
    before: Option<([f64; A], [f64; A])>,
}

impl<const A: usize> ControllerKind<A> for PassivityControl<A> {
    const KIND: SampleKind = SampleKind::Energy;
    const PARAMETERS: &[LawParameter] = &[LawParameter {
        key: "reserve",
        form: LawForm::Energy,
        default: "0",
        about: "Energy that each peer may give on each axis beyond the energy of the springs between the copies at the beginning",
        can_change: true,
    }];

    fn new(session: &SessionParameters<A>) -> Self {
        let gains = session.law.gains;
        let reserve = session.law.own.number(0);
        let others = session.others();
        let own = &session.initial[session.place];
        let springs = |axis: usize| -> f64 {
            let squares = session.initial.iter().map(|other| own.position[axis] - other.position[axis]).map(|apart| apart * apart);
            // A quarter: each of the two ends of a spring may give half of its energy ½·k·x².
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
    /// Counts the energy of the tick just over. A second call in the same tick has no effect, because the sample and the command of a tick both need the
    /// count.
    fn settle(&mut self, own: &State<A>) {
        // `take` makes the second call of a tick find nothing.
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
        // The energy of the tick just over counts first: the available energy depends on it.
        self.settle(own);
        let limited = |axis: usize| {
            let wanted = coordinate(&self.gains, own.along(axis).relative_to(mean.along(axis)));
            let available = self.initial[axis] + self.heard[axis] / self.others - self.given[axis];
            let (free, compliance) = (context.ahead.free[axis], context.ahead.compliance);
            // −F·d = (c·F − d0)·F. Most forces stay below the available energy, and need no root.
            if (compliance * wanted - free) * wanted <= available {
                return wanted;
            }
            // A can be negative by rounding, or after a reduced reserve. Both limits are then d0/(2·c), the force that takes the most energy from the copy.
            let root = libm::sqrt((free * free + 4.0 * compliance * available).max(0.0));
            let (least, most) = ((free - root) / (2.0 * compliance), (free + root) / (2.0 * compliance));
            // Between the limits the force is unchanged; beyond, the nearer limit gives exactly the available energy.
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

    /// Returns Ein with the tick just over.
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
    /// Sets the reserve. Additional reserve is available from now on; a reduced reserve reduces the available energy, also below zero.
    fn set_parameters(&mut self, own: &LawValues) {
        let more = own.number(0) - core::mem::replace(&mut self.reserve, own.number(0));
        self.initial = self.initial.map(|initial| initial + more);
    }
}
