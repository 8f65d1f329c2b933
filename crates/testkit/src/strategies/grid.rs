//! Round numbers, and random choices among them.

use proptest::prelude::Rng;
use proptest::test_runner::TestRng;

/// Range of whole numbers from `low` to `high`. Round numbers within the range are multiples of `step`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Span {
    pub(super) low: u64,
    pub(super) high: u64,
    pub(super) step: u64,
}

impl Span {
    pub(super) const fn contains(&self, value: u64) -> bool {
        self.low <= value && value <= self.high
    }
}

/// Returns the least number above `value` with at most `digits` significant digits, counted in steps. `None` if it does not fit.
fn next_above(value: u64, digits: u32, step: u64) -> Option<u64> {
    let count = value / step;
    let unit = unit(count, digits);
    (count / unit).checked_add(1)?.checked_mul(unit)?.checked_mul(step)
}

/// Returns the value of the last of the first `digits` digits of a count.
fn unit(count: u64, digits: u32) -> u64 {
    let places = count.checked_ilog10().map_or(1, |log| log + 1);
    10_u64.pow(places.saturating_sub(digits))
}

/// Returns the greatest number below `value` with at most `digits` significant digits, counted in steps. `None` if `value` is 0.
fn next_below(value: u64, digits: u32, step: u64) -> Option<u64> {
    let count = value.checked_sub(1)? / step;
    Some(count / unit(count, digits) * unit(count, digits) * step)
}

/// Returns the next round number after `value` on the way to `goal`, or `goal` if no round number precedes `goal`.
pub(super) fn next_towards(goal: u64, value: u64, digits: u32, step: u64) -> u64 {
    if goal < value {
        next_below(value, digits, step).map_or(goal, |next| next.max(goal))
    } else {
        next_above(value, digits, step).map_or(goal, |next| next.min(goal))
    }
}

/// Returns all numbers strictly between `low` and `high` with at most `digits` significant digits, ascending. A decade has at most 0.9 · 10^`digits` of them.
pub(super) fn round_between(low: u64, high: u64, digits: u32, step: u64) -> Vec<u64> {
    std::iter::successors(next_above(low, digits, step), |value| next_above(*value, digits, step)).take_while(|value| *value < high).collect()
}

/// Returns whether a number has at most `digits` significant digits, counted in steps.
pub(super) fn is_round(value: u64, digits: u32, step: u64) -> bool {
    let count = value / step;
    value.is_multiple_of(step) && count.is_multiple_of(unit(count, digits))
}

/// Source of random choices.
pub(super) struct Dice<'a>(pub(super) &'a mut TestRng);

impl Dice<'_> {
    /// Returns a number from 0 to `count` − 1, or 0 if `count` is 0. The bias is below 2⁻³² for the counts used here.
    pub(super) fn below(&mut self, count: u64) -> u64 {
        let wide = u128::from(self.0.next_u64()) * u128::from(count);
        u64::try_from(wide >> 64).unwrap_or(0)
    }

    pub(super) fn one_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }

    /// Returns one of several values, each with equal probability.
    pub(super) fn pick<T: Copy>(&mut self, first: T, others: &[T]) -> T {
        let place = usize::try_from(self.below(others.len() as u64 + 1)).unwrap_or(0);
        place.checked_sub(1).and_then(|place| others.get(place)).copied().unwrap_or(first)
    }

    /// Draws a number of a range, whose logarithm is uniform. The range begins above 0.
    #[cfg(feature = "files")]
    pub(super) fn even_in_logarithm(&mut self, range: &std::ops::RangeInclusive<u64>) -> u64 {
        // 53 bits are a fraction of 1 without rounding.
        #[expect(clippy::cast_precision_loss, reason = "53 bits are exact, and bounds have few digits")]
        let (part, low, high) = ((self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64, *range.start() as f64, *range.end() as f64);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between the bounds, which are whole and positive")]
        let number = (low * (high / low).powf(part)).round() as u64;
        number.clamp(*range.start(), *range.end())
    }

    /// Draws a number of a range. In a tenth of all cases each the result is the lower end, the upper end, or any number. Otherwise the result has two
    /// significant digits; in half of all cases every decade is equally likely.
    pub(super) fn number(&mut self, span: Span) -> u64 {
        let Span { low, high, step } = span;
        let anywhere = |dice: &mut Self| low + dice.below((high - low).saturating_add(1));
        // Round numbers are preferred, because shrinking needs more tries for a number with more digits.
        match self.below(10) {
            0 => low,
            1 => high,
            2..=6 => self.pick(low, &round_between(low, high, 2, step)),
            7 | 8 => {
                let value = anywhere(self);
                next_above(value, 2, step).map_or(high, |round| round.min(high))
            }
            _ => {
                let value = anywhere(self);
                (value - value % step).max(low)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_numbers_have_few_digits() {
        assert_eq!(round_between(0, 30, 1, 1), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 20]);
        assert_eq!(round_between(95, 121, 2, 1), [96, 97, 98, 99, 100, 110, 120]);
        assert_eq!(round_between(8_500, 21_000, 1, 1_000), [9_000, 10_000, 20_000]);
        assert!(round_between(5, 5, 1, 1).is_empty());
        assert!(round_between(u64::MAX - 1, u64::MAX, 2, 1).is_empty());
    }

    #[test]
    fn the_next_round_number_is_the_last_before_the_goal_or_the_goal() {
        for (goal, value) in [(7, 100), (7, 101), (95, 123_456), (100, 7), (123_456, 95), (0, 1), (5, 5)] {
            for digits in 1..6 {
                let mut between = round_between(goal.min(value), goal.max(value), digits, 1);
                if goal > value {
                    between.reverse();
                }
                assert_eq!(next_towards(goal, value, digits, 1), between.last().copied().unwrap_or(goal), "{goal} {value} {digits}");
            }
        }
    }

    #[test]
    fn what_lies_between_round_numbers_is_not_round() {
        for digits in 1..4 {
            let round = round_between(0, 100_000, digits, 10);
            assert!(round.iter().all(|value| is_round(*value, digits, 10)));
            assert_eq!((1..100_000).filter(|value| is_round(*value, digits, 10)).count(), round.len());
        }
    }
}
