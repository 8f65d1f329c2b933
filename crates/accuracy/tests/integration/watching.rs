//! A watcher sees every row, and can end the measurement.

use std::cell::RefCell;

use cohaptic_accuracy::{AccuracyError, Options, Row, Subject, Unwatched, Watch, analysis, measure, network, real_time};

/// A watcher that keeps the rows and stops the measurement after `most` rows.
struct Until {
    rows: RefCell<Vec<Row>>,
    most: usize,
}

impl Watch for Until {
    fn row(&self, row: &Row) {
        self.rows.borrow_mut().push(row.clone());
    }

    fn stops(&self) -> bool {
        self.rows.borrow().len() >= self.most
    }
}

const QUICK: Options = Options { quick: true };

#[test]
fn a_watcher_sees_every_row_in_order() {
    let watch = Until { rows: RefCell::default(), most: usize::MAX };
    let rows = measure(&[Subject::Motion], QUICK, &watch).unwrap();
    assert_eq!(*watch.rows.borrow(), rows);
    assert!(rows.iter().all(|row| row.subject == Subject::Motion));
}

#[test]
fn the_work_ends_soon_after_it_is_asked_to() {
    for subject in [Subject::Motion, Subject::Time] {
        let watch = Until { rows: RefCell::default(), most: 5 };
        assert!(matches!(measure(&[subject], QUICK, &watch), Err(AccuracyError::Stopped)));
        let seen = watch.rows.borrow().len();
        assert!((5..10).contains(&seen), "{seen} rows");
    }
}

#[test]
fn subjects_that_measure_for_long_ask_the_watcher_too() {
    let until = |most| Until { rows: RefCell::default(), most };
    let stopped = |found| matches!(found, Err(AccuracyError::Stopped));
    assert!(stopped(network::rows(network::Effort::QUICK, &until(1))));
    assert!(stopped(analysis::rows(analysis::Effort::QUICK, &until(1))));
    assert!(stopped(real_time::rows(real_time::Effort::QUICK, &until(0))));
}

/// Costs are measured, but errors are computed and equal in every run.
#[test]
fn errors_are_the_same_every_time() {
    let errors = || -> Vec<(String, String, Option<u64>)> {
        let rows = measure(&[Subject::Motion, Subject::Time], QUICK, &Unwatched).unwrap();
        rows.into_iter().map(|row| (row.method, row.setting, row.error.map(f64::to_bits))).collect()
    };
    assert_eq!(errors(), errors());
}
