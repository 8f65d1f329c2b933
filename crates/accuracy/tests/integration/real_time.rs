use cohaptic_accuracy::Unwatched;
use cohaptic_accuracy::real_time::{Effort, rows};

use crate::rows::assert_sound;

/// How late anything is depends on the machine. What does not: that packets left, that none left early (lateness is no negative number), that the median
/// is not above the 99 %, and that each way has both rows.
#[test]
fn every_way_releases_packets() {
    let rows = rows(Effort { rounds: 2, turn_millis: 60 }, &Unwatched).unwrap();
    assert_sound(&rows);
    assert_eq!(rows.len(), 18);
    for pair in rows.chunks(2) {
        assert!(pair[0].error <= pair[1].error, "{pair:?}");
        let packets: u64 = pair[0].note.strip_prefix("measured over ").and_then(|note| note.split_once(' ')).unwrap().0.parse().unwrap();
        // 24 packets come back after 24 ms on average, and are released up to the instant 60 ms, however late that is: at least each one once.
        assert!(packets >= 48, "{pair:?}");
    }
}

/// Instants are those of the link, whoever waits: all ways release the same packets.
#[test]
fn all_ways_release_the_same_packets() {
    let rows = rows(Effort { rounds: 1, turn_millis: 50 }, &Unwatched).unwrap();
    let packets = |note: &str| note.split_once(" packets").unwrap().0.to_owned();
    let first = packets(&rows[0].note);
    assert!(rows.iter().all(|row| packets(&row.note) == first), "{rows:?}");
}
