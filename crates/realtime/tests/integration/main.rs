//! The clock and the pacer on a real system. Asserted is only what no load on the machine can break.
#![allow(clippy::unwrap_used, reason = "tests")]

use std::io::Write as _;
use std::os::fd::AsFd as _;
use std::os::unix::net::UnixStream;
use std::time::Duration;

use cohaptic_realtime::{Clock as _, MonotonicClock, Pacer, Pacing, Woken};

#[test]
fn no_wait_ends_before_its_deadline() {
    let clock = MonotonicClock::start();
    for pacing in [Pacing::Sleep, Pacing::SPIN] {
        let mut pacer = Pacer::new(pacing);
        let mut due = clock.now();
        for _ in 0..20 {
            due += Duration::from_micros(700);
            assert_eq!(pacer.wait(&clock, Some(due), &[]).unwrap(), Woken::Deadline);
            assert!(clock.now() >= due);
        }
    }
}

#[test]
fn a_wait_with_sockets_ends_at_its_deadline_or_when_one_can_be_read() {
    let (mut sender, receiver) = UnixStream::pair().unwrap();
    let clock = MonotonicClock::start();
    let mut pacer = Pacer::new(Pacing::Sleep);
    let due = clock.now() + Duration::from_millis(5);
    assert_eq!(pacer.wait(&clock, Some(due), &[receiver.as_fd()]).unwrap(), Woken::Deadline);
    assert!(clock.now() >= due);
    sender.write_all(b"x").unwrap();
    // The deadline is an hour away, so only the readable socket can end this wait.
    let far = clock.now() + Duration::from_secs(3600);
    assert_eq!(pacer.wait(&clock, Some(far), &[receiver.as_fd()]).unwrap(), Woken::Readable);
    assert_eq!(pacer.wait(&clock, None, &[receiver.as_fd()]).unwrap(), Woken::Readable);
}

#[test]
fn the_two_clocks_read_together_place_a_stamp_of_now_at_now() {
    let clock = MonotonicClock::start();
    // Returns whether a stamp taken between two readings is placed between them, and not at the later reading of the stamps.
    let is_placed = || {
        let before = clock.now();
        let unix = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap();
        let after = clock.now();
        std::thread::sleep(Duration::from_millis(2));
        let stamps = clock.stamps();
        let placed = stamps.instant(Some(unix));
        assert!(before <= placed && placed <= stamps.now(), "{before:?} {placed:?} {stamps:?}");
        placed <= after
    };
    // The two clocks are read a moment apart, and a busy machine can make this moment long, so not every attempt succeeds.
    assert!((0..1000).any(|_| is_placed()));
}

mod udp;
