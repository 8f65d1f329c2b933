//! The event queue against a binary heap.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use cohaptic_wan::{Event, EventQueue};
use proptest::collection::vec;
use proptest::prelude::*;

use crate::random_links::{at, cases};

/// Event with an instant, a rank that breaks ties, and a serial number that makes the event unique.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Note {
    at: Instant,
    rank: u8,
    serial: usize,
}

impl Event for Note {
    type Key = Self;

    fn at(&self) -> Instant {
        self.at
    }

    fn key(&self) -> Self {
        *self
    }
}

#[derive(Clone, Copy, Debug)]
enum When {
    /// Span \[ns\] after the latest instant so far. Spans lie below and beyond the 65.5 µs of a bucket and the 268 ms of the ring.
    Ahead(u64),
    /// Span \[ns\] before the latest instant so far.
    Behind(u64),
    /// At this instant \[ns\].
    Exactly(u64),
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Push(When, u8),
    /// As many events, out of order, spread over this span \[ns\] after the latest instant so far: a queue of any number of events, few or many.
    Burst(u64, usize),
    /// Lets time pass and takes at most so many events.
    Pop(u64, usize),
    /// Lets time pass until the next event.
    Next,
    /// Takes all.
    Drain(u64),
}

const BUCKET: u64 = 1 << 16;
const RING: u64 = 4096 * BUCKET;

fn span() -> BoxedStrategy<u64> {
    prop_oneof![
        2 => Just(0),
        2 => 0..4u64,
        4 => 0..BUCKET * 3,
        2 => (0..5u64, 0..3u64).prop_map(|(buckets, more)| (buckets * BUCKET + more).saturating_sub(1)),
        3 => 0..RING,
        2 => (0..3u64, 0..3 * BUCKET).prop_map(|(rings, more)| (rings * RING + more).saturating_sub(BUCKET)),
        1 => 0..RING * 100,
        1 => any::<u64>(),
    ]
    .boxed()
}

fn steps() -> BoxedStrategy<Vec<Step>> {
    let edge = prop_oneof![Just(0), Just(u64::MAX), Just(u64::MAX - 1), u64::MAX - RING * 2..u64::MAX];
    let when = prop_oneof![12 => span().prop_map(When::Ahead), 2 => span().prop_map(When::Behind), 1 => edge.prop_map(When::Exactly)];
    let quiet = prop_oneof![6 => 0..BUCKET * 2, 3 => 0..RING * 2, 1 => span()];
    vec(
        prop_oneof![
            10 => (when, 0..4u8).prop_map(|(when, rank)| Step::Push(when, rank)),
            1 => (0..BUCKET * 300, 1..150usize).prop_map(|(span, count)| Step::Burst(span, count)),
            4 => (quiet.clone(), 0..6usize).prop_map(|(span, count)| Step::Pop(span, count)),
            3 => Just(Step::Next),
            1 => quiet.prop_map(Step::Drain),
        ],
        1..200,
    )
    .boxed()
}

properties! {
    #![proptest_config(cases(1_500))]

    #[test]
    fn the_queue_gives_what_a_heap_gives(steps in steps()) {
        let mut queue = EventQueue::new();
        let mut heap = BinaryHeap::new();
        let mut now = 0u64;
        for (serial, step) in steps.into_iter().enumerate() {
            let take = match step {
                Step::Push(when, rank) => {
                    let instant = match when {
                        When::Ahead(span) => now.saturating_add(span),
                        When::Behind(span) => now.saturating_sub(span),
                        When::Exactly(instant) => instant,
                    };
                    let note = Note { at: at(instant), rank, serial: serial * 1_000 };
                    queue.push(note);
                    heap.push(Reverse(note));
                    0
                }
                Step::Burst(span, count) => {
                    for number in 0..count {
                        // 37 has no factor in common with most counts, so that few events of a burst have one instant.
                        let place = (number * 37 % count) as u64;
                        let note = Note { at: at(now.saturating_add(span / count as u64 * place)), rank: 0, serial: serial * 1_000 + number };
                        queue.push(note);
                        heap.push(Reverse(note));
                    }
                    0
                }
                Step::Pop(span, count) => {
                    now = now.saturating_add(span);
                    count
                }
                Step::Next => {
                    now = now.max(queue.next_at().map_or(0, Instant::as_nanos));
                    1
                }
                Step::Drain(span) => {
                    now = now.saturating_add(span);
                    usize::MAX
                }
            };
            for _ in 0..take {
                let due = heap.peek().filter(|note| note.0.at <= at(now)).copied();
                prop_assert_eq!(queue.pop_due(at(now)), due.map(|note| note.0));
                if due.is_none() {
                    break;
                }
                heap.pop();
            }
            prop_assert_eq!(queue.len(), heap.len());
            prop_assert_eq!(queue.is_empty(), heap.is_empty());
            prop_assert_eq!(queue.next_at(), heap.peek().map(|note| note.0.at));
        }
        let rest: Vec<Note> = std::iter::from_fn(|| queue.pop_due(Instant::MAX)).collect();
        let expected: Vec<Note> = std::iter::from_fn(|| heap.pop()).map(|note| note.0).collect();
        prop_assert_eq!(rest, expected);
    }
}

#[test]
fn many_thousands_of_simultaneous_events_come_by_key() {
    const COUNT: usize = 50_000;
    for instant in [0, 5 * BUCKET, 3 * RING, u64::MAX] {
        let mut queue = EventQueue::new();
        // 7919 is prime and does not divide the count, so this is a permutation.
        for serial in (0..COUNT).map(|number| number * 7_919 % COUNT) {
            queue.push(Note { at: at(instant), rank: 0, serial });
        }
        assert_eq!(queue.next_at(), Some(at(instant)));
        let order: Vec<usize> = std::iter::from_fn(|| queue.pop_due(at(instant))).map(|note| note.serial).collect();
        assert!(order.into_iter().eq(0..COUNT), "events at {instant} come by key");
        assert_eq!(queue.next_at(), None);
    }
}
