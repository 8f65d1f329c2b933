//! What can be made of a value that shrinks.

use core::fmt;

/// A number that can be changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::strategies) struct Number {
    pub(in crate::strategies) value: u64,
    /// What would impair least.
    pub(in crate::strategies) goal: u64,
    /// What digits are counted in.
    pub(in crate::strategies) step: u64,
}

/// What can be made of a value.
pub(in crate::strategies) trait Space: fmt::Debug {
    type Value: Clone + PartialEq + fmt::Debug;
    type Part: Clone + fmt::Debug;
    type Form: Clone + fmt::Debug;
    type Place: Clone + fmt::Debug;

    /// How many levels of parts there are.
    const LEVELS: usize;

    /// What can be taken away at that level.
    fn parts(&self, value: &Self::Value, level: usize) -> Vec<Self::Part>;

    /// The value without these parts; `None` if that is no value.
    fn without(&self, value: &Self::Value, parts: &[Self::Part]) -> Option<Self::Value>;

    /// What might be made plainer.
    fn forms(&self, value: &Self::Value) -> Vec<Self::Form>;

    /// The value with that made plainer; `None` if it is plain, or that is no value.
    fn plainer(&self, value: &Self::Value, form: &Self::Form) -> Option<Self::Value>;

    /// Where numbers are.
    fn places(&self, value: &Self::Value) -> Vec<Self::Place>;

    /// The number there, if there is one.
    fn number(&self, value: &Self::Value, place: &Self::Place) -> Option<Number>;

    /// The value with another number there; `None` if that is no value.
    fn with_number(&self, value: &Self::Value, place: &Self::Place, number: u64) -> Option<Self::Value>;
}
