use alloc::vec::Vec;
use core::time::Duration;

use cohaptic_tests_common::properties;
use proptest::prelude::*;

use super::*;

/// Octets of a segment.
const SIZE: u64 = 1000;

/// Start of the segment with this number.
const fn start(number: u64) -> Position {
    number * SIZE
}

const fn at(millis: u64) -> Instant {
    Instant::from_nanos(millis * 1_000_000)
}

/// Returns a scoreboard with `count` segments, sent 10 ms after each other from 0 on.
fn flight(count: u64) -> Scoreboard {
    let mut board = Scoreboard::default();
    (0..count).for_each(|number| board.push(start(number), start(number + 1), at(10 * number), Ending::default()));
    board
}

/// Notes that the segments from `from` to `to` (exclusive) have arrived out of order, and returns the latest transmission among them.
fn sack(board: &mut Scoreboard, from: u64, to: u64) -> SentAt {
    let mut news = News::default();
    board.sack(start(from), start(to), 0, &mut news);
    news.latest.unwrap().0
}

fn acknowledge(board: &mut Scoreboard, position: Position) {
    board.acknowledge(position, 0, &mut News::default());
}

/// Returns the ends of the segments that are lost.
fn lost(board: &Scoreboard) -> Vec<Position> {
    board.queue.iter().filter(|sent| sent.lost).map(|sent| sent.end).collect()
}

const PATIENCE: Duration = Duration::from_millis(50);

/// The order of transmissions is the order of segments.
#[test]
fn segments_that_were_sent_once_are_lost_in_their_order() {
    let mut board = flight(4);
    let delivered = sack(&mut board, 3, 4);
    assert_eq!(board.detect_by_time(at(49), delivered, PATIENCE), Some(at(70)));
    assert_eq!(lost(&board), []);
    assert_eq!(board.detect_by_time(at(60), delivered, PATIENCE), Some(at(70)));
    assert_eq!(lost(&board), [start(1), start(2)]);
    assert_eq!(board.detect_by_time(at(70), delivered, PATIENCE), None);
    assert_eq!(lost(&board), [start(1), start(2), start(3)]);
}

/// A segment is sent again before the first search by time, as a tail probe is. Its transmission is the latest, although other segments lie above.
#[test]
fn a_segment_that_was_sent_again_is_the_latest_transmission() {
    for again in 0..4 {
        let mut board = flight(4);
        board.sent_again(start(again), at(40), false);
        let other = if again == 3 { 2 } else { 3 };
        let delivered = sack(&mut board, other, other + 1);
        board.detect_by_time(at(90), delivered, PATIENCE);
        let expected: Vec<_> = (0..other).filter(|number| *number != again).map(|number| start(number + 1)).collect();
        assert_eq!(lost(&board), expected, "{again} was sent again");
        // The answer to a later transmission tells that the repeated segment is lost too.
        board.push(start(4), start(5), at(50), Ending::default());
        let delivered = sack(&mut board, 4, 5);
        board.detect_by_time(at(100), delivered, PATIENCE);
        assert_eq!(lost(&board), (0..4).filter(|number| *number != other).map(|number| start(number + 1)).collect::<Vec<_>>());
    }
}

/// A path between the ends cuts segments into smaller ones, so that acknowledgements end inside a segment of the sender.
#[test]
fn a_segment_whose_head_has_arrived_is_lost_like_others() {
    for is_searched_before in [false, true] {
        let mut board = flight(3);
        if is_searched_before {
            board.detect_by_time(at(20), (at(0), 1), PATIENCE);
        }
        for position in [300, 600, 900] {
            acknowledge(&mut board, position);
        }
        let delivered = sack(&mut board, 2, 3);
        assert_eq!(board.detect_by_time(at(50), delivered, PATIENCE), Some(at(60)));
        assert_eq!(lost(&board), [start(1)]);
        assert_eq!(board.next_lost().map(|sent| (sent.start, sent.end)), Some((900, 1000)));
        // Another part arrives before the rest is sent again.
        acknowledge(&mut board, 950);
        assert_eq!(board.next_lost().map(|sent| (sent.start, sent.end)), Some((950, 1000)));
        board.sent_again(950, at(60), true);
        acknowledge(&mut board, 970);
        board.push(start(3), start(4), at(70), Ending::default());
        let delivered = sack(&mut board, 3, 4);
        board.detect_by_time(at(110), delivered, PATIENCE);
        assert_eq!((board.next_lost().map(|sent| sent.start), board.losses), (Some(970), 3));
    }
}

