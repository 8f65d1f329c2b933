//! Curves in bounded memory: the lowest and highest value in each of a fixed number of spans of time.

use std::ops::Range;
use std::time::Duration;

use cohaptic_units::Instant;

use crate::arrays::{Ticks, WIDTH, larger, smaller};

/// Curves over the duration of a scene, each with its lowest and highest value in every span. A plot with one pixel for each span is exact.
#[derive(Clone, Debug)]
pub struct Bands {
    /// Duration of the scene.
    duration: Duration,
    spans: usize,
    /// Width of a span \[ns\]. The end of the scene can cut the last span short.
    width: u64,
    curves: usize,
    /// Lowest and highest values in blocks of eight curves, ordered by span, then curve. [`Extremes::NONE`] in spans without a value. Lanes beyond the last
    /// curve have no meaning.
    extremes: Vec<Extremes>,
    /// Span of the latest value, and the instants in this span \[ns\]. Kept because finding a span takes a division.
    latest: (usize, Range<u64>),
}

/// Lowest and highest values of eight curves in a span.
#[derive(Clone, Copy, Debug)]
struct Extremes {
    low: [f64; WIDTH],
    high: [f64; WIDTH],
}

impl Extremes {
    const NONE: Self = Self { low: [f64::INFINITY; WIDTH], high: [f64::NEG_INFINITY; WIDTH] };

    /// Adds a value to one curve. Ignores a value that is not finite: such a value becomes NaN, and comparisons with NaN are false.
    #[inline(always)]
    fn take_in(&mut self, lane: usize, value: f64) {
        let value = if value.abs() <= f64::MAX { value } else { f64::NAN };
        self.low[lane] = smaller(value, self.low[lane]);
        self.high[lane] = larger(value, self.high[lane]);
    }

    fn of(&self, lane: usize) -> (f64, f64) {
        (self.low[lane], self.high[lane])
    }
}

impl Bands {
    /// Returns `curves` empty curves over a scene of the given duration, with `spans` spans, at least one.
    #[must_use]
    pub fn new(duration: Duration, spans: usize, curves: usize) -> Self {
        let spans = spans.max(1);
        // Rounded up, so that `spans` spans cover the whole duration.
        let width = duration.as_nanos().div_ceil(spans as u128).max(1);
        let width = u64::try_from(width).unwrap_or(u64::MAX);
        Self { duration, spans, width, curves, extremes: vec![Extremes::NONE; spans * curves.div_ceil(WIDTH)], latest: (0, 0..0) }
    }

    /// Adds a value to a curve. Ignores values that are not finite and values at or beyond the end.
    ///
    /// # Panics
    ///
    /// If the curve does not exist.
    pub fn add(&mut self, curve: usize, at: Instant, value: f64) {
        assert!(curve < self.curves, "there are {} curves", self.curves);
        if let Some(span) = self.of_span(at) {
            span[curve / WIDTH].take_in(curve % WIDTH, value);
        }
    }

    /// Adds the position of each peer's copy along an axis to the curve of the same index, as [`Bands::add`] does, eight curves at a time.
    ///
    /// # Panics
    ///
    /// If the scene has no such axis.
    #[inline]
    pub fn add_positions(&mut self, ticks: &Ticks<'_>, axis: usize) {
        if let Some(span) = self.of_span(ticks.at()) {
            for (extremes, positions) in span.iter_mut().zip(ticks.blocks_of_positions(axis)) {
                positions.iter().enumerate().for_each(|(lane, position)| extremes.take_in(lane, *position));
            }
        }
    }

    /// Returns the extremes of all curves in the span of an instant; `None` at the end of the scene and beyond.
    fn of_span(&mut self, at: Instant) -> Option<&mut [Extremes]> {
        // The values of a run come in the order of time, so the span of the latest value is usually the right span.
        if !self.latest.1.contains(&at.as_nanos()) {
            let span = self.span(at)?;
            let begin = self.width.saturating_mul(span as u64);
            let end = Instant::ZERO.saturating_add(self.duration).as_nanos();
            self.latest = (span, begin..begin.saturating_add(self.width).min(end));
        }
        let blocks = self.curves.div_ceil(WIDTH);
        let begin = self.latest.0 * blocks;
        Some(&mut self.extremes[begin..begin + blocks])
    }

    /// Returns the extremes of a curve in a span; `None` without a value.
    fn extremes(&self, span: usize, curve: usize) -> Option<(f64, f64)> {
        let extremes = self.extremes[span * self.curves.div_ceil(WIDTH) + curve / WIDTH].of(curve % WIDTH);
        // `NONE` has its lowest value above its highest.
        Some(extremes).filter(|(low, high)| low <= high)
    }

    /// Returns the span of an instant; `None` at the end of the scene and beyond.
    #[must_use]
    pub(crate) fn span(&self, at: Instant) -> Option<usize> {
        if at >= Instant::ZERO.saturating_add(self.duration) {
            return None;
        }
        usize::try_from(at.as_nanos() / self.width).ok().filter(|span| *span < self.spans)
    }

