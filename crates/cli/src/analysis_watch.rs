//! Progress of an analysis on the terminal, and the end of an analysis when the user asks for the end.

use std::io::Write as _;

pub(crate) use cohaptic_answers::OPERATIONS_A_SECOND;
use cohaptic_stability::{PartCost, Watch};

use crate::interrupt;
use crate::progress::Progress;

/// Estimated time \[s\] up to which an analysis has no bar.
const SHORT: f64 = 1.0;

/// Estimated time of a part \[s\]: from this time on, the cost of the part is printed before the part begins, also if standard error is no terminal.
const TOLD: f64 = 2.0;

/// Operations per step of the bar.
const STEP: f64 = 1e6;

/// Watch without output. Ends an analysis when the user asks for the end.
pub(crate) struct Interruptible;

impl Watch for Interruptible {
    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Watch of a long analysis: shows the progress, and ends the analysis when the user asks for the end.
pub(crate) struct AnalysisWatch {
    shown: std::sync::Mutex<Shown>,
    /// Limit of the memory of a part \[bytes\].
    most_memory: u64,
}

#[derive(Default)]
struct Shown {
    bar: Option<Progress>,
    /// Operations of all announced parts.
    expected: f64,
    /// Operations done but not shown yet.
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
        // A short part is over before anybody has read a note about the cost.
        if cost.operations / OPERATIONS_A_SECOND < TOLD {
            return;
        }
        // The analysis continues even if standard error cannot be written to.
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
        // A part that is long by itself begins the bar. Earlier short parts are in the estimate of the time, and not in the length of the bar.
        if shown.bar.is_some() || is_long(operations) {
            // The bar begins with length 0, because each announced part adds its length.
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
        let Shown { bar, left, .. } = &mut *shown;
        *left += operations;
        if let Some(bar) = bar {
            bar.more(take_steps(left));
        }
    }

    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Describes the estimated time of a number of operations.
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

/// Watch of the cells or values of a picture with a bar of cells. Shows the progress of long cells after the bar, and ends the cells when `stops` returns true.
pub(crate) struct CellWatch<'a> {
    progress: &'a Progress,
    /// Word for a cell in the note, such as "cell".
    name: &'static str,
    stops: &'a (dyn Fn() -> bool + Sync),
    /// Operations of all begun cells, operations done, and the largest number of operations announced at once.
    operations: std::sync::Mutex<[f64; 3]>,
}

impl<'a> CellWatch<'a> {
    pub(crate) fn new(progress: &'a Progress, name: &'static str, stops: &'a (dyn Fn() -> bool + Sync)) -> Self {
        Self { progress, name, stops, operations: std::sync::Mutex::default() }
    }

    fn operations(&self) -> std::sync::MutexGuard<'_, [f64; 3]> {
        self.operations.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    fn count(&self, add: [f64; 2]) {
        let mut operations = self.operations();
        let [expected, done, largest] = &mut *operations;
        (*expected, *done, *largest) = (*expected + add[0], *done + add[1], largest.max(add[0]));
        if let Some(note) = note(self.name, *operations) {
            self.progress.note(note);
        }
    }
}

/// Returns whether a cell of this cost may take longer than [`SHORT`].
fn is_long(operations: f64) -> bool {
    operations / OPERATIONS_A_SECOND > SHORT
}

/// Returns the note about long cells, or `None` if no begun cell takes longer than [`SHORT`].
fn note(name: &str, [expected, done, largest]: [f64; 3]) -> Option<String> {
    // The announced cost is an estimate and may be exceeded, so that the share is limited to 100 %.
    is_long(largest).then(|| format!("; a {name} takes {}, {:.0} % of those begun", estimate(largest), 100.0 * (done / expected).min(1.0)))
}

impl Watch for CellWatch<'_> {
    fn expects(&self, operations: f64) {
        self.count([operations, 0.0]);
    }

    fn done(&self, operations: f64) {
        self.count([0.0, operations]);
    }

    fn stops(&self) -> bool {
        let stops = (self.stops)();
        // Short cells end by themselves soon, and the command then answers with the cells of that time. On a busy machine this may be later than the
        // interruption waits for a command without results.
        if stops && !is_long(self.operations()[2]) {
            interrupt::has_results();
        }
        stops
    }
}

/// Returns the whole steps in `left`, and leaves the fraction of a step there, because many parts are shorter than a step.
#[expect(clippy::cast_precision_loss, reason = "steps of a bar")]
fn take_steps(left: &mut f64) -> u64 {
    let whole = steps(*left);
    *left -= whole as f64 * STEP;
    whole
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

    /// Ten parts of 1.7 steps are 17 steps, also if each part is shown by itself.
    #[test]
    fn no_fraction_of_a_step_is_lost() {
        let mut left = 0.0;
        let shown: u64 = (0..10)
            .map(|_| {
                left += 1.7 * STEP;
                take_steps(&mut left)
            })
            .sum();
        assert_eq!((shown, left.round()), (17, 0.0));
    }

    #[test]
    fn of_a_cell_that_takes_long_it_is_said_how_far_it_is() {
        let minutes = 720.0 * OPERATIONS_A_SECOND;
        assert_eq!(note("cell", [2.0 * minutes, 0.5 * minutes, minutes]).unwrap(), "; a cell takes about 12 min, 25 % of those begun");
        assert_eq!(note("cell", [minutes, 0.0, 0.1 * OPERATIONS_A_SECOND]), None);
    }
}
