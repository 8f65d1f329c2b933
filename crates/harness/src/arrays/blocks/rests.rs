//! Peers that do not tick while others do: what they are is kept, and put back after the tick of all.

use super::{Blocks, Forces, Mask, Motions, WIDTH};

/// What all peers were before a tick that only some of them make.
#[derive(Clone, Debug, Default)]
pub(in crate::arrays) struct Rests {
    /// Devices and copies, by block.
    motions: Vec<[Motions; 2]>,
    late: Vec<Forces>,
    memory: Vec<f64>,
    /// The oldest copies that the law looks back to, by block.
    oldest: Vec<Motions>,
}

impl Rests {
    /// Keeps what all peers are.
    pub(in crate::arrays) fn keep(&mut self, blocks: &Blocks) {
        self.motions.clear();
        self.motions.extend(blocks.blocks.iter().map(|block| [block.device, block.object]));
        self.late.clear();
        self.late.extend(blocks.late.iter().flatten().map(|late| late.computed));
        self.memory.clear();
        self.memory.extend_from_slice(&blocks.memory);
        self.oldest.clear();
        if !blocks.past.is_empty() {
            let count = blocks.blocks.len();
            self.oldest.extend_from_slice(&blocks.past[blocks.oldest * count..(blocks.oldest + 1) * count]);
        }
    }

    /// Puts all but those peers back, by block of peers, after a tick.
    pub(in crate::arrays) fn put_back(&self, blocks: &mut Blocks, tick: &[Mask]) {
        let (per_axis, count) = (tick.len(), blocks.blocks.len());
        let remembered = self.memory.len() / count;
        for (place, [device, object]) in self.motions.iter().enumerate() {
            let tick = tick[place % per_axis];
            let block = &mut blocks.blocks[place];
            for (now, before) in [(&mut block.device, device), (&mut block.object, object)] {
                now.position = tick.choose(now.position, before.position);
                now.velocity = tick.choose(now.velocity, before.velocity);
            }
            if let (Some(late), Some(before)) = (&mut blocks.late, self.late.get(place)) {
                let now = &mut late[place].computed;
                now.coupling = tick.choose(now.coupling, before.coupling);
                now.on_object = tick.choose(now.on_object, before.on_object);
            }
            let each = remembered / WIDTH;
            for lane in (0..WIDTH).filter(|lane| each > 0 && !tick.get(*lane)) {
                let numbers = place * remembered + lane * each..place * remembered + (lane + 1) * each;
                blocks.memory[numbers.clone()].copy_from_slice(&self.memory[numbers]);
            }
        }
        self.put_past_back(blocks, tick);
    }

    /// Past copies lie by tick, and the place of the oldest one has moved on for all: those of a peer that did not tick move on with it.
    fn put_past_back(&self, blocks: &mut Blocks, tick: &[Mask]) {
        let (per_axis, count) = (tick.len(), blocks.blocks.len());
        let lag = blocks.past.len() / count;
        let place_of = |oldest: usize, age: usize, place: usize| (oldest + age) % lag * count + place;
        for (place, kept) in self.oldest.iter().enumerate().filter(|(place, _)| tick[place % per_axis] != Mask::ALL) {
            let tick = tick[place % per_axis];
            // The oldest one comes first, and its place is now that of the second.
            for age in (0..lag).rev() {
                let before = match age {
                    0 => *kept,
                    _ => blocks.past[place_of(blocks.oldest, age - 1, place)],
                };
                let now = &mut blocks.past[place_of(blocks.oldest, age, place)];
                now.position = tick.choose(now.position, before.position);
                now.velocity = tick.choose(now.velocity, before.velocity);
            }
        }
    }
}
