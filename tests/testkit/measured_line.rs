//! A link that was fitted to a measurement, in a test: the end of `docs/how-to-measure-your-line.md`.

use std::time::Duration;

use cohaptic_testkit::{Bed, Instant, Testbed, time};

/// Sends a position every 10 ms, and returns the longest time for which the other end had no new one.
async fn longest_pause(bed: Bed) -> Duration {
    let (home, server) = (bed.host("home").bind("0.0.0.0:0").unwrap(), bed.host("server").bind("0.0.0.0:7").unwrap());
    bed.host("home").spawn(async move {
        for position in 0..2_000_u32 {
            home.send_to(&position.to_be_bytes(), "server:7").await.unwrap();
            time::sleep(Duration::from_millis(10)).await;
        }
    });
    let (mut longest, mut before) = (Duration::ZERO, None::<Instant>);
    while let Ok(Ok(_)) = time::timeout(Duration::from_secs(1), server.recv(&mut [0; 4])).await {
        let now = time::now();
        longest = longest.max(before.map_or(Duration::ZERO, |before| now - before));
        before = Some(now);
    }
    longest
}

#[test]
fn no_pause_of_the_evening_at_home_lasts_300_milliseconds() {
    let pause = Testbed::from_file("testkit/home.toml").run(longest_pause);
    assert!(pause < Duration::from_millis(300), "{pause:?}");
}
