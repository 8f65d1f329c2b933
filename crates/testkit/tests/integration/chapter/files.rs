//! The blocks of docs/testing.md that keep files or are given some, as they stand there.

use std::time::Duration;

use cohaptic_testkit::{Bed, Instant, Testbed, time};

use super::programs::echo;

/// Asks every 100 ms until there is an answer. Returns the instant of the answer.
async fn ask_until_answered(bed: Bed) -> Instant {
    bed.host("server").spawn(echo());
    let phone = bed.host("phone").bind("0.0.0.0:0").unwrap();
    loop {
        phone.send_to(b"there?", "server:7").await.unwrap();
        if time::timeout(Duration::from_millis(100), phone.recv(&mut [0; 10])).await.is_ok() {
            return time::now();
        }
    }
}

#[test]
fn who_asks_at_home_is_answered() {
    let answered = Testbed::from_file("tests/home.links").run(ask_until_answered);
    assert!(answered >= Instant::from_nanos(45_000_000));
}

#[test]
fn what_the_links_did_is_done_again() {
    let folder = tempfile::tempdir().unwrap();
    let kept = folder.path().join("kept");
    let (answered, record) = Testbed::from_file("tests/home.links").run_recorded(ask_until_answered);
    record.write(&kept).unwrap();

    let replayed = Testbed::from_file(kept.join("links.txt")).seed(1).run(ask_until_answered);
    assert_eq!(replayed, answered);
}
