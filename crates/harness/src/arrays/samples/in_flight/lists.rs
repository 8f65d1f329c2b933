//! Lists of items that share one memory.
//!
//! A list takes blocks of items, and its blocks are given back together. The block given back last is taken first. The memory in use is therefore hardly more
//! than the items in all lists, and its most recently used part is used again at once. With an allocation for each list, a long list would lie in another
//! allocation each time, and the allocations of all lists would grow to the length of the longest list.

/// Binary logarithm of the number of items of a block, for few items and for [`MANY`].
///
/// Short blocks suit few items. If blocks were long, the first blocks of many short lists would lie in few sets of a cache: with 50 peers, links like
/// `wifi-busy` took 121 ns a packet with blocks of 1024 items, and 26 ns with blocks of 32. Long blocks suit more items than a cache holds, because they are
/// read in order, where many short blocks lie anywhere in the memory: with 1000 peers, jitter and loss, a run with blocks of 1024 items took 0.65 of the time.
const SHIFTS: [u32; 2] = [5, 10];
/// Number of items from which on blocks are long: 5 MB.
const MANY: usize = 1 << 17;
/// Number of no block.
const NONE: u32 = u32::MAX;

/// Memory of many lists.
#[derive(Clone, Debug)]
pub(super) struct Lists<T> {
    /// Items of all blocks, indexed by place.
    items: Vec<T>,
    /// Number of the next block of the list, or of the next free block, indexed by number of a block. [`NONE`] after the last free block; without meaning in
    /// the last block of a list.
    following: Vec<u32>,
    /// Number of the free block given back last, or [`NONE`].
    free: u32,
    /// Item in places of a new block.
    fill: T,
    /// Binary logarithm of the number of items of a block.
    shift: u32,
}

/// A list in [`Lists`]. All its blocks but the last are full.
#[derive(Clone, Copy, Debug)]
pub(in crate::arrays::samples) struct List {
    /// Number of the first block. Without meaning in an empty list.
    first: u32,
    /// Place after the last item; 0 in an empty list. A place is the number of a block, times the number of items of a block, plus an index in the block.
    end: u32,
}

impl List {
    pub(super) const EMPTY: Self = Self { first: NONE, end: 0 };

    #[inline(always)]
    pub(super) const fn is_empty(self) -> bool {
        self.end == 0
    }
}

impl<T: Copy> Lists<T> {
    /// Returns a memory without lists, for about as many items as `expected`. `fill` stands in places without an item.
    pub(super) fn new(fill: T, expected: usize) -> Self {
        let shift = SHIFTS[usize::from(expected >= MANY)];
        Self { items: Vec::new(), following: Vec::new(), free: NONE, fill, shift }
    }

    /// Returns the number of the block of a place.
    #[inline(always)]
    const fn block_of(&self, place: u32) -> usize {
        (place >> self.shift) as usize
    }

    /// Returns whether a place is the first of a block.
    #[inline(always)]
    const fn is_first(&self, place: u32) -> bool {
        place & ((1 << self.shift) - 1) == 0
    }

    /// Appends a place to a list, and returns the place, and the item there, which the caller replaces.
    #[inline(always)]
    pub(super) fn push(&mut self, list: &mut List) -> (u32, &mut T) {
        self.push_unless(false, 0, list)
    }

    /// Returns the place `instead`, which was returned before, and its item if `is_in_place` is set. Appends a place to the list otherwise, like
    /// [`push`](Self::push).
    #[inline(always)]
    pub(super) fn push_unless(&mut self, is_in_place: bool, instead: u32, list: &mut List) -> (u32, &mut T) {
        // The place after a full block is the first place of some block, and so is that of an empty list.
        if !is_in_place & self.is_first(list.end) {
            self.lengthen(list);
        }
        let place = std::hint::select_unpredictable(is_in_place, instead, list.end);
        list.end += u32::from(!is_in_place);
        (place, &mut self.items[place as usize])
    }

    /// Appends a block to a list without room.
    #[inline(always)]
    fn lengthen(&mut self, list: &mut List) {
        let block = if self.free == NONE { self.grow() } else { self.free };
        self.free = self.following[block as usize];
        if list.is_empty() {
            list.first = block;
        } else {
            // The list is full, so its end is the end of its last block.
            let last = self.block_of(list.end) - 1;
            self.following[last] = block;
        }
        list.end = block << self.shift;
    }

    /// Adds a block, and returns its number.
    #[cold]
    #[expect(clippy::cast_possible_truncation, reason = "fewer than 2^32 items fit into memory")]
    fn grow(&mut self) -> u32 {
        self.items.resize(self.items.len() + (1 << self.shift), self.fill);
        self.following.push(NONE);
        self.following.len() as u32 - 1
    }

