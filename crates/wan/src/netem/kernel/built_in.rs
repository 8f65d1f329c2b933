//! The distribution tables of iproute2, computed.

use alloc::boxed::Box;
use core::f64::consts::SQRT_2;

/// Scale of table entries: an entry of 8192 is one standard deviation.
pub(super) const TABLE_SCALE: i32 = 8192;

const ENTRIES: i32 = 4096;

pub(super) fn normal() -> Box<[i16]> {
    (0..ENTRIES).map(|rank| clamped(normal_entry(rank))).collect()
}

pub(super) fn pareto() -> Box<[i16]> {
    (0..ENTRIES).map(|rank| clamped(pareto_entry(rank))).collect()
}

pub(super) fn pareto_normal() -> Box<[i16]> {
    // The lowest normal entry enters the sum before its clamping, and the division rounds towards zero.
    (0..ENTRIES).map(|rank| clamped((normal_entry(rank) + 3 * pareto_entry(rank)) / 4)).collect()
}

/// Returns the quantile of the standard normal law at (4·rank + ½)/16384, rounded down to a grid, in 1/8192.
fn normal_entry(rank: i32) -> i32 {
    const STEP: f64 = 5e-5;
    let point = |index: i32| -10.0 + f64::from(index) * STEP;
    let target = (4.0 * f64::from(rank) + 0.5) / 16_384.0;
    let is_below = |index: i32| 0.5 + 0.5 * libm::erf(point(index) / SQRT_2) < target;
    // Φ(−10) is below every target and Φ(10) above, so the search keeps a grid point on either side.
    let (mut below, mut above) = (0, 400_000);
    while above - below > 1 {
        let middle = i32::midpoint(below, above);
        if is_below(middle) {
            below = middle;
        } else {
            above = middle;
        }
    }
    rounded(point(below) * f64::from(TABLE_SCALE))
}

fn pareto_entry(rank: i32) -> i32 {
    let survival = 1.0 - f64::from(rank) / f64::from(ENTRIES);
    let value = (libm::pow(survival, -1.0 / 3.0) - 1.5) * 4.0 / 3.0;
    // The highest ranks do not fit into 16 bits, and are cut before `pareto_normal`.
    rounded(value * f64::from(TABLE_SCALE)).min(i32::from(i16::MAX))
}

#[expect(clippy::cast_possible_truncation, reason = "entries are below 2^18")]
fn rounded(value: f64) -> i32 {
    libm::rint(value) as i32
}

fn clamped(value: i32) -> i16 {
    i16::try_from(value).unwrap_or(if value < 0 { i16::MIN } else { i16::MAX })
}
