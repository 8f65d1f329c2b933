//! Watch that ends the work. The tests of `cohaptic-proofs` use this file too.

use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use cohaptic_stability::Watch;

/// Watch that counts its questions, and ends the work at question number `at`, counted from 1.
pub(crate) struct Ends {
    at: usize,
    asked: AtomicUsize,
    /// Number of expected operations, and number of operations done.
    pub(crate) operations: Mutex<(f64, f64)>,
}

impl Ends {
    pub(crate) fn at(at: usize) -> Self {
        Self { at, asked: AtomicUsize::new(0), operations: Mutex::new((0.0, 0.0)) }
    }

    pub(crate) fn asked(&self) -> usize {
        self.asked.load(Ordering::Relaxed)
    }
}

impl Watch for Ends {
    fn expects(&self, operations: f64) {
        self.operations.lock().unwrap().0 += operations;
    }

    fn done(&self, operations: f64) {
        self.operations.lock().unwrap().1 += operations;
    }

    fn stops(&self) -> bool {
        self.asked.fetch_add(1, Ordering::Relaxed) + 1 >= self.at
    }
}

/// Checks that an analysis ends wherever its watch ends the work. A first run counts the questions. Further runs end at the first, the middle and the last
/// question: each must report the end, and ask at most a few times afterwards, because each of its threads may be at a question.
#[track_caller]
pub(crate) fn ends_wherever_it_is_asked(least: usize, run: impl Fn(&Ends) -> bool) {
    let whole = Ends::at(usize::MAX);
    assert!(!run(&whole), "it ends by itself");
    let asked = whole.asked();
    assert!(asked >= least, "asked {asked} times");
    for at in [1, asked / 2, asked] {
        let ends = Ends::at(at);
        assert!(run(&ends), "ended at {at} of {asked}");
        assert!(ends.asked() <= at + 16, "{} questions, though it was ended at {at}", ends.asked());
    }
}
