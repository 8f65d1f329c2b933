//! Laws with coefficients for eight lanes.

use std::mem::discriminant;

use cohaptic_peer::coordination::{BuiltIn, Coefficients, Law};

use super::Lanes;

/// Law with coefficients for eight lanes, by its own type.
pub(in crate::arrays) trait LawOfLanes: Coefficients<Coefficient = Lanes, Of<f64>: Law<f64>> {
    /// Returns the law of one lane.
    #[inline(always)]
    fn of_lane(&self, lane: usize) -> Self::Of<f64> {
        self.map(|coefficient| coefficient.0[lane])
    }

    /// Returns how many numbers the law remembers along each axis. A constant for most laws, so the compiler removes the code for memory.
    #[inline(always)]
    fn remembered(&self) -> usize {
        self.of_lane(0).memory()
    }

    /// Returns how many ticks the law looks back.
    #[inline(always)]
    fn looks_back(&self) -> usize {
        self.of_lane(0).lag()
    }
}

impl<L: Coefficients<Coefficient = Lanes, Of<f64>: Law<f64>>> LawOfLanes for L {}

/// Combines the laws of runs into one law of eight lanes. All laws must be of the same kind; lane l gets the coefficients of run l modulo the number of runs.
pub(in crate::arrays) fn law_of_lanes(laws: &[BuiltIn]) -> BuiltIn<Lanes> {
    let coefficients = |law: &BuiltIn| {
        let mut all = Vec::new();
        let _ = law.map(|coefficient| all.push(*coefficient));
        all
    };
    debug_assert!(laws.iter().all(|law| discriminant(law) == discriminant(&laws[0])), "runs side by side have one law");
    let each: Vec<Vec<f64>> = laws.iter().map(coefficients).collect();
    let mut place = 0..;
    laws[0].map(|_| {
        let place = place.next().unwrap_or_default();
        Lanes(std::array::from_fn(|lane| each[lane % laws.len()][place]))
    })
}

/// Returns the remembered numbers of one lane.
#[inline(always)]
pub(super) fn memory_of_lane(memory: &mut [f64], remembered: usize, lane: usize) -> &mut [f64] {
    if remembered > 0 { &mut memory[lane * remembered..(lane + 1) * remembered] } else { &mut [] }
}