    /// Returns the middle of a span \[s\].
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of spans is small")]
    pub(crate) fn middle_of(&self, span: usize) -> f64 {
        (span as f64 + 0.5) * (self.width as f64 / 1e9)
    }

    /// Divides the curves into `parts` equal parts, in order.
    #[must_use]
    pub fn split(&self, parts: usize) -> Vec<Self> {
        let size = (self.curves / parts.max(1)).max(1);
        let part = |first: usize| {
            let mut part = Self::new(self.duration, self.spans, size.min(self.curves - first));
            for span in 0..self.spans {
                for curve in 0..part.curves {
                    if let Some((low, high)) = self.extremes(span, first + curve) {
                        // A part may begin in the middle of a block of eight curves, so each curve is copied by itself.
                        let extremes = &mut part.extremes[span * part.curves.div_ceil(WIDTH) + curve / WIDTH];
                        (extremes.low[curve % WIDTH], extremes.high[curve % WIDTH]) = (low, high);
                    }
                }
            }
            part
        };
        (0..self.curves).step_by(size).map(part).collect()
    }

    /// Returns the number of curves.
    #[must_use]
    pub const fn curves(&self) -> usize {
        self.curves
    }

    /// Returns the number of spans.
    #[must_use]
    pub(crate) const fn spans(&self) -> usize {
        self.spans
    }

    /// Returns the duration of the scene \[s\].
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.duration.as_secs_f64()
    }

    /// Returns a curve as (middle of the span \[s\], lowest, highest), without empty spans.
    ///
    /// # Panics
    ///
    /// If the curve does not exist.
    pub fn curve(&self, curve: usize) -> impl Iterator<Item = (f64, f64, f64)> {
        assert!(curve < self.curves, "there are {} curves", self.curves);
        (0..self.spans).filter_map(move |span| self.extremes(span, curve).map(|(low, high)| (self.middle_of(span), low, high)))
    }

    /// Returns the extremes of all curves in some spans, without empty spans.
    fn all(&self, spans: Range<usize>) -> impl Iterator<Item = (f64, f64)> {
        spans.flat_map(move |span| (0..self.curves).filter_map(move |curve| self.extremes(span, curve)))
    }

    /// Returns the range of values to show, with a margin, and whether values beyond this range are left out.
    ///
    /// A scene that diverges ends in numbers that would flatten all earlier values. The range is therefore limited if the curves go farther than `sane` from
    /// their first value and also a thousand times as far as in the first tenth of the scene. The limit is three times the reach in the first tenth, and at
    /// least a tenth of `sane`.
    #[must_use]
    pub fn range(&self, sane: f64) -> (Range<f64>, bool) {
        // Distances are measured from the lowest value in the first span of the first curve with values.
        let start = (0..self.curves()).find_map(|curve| self.curve(curve).next()).map_or(0.0, |(_, low, _)| low);
        let reach_until = |span: usize| self.all(0..span).map(|(low, high)| (low - start).abs().max((high - start).abs())).fold(0.0, f64::max);
        let (first, whole) = (reach_until(self.spans.div_ceil(10)), reach_until(self.spans));
        let limit = if whole > sane && whole > 1000.0 * first { (3.0 * first).max(0.1 * sane) } else { f64::INFINITY };
        let shown = |value: &f64| (value - start).abs() <= limit;
        let values = || self.all(0..self.spans).flat_map(|(low, high)| [low, high]);
        let (low, high) = values().filter(shown).fold((start, start), |(low, high), value| (low.min(value), high.max(value)));
        // A constant curve still needs a range of positive width.
        let margin = if high > low { 0.05 * (high - low) } else { start.abs().max(1e-3) };
        (low - margin..high + margin, values().any(|value| !shown(&value)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_keeps_its_extremes() {
        let mut bands = Bands::new(Duration::from_secs(1), 2, 1);
        for (millis, value) in [(0, 1.0), (100, 3.0), (499, -2.0), (500, 7.0), (1000, 99.0), (600, f64::NAN)] {
            bands.add(0, Instant::from_nanos(millis * 1_000_000), value);
        }
        assert_eq!(bands.curve(0).collect::<Vec<_>>(), [(0.25, -2.0, 3.0), (0.75, 7.0, 7.0)]);
    }

    #[test]
    fn what_explodes_at_the_end_is_cut_off_and_what_travels_is_not() {
        let range = |motion: fn(f64) -> f64| {
            let mut bands = Bands::new(Duration::from_secs(100), 100, 1);
            for second in 0..100_u32 {
                bands.add(0, Instant::from_nanos(u64::from(second) * 1_000_000_000), motion(f64::from(second)));
            }
            bands.range(1.0)
        };
        let (explosion, cut) = range(|t| 0.01 * t.exp());
        assert!(cut && explosion.end < 1e4, "{explosion:?}");
        let (acceleration, cut) = range(|t| 0.1 * t * t);
        assert!(!cut && acceleration.end > 980.0, "{acceleration:?}");
    }
}
