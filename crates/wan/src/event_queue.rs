//! The event queue: a ring while events come in order, and a calendar of buckets, each sorted when its time comes, as soon as they do not.
//!
//! Where all links have one constant delay, events are pushed in the order in which they are taken. Then the queue is a ring: a push, a pop and one
//! comparison an event. The first event out of order turns the ring into a calendar; an empty queue is a ring again.
//!
//! ```text
//!   front          ring of 8192 buckets of 2^w ns each                  far
//!   [a b c …]      │ │x│ │y z│ │ │ … │w│                                binary heap
//!   sorted,        unsorted; an empty bucket holds no memory            beyond the ring
//!   taken from
//! ```
//!
//! Events of a network come in bursts (all peers sample at a tick) whose arrivals lie close together, often already in order. Pushing to a bucket
//! and sorting it once is cheaper than a heap's sifting of every event. Which bucket an event is in, or whether the
//! queue is a ring, never changes the order: that is by key alone.
//!
//! In the calendar an event stays where it was stored first, in a slab. The sorted key is one word an event: how far into its bucket it happens, and
//! where it is. Events themselves, of 48 bytes, are moved only in and out.
//!
//! The width of a bucket follows the events, so that a bucket holds about eight: fewer cost a search for the next bucket each, more a longer sort.
//! With 10 peers and jitter this took 6 % off the instructions of a packet, against a fixed width that suits 50.

use alloc::collections::{BinaryHeap, VecDeque};
use alloc::vec::Vec;
use core::cmp::Reverse;

use cohaptic_units::Instant;

use crate::ring::Ring;

/// What an event is ordered by.
pub trait Event {
    /// Compares first by instant, then by the fixed rule that breaks ties.
    type Key: Ord;

    /// When it happens.
    fn at(&self) -> Instant;

    /// The key. Events with equal keys come out in no stated order: make keys differ.
    fn key(&self) -> Self::Key;
}

/// Events in order of their keys.
#[derive(Clone, Debug)]
pub struct EventQueue<E> {
    /// All events, while they come in order.
    ordered: Ring<E>,
    in_order: bool,
    /// The events of the calendar, each in its place until it is taken.
    slab: Slab<E>,
    /// The bucket being taken from, in order, and whatever was pushed that is not later than it.
    front: VecDeque<Entry>,
    /// The number of the front's bucket. Every event in the ring is in a later one.
    current: u64,
    ring: Vec<Vec<Packed>>,
    /// A bit for each bucket that is not empty.
    occupied: [u64; RING / 64],
    /// Memory of emptied buckets, to be used again: so the queue touches memory in proportion to its events, not to the ring.
    spare: Vec<Vec<Packed>>,
    far: BinaryHeap<Reverse<Entry>>,
    /// Nothing in the ring or beyond happens before this instant, so that the quiet ticks of a few peers search no bucket: it took 3 % of the instructions of three peers with jitter off.
    quiet_until: Instant,
    len: usize,
    /// Buckets are 2 to this power ns wide.
    width: u32,
    /// Buckets brought to the front since the width was last looked at, and the events in them.
    brought: (u32, u64),
}

/// An event outside the ring: its instant and its place in the slab.
type Entry = (Instant, u32);

/// An event in a bucket: how long after the bucket's begin it happens \[ns\] in the upper half, its place in the slab in the lower.
type Packed = u64;

/// How many buckets there are, each 2 to the power of one of these widths ns wide: the ring reaches from 134 ms to 34 s.
const RING: usize = 8192;
const WIDTHS: core::ops::RangeInclusive<u32> = 14..=22;
const FIRST_WIDTH: u32 = 17;
/// Number of buckets after which the width is checked; it is right if they held between these numbers of events on the average.
const LOOK_EVERY: u32 = 1024;
const RIGHT_FILL: core::ops::RangeInclusive<u64> = 4..=16;

impl<E: Event> Default for EventQueue<E> {
    fn default() -> Self {
        Self::new()
    }
}

impl<E: Event> EventQueue<E> {
    /// An empty queue.
    #[must_use]
    pub fn new() -> Self {
        Self {
            ordered: Ring::new(),
            in_order: true,
            slab: Slab { places: Vec::new(), free: Vec::new() },
            front: VecDeque::new(),
            current: 0,
            ring: Vec::new(),
            occupied: [0; RING / 64],
            spare: Vec::new(),
            far: BinaryHeap::new(),
            quiet_until: Instant::MAX,
            len: 0,
            width: FIRST_WIDTH,
            brought: (0, 0),
        }
    }

