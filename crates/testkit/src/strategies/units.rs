//! Times and percentages as whole numbers: nanoseconds, and ten-thousandths of a percent.

use core::time::Duration;

use cohaptic_wan::netem::Percent;

/// 100 % in ten-thousandths of a percent.
pub(super) const ALL: u64 = 1_000_000;

pub(super) fn nanos(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

/// Converts a percentage to ten-thousandths, rounded to the nearest.
pub(super) fn units(percent: f64) -> u64 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a percentage is from 0 to 100")]
    let units = (percent * 10_000.0).round() as u64;
    units.min(ALL)
}

/// Converts ten-thousandths to a percentage, which prints with at most four decimal places.
pub(super) fn percent(units: u64) -> Percent {
    let units = u32::try_from(units.min(ALL)).unwrap_or(u32::MAX);
    Percent::new(f64::from(units) / 10_000.0).unwrap_or_default()
}

pub(super) fn whole(percent: Percent) -> u64 {
    units(percent.get())
}