    /// Returns the items of a list, in order, in slices of at most a block.
    #[inline(always)]
    pub(super) fn slices(&self, list: List) -> impl Iterator<Item = &[T]> {
        let mut next = (!list.is_empty()).then_some(list.first as usize);
        std::iter::from_fn(move || {
            let block = next?;
            let (first, end) = (block << self.shift, list.end as usize);
            let is_last = block == self.block_of(list.end - 1);
            next = if is_last { None } else { Some(self.following[block] as usize) };
            Some(&self.items[first..if is_last { end } else { first + (1 << self.shift) }])
        })
    }

    /// Gives the blocks of a list back.
    #[inline(always)]
    pub(super) fn give_back(&mut self, list: List) {
        if !list.is_empty() {
            let last = self.block_of(list.end - 1);
            self.following[last] = self.free;
            self.free = list.first;
        }
    }

    /// Appends the items of the list `from` that `keeps` accepts to `list`, in order, and gives the blocks of `from` back.
    pub(super) fn append(&mut self, list: &mut List, from: List, keeps: impl Fn(&T) -> bool) {
        let items: Vec<T> = self.slices(from).flatten().filter(|item| keeps(item)).copied().collect();
        self.give_back(from);
        for item in items {
            *self.push(list).1 = item;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn items(lists: &Lists<u64>, list: List) -> Vec<u64> {
        lists.slices(list).flatten().copied().collect()
    }

    /// Number of items of the shortest block.
    const BLOCK: u32 = 1 << SHIFTS[0];

    /// Seven lists that grow and end in turn, at all lengths around a block, against vectors, with short blocks and with long ones.
    #[test]
    fn lists_hold_their_items() {
        for (expected, shift) in [0, MANY].into_iter().zip(SHIFTS) {
            let mut lists = Lists::new(0, expected);
            assert_eq!(lists.shift, shift);
            let block = 1_u64 << shift;
            let mut all = [(); 7].map(|()| (List::EMPTY, Vec::new()));
            let mut places = std::collections::BTreeMap::new();
            for step in 0..500 * block {
                let number = ((step * 5 + step / 11) % 7) as usize;
                let (list, expected) = &mut all[number];
                if expected.len() as u64 >= block - 3 + step % (block + 8) {
                    assert_eq!(items(&lists, *list), *expected);
                    lists.give_back(std::mem::replace(list, List::EMPTY));
                    expected.clear();
                    places.retain(|_, (other, _)| *other != number);
                }
                let (place, item) = lists.push(list);
                *item = step;
                expected.push(step);
                assert_eq!(places.insert(place, (number, step)), None, "a place has one item");
            }
            for (place, (number, item)) in places {
                assert_eq!(lists.push_unless(true, place, &mut all[number].0), (place, &mut { item }));
            }
            for (list, expected) in &all {
                assert_eq!(items(&lists, *list), *expected);
            }
            // Three blocks are the most that one of these lists takes.
            assert!(lists.following.len() <= 3 * all.len(), "{} blocks", lists.following.len());
        }
    }

    #[test]
    fn a_list_takes_the_block_given_back_last() {
        let mut lists = Lists::new(0, 0);
        let (mut first, mut second) = (List::EMPTY, List::EMPTY);
        for _ in 0..2 * BLOCK {
            lists.push(&mut first);
        }
        lists.push(&mut second);
        lists.give_back(second);
        lists.give_back(first);
        let mut third = List::EMPTY;
        let places: Vec<u32> = (0..=2 * BLOCK).map(|_| lists.push(&mut third).0).collect();
        assert_eq!([places[0], places[BLOCK as usize], places[2 * BLOCK as usize]].map(|place| lists.block_of(place)), [0, 1, 2]);
        assert_eq!(lists.following.len(), 3);
    }

    #[test]
    fn items_are_appended_in_order() {
        let mut lists = Lists::new(0, 0);
        let (mut even, mut all, mut kept) = (List::EMPTY, List::EMPTY, List::EMPTY);
        for item in 0..100 {
            *lists.push(&mut all).1 = item;
        }
        lists.append(&mut even, all, |item| item % 2 == 0);
        *lists.push(&mut kept).1 = 7;
        lists.append(&mut kept, even, |_| true);
        assert_eq!(items(&lists, kept), [7].into_iter().chain((0..100).step_by(2)).collect::<Vec<_>>());
        assert!(items(&lists, List::EMPTY).is_empty());
    }
}
