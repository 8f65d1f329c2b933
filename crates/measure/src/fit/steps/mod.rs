//! Finds steps of a clock: lasting changes of the least delay at one instant.
//!
//! Input is measurements; output is a list of steps. Setting a clock, for example by NTP, moves all later delays by the same amount. The least of many
//! delays in a row hardly varies, and so shows such a step among varying delays. The arrivals are divided into up to 100 blocks of equal numbers in the
//! order of sending. Each block has a least delay, without the common drift. Between two blocks lies a step if all of these hold:
//!
//! - The least delays of the five blocks before and of the five blocks after are apart by more than twice the spread of either five.
//! - The least delay changes by at least a tenth of the typical distance between median and least delay of a block. A smaller step does not show in a fit.
//! - At least nine of ten blocks up to the neighbouring steps lie on the side of their five. A single burst of long delays is no step.
//! - The next step does not reverse this step. A queue that fills and empties is no clock.
//!
//! Delays with a memory of an eighth of the measurement have a step by chance in at most one of a hundred measurements; delays with shorter memory have none.
//!
//! A change of the path to another route looks the same, and cannot be distinguished from one direction.

use std::ops::Range;

use serde::Serialize;

use super::{Measurement, Measurements};

/// A step of the least delay.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Step {
    /// Instant of sending of the first packet with the new least delay \[s\].
    pub at_s: f64,
    /// Change of the least delay \[s\]; negative for a decrease.
    pub by_s: f64,
    /// Number of the first packet with the new least delay, counted from 0, lost packets included.
    pub packet: usize,
}

/// Largest number of blocks.
const MOST_BLOCKS: usize = 100;
/// Fewest blocks. With fewer, chance often orders their least delays like a step.
const FEWEST_BLOCKS: usize = 20;
/// Fewest arrivals in a block.
const SHORTEST_BLOCK: usize = 10;
/// Number of blocks compared on each side of a step.
const SIDE: usize = 5;
/// Least distance between the two sides, in units of their spread.
const APART: f64 = 2.0;
/// Smallest step that matters, as a share of the distance between median and least delay.
const SMALLEST: f64 = 0.1;
/// Change of delay that rounding may cause \[s\], ten times the resolution of a nanosecond.
const RESOLUTION_S: f64 = 1e-8;

/// A block of arrivals.
struct Block {
    /// Mean instant of sending \[s\].
    sent_s: f64,
    /// Least delay of the block without the drift \[s\].
    least_s: f64,
    /// Distance of the median delay from the least \[s\].
    median_above_s: f64,
}

/// A candidate for a step, between two blocks.
struct Found {
    /// Index of the first block after the step.
    block: usize,
    /// Delay halfway between the blocks before and after the step \[s\], without the drift.
    middle_s: f64,
    /// Change of the least delay \[s\].
    by_s: f64,
    /// Distance between the five blocks before and the five blocks after \[s\].
    gap_s: f64,
}

impl Measurements {
    /// Finds lasting changes of the least delay, in the order of sending. Finds none in fewer than 200 delays, or within a twentieth of the measurement
    /// from either end.
    #[must_use]
    pub fn steps(&self) -> Vec<Step> {
        let arrivals: Vec<(usize, Measurement, f64)> =
            self.packets().iter().enumerate().filter_map(|(number, packet)| Some((number, *packet, packet.delay_s?))).collect();
        let count = (arrivals.len() / SHORTEST_BLOCK).min(MOST_BLOCKS);
        if count < FEWEST_BLOCKS {
            return Vec::new();
        }
        let range = |block: usize| block * arrivals.len() / count..(block + 1) * arrivals.len() / count;
        let mut blocks: Vec<Block> = (0..count)
            .map(|block| {
                let arrivals = &arrivals[range(block)];
                let mean = arrivals.iter().map(|arrival| arrival.1.sent_s).sum::<f64>() / crate::series::count(arrivals.len());
                let mut delays: Vec<f64> = arrivals.iter().map(|arrival| arrival.2).collect();
                delays.sort_by(f64::total_cmp);
                Block { sent_s: mean, least_s: delays[0], median_above_s: delays[delays.len() / 2] - delays[0] }
            })
            .collect();
        let drift = drift(&blocks);
        let origin = blocks[0].sent_s;
        blocks.iter_mut().for_each(|block| block.least_s -= drift * (block.sent_s - origin));

        let step = |found: &Found| {
            // The delays of the last block before and the first block after show the exact place: after the last short delay for a rise, at the first short
            // delay for a fall.
            let near = &arrivals[range(found.block - 1).start..range(found.block).end];
            let is_short = |arrival: &(usize, Measurement, f64)| arrival.2 - drift * (arrival.1.sent_s - origin) < found.middle_s;
            let place = if found.by_s > 0.0 { near.iter().rposition(is_short).map(|place| place + 1) } else { near.iter().position(is_short) };
            let (packet, at, _) = near[place.unwrap_or(0).min(near.len() - 1)];
            Step { at_s: at.sent_s, by_s: found.by_s, packet }
        };
        let mut spreads: Vec<f64> = blocks.iter().map(|block| block.median_above_s).collect();
        spreads.sort_by(f64::total_cmp);
        let smallest = SMALLEST * spreads[spreads.len() / 2];
        let mut found = candidates(&blocks);
        found.retain(|found| found.by_s.abs() >= smallest);
        lasting(&blocks, found).iter().map(step).collect()
    }

