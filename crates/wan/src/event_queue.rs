//! Event queue: a first-in, first-out ring while events are pushed in order, and a calendar of buckets otherwise. A bucket is sorted when its time comes.
//!
//! If all links have the same constant delay, events are pushed in the order of taking. The queue is then a ring, with a push, a pop and a comparison per
//! event. The first event out of order turns the ring into a calendar. An empty calendar becomes a ring again.
//!
//! ```text
//!   front          ring of 8192 buckets of 2^w ns each                  far
//!   [a b c …]      │ │x│ │y z│ │ │ … │w│                                binary heap
//!   sorted,        unsorted; an empty bucket holds no memory            beyond the ring
//!   taken from
//! ```
//!
//! Events of a network come in bursts (all peers sample at a tick). The arrivals lie close together and are often in order already. Each bucket is sorted
//! only once, while a heap would sift every event. Neither the bucket of an event nor the form of the queue changes the order of events: the order depends on
//! the keys alone.
//!
//! In the calendar an event stays in its [store](Store). Buckets sort one word per event: the lower bits of the instant, and the place in the
//! store. The store of an [`EventQueue`] is a slab of events. A network has a store that keeps what the packets of a broadcast have in common only once.
//!
//! The width of the buckets adapts to the events, so a bucket holds 4 to 16 events on average. With fewer events per bucket, searches for the next bucket
//! cost more; with more events, sorting costs more.
//!
//! A short calendar has no buckets: all events lie in the front, and a new event is inserted there. With few events in all, a bucket holds hardly
//! any, and finding and emptying the bucket takes longer than the insertion.

mod bucket;
mod front;
pub(crate) mod slab;
#[cfg(test)]
mod tests;

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;
use core::ops::ControlFlow;

use cohaptic_units::Instant;

use bucket::{FEW, PLACE_BITS, Packed, has_ties, pack, sort_few, unpack};
use front::Front;
use slab::Slab;

use crate::ring::Ring;

/// Event of a queue, with its instant and its key.
pub trait Event {
    /// Key for the order of events: first by instant, then by a fixed rule for ties.
    type Key: Ord;

    /// Returns the instant of the event.
    fn at(&self) -> Instant;

    /// Returns the key of the event. The order of events with equal keys is not specified, so keys should be distinct.
    fn key(&self) -> Self::Key;
}

/// Queue of events, taken in the order of their keys.
#[derive(Clone, Debug)]
pub struct EventQueue<E>(Queue<E, Slab<E>>);

impl<E: Event> Default for EventQueue<E> {
    fn default() -> Self {
        Self::new()
    }
}

impl<E: Event> EventQueue<E> {
    /// Returns an empty queue.
    #[must_use]
    pub fn new() -> Self {
        Self(Queue::new(Slab::new()))
    }

    /// Returns the number of pending events.
    #[must_use]
    pub const fn len(&self) -> usize {
        self.0.len()
    }

    /// Returns whether no event is pending.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.0.len() == 0
    }

    /// Adds an event. An event may lie before events already taken, and is then taken before all later events.
    #[inline(always)]
    pub fn push(&mut self, event: E) {
        self.0.push(event);
    }

    /// Removes and returns the first event if its instant is at most `now`.
    #[inline(always)]
    pub fn pop_due(&mut self, now: Instant) -> Option<E> {
        self.0.take_due(now, |event| event)
    }

    /// Returns the instant of the first event, or `None` for an empty queue.
    #[must_use]
    pub fn next_at(&self) -> Option<Instant> {
        self.0.next_at()
    }
}

/// Storage of the events of a calendar.
pub(crate) trait Store<E: Event> {
    /// Stores an event constructed by `make`, and returns its place.
    fn store(&mut self, make: impl FnOnce() -> E) -> Place;

    /// Removes and returns the event at a place. `at` is the instant of the event.
    fn take(&mut self, at: Instant, place: Place) -> Option<E>;

    /// Returns the key of the event at a place, or `None` for a place without event. `at` is the instant of the event.
    fn key(&self, at: Instant, place: Place) -> Option<E::Key>;
}

/// Place of an event in a store: a number below 2^[`PLACE_BITS`].
pub(crate) type Place = u64;

