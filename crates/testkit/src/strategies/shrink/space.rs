//! Interface between the search and a kind of values that shrink.

use core::fmt;

/// Number of a value that can be changed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(in crate::strategies) struct Number {
    pub(in crate::strategies) value: u64,
    /// Value of the number that impairs least.
    pub(in crate::strategies) goal: u64,
    /// Unit in which significant digits are counted.
    pub(in crate::strategies) step: u64,
}

/// Changes that shrinking can make to a value.
pub(in crate::strategies) trait Space: fmt::Debug {
    type Value: Clone + PartialEq + fmt::Debug;
    type Part: Clone + fmt::Debug;
    type Form: Clone + fmt::Debug;
    type Place: Clone + fmt::Debug;

    /// Number of levels of parts.
    const LEVELS: usize;

    /// Returns the parts of a level that can be removed.
    fn parts(&self, value: &Self::Value, level: usize) -> Vec<Self::Part>;

    /// Returns the value without the given parts, or `None` if the result is not valid.
    fn without(&self, value: &Self::Value, parts: &[Self::Part]) -> Option<Self::Value>;

    /// Returns the forms that may become plainer.
    fn forms(&self, value: &Self::Value) -> Vec<Self::Form>;

    /// Returns the value with a form made plainer. `None` if the form is plain already, or the result is not valid.
    fn plainer(&self, value: &Self::Value, form: &Self::Form) -> Option<Self::Value>;

    /// Returns the places of numbers.
    fn places(&self, value: &Self::Value) -> Vec<Self::Place>;

    /// Returns the number at a place, or `None` if the place has no number.
    fn number(&self, value: &Self::Value, place: &Self::Place) -> Option<Number>;

    /// Returns the value with another number at a place, or `None` if the result is not valid.
    fn with_number(&self, value: &Self::Value, place: &Self::Place, number: u64) -> Option<Self::Value>;
}
