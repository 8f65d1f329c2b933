//! Progress of an analysis on the terminal, and its end when the user asks for it.

use std::io::Write as _;

pub(crate) use cohaptic_answers::OPERATIONS_A_SECOND;
use cohaptic_stability::{PartCost, Watch};

use crate::interrupt;
use crate::progress::Progress;

/// What takes fewer seconds than this has no bar.
const SHORT: f64 = 1.0;

/// Of what takes more seconds than this, the cost is said before it is begun, also where nobody sees a bar.
const TOLD: f64 = 2.0;

/// The steps of the bar: millions of operations.
const STEP: f64 = 1e6;

/// Ends an analysis when the user asks for it, and shows nothing.
pub(crate) struct Interruptible;

impl Watch for Interruptible {
    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Shows how far an analysis is, if it takes long, and ends it when the user asks for it.
pub(crate) struct AnalysisWatch {
    shown: std::sync::Mutex<Shown>,
    /// The most memory of a part \[bytes\].
    most_memory: u64,
}

#[derive(Default)]
struct Shown {
    bar: Option<Progress>,
    /// Of all that was said of.
    expected: f64,
    /// Of what was done, what no step was shown for yet.
    left: f64,
}

impl AnalysisWatch {
    pub(crate) fn new(most_memory: u64) -> Self {
        Self { shown: std::sync::Mutex::default(), most_memory }
    }

    pub(crate) fn clear(&self) {
        if let Some(bar) = self.shown().bar.take() {
            bar.clear();
        }
    }

    fn shown(&self) -> std::sync::MutexGuard<'_, Shown> {
        self.shown.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Watch for AnalysisWatch {
    fn most_memory(&self) -> u64 {
        self.most_memory
    }

    fn begins(&self, cost: &PartCost) {
        if cost.operations / OPERATIONS_A_SECOND < TOLD {
            return;
        }
        // If it cannot be said, the analysis goes on all the same.
        let say = || drop(writeln!(std::io::stderr(), "note: {cost}: {}", estimate(cost.operations)));
        match &self.shown().bar {
            Some(bar) => bar.aside(say),
            None => say(),
        }
    }

    fn expects(&self, operations: f64) {
        let mut shown = self.shown();
        shown.expected += operations;
        let all = estimate(shown.expected);
        if shown.bar.is_some() || operations / OPERATIONS_A_SECOND > SHORT {
            // Its length comes on the way.
            let bar = shown.bar.get_or_insert_with(|| {
                let bar = Progress::new(0, "{bar:30} {percent:>3} %  {elapsed} passed, {msg}");
                bar.tick();
                bar
            });
            bar.expect(steps(operations));
            bar.note(format!("{all} in all"));
        }
    }

    fn done(&self, operations: f64) {
        let mut shown = self.shown();
        shown.left += operations;
        let whole = steps(shown.left);
        if let Some(bar) = shown.bar.as_ref().filter(|_| whole > 0) {
            bar.more(whole);
            shown.left = 0.0;
        }
    }

    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// How long that number of operations takes, in words.
pub(crate) fn estimate(operations: f64) -> String {
    let seconds = operations / OPERATIONS_A_SECOND;
    match seconds {
        ..1.0 => "less than a second".to_owned(),
        ..90.0 => format!("about {seconds:.0} s"),
        ..5400.0 => format!("about {:.0} min", seconds / 60.0),
        ..259_200.0 => format!("about {:.0} h", seconds / 3600.0),
        _ => format!("about {:.0} days", seconds / 86_400.0),
    }
}

/// Shows, behind a bar of another kind, how far the cells or values are that take long, and ends them when the user asks for it.
pub(crate) struct CellWatch<'a> {
    progress: &'a Progress,
    /// What a cell is called.
    name: &'static str,
    stops: &'a (dyn Fn() -> bool + Sync),
    /// How many operations the cells take that were begun, how many are done, and the largest estimate of one.
    operations: std::sync::Mutex<[f64; 3]>,
}

impl<'a> CellWatch<'a> {
    pub(crate) fn new(progress: &'a Progress, name: &'static str, stops: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self { progress, name, stops, operations: std::sync::Mutex::default() }
    }

    fn count(&self, add: [f64; 2]) {
        let mut operations = self.operations.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let [expected, done, largest] = &mut *operations;
        (*expected, *done, *largest) = (*expected + add[0], *done + add[1], largest.max(add[0]));
        if let Some(note) = note(self.name, *operations) {
            self.progress.note(note);
        }
    }
}

/// The words about cells that take long; none about others.
fn note(name: &str, [expected, done, largest]: [f64; 3]) -> Option<String> {
    let long = largest / OPERATIONS_A_SECOND > SHORT;
    long.then(|| format!("; a {name} takes {}, {:.0} % of those begun", estimate(largest), 100.0 * (done / expected).min(1.0)))
}

impl Watch for CellWatch<'_> {
    fn expects(&self, operations: f64) {
        self.count([operations, 0.0]);
    }

    fn done(&self, operations: f64) {
        self.count([0.0, operations]);
    }

    fn stops(&self) -> bool {
        (self.stops)()
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a conversion to the nearest number that there is")]
fn steps(operations: f64) -> u64 {
    (operations / STEP) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_estimate_has_the_unit_that_fits_it() {
        for (seconds, words) in
            [(0.5, "less than a second"), (12.4, "about 12 s"), (90.0, "about 2 min"), (720.0, "about 12 min"), (7200.0, "about 2 h")]
        {
            assert_eq!(estimate(seconds * OPERATIONS_A_SECOND), words);
        }
        assert_eq!(estimate(1e6 * OPERATIONS_A_SECOND), "about 12 days");
    }

    #[test]
    fn of_a_cell_that_takes_long_it_is_said_how_far_it_is() {
        let minutes = 720.0 * OPERATIONS_A_SECOND;
        assert_eq!(note("cell", [2.0 * minutes, 0.5 * minutes, minutes]).unwrap(), "; a cell takes about 12 min, 25 % of those begun");
        assert_eq!(note("cell", [minutes, 0.0, 0.1 * OPERATIONS_A_SECOND]), None);
    }
}
