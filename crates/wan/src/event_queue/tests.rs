use super::*;

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
struct Note(u64, u32);

impl Event for Note {
    type Key = Self;

    fn at(&self) -> Instant {
        Instant::from_nanos(self.0)
    }

    fn key(&self) -> Self {
        *self
    }
}

#[test]
fn simultaneous_events_come_in_order_of_their_keys() {
    let mut queue = EventQueue::new();
    for key in [3, 1, 2, 0] {
        queue.push(Note(1_000_000, key));
    }
    assert_eq!(queue.next_at(), Some(Instant::from_nanos(1_000_000)));
    assert_eq!(queue.pop_due(Instant::from_nanos(999_999)), None);
    let order: Vec<u32> = core::iter::from_fn(|| queue.pop_due(Instant::from_nanos(1_000_000))).map(|note| note.1).collect();
    assert_eq!(order, [0, 1, 2, 3]);
}

/// For events in the ring, in buckets and beyond the buckets: `quiet_until` is not after an event, and is later than an instant at which a search has found no
/// event.
#[test]
fn no_event_is_due_in_a_quiet_time() {
    let (mut queue, mut pending, mut number) = (Queue::new(Slab::new()), alloc::collections::BTreeSet::new(), 2015_u64);
    let mut draw = |below: u64| {
        number = number.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (number >> 33) % below
    };
    let (mut now, mut quiet) = (0, 0);
    for key in 0..20_000 {
        let reach = [1, 200_000, 30_000_000, 3_000_000_000][usize::try_from(draw(4)).expect("small")];
        if draw(3) > 0 {
            let note = Note(now + draw(reach), key);
            queue.push(note);
            pending.insert(note);
        }
        now += draw(2) * draw(2_000_000);
        let (at, first) = (Instant::from_nanos(now), pending.first().copied().filter(|first: &Note| first.0 <= now));
        assert!(first.is_none() || queue.quiet_until() <= at, "{first:?} is due at {now}");
        quiet += usize::from(first.is_none() && !pending.is_empty() && queue.quiet_until() > at);
        assert_eq!(queue.take_due(at, |note| note), first);
        if let Some(first) = first {
            pending.remove(&first);
        } else {
            assert!(queue.quiet_until() > at, "what was searched in vain at {now} is searched again");
        }
    }
    assert!(quiet > 1000, "only {quiet} instants were known to be quiet");
}

#[test]
fn the_edges_of_time_are_ordinary_instants() {
    let mut queue = EventQueue::new();
    for at in [u64::MAX, 0, u64::MAX - 1] {
        queue.push(Note(at, 0));
    }
    let order: Vec<u64> = core::iter::from_fn(|| queue.pop_due(Instant::MAX)).map(|note| note.0).collect();
    assert_eq!(order, [0, u64::MAX - 1, u64::MAX]);
}
