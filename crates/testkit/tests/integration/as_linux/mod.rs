//! Sockets do what those of Linux do, with the same numbers of errors. Each figure was measured on Linux 6.18.

mod names;
mod streams;
mod udp;

use std::io;
use std::time::Duration;

use cohaptic_testkit::{Bed, Testbed};

/// Returns test beds with the same hosts on both runtimes. A round trip takes 20 ms.
fn beds() -> [Testbed; 2] {
    let bed = Testbed::new(["a", "b"]).links("delay 10ms").seed(1);
    [bed.clone(), bed.on_tokio()]
}

/// Round trip.
const R: Duration = Duration::from_millis(20);

/// Returns the number of an error.
#[track_caller]
fn number<T>(outcome: io::Result<T>) -> Option<i32> {
    let error = outcome.map(drop).unwrap_err();
    assert!(error.raw_os_error().is_some(), "{error:?}");
    error.raw_os_error()
}

/// Calls `act`, and returns the number of its error, and how long it took.
async fn timed<T>(bed: &Bed, act: impl Future<Output = io::Result<T>>) -> (Option<i32>, Duration) {
    let begin = bed.now();
    let number = number(act.await);
    (number, bed.now() - begin)
}
