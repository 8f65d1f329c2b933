//! A law of the registry as the strategy of a peer.

use alloc::vec;
use alloc::vec::Vec;

use super::{BuiltIn, Command, Context, Coordination, Law, LawParameters, Observation, Strategy};
use crate::{Gains, State};

/// A law of the registry with what it remembers.
#[derive(Clone, Debug)]
pub struct LawStrategy<const A: usize> {
    coordination: Coordination,
    parameters: LawParameters,
    law: BuiltIn,
    horizon: Option<f64>,
    /// What the law remembers along each axis, one axis after another.
    memory: Vec<f64>,
}

impl<const A: usize> LawStrategy<A> {
    /// The strategy of one peer, with nothing remembered.
    ///
    /// # Panics
    ///
    /// If the strategy of the registry is not a law.
    #[must_use]
    pub fn new(coordination: Coordination, parameters: LawParameters) -> Self {
        let law = coordination.law(&parameters).expect("the strategy is a law");
        let memory = vec![0.0; A * Law::<f64>::memory(&law)];
        Self { coordination, parameters, horizon: Law::<f64>::horizon(&law), law, memory }
    }
}

impl<const A: usize> Strategy<A> for LawStrategy<A> {
    #[inline]
    fn command(&mut self, context: &Context<'_, A>) -> Command<A> {
        let mut command = Command { force: [0.0; A], target: State::REST };
        let remembered = self.memory.len() / A;
        let lead = self.horizon.map_or([0.0; A], |horizon| context.held.lead(context.local_time, horizon));
        for (axis, lead) in lead.into_iter().enumerate() {
            let seen = Observation { own: context.own.along(axis), mean: context.held.mean().along(axis), lead };
            command.force[axis] = self.law.force(&seen, &mut self.memory[axis * remembered..(axis + 1) * remembered]);
            command.target.set_along(axis, self.law.target(&seen));
        }
        command
    }

    fn needs_ages(&self) -> bool {
        self.horizon.is_some()
    }

    fn set_gains(&mut self, gains: Gains) {
        self.parameters.gains = gains;
        self.law = self.coordination.law(&self.parameters).expect("it was a law when the strategy was made");
    }

    fn memory(&self) -> &[f64] {
        &self.memory
    }

    fn set_memory(&mut self, memory: &[f64]) {
        self.memory.copy_from_slice(memory);
    }
}