/// [`EventQueue`] with the store S.
#[derive(Clone, Debug)]
pub(crate) struct Queue<E, S> {
    /// All events while `in_order` is true, else empty.
    ordered: Ring<E>,
    /// Whether the queue is a ring (all events in `ordered`) or a calendar (all events in `store`).
    in_order: bool,
    /// Events of the calendar. Each event keeps its place until its removal.
    store: S,
    /// Events in order, with the next events to take: the events of the current bucket, and events pushed later into this bucket or an earlier bucket.
    front: Front,
    /// `true` if all events of the calendar lie in `front`, whatever their buckets. Becomes `false` when the calendar has more than [`SHORT`] events, and stays
    /// so until the queue is a ring again.
    is_short: bool,
    /// Number of the current bucket: its instant divided by the width. Every event in `ring` and in `far` lies in a later bucket. Without meaning in a short
    /// calendar.
    current: u64,
    /// Unsorted buckets after the current bucket, indexed by [`slot`]. Fewer than `RING` consecutive buckets are in use, so no two share a slot.
    ring: Vec<Vec<Packed>>,
    /// Bits of the occupied slots in `ring`: slot i is bit i mod 64 of word i / 64.
    occupied: [u64; RING / 64],
    /// Memory of emptied buckets for reuse. The queue then touches memory in proportion to its events, and not to the number of slots.
    spare: Vec<Vec<Packed>>,
    /// Events at least `RING` buckets after the current bucket.
    far: BinaryHeap<Reverse<Entry>>,
    /// Lower bound of the instants of all events in `ring` and `far`. Ticks before this instant need no search for the next bucket.
    quiet_until: Instant,
    /// Number of events in the calendar, 0 while the queue is a ring.
    len: usize,
    /// Width of a bucket as an exponent: a bucket spans 2^`width` ns.
    width: u32,
    /// Number of buckets brought to the front since the latest check of the width, and number of events in these buckets.
    brought: (u32, u64),
}

/// Event outside `ring`: its instant, and its place in the store.
type Entry = (Instant, Place);

/// Number of slots, a power of two. With the widths below, the slots span 134 ms to 34 s.
const RING: usize = 8192;
/// Allowed exponents of the width. At most 64 − [`PLACE_BITS`], so an instant within a bucket and a place fit into a word.
const WIDTHS: core::ops::RangeInclusive<u32> = 14..=22;
/// Initial exponent of the width: buckets of 131 µs.
const FIRST_WIDTH: u32 = 17;
/// Most events of a short calendar.
const SHORT: usize = 48;
/// Number of buckets brought to the front between two checks of the width.
const LOOK_EVERY: u32 = 1024;
/// Average number of events per bucket without a change of the width.
const RIGHT_FILL: core::ops::RangeInclusive<u64> = 4..=16;

