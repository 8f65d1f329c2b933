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
//! In the calendar an event stays in the slab where it was first stored. Buckets sort one word per event: the time since the beginning of the bucket, and the
//! index in the slab. The events, of some 48 bytes, are moved only into and out of the slab.
//!
//! The width of the buckets adapts to the events, so a bucket holds 4 to 16 events on average. With fewer events per bucket, searches for the next bucket
//! cost more; with more events, sorting costs more.
//!
//! A short calendar has no buckets: all events lie in the front, and a new event is inserted there. With few events in all, a bucket holds hardly
//! any, and finding and emptying the bucket takes longer than the insertion.

mod front;
mod slab;

use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;

use cohaptic_units::Instant;

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
pub struct EventQueue<E> {
    /// All events while `in_order` is true, else empty.
    ordered: Ring<E>,
    /// Whether the queue is a ring (all events in `ordered`) or a calendar (all events in `slab`).
    in_order: bool,
    /// Events of the calendar. Each event keeps its index until its removal.
    slab: Slab<E>,
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

/// Event outside `ring`: its instant, and its index in the slab.
type Entry = (Instant, u32);

/// Event in a bucket. The upper 32 bits are the time since the beginning of the bucket \[ns\], the lower 32 bits the index in the slab.
type Packed = u64;

/// Number of slots, a power of two. With the widths below, the slots span 134 ms to 34 s.
const RING: usize = 8192;
/// Allowed exponents of the width. At most 32, so a time within a bucket fits into half a word.
const WIDTHS: core::ops::RangeInclusive<u32> = 14..=22;
/// Initial exponent of the width: buckets of 131 µs.
const FIRST_WIDTH: u32 = 17;
/// Most events of a short calendar.
const SHORT: usize = 48;
/// Number of buckets brought to the front between two checks of the width.
const LOOK_EVERY: u32 = 1024;
/// Average number of events per bucket without a change of the width.
const RIGHT_FILL: core::ops::RangeInclusive<u64> = 4..=16;

impl<E: Event> Default for EventQueue<E> {
    fn default() -> Self {
        Self::new()
    }
}

impl<E: Event> EventQueue<E> {
    /// Returns an empty queue.
    #[must_use]
    pub fn new() -> Self {
        Self {
            ordered: Ring::new(),
            in_order: true,
            slab: Slab::new(),
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
    #[must_use]
    pub const fn len(&self) -> usize {
        if self.in_order { self.ordered.len() } else { self.len }
    }

    /// Returns whether no event is pending.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Adds an event. An event may lie before events already taken, and is then taken before all later events.
    #[inline(always)]
    pub fn push(&mut self, event: E) {
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
        let place = self.slab.store(make);
        self.len += 1;
        self.push_entry((at, place));
    }

    /// Removes and returns the first event if its instant is at most `now`.
    #[inline(always)]
    pub fn pop_due(&mut self, now: Instant) -> Option<E> {
        if self.in_order {
            if self.ordered.front()?.at() > now {
                return None;
            }
            return self.ordered.pop();
        }
        if !self.is_due(now) {
            return None;
        }
        let (_, place) = self.front.pop()?;
        self.len -= 1;
        // An empty calendar becomes a ring again.
        self.in_order = self.len == 0;
        self.slab.take(place)
    }

    /// Removes the first event if its instant is at most `now`, and returns the answer of `take` for the event. `take` is called at one place for both forms of
    /// the queue, so the compiler inlines `take` and reads only the used fields of the event.
    #[inline(always)]
    pub(crate) fn take_due<T>(&mut self, now: Instant, take: impl FnOnce(E) -> T) -> Option<T> {
        let place = if self.in_order {
            self.ordered.front().filter(|first| first.at() <= now)?;
            self.ordered.pass_front()?
        } else {
            if !self.is_due(now) {
                return None;
            }
            let (_, place) = self.front.pop()?;
            self.len -= 1;
            self.in_order = self.len == 0;
            self.slab.pass(place)
        };
        place.take().map(take)
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
        self.front.first().and_then(|first| self.slab.key(first.1))
    }

    /// Returns whether the front of the calendar begins with an event that is due at `now`, after a search for the next bucket if the front is empty.
    #[inline(always)]
    fn is_due(&mut self, now: Instant) -> bool {
        match self.front.first() {
            Some(first) => first.0 <= now,
            None => self.advance(now),
        }
    }

    /// Returns whether an event may be due at `now`, without a search. `false` is certain. After `true`, no event need be due.
    #[inline(always)]
    pub(crate) fn may_be_due(&self, now: Instant) -> bool {
        if self.in_order {
            return self.ordered.front().is_some_and(|first| first.at() <= now);
        }
        // Events in `ring` and `far` come after every event of the front, so the front decides unless it is empty.
        self.front.first().map_or(self.quiet_until <= now && self.len > 0, |first| first.0 <= now)
    }

    /// Returns the instant of the first event, or `None` for an empty queue.
    #[must_use]
    pub fn next_at(&self) -> Option<Instant> {
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
        self.ring[slot(bucket)].iter().min().map(|first| self.unpack(bucket, *first).0)
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
        let place = self.slab.store(|| event);
        self.len += 1;
        self.push_entry((at, place));
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

    /// Puts an event of the slab into the front, into a bucket, or beyond the buckets.
    #[inline(always)]
    fn push_entry(&mut self, entry: Entry) {
        // Later buckets stay unsorted until their time comes. A bucket before the next bucket is far beyond the ring in this difference.
        let bucket = self.bucket_of(entry.0);
        let beyond_next = bucket.wrapping_sub(self.current).wrapping_sub(1);
        if self.is_short || beyond_next >= RING as u64 - 1 {
            return self.push_elsewhere(bucket, entry);
        }
        self.quiet_until = self.quiet_until.min(entry.0);
        self.push_ring(bucket, entry);
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

    /// Packs an entry into the word of its bucket.
    fn pack(&self, (at, place): Entry) -> Packed {
        (at.as_nanos() & ((1 << self.width) - 1)) << 32 | u64::from(place)
    }

    /// Returns the entry of a word in the bucket with the number `bucket`.
    fn unpack(&self, bucket: u64, packed: Packed) -> Entry {
        (Instant::from_nanos((bucket << self.width) + (packed >> 32)), place_of(packed))
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
        let mut few = [0; FEW];
        let is_tie = |pair: &[Packed]| pair[0] >> 32 == pair[1] >> 32;
        let sorted = if events.windows(2).any(is_tie) {
            // Events of one instant, such as a flight of segments, are pushed in few ascending runs of keys. A stable sort merges the runs.
            events.sort_by_key(|packed| self.slab.key(place_of(*packed)));
            &mut events
        } else {
            let sorted = sort(&mut events, &mut few);
            if sorted.windows(2).any(is_tie) {
                // Words sort by instant and then by index in the slab. Keys are read from the slab only for two equal instants.
                sorted.sort_unstable_by_key(|packed| self.slab.key(place_of(*packed)));
            }
            sorted
        };
        let start = bucket << self.width;
        self.front.extend(sorted.iter().map(|&packed| (Instant::from_nanos(start + (packed >> 32)), place_of(packed))));
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
            entries.extend(events.iter().map(|packed| self.unpack(bucket, *packed)));
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
        let Self { front, slab, .. } = self;
        // Instants differ for nearly all pairs, so keys are read from the slab only for two equal instants.
        front.insert(entry, |other| other.0 < entry.0 || other.0 == entry.0 && slab.are_in_order(other.1, entry.1));
    }

    #[inline(always)]
    fn push_ring(&mut self, bucket: u64, entry: Entry) {
        let packed = self.pack(entry);
        let place = slot(bucket);
        let events = &mut self.ring[place];
        // The first event of a bucket marks its slot, and reuses the memory of an emptied bucket.
        if events.is_empty() {
            self.occupied[place / 64] |= 1 << (place % 64);
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

/// Returns the index in the slab of a packed event.
#[expect(clippy::cast_possible_truncation, reason = "the lower half is the place")]
fn place_of(packed: Packed) -> u32 {
    packed as u32
}

/// Sorts distinct words. At most [`FEW`] words are sorted into `few` by counting: the number of smaller words is the index of a word. No branch then depends on
/// the order of the words. A processor cannot predict this order.
fn sort<'a>(words: &'a mut [Packed], few: &'a mut [Packed; FEW]) -> &'a mut [Packed] {
    if words.len() > FEW {
        words.sort_unstable();
        return words;
    }
    for word in &*words {
        // Words are distinct, because each has a different index in the slab, so no two ranks are equal.
        let rank: usize = words.iter().map(|other| usize::from(other < word)).sum();
        few[rank] = *word;
    }
    &mut few[..words.len()]
}

/// Largest number of words sorted by counting.
const FEW: usize = 24;

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

    /// For events in the ring, in buckets and beyond the buckets: `may_be_due` is true if an event is due, and false after a search at the same instant that
    /// found no event.
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