    /// How many events are pending.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.len
    }

    /// Whether no event is pending.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds an event. It may lie before events already taken; it then comes next.
    #[inline(always)]
    pub fn push(&mut self, event: E) {
        self.len += 1;
        if self.in_order {
            if self.ordered.back().is_none_or(|last| last.key() <= event.key()) {
                self.ordered.push(|| event);
                return;
            }
            self.become_calendar();
        }
        self.push_calendar(event);
    }

    /// The event that was pushed last, while all come in order.
    #[inline(always)]
    pub(crate) fn last_in_order(&self) -> Option<&E> {
        // In a calendar the ring is empty.
        self.ordered.back()
    }

    /// Adds the event of that instant that is made. `follows` says whether its key is not below that of [`EventQueue::last_in_order`]. It is made where it is stored: one that
    /// is handed on is written in parts and read as a whole, for which a processor waits.
    #[inline(always)]
    pub(crate) fn push_made(&mut self, at: Instant, follows: bool, make: impl FnOnce() -> E) {
        self.len += 1;
        if self.in_order {
            if follows {
                return self.ordered.push(make);
            }
            self.become_calendar();
        }
        let place = self.slab.store(make);
        self.push_entry((at, place));
    }

    /// Takes the first event if it is not later than `now`.
    #[inline(always)]
    pub fn pop_due(&mut self, now: Instant) -> Option<E> {
        if self.in_order {
            if self.ordered.front()?.at() > now {
                return None;
            }
            self.len -= 1;
            return self.ordered.pop();
        }
        if self.front.front().is_none_or(|first| first.0 > now) && !self.advance(now) {
            return None;
        }
        let (_, place) = self.front.pop_front()?;
        self.len -= 1;
        self.in_order = self.len == 0;
        self.slab.take(place)
    }

    /// Takes the first event if it is not later than `now`, and hands it on. That is asked for in one place for both kinds of queue, so that it is compiled into the loop of
    /// its caller, and only the fields of an event that it asks for are read: it took 60 instructions off an arrival.
    #[inline(always)]
    pub(crate) fn take_due<T>(&mut self, now: Instant, take: impl FnOnce(E) -> T) -> Option<T> {
        let place = if self.in_order {
            self.ordered.front().filter(|first| first.at() <= now)?;
            self.len -= 1;
            self.ordered.pass_front()?
        } else {
            if self.front.front().is_none_or(|first| first.0 > now) && !self.advance(now) {
                return None;
            }
            let (_, place) = self.front.pop_front()?;
            self.len -= 1;
            self.in_order = self.len == 0;
            self.slab.pass(place)
        };
        place.take().map(take)
    }

    /// Whether an event may be due at `now`. `false` is certain, `true` is where it takes no search to know.
    #[inline(always)]
    pub(crate) fn may_be_due(&self, now: Instant) -> bool {
        if self.in_order {
            return self.ordered.front().is_some_and(|first| first.at() <= now);
        }
        self.front.front().map_or(self.quiet_until <= now && self.len > 0, |first| first.0 <= now)
    }

    /// The instant of the first event.
    #[must_use]
    pub fn next_at(&self) -> Option<Instant> {
        if self.in_order {
            return self.ordered.front().map(Event::at);
        }
        if let Some(first) = self.front.front() {
            return Some(first.0);
        }
        let Some(bucket) = self.next_occupied() else {
            return self.far.peek().map(|Reverse(first)| first.0);
        };
        self.ring[slot(bucket)].iter().min().map(|first| self.unpack(bucket, *first).0)
    }

    /// Puts the events of the ring that the queue was into buckets, from the first one on.
    #[cold]
    fn become_calendar(&mut self) {
        self.in_order = false;
        self.quiet_until = Instant::MAX;
        self.ring.resize_with(RING, Vec::new);
        self.current = self.ordered.front().map_or(0, |first| self.bucket_of(first.at()));
        let mut ordered = core::mem::take(&mut self.ordered);
        while let Some(event) = ordered.pop() {
            self.push_calendar(event);
        }
    }

    #[inline]
    fn push_calendar(&mut self, event: E) {
        let at = event.at();
        let place = self.slab.store(|| event);
        self.push_entry((at, place));
    }

    #[inline]
    fn push_entry(&mut self, entry: Entry) {
        let bucket = self.bucket_of(entry.0);
        if bucket <= self.current {
            return self.push_front(entry);
        }
        self.quiet_until = self.quiet_until.min(entry.0);
        if bucket - self.current < RING as u64 {
            self.push_ring(bucket, entry);
        } else {
            self.far.push(Reverse(entry));
        }
    }

    fn bucket_of(&self, at: Instant) -> u64 {
        at.as_nanos() >> self.width
    }

    fn pack(&self, (at, place): Entry) -> Packed {
        (at.as_nanos() & ((1 << self.width) - 1)) << 32 | u64::from(place)
    }

    fn unpack(&self, bucket: u64, packed: Packed) -> Entry {
        (Instant::from_nanos((bucket << self.width) + (packed >> 32)), place_of(packed))
    }

    /// Brings the next bucket that is due to the front; says whether the front now begins with an event that is due.
    fn advance(&mut self, now: Instant) -> bool {
        let present = self.bucket_of(now);
        while self.front.is_empty() && self.len > 0 {
            let next = self.next_occupied().or_else(|| self.far.peek().map(|Reverse(first)| self.bucket_of(first.0)));
            let Some(next) = next else { break };
            if next > present {
                self.quiet_until = Instant::from_nanos(next << self.width);
                break;
            }
            self.bring_to_front(next);
        }
        if self.front.is_empty() {
            // Nothing lies before the present: later events may use the whole ring from here on.
            self.move_to(self.current.max(present));
        }
        self.front.front().is_some_and(|first| first.0 <= now)
    }

    fn bring_to_front(&mut self, bucket: u64) {
        let place = slot(bucket);
        self.occupied[place / 64] &= !(1 << (place % 64));
        let mut events = core::mem::take(&mut self.ring[place]);
        self.brought = (self.brought.0 + 1, self.brought.1 + events.len() as u64);
        let mut few = [0; FEW];
        let sorted = sort(&mut events, &mut few);
        if sorted.windows(2).any(|pair| pair[0] >> 32 == pair[1] >> 32) {
            // Instants decide most often, so that the events themselves are looked at only where two are equal.
            sorted.sort_unstable_by_key(|packed| self.slab.key(place_of(*packed)));
        }
        let start = bucket << self.width;
        self.front.extend(sorted.iter().map(|&packed| (Instant::from_nanos(start + (packed >> 32)), place_of(packed))));
        events.clear();
        if events.capacity() > 0 {
            self.spare.push(events);
        }
        self.move_to(bucket);
        if self.brought.0 == LOOK_EVERY {
            self.adapt_width();
        }
    }

    /// Widens buckets that hold too few events and narrows those that hold too many, and puts everything in its new place.
    #[cold]
    fn adapt_width(&mut self) {
        let fill = self.brought.1 / u64::from(self.brought.0);
        self.brought = (0, 0);
        let width = if fill < *RIGHT_FILL.start() {
            self.width + 1
        } else if fill > *RIGHT_FILL.end() {
            self.width - 1
        } else {
            return;
        };
        if !WIDTHS.contains(&width) {
            return;
        }
        let mut entries: Vec<Entry> = core::mem::take(&mut self.front).into();
        while let Some(bucket) = self.next_occupied() {
            let place = slot(bucket);
            self.occupied[place / 64] &= !(1 << (place % 64));
            let events = core::mem::take(&mut self.ring[place]);
            entries.extend(events.iter().map(|packed| self.unpack(bucket, *packed)));
        }
        entries.extend(core::mem::take(&mut self.far).into_iter().map(|Reverse(entry)| entry));
        self.width = width;
        self.current = entries.iter().map(|entry| self.bucket_of(entry.0)).min().unwrap_or(0);
        for entry in entries {
            self.push_entry(entry);
        }
    }

    /// Makes a bucket the current one, and pulls in from afar what the ring now reaches.
    fn move_to(&mut self, bucket: u64) {
        self.current = bucket;
        while let Some(Reverse(first)) = self.far.peek() {
            if self.bucket_of(first.0).saturating_sub(self.current) >= RING as u64 {
                break;
            }
            let Some(Reverse(entry)) = self.far.pop() else { break };
            self.push_entry(entry);
        }
    }

    fn push_front(&mut self, entry: Entry) {
        let key = |(at, place): Entry| (at, self.slab.key(place));
        let wanted = key(entry);
        // Bursts come in order: most often the event belongs at the end.
        if self.front.back().is_none_or(|last| key(*last) <= wanted) {
            self.front.push_back(entry);
        } else {
            let place = self.front.partition_point(|other| key(*other) <= wanted);
            self.front.insert(place, entry);
        }
    }

    #[inline]
    fn push_ring(&mut self, bucket: u64, entry: Entry) {
        let packed = self.pack(entry);
        let place = slot(bucket);
        let events = &mut self.ring[place];
        if events.is_empty() {
            self.occupied[place / 64] |= 1 << (place % 64);
            if let Some(spare) = self.spare.pop() {
                *events = spare;
            }
        }
        events.push(packed);
    }

    /// The first bucket after the current one that is not empty.
    fn next_occupied(&self) -> Option<u64> {
        let start = self.current + 1;
        let (word, bit) = (slot(start) / 64, slot(start) % 64);
        let words = self.occupied.len();
        // The first word is looked at twice: its upper bits first, and its lower ones, which belong to the far end of the ring, last.
        for step in 0..=words {
            let index = (word + step) % words;
            let mask = match step {
                0 => !0 << bit,
                _ if step == words => !(!0 << bit),
                _ => !0,
            };
            let found = self.occupied[index] & mask;
            if found != 0 {
                let place = index as u64 * 64 + u64::from(found.trailing_zeros());
                return Some(start + (place.wrapping_sub(start) & (RING as u64 - 1)));
            }
        }
        None
    }
}

