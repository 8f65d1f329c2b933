//! Progress of an analysis on the terminal, and its end when the user asks for it.

use cohaptic_stability::Watch;

use crate::interrupt;
use crate::progress::Progress;

/// How many operations, as the analysis estimates them, this program does in a second and on one thread: measured on a shared core of a server, 0.5
/// billion of a mean square with bursts on six links, 1.7 of an admittance, 5 of the eigenvalues of 400 rows. It tells seconds from hours, and nothing
/// finer.
pub(crate) const OPERATIONS_A_SECOND: f64 = 1e9;

/// What takes fewer seconds than this has no bar.
const SHORT: f64 = 1.0;

/// The steps of the bar: millions of operations.
const STEP: f64 = 1e6;

/// Ends an analysis when the user asks for it, and shows nothing.
pub(crate) struct Interruptible;

impl Watch for Interruptible {
    fn stops(&self) -> bool {
        interrupt::asked()
    }
}

/// Shows how far an analysis is, if it takes long, and ends it when the user asks for it.
pub(crate) struct AnalysisWatch(std::sync::Mutex<Shown>);

#[derive(Default)]
struct Shown {
    bar: Option<Progress>,
    /// Of what was done, what no step was shown for yet.
    left: f64,
}

impl AnalysisWatch {
    pub(crate) fn new() -> Self {
        Self(std::sync::Mutex::default())
    }

    pub(crate) fn clear(&self) {
        if let Some(bar) = self.shown().bar.take() {
            bar.clear();
        }
    }

    fn shown(&self) -> std::sync::MutexGuard<'_, Shown> {
        self.0.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }
}

impl Watch for AnalysisWatch {
    fn expects(&self, operations: f64) {
        let mut shown = self.shown();
        if shown.bar.is_some() || operations / OPERATIONS_A_SECOND > SHORT {
            shown.bar.get_or_insert_with(Progress::through_operations).expect(steps(operations));
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
        interrupt::asked()
    }
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a conversion to the nearest number that there is")]
fn steps(operations: f64) -> u64 {
    (operations / STEP) as u64
}
