use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use cohaptic_testkit::time::sleep;
use cohaptic_testkit::{Bed, Testbed};

fn random() -> [u8; 9] {
    let mut bytes = [0; 9];
    // SAFETY: the memory has 9 bytes.
    assert_eq!(unsafe { libc::getrandom(bytes.as_mut_ptr().cast(), 9, 0) }, 9);
    bytes
}

#[test]
#[expect(clippy::disallowed_methods, reason = "the clocks of the standard library are what is tested")]
fn clocks_follow_virtual_time_where_the_test_says_so() {
    for is_virtual in [true, false] {
        let bed = Testbed::new(["host"]);
        let bed = if is_virtual { bed.std_clocks() } else { bed };
        bed.run(async move |bed: Bed| {
            bed.host("host")
                .spawn(async move {
                    let (begin, day) = (Instant::now(), SystemTime::now());
                    sleep(Duration::from_millis(600_001)).await;
                    let passed = (begin.elapsed(), day.elapsed().unwrap());
                    if is_virtual {
                        assert_eq!(passed, (Duration::from_millis(600_001), Duration::from_millis(600_001)));
                        // The first of January 2027.
                        assert_eq!(day.duration_since(UNIX_EPOCH).unwrap().as_secs(), 1_798_761_600);
                    } else {
                        assert!(passed.0 < Duration::from_secs(3600));
                    }
                })
                .await
                .unwrap();
        });
    }
}

#[test]
fn random_numbers_come_from_the_seed_where_the_test_says_so() {
    let drawn = |bed: Testbed| bed.run(async |bed: Bed| bed.host("host").spawn(async { [random(), random()] }).await.unwrap());
    let bed = |seed| Testbed::new(["host"]).seed(seed);
    let first = drawn(bed(1).std_random());
    assert_ne!(first[0], first[1]);
    assert_eq!(drawn(bed(1).std_random()), first);
    assert_ne!(drawn(bed(2).std_random()), first);
    assert_ne!(drawn(bed(1)), drawn(bed(1)));
    assert_ne!(random(), random());
}