#[expect(clippy::cast_possible_truncation, reason = "masked to the size of the ring")]
fn slot(bucket: u64) -> usize {
    (bucket & (RING as u64 - 1)) as usize
}

#[expect(clippy::cast_possible_truncation, reason = "the lower half is the place")]
fn place_of(packed: Packed) -> u32 {
    packed as u32
}

/// Sorts words that are all different, into `few` where there are few. Then each is put behind as many as are smaller: no branch depends on the order,
/// which a processor could not foresee. It took 4 % off a packet with jitter.
fn sort<'a>(words: &'a mut [Packed], few: &'a mut [Packed; FEW]) -> &'a mut [Packed] {
    if words.len() > FEW {
        words.sort_unstable();
        return words;
    }
    for word in &*words {
        let rank: usize = words.iter().map(|other| usize::from(other < word)).sum();
        few[rank] = *word;
    }
    &mut few[..words.len()]
}

/// Largest number of words that is sorted by counting.
const FEW: usize = 24;

/// Events in places of their own, which are used again.
#[derive(Clone, Debug)]
struct Slab<E> {
    places: Vec<Option<E>>,
    free: Vec<u32>,
}

impl<E: Event> Slab<E> {
    #[inline(always)]
    fn store(&mut self, make: impl FnOnce() -> E) -> u32 {
        let place = self.free.pop().unwrap_or_else(|| self.grow());
        let stored = &mut self.places[place as usize];
        // It always is: where it is known, nothing is dropped there, and the event is not made elsewhere first.
        if stored.is_none() {
            *stored = Some(make());
        }
        place
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self) -> u32 {
        let place = u32::try_from(self.places.len()).expect("fewer than 2^32 events, 200 GB of them, are pending");
        self.places.push(None);
        place
    }