/// Step of a random history of a scoreboard. Numbers of segments are taken modulo the number of segments on the way.
#[derive(Clone, Copy, Debug)]
enum Step {
    /// Sends new segments at the present instant.
    Push(u64),
    /// Acknowledges octets.
    Acknowledge(u64),
    Sack {
        first: usize,
        count: u64,
    },
    SendAgain {
        number: usize,
        counts: bool,
    },
    /// Repeats the first lost segment.
    Repair,
    Wait(u64),
    /// Searches by time, after the arrival of the latest sacked transmission.
    Detect,
    /// The retransmission timer has run out, with or without sparing recent segments.
    TimeOut(bool),
    Undo,
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        (1u64..5).prop_map(Step::Push),
        (1u64..3 * SIZE).prop_map(Step::Acknowledge),
        (0usize..12, 1u64..4).prop_map(|(first, count)| Step::Sack { first, count }),
        (0usize..12, any::<bool>()).prop_map(|(number, counts)| Step::SendAgain { number, counts }),
        Just(Step::Repair),
        (0u64..30).prop_map(Step::Wait),
        Just(Step::Detect),
        Just(Step::Detect),
        any::<bool>().prop_map(Step::TimeOut),
        Just(Step::Undo),
    ]
}

/// Marks lost segments as [`Scoreboard::detect_by_time`] does, from the segments alone.
fn detect_in_all(board: &mut Scoreboard, now: Instant, delivered: SentAt) -> Option<Instant> {
    let mut waits = None;
    for index in 0..board.queue.len() {
        let sent = &board.queue[index];
        let deadline = sent.at.saturating_add(PATIENCE);
        if sent.sacked || (sent.lost && !sent.again) || (sent.at, sent.order) >= delivered {
            continue;
        }
        if deadline > now {
            waits = waits.max(Some(deadline));
        } else {
            board.mark_lost(index);
        }
    }
    waits
}

properties! {
    /// The list of transmissions by time finds what a look at all segments finds.
    #[test]
    fn a_search_by_time_finds_each_lost_segment(steps in prop::collection::vec(step(), 0..60)) {
        let (mut board, mut now, mut una, mut next, mut delivered) = (Scoreboard::default(), at(0), 0, 0, None);
        for step in steps {
            let count = board.queue.len();
            match step {
                Step::Push(count) => {
                    for _ in 0..count {
                        board.push(next, next + SIZE, now, Ending::default());
                        next += SIZE;
                    }
                }
                Step::Acknowledge(octets) => {
                    una = (una + octets).min(next);
                    acknowledge(&mut board, una);
                }
                Step::Sack { first, count: blocks } if count > 1 => {
                    let from = board.queue[1 + first % (count - 1)].start;
                    let mut news = News::default();
                    board.sack(from, (from + blocks * SIZE).min(next), 0, &mut news);
                    delivered = delivered.max(news.latest.map(|(sent_at, _)| sent_at));
                }
                Step::SendAgain { number, counts } if count > 0 => {
                    let sent = &board.queue[number % count];
                    if !sent.sacked {
                        board.sent_again(sent.start, now, counts && sent.lost);
                    }
                }
                Step::Repair => {
                    if let Some(start) = board.next_lost().map(|sent| sent.start) {
                        board.sent_again(start, now, true);
                    }
                }
                Step::Wait(millis) => now = now.saturating_add(Duration::from_millis(millis)),
                Step::Detect => {
                    let Some(delivered) = delivered else { continue };
                    let mut twin = board.clone();
                    let expected = detect_in_all(&mut twin, now, delivered);
                    prop_assert_eq!(board.detect_by_time(now, delivered, PATIENCE), expected);
                    prop_assert_eq!(lost(&board), lost(&twin));
                    prop_assert_eq!((board.lost_out, board.again_out, board.losses), (twin.lost_out, twin.again_out, twin.losses));
                }
                Step::TimeOut(spares) => board.mark_all_lost(now, spares.then_some(PATIENCE), true),
                Step::Undo => board.unmark_lost(),
                Step::Sack { .. } | Step::SendAgain { .. } => {}
            }
        }
    }
}
