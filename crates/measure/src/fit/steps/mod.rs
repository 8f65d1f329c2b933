//! Steps of a clock: the least delay changes at one instant, and stays so.
//!
//! A clock that is set (by NTP, for example) moves every later delay by the same amount. The least of many delays in a row hardly varies, so that it shows
//! such a step among delays that do. The arrivals are cut into up to 100 blocks of equal numbers, in the order of sending, each with its least delay, from
//! which the common drift is taken off. Between two blocks there is a step if
//!
//! - the least delays of the five blocks before and of the five blocks after lie apart, by more than twice what either five spread over;
//! - the least delay changes by a tenth or more of what the median delay of a block lies above its least: a smaller step does not show in a fit;
//! - nine of ten blocks up to the neighbouring steps lie on the side of their five: a single burst of long delays is no step;
//! - the next step does not take it back: a queue that filled and emptied is no clock.
//!
//! Of delays that remember for an eighth of the measurement, at most one in a hundred has a step by chance; of others none.
//!
//! A path that changes to another route looks the same: from one direction the two cannot be told apart.

use std::ops::Range;

use serde::Serialize;

use super::{Measurement, Measurements};

/// A step of the least delay.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Step {
    /// Instant at which the first packet with the new least delay was sent \[s\].
    pub at_s: f64,
    /// By how much the least delay grew; negative if it fell \[s\].
    pub by_s: f64,
    /// Number of the first packet with the new least delay, counted from 0, lost packets included.
    pub packet: usize,
}

const MOST_BLOCKS: usize = 100;
/// With fewer blocks, the order of their least delays is too easily chance.
const FEWEST_BLOCKS: usize = 20;
/// The fewest arrivals of a block.
const SHORTEST_BLOCK: usize = 10;
/// Blocks on either side that are compared.
const SIDE: usize = 5;
/// Blocks must lie apart by this multiple of their spread.
const APART: f64 = 2.0;
/// The smallest step that matters, in parts of the distance of the median delay from the least.
const SMALLEST: f64 = 0.1;
/// Delays are told to whole nanoseconds at best; a smaller step is rounding.
const RESOLUTION_S: f64 = 1e-8;

/// A block of arrivals.
struct Block {
    /// Mean instant of sending \[s\].
    sent_s: f64,
    /// Least delay without the drift \[s\].
    least_s: f64,
    /// Distance of the median delay from the least \[s\].
    median_above_s: f64,
}

/// A step between two blocks.
struct Found {
    /// Number of the first block after it.
    block: usize,
    /// The delay between those before and those after \[s\], the drift taken off.
    middle_s: f64,
    /// \[s\]
    by_s: f64,
    /// Distance between blocks \[s\].
    gap_s: f64,
}

impl Measurements {
    /// The instants at which the least delay changes and stays so, in the order of sending. None is found in fewer than 200 delays, or within a twentieth
    /// of the measurement from either end.
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
            // Within the last block before and the first after it, the delays tell where the step is: before a rise the last short delay, at a fall the first.
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

    /// The packets from one number to another, the latter left out; times count as before.
    ///
    /// # Panics
    ///
    /// Panics if there are no such packets.
    #[must_use]
    pub fn part(&self, range: Range<usize>) -> Self {
        Self { packets: self.packets[range].to_vec(), removed: self.removed }
    }

    /// The numbers of the packets of the longest stretch without a step; everything if there is no step.
    #[must_use]
    pub fn longest_part(&self, steps: &[Step]) -> Range<usize> {
        let borders: Vec<usize> = [0].into_iter().chain(steps.iter().map(|step| step.packet)).chain([self.packets.len()]).collect();
        borders.windows(2).max_by_key(|part| part[1].saturating_sub(part[0])).map_or(0..0, |part| part[0]..part[1])
    }
}

/// The common slope of the least delays \[s/s\]: the median over blocks a fifth of all apart, which few steps move little.
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

/// Least and greatest.
fn extent(blocks: &[Block]) -> (f64, f64) {
    blocks.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(least, greatest), block| (least.min(block.least_s), greatest.max(block.least_s)))
}

/// Steps between groups of five blocks, in the order of time, of neighbouring ones the clearest.
fn candidates(blocks: &[Block]) -> Vec<Found> {
    let mut found: Vec<Found> = (SIDE..=blocks.len() - SIDE).filter_map(|block| between(blocks, block)).collect();
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

fn between(blocks: &[Block], block: usize) -> Option<Found> {
    let [before, after] = [&blocks[block - SIDE..block], &blocks[block..block + SIDE]].map(extent);
    let spread = (before.1 - before.0).max(after.1 - after.0);
    let (gap_s, middle_s) = if after.0 > before.1 {
        (after.0 - before.1, f64::midpoint(after.0, before.1))
    } else {
        (before.0 - after.1, f64::midpoint(before.0, after.1))
    };
    // The least of all is the surest value of each side.
    let by_s = after.0 - before.0;
    (gap_s > APART * spread + RESOLUTION_S).then_some(Found { block, middle_s, by_s, gap_s })
}

/// The steps that stay.
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