    /// Returns the packets with numbers in `range`. Times keep their origin.
    ///
    /// # Panics
    ///
    /// If `range` reaches beyond the packets.
    #[must_use]
    pub fn part(&self, range: Range<usize>) -> Self {
        Self { packets: self.packets[range.clone()].to_vec(), removed: self.removed, ticks: self.ticks.part(range) }
    }

    /// Returns the numbers of the packets of the longest part without a step, or of all packets without steps.
    #[must_use]
    pub fn longest_part(&self, steps: &[Step]) -> Range<usize> {
        let borders: Vec<usize> = [0].into_iter().chain(steps.iter().map(|step| step.packet)).chain([self.packets.len()]).collect();
        borders.windows(2).max_by_key(|part| part[1].saturating_sub(part[0])).map_or(0..0, |part| part[0]..part[1])
    }
}

/// Returns the common slope of the least delays \[s/s\]: the median slope between blocks a fifth of all blocks apart, which a few steps move little.
fn drift(blocks: &[Block]) -> f64 {
    let far = blocks.len() / 5;
    let mut slopes: Vec<f64> = blocks
        .iter()
        .zip(&blocks[far..])
        .map(|(one, other)| (other.least_s - one.least_s) / (other.sent_s - one.sent_s))
        .filter(|slope| slope.is_finite())
        .collect();
    slopes.sort_by(f64::total_cmp);
    slopes.get(slopes.len() / 2).copied().unwrap_or(0.0)
}

/// Returns the smallest and the largest of the least delays \[s\].
fn extent(blocks: &[Block]) -> (f64, f64) {
    blocks.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, greatest), block| (least.min(block.least_s), greatest.max(block.least_s)))
}

/// Returns candidates for steps between groups of five blocks, in order of time. Of candidates closer than five blocks, only the clearest is kept.
fn candidates(blocks: &[Block]) -> Vec<Found> {
    let mut found: Vec<Found> = (SIDE..=blocks.len() - SIDE).filter_map(|block| between(blocks, block)).collect();
    // The clearest candidate first, so that it suppresses its neighbours.
    found.sort_by(|one, other| other.gap_s.total_cmp(&one.gap_s));
    let mut clearest: Vec<Found> = Vec::new();
    for step in found {
        if clearest.iter().all(|other| other.block.abs_diff(step.block) >= SIDE) {
            clearest.push(step);
        }
    }
    clearest.sort_by_key(|step| step.block);
    clearest
}

/// Returns the step before block number `block`, if the two groups of five are clearly apart.
fn between(blocks: &[Block], block: usize) -> Option<Found> {
    let [before, after] = [&blocks[block - SIDE..block], &blocks[block..block + SIDE]].map(extent);
    let spread = (before.1 - before.0).max(after.1 - after.0);
    let (gap_s, middle_s) = if after.0 > before.1 {
        (after.0 - before.1, f64::midpoint(after.0, before.1))
    } else {
        (before.0 - after.1, f64::midpoint(before.0, after.1))
    };
    // The smallest of the five least delays is the most certain value of each side.
    let by_s = after.0 - before.0;
    (gap_s > APART * spread + RESOLUTION_S).then_some(Found { block, middle_s, by_s, gap_s })
}

/// Keeps the lasting steps: nine of ten blocks on their side, and not reversed by the next step.
fn lasting(blocks: &[Block], found: Vec<Found>) -> Vec<Found> {
    let borders: Vec<usize> = [0].into_iter().chain(found.iter().map(|step| step.block)).chain([blocks.len()]).collect();
    let mut lasting: Vec<Found> = Vec::new();
    for (place, step) in found.into_iter().enumerate() {
        let rises = step.by_s > 0.0;
        let share = |range: &[Block], is_above: bool| {
            let on_side = range.iter().filter(|block| (block.least_s > step.middle_s) == is_above).count();
            crate::series::count(on_side) / crate::series::count(range.len())
        };
        let stays = share(&blocks[borders[place]..step.block], !rises) >= 0.9 && share(&blocks[step.block..borders[place + 2]], rises) >= 0.9;
        if !stays {
            continue;
        }
        match lasting.last() {
            Some(before) if (before.by_s + step.by_s).abs() < 0.5 * before.by_s.abs().min(step.by_s.abs()) => {
                lasting.pop();
            }
            Some(_) | None => lasting.push(step),
        }
    }
    lasting
}

#[cfg(test)]
mod tests;
