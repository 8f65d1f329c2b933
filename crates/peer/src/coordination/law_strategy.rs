//! Strategy of a peer with a law of the registry.

use alloc::vec;
use alloc::vec::Vec;

use super::past::Past;
use super::{BuiltIn, Command, Context, Coordination, Law, LawParameters, LawValues, Observation, Strategy};
use crate::{Gains, State};

/// A law of the registry, with its memory.
#[derive(Clone, Debug)]
pub struct LawStrategy<const A: usize> {
    coordination: Coordination,
    parameters: LawParameters,
    law: BuiltIn,
    /// Memory of the law along each axis, one axis after another.
    memory: Vec<f64>,
    /// Own states of the latest ticks, for a law with a lag. Such a law has no other memory.
    past: Option<Past<A>>,
    /// `true` if the law has neither a memory nor a lag, so that [`LawStrategy::at_once`] is its command.
    is_of_the_present: bool,
}

impl<const A: usize> LawStrategy<A> {
    /// Returns the strategy of one peer, with an empty memory.
    ///
    /// # Panics
    ///
    /// If `coordination` is not a law.
    #[must_use]
    pub fn new(coordination: Coordination, parameters: LawParameters) -> Self {
        let law = coordination.law(&parameters).expect("the strategy is a law");
        let memory = vec![0.0; A * Law::<f64>::memory(&law)];
        let lag = Law::<f64>::lag(&law);
        debug_assert!(lag == 0 || memory.is_empty(), "a law that looks back remembers nothing else");
        let past = (lag > 0).then(|| Past::new(lag));
        let is_of_the_present = memory.is_empty() && past.is_none();
        Self { coordination, parameters, law, memory, past, is_of_the_present }
    }

    /// Returns whether the law has neither a memory nor a lag, so that [`LawStrategy::at_once`] is its command.
    #[inline(always)]
    pub(super) const fn is_of_the_present(&self) -> bool {
        self.is_of_the_present
    }

    /// Returns the command of a law without memory and lag.
    #[inline(always)]
    pub(super) fn at_once(&self, context: &Context<'_, A>) -> Command<A> {
        let mut command = Command { force: [0.0; A], target: State::REST };
        let lead = context.held.lead();
        for (axis, lead) in lead.into_iter().enumerate() {
            let own = context.own.along(axis);
            let (force, target) = self.law.command(&Observation { own, past: own, mean: context.held.mean().along(axis), lead }, &mut []);
            command.force[axis] = force;
            command.target.set_along(axis, target);
        }
        command
    }
}

impl<const A: usize> Strategy<A> for LawStrategy<A> {
    #[inline]
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let mut command = Command { force: [0.0; A], target: State::REST };
        // `new` made the memory of equal parts, one for each axis.
        let remembered = self.memory.len() / A;
        let lead = context.held.lead();
        // Without a lag the past is the present; with a lag, the exchange returns the oldest state and stores the present one.
        let past = self.past.as_mut().map_or(*context.own, |past| past.exchange(context.own));
        for (axis, lead) in lead.into_iter().enumerate() {
            let seen = Observation { own: context.own.along(axis), past: past.along(axis), mean: context.held.mean().along(axis), lead };
            let memory = &mut self.memory[axis * remembered..(axis + 1) * remembered];
            let (force, target) = self.law.command(&seen, memory);
            command.force[axis] = force;
            command.target.set_along(axis, target);
        }
        command
    }

    fn horizon(&self) -> Option<f64> {
        Law::<f64>::horizon(&self.law)
    }

    fn set_gains(&mut self, gains: Gains) {
        self.parameters.gains = gains;
        // The coefficients are computed from gains and parameters together, so both setters make the whole law anew.
        self.law = self.coordination.law(&self.parameters).expect("it was a law when the strategy was made");
    }

    fn set_parameters(&mut self, own: &LawValues) {
        self.parameters.own = *own;
        self.set_gains(self.parameters.gains);
        // A lag above zero before and after keeps the known states. A new lag starts without states.
        match (&mut self.past, Law::<f64>::lag(&self.law)) {
            (Some(past), lag @ 1..) => past.set_lag(lag),
            (past, lag) => *past = (lag > 0).then(|| Past::new(lag)),
        }
        self.is_of_the_present = self.memory.is_empty() && self.past.is_none();
    }

    fn memory(&self) -> &[f64] {
        self.past.as_ref().map_or(&self.memory, Past::numbers)
    }

    fn set_memory(&mut self, memory: &[f64]) {
        match &mut self.past {
            Some(past) => past.set_numbers(memory),
            None => self.memory.copy_from_slice(memory),
        }
    }
}
