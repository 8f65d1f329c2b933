//! Signals that a test sends to the programs of hosts.

use std::time::Duration;

use cohaptic_testkit::{Bed, Testbed};
use tokio::signal::unix::{SignalKind, signal};
use tokio::time::{Instant, sleep};

/// A server that ends its work when `SIGTERM` comes, and at once on Ctrl-C.
async fn serve() -> &'static str {
    let mut end = signal(SignalKind::terminate()).unwrap();
    tokio::select! {
        _ = end.recv() => sleep(Duration::from_secs(3)).await,
        outcome = tokio::signal::ctrl_c() => {
            outcome.unwrap();
            return "interrupted";
        }
    }
    "ended"
}

#[test]
fn a_program_ends_its_work_on_a_signal() {
    for (number, said, seconds) in [(15, "ended", 13), (2, "interrupted", 10)] {
        Testbed::new(["server", "other"]).on_tokio().run(async move |bed: Bed| {
            let begin = Instant::now();
            let server = bed.host("server").spawn(serve());
            let other = bed.host("other").spawn(serve());
            sleep(Duration::from_secs(10)).await;
            bed.host("server").signal(number);
            assert_eq!(server.await.unwrap(), said);
            assert_eq!(begin.elapsed(), Duration::from_secs(seconds));
            assert!(!other.is_finished());
        });
    }
}