    /// Frees a place, out of which the event is to be taken.
    #[inline(always)]
    fn pass(&mut self, place: u32) -> &mut Option<E> {
        self.free.push(place);
        &mut self.places[place as usize]
    }

    #[inline]
    fn take(&mut self, place: u32) -> Option<E> {
        self.free.push(place);
        self.places[place as usize].take()
    }

    /// The key of a stored event; `None` only for a place that is free.
    fn key(&self, place: u32) -> Option<E::Key> {
        self.places[place as usize].as_ref().map(Event::key)
    }
}

#[cfg(test)]
mod tests {
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

    /// Over a ring, buckets and what lies beyond them: whatever is due may be due, and what was searched in vain is not searched again at the same instant.
    #[test]
    fn what_is_due_may_be_due() {
        let (mut queue, mut pending, mut number) = (EventQueue::new(), alloc::collections::BTreeSet::new(), 2015_u64);
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
            assert!(first.is_none() || queue.may_be_due(at), "{first:?} is due at {now}");
            quiet += usize::from(first.is_none() && !pending.is_empty() && !queue.may_be_due(at));
            assert_eq!(queue.pop_due(at), first);
            if let Some(first) = first {
                pending.remove(&first);
            } else {
                assert!(!queue.may_be_due(at), "what was searched in vain at {now} is searched again");
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
}
