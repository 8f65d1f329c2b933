use std::sync::LazyLock;

use cohaptic_accuracy::least::{Effort, rows};
use cohaptic_accuracy::{AccuracyError, Row, Unwatched, Watch};

use crate::rows::assert_sound;

const EFFORT: Effort = Effort { simulated_millis: 400, rounds: 1, round_millis: 1 };

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| rows(EFFORT, &Unwatched).unwrap());

#[test]
fn every_row_is_sound() {
    assert_sound(&ROWS);
    for thing in [
        "axis",
        "jitter",
        "loss",
        "correlation",
        "rate",
        "in-order",
        "duplication",
        "corruption",
        "contact",
        "text",
        "compute",
        "drifts",
        "wall",
        "general",
    ] {
        assert!(ROWS.iter().any(|row| row.method.contains(thing)), "{thing}");
    }
}

/// The promise of `docs/architecture.md`: not one bit differs.
#[test]
fn the_least_model_is_the_general_one_to_the_bit() {
    for row in ROWS.iter() {
        assert_eq!(row.error, Some(0.0), "{row:?}");
    }
}

/// A watch that has seen enough after so many rows.
struct Until(std::cell::Cell<usize>);

impl Watch for Until {
    fn row(&self, _row: &Row) {
        self.0.set(self.0.get() - 1);
    }

    fn stops(&self) -> bool {
        self.0.get() == 0
    }
}

#[test]
fn who_watches_can_end_it() {
    let stopped = |found| matches!(found, Err(AccuracyError::Stopped));
    assert!(stopped(rows(EFFORT, &Until(2.into()))));
    let network = cohaptic_accuracy::network::Effort::QUICK;
    assert!(stopped(cohaptic_accuracy::network::rows(network, &Until(1.into()))));
    let analysis = cohaptic_accuracy::analysis::Effort::QUICK;
    assert!(stopped(cohaptic_accuracy::analysis::rows(analysis, &Until(1.into()))));
    let real_time = cohaptic_accuracy::real_time::Effort::QUICK;
    assert!(stopped(cohaptic_accuracy::real_time::rows(real_time, &Until(0.into()))));
}