impl<E: Event, S: Store<E>> Queue<E, S> {
    /// Returns an empty queue with an empty store.
    pub(crate) fn new(store: S) -> Self {
        Self {
            ordered: Ring::new(),
            in_order: true,
            store,
            front: Front::default(),
            is_short: false,
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

    /// Returns the number of pending events.
    pub(crate) const fn len(&self) -> usize {
        if self.in_order { self.ordered.len() } else { self.len }
    }

    /// Adds an event: see [`EventQueue::push`].
    #[inline(always)]
    pub(crate) fn push(&mut self, event: E) {
        if self.in_order {
            if self.ordered.back().is_none_or(|last| last.key() <= event.key()) {
                self.ordered.push(|| event);
                return;
            }
            // The event comes before the last event in the ring.
            self.become_calendar();
        }
        self.push_calendar(event);
    }

    /// Returns the event pushed last, or `None` if the queue is empty or a calendar.
    #[inline(always)]
    pub(crate) fn last_in_order(&self) -> Option<&E> {
        // `ordered` is empty in a calendar.
        self.ordered.back()
    }

    /// Adds an event at the instant `at`. `make` constructs the event in its final place, so no large value is moved. `follows` tells whether the key of
    /// the event is at least the key of [`EventQueue::last_in_order`].
    #[inline(always)]
    pub(crate) fn push_made(&mut self, at: Instant, follows: bool, make: impl FnOnce() -> E) {
        if self.in_order {
            if follows {
                return self.ordered.push(make);
            }
            self.become_calendar();
        }
        let place = self.store.store(make);
        self.push_stored(at, place);
    }

    /// Turns the queue into a calendar, and returns the store. Events put into the store must be announced by [`Queue::push_stored`] before the next removal.
    pub(crate) fn open_store(&mut self) -> &mut S {
        if self.in_order {
            self.become_calendar();
        }
        &mut self.store
    }

    /// Adds an event of the store. The queue is a calendar.
    #[inline(always)]
    pub(crate) fn push_stored(&mut self, at: Instant, place: Place) {
        self.len += 1;
        self.push_entry((at, place));
    }

    /// Removes the first event if its instant is at most `now`, and returns the answer of `take` for the event. `take` is called at one place for both forms of
    /// the queue, so the compiler inlines `take` and reads only the used fields of the event.
    #[inline(always)]
    pub(crate) fn take_due<T>(&mut self, now: Instant, take: impl FnOnce(E) -> T) -> Option<T> {
        let event = if self.in_order {
            self.ordered.front().filter(|first| first.at() <= now)?;
            self.ordered.pop()?
        } else {
            if !self.is_due(now) {
                return None;
            }
            let (at, place) = self.front.pop()?;
            self.len -= 1;
            // An empty calendar becomes a ring again.
            self.in_order = self.len == 0;
            self.store.take(at, place)?
        };
        Some(take(event))
    }

    /// Removes the first events of a calendar with instants of at most `now`, and gives each event to `take`, until `take` breaks. Ends at the latest after the
    /// events of a bucket: `None` says nothing about further events.
    #[inline(always)]
    pub(crate) fn take_some_due<T>(&mut self, now: Instant, mut take: impl FnMut(E) -> ControlFlow<T>) -> Option<T> {
        let Self { front, store, .. } = self;
        let (mut taken, mut ended) = (0, None);
        for &(at, place) in front.entries().iter().take_while(|entry| entry.0 <= now) {
            taken += 1;
            if let Some(event) = store.take(at, place)
                && let ControlFlow::Break(value) = take(event)
            {
                ended = Some(value);
                break;
            }
        }
        // Counted once for all events, because `take` cannot see the queue.
        if taken > 0 {
            front.drop_first(taken);
            self.len -= taken;
            // An empty calendar becomes a ring again.
            self.in_order = self.len == 0;
        }
        ended
    }

    /// Returns whether the queue is a ring.
    #[inline(always)]
    pub(crate) const fn is_in_order(&self) -> bool {
        self.in_order
    }

    /// Returns the key of the first event if its instant is at most `now`.
    #[inline]
    pub(crate) fn due_key(&mut self, now: Instant) -> Option<E::Key> {
        if self.in_order {
            return self.ordered.front().filter(|first| first.at() <= now).map(Event::key);
        }
        if !self.is_due(now) {
            return None;
        }
        self.front.first().and_then(|first| self.store.key(first.0, first.1))
    }

    /// Returns whether the front of the calendar begins with an event that is due at `now`, after a search for the next bucket if the front is empty.
    #[inline(always)]
    pub(crate) fn is_due(&mut self, now: Instant) -> bool {
        match self.front.first() {
            Some(first) => first.0 <= now,
            None => self.advance(now),
        }
    }

    /// Returns an instant before which no event is due, without a search. An event need not be due at the instant. [`Instant::MAX`] for an empty queue.
    #[inline(always)]
    pub(crate) fn quiet_until(&self) -> Instant {
        if self.in_order {
            return self.ordered.front().map_or(Instant::MAX, Event::at);
        }
        // Events in `ring` and `far` come after every event of the front, so the front decides unless it is empty.
        self.front.first().map_or(if self.len > 0 { self.quiet_until } else { Instant::MAX }, |first| first.0)
    }

    /// Returns the instant of the first event, or `None` for an empty queue.
    pub(crate) fn next_at(&self) -> Option<Instant> {
        if self.in_order {
            return self.ordered.front().map(Event::at);
        }
        // Front, ring and far hold events in this order of time, so the first event found decides.
        if let Some(first) = self.front.first() {
            return Some(first.0);
        }
        let Some(bucket) = self.next_occupied() else {
            return self.far.peek().map(|Reverse(first)| first.0);
        };
        // A bucket is unsorted until its time comes, so its minimum is searched.
        self.ring[slot(bucket)].iter().min().map(|first| unpack(bucket << self.width, *first).0)
    }

    /// Turns the ring into a calendar, which is short at first, and moves all events of `ordered` there.
    #[cold]
    fn become_calendar(&mut self) {
        self.in_order = false;
        self.is_short = true;
        self.quiet_until = Instant::MAX;
        let mut ordered = core::mem::take(&mut self.ordered);
        while let Some(event) = ordered.pop() {
            self.push_calendar(event);
        }
    }

    #[inline]
    fn push_calendar(&mut self, event: E) {
        let at = event.at();
        let place = self.store.store(|| event);
        self.push_stored(at, place);
    }

    /// Distributes the events of a short calendar, which are all in the front, to buckets.
    #[cold]
    fn fill_buckets(&mut self) {
        self.is_short = false;
        self.ring.resize_with(RING, Vec::new);
        let events = core::mem::take(&mut self.front).into_entries();
        // Events of the front are in order, so no event lies before the bucket of the first event.
        self.current = events.first().map_or(0, |first| self.bucket_of(first.0));
        for entry in events {
            self.push_entry(entry);
        }
    }

    /// Puts an event of the store into the front, into a bucket, or beyond the buckets.
    #[inline(always)]
    fn push_entry(&mut self, entry: Entry) {
        // Later buckets stay unsorted until their time comes. A bucket before the next bucket is far beyond the ring in this difference.
        let bucket = self.bucket_of(entry.0);
        let beyond_next = bucket.wrapping_sub(self.current).wrapping_sub(1);
        if self.is_short || beyond_next >= RING as u64 - 1 {
            return self.push_elsewhere(bucket, entry);
        }
        let packed = pack(entry);
        let events = &mut self.ring[slot(bucket)];
        // An empty bucket has no memory, so one test finds both empty and full buckets.
        if events.len() == events.capacity() {
            return self.push_without_room(bucket, packed);
        }
        events.push(packed);
    }

    /// Puts an event into the front or beyond the buckets. Not inlined, so that a push into a bucket stays small.
    #[inline(never)]
    fn push_elsewhere(&mut self, bucket: u64, entry: Entry) {
        if self.is_short {
            self.push_front(entry);
            if self.len > SHORT {
                self.fill_buckets();
            }
        } else if bucket <= self.current {
            // Past events and events of the current bucket go to the sorted front.
            self.push_front(entry);
        } else {
            self.quiet_until = self.quiet_until.min(entry.0);
            self.far.push(Reverse(entry));
        }
    }

    /// Returns the number of the bucket of an instant.
    fn bucket_of(&self, at: Instant) -> u64 {
        at.as_nanos() >> self.width
    }

    /// Brings the next bucket to the front if the front is empty and the bucket has begun at `now`. Returns whether the front begins with a due event.
    fn advance(&mut self, now: Instant) -> bool {
        let present = self.bucket_of(now);
        while self.front.first().is_none() && self.len > 0 {
            // All events of `ring` come before all events of `far`.
            let next = self.next_occupied().or_else(|| self.far.peek().map(|Reverse(first)| self.bucket_of(first.0)));
            let Some(next) = next else { break };
            if next > present {
                // The first event of a later bucket may lie at its beginning, and not earlier.
                self.quiet_until = Instant::from_nanos(next << self.width);
                break;
            }
            self.bring_to_front(next);
        }
        if self.front.first().is_none() {
            // No event lies in the present bucket or before, so the ring may begin here. Events pushed next then find all slots free for the time ahead.
            self.move_to(self.current.max(present));
        }
        self.front.first().is_some_and(|first| first.0 <= now)
    }

    /// Sorts a bucket into the empty front, and makes the bucket the current bucket. If the first event is in `far`, the slot is empty, and `move_to` pulls the
    /// events out of `far`.
    fn bring_to_front(&mut self, bucket: u64) {
        let place = slot(bucket);
        self.occupied[place / 64] &= !(1 << (place % 64));
        let mut events = core::mem::take(&mut self.ring[place]);
        self.brought = (self.brought.0 + 1, self.brought.1 + events.len() as u64);
        let begin = bucket << self.width;
        let Self { front, store, .. } = self;
        let key = |entry: &Entry| store.key(entry.0, entry.1);
        if events.len() <= FEW {
            let sorted = front.refill(sort_few(&events, &mut [0; FEW]).iter().map(|packed| unpack(begin, *packed)));
            // Keys are read from the store only for two equal instants.
            if has_ties(sorted) {
                sorted.sort_by_key(key);
            }
        } else {
            let is_tie = |pair: &[Packed]| pair[0] >> PLACE_BITS == pair[1] >> PLACE_BITS;
            // Events of one instant, such as a flight of segments, are pushed in few ascending runs of keys. A stable sort merges the runs.
            let are_flights = events.windows(2).any(is_tie);
            if !are_flights {
                events.sort_unstable();
            }
            let sorted = front.refill(events.iter().map(|packed| unpack(begin, *packed)));
            if are_flights {
                sorted.sort_by_key(key);
            } else if has_ties(sorted) {
                // Words sort by instant and then by place.
                sorted.sort_unstable_by_key(key);
            }
        }
        // Buckets without any event so far have no memory to keep.
        events.clear();
        if events.capacity() > 0 {
            self.spare.push(events);
        }
        self.move_to(bucket);
        if self.brought.0 == LOOK_EVERY {
            self.adapt_width();
        }
    }

    /// Doubles the width if buckets hold too few events, halves the width if buckets hold too many, and then stores all events anew.
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
        let mut entries = core::mem::take(&mut self.front).into_entries();
        while let Some(bucket) = self.next_occupied() {
            let place = slot(bucket);
            self.occupied[place / 64] &= !(1 << (place % 64));
            let events = core::mem::take(&mut self.ring[place]);
            entries.extend(events.iter().map(|packed| unpack(bucket << self.width, *packed)));
        }
        entries.extend(core::mem::take(&mut self.far).into_iter().map(|Reverse(entry)| entry));
        self.width = width;
        // The earliest bucket becomes the current bucket, so `push_entry` sorts the events of the bucket into the front.
        self.current = entries.iter().map(|entry| self.bucket_of(entry.0)).min().unwrap_or(0);
        for entry in entries {
            self.push_entry(entry);
        }
    }

    /// Makes a bucket the current bucket, and moves events from `far` now within reach to the ring or to the front.
    fn move_to(&mut self, bucket: u64) {
        self.current = bucket;
        while let Some(Reverse(first)) = self.far.peek() {
            // `far` is ordered by instant, so the first event out of reach ends the search.
            if self.bucket_of(first.0).saturating_sub(self.current) >= RING as u64 {
                break;
            }
            let Some(Reverse(entry)) = self.far.pop() else { break };
            self.push_entry(entry);
        }
    }

    /// Inserts an entry into the front by instant and key.
    fn push_front(&mut self, entry: Entry) {
        let Self { front, store, .. } = self;
        // Instants differ for nearly all pairs, so keys are read from the store only for two equal instants.
        front.insert(entry, |other| other.0 < entry.0 || other.0 == entry.0 && are_in_order(store, *other, entry));
    }

    /// Puts an event into a bucket without room. Marks the slot of an empty bucket, and reuses the memory of an emptied bucket. Not inlined, so that a push
    /// into a bucket stays small.
    #[inline(never)]
    fn push_without_room(&mut self, bucket: u64, packed: Packed) {
        let place = slot(bucket);
        let events = &mut self.ring[place];
        if events.is_empty() {
            self.occupied[place / 64] |= 1 << (place % 64);
            // Later events of the bucket may lie before this event, but not before the bucket.
            self.quiet_until = self.quiet_until.min(Instant::from_nanos(bucket << self.width));
            if let Some(spare) = self.spare.pop() {
                *events = spare;
            }
        }
        events.push(packed);
    }

    /// Returns the number of the first occupied bucket after the current bucket, or `None` if all slots are empty.
    fn next_occupied(&self) -> Option<u64> {
        let start = self.current + 1;
        let (word, bit) = (slot(start) / 64, slot(start) % 64);
        let words = self.occupied.len();
        // The first word is tested twice: first its upper bits, and last its lower bits for the latest buckets of the ring.
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
                // The distance from `start` to the slot, modulo the number of slots, turns the slot back into a bucket number.
                return Some(start + (place.wrapping_sub(start) & (RING as u64 - 1)));
            }
        }
        None
    }
}

/// Returns the slot of a bucket: its number modulo the number of slots.
#[expect(clippy::cast_possible_truncation, reason = "masked to the size of the ring")]
fn slot(bucket: u64) -> usize {
    (bucket & (RING as u64 - 1)) as usize
}

/// Returns whether the key of the event `first` is at most the key of the event `second`. Not inlined, because the comparison of two keys is longer than
/// everything around it, and rare.
#[inline(never)]
fn are_in_order<E: Event>(store: &impl Store<E>, first: Entry, second: Entry) -> bool {
    store.key(first.0, first.1) <= store.key(second.0, second.1)
}
