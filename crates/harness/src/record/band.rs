//! A curve in bounded memory: its lowest and highest value in each of a fixed number of spans of time.

use std::ops::Range;
use std::time::Duration;

use cohaptic_units::Instant;

/// Curves over the whole of a scene, each as (lowest, highest) in every span. A plot with one pixel for each span is exact.
#[derive(Clone, PartialEq, Debug)]
pub struct Bands {
    duration: Duration,
    spans: usize,
    /// The width of a span \[ns\]; the last one may be cut short by the end.
    width: u64,
    curves: usize,
    /// The lowest and the highest value by span, then curve: values added at an instant lies together. [`NOTHING`] where nothing was added.
    extremes: Vec<(f64, f64)>,
    /// The span of the latest value, and the instants in it \[ns\]: finding a span takes a division.
    latest: (usize, Range<u64>),
}

const NOTHING: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

impl Bands {
    /// A number of curves over a scene of a duration, in a number of spans (at least one each).
    #[must_use]
    pub fn new(duration: Duration, spans: usize, curves: usize) -> Self {
        let spans = spans.max(1);
        let width = duration.as_nanos().div_ceil(spans as u128).max(1);
        let width = u64::try_from(width).unwrap_or(u64::MAX);
        Self { duration, spans, width, curves, extremes: vec![NOTHING; spans * curves], latest: (0, 0..0) }
    }

    /// Adds a value to a curve. A value that is not finite or beyond the end is left out.
    ///
    /// # Panics
    ///
    /// If there is no such curve.
    pub fn add(&mut self, curve: usize, at: Instant, value: f64) {
        assert!(curve < self.curves, "there are {} curves", self.curves);
        if let Some(slots) = self.slots(at) {
            take_in(&mut slots[curve], value);
        }
    }

    /// Adds a value to each curve, in their order, as [`Bands::add`] does. Values beyond the last curve are left out.
    #[inline]
    pub fn add_all(&mut self, at: Instant, values: impl Iterator<Item = f64>) {
        if let Some(slots) = self.slots(at) {
            // Values come block by block, which is a loop in a loop as long as nobody asks for the next one.
            let mut slots = slots.iter_mut();
            values.for_each(|value| slots.next().into_iter().for_each(|slot| take_in(slot, value)));
        }
    }

    /// The extremes of all curves in the span of an instant.
    #[inline]
    fn slots(&mut self, at: Instant) -> Option<&mut [(f64, f64)]> {
        if !self.latest.1.contains(&at.as_nanos()) {
            let span = self.span(at)?;
            let begin = self.width.saturating_mul(span as u64);
            let end = Instant::ZERO.saturating_add(self.duration).as_nanos();
            self.latest = (span, begin..begin.saturating_add(self.width).min(end));
        }
        let begin = self.latest.0 * self.curves;
        Some(&mut self.extremes[begin..begin + self.curves])
    }

    /// In which span an instant lies; `None` at the end of the scene and beyond.
    #[must_use]
    pub fn span(&self, at: Instant) -> Option<usize> {
        if at >= Instant::ZERO.saturating_add(self.duration) {
            return None;
        }
        usize::try_from(at.as_nanos() / self.width).ok().filter(|span| *span < self.spans)
    }

    /// The middle of a span \[s\].
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "the number of spans is small")]
    pub fn middle_of(&self, span: usize) -> f64 {
        (span as f64 + 0.5) * (self.width as f64 / 1e9)
    }

    /// The curves in `parts` equal parts, in order.
    #[must_use]
    pub fn split(&self, parts: usize) -> Vec<Self> {
        let size = (self.curves / parts.max(1)).max(1);
        let part = |first: usize| {
            let curves = size.min(self.curves - first);
            let extremes = self.extremes.chunks(self.curves).flat_map(|span| &span[first..first + curves]);
            Self { curves, extremes: extremes.copied().collect(), latest: (0, 0..0), ..*self }
        };
        (0..self.curves).step_by(size).map(part).collect()
    }

    /// How many curves there are.
    #[must_use]
    pub const fn curves(&self) -> usize {
        self.curves
    }

    /// How many spans there are.
    #[must_use]
    pub const fn spans(&self) -> usize {
        self.spans
    }

    /// How long the scene is \[s\].
    #[must_use]
    pub const fn seconds(&self) -> f64 {
        self.duration.as_secs_f64()
    }

    /// A curve as (middle of the span \[s\], lowest, highest), spans without a value left out.
    ///
    /// # Panics
    ///
    /// If there is no such curve.
    pub fn curve(&self, curve: usize) -> impl Iterator<Item = (f64, f64, f64)> {
        assert!(curve < self.curves, "there are {} curves", self.curves);
        let spans = self.extremes.chunks(self.curves).map(move |span| span[curve]).enumerate();
        spans.filter(|(_, extremes)| is_there(extremes)).map(|(span, (low, high))| (self.middle_of(span), low, high))
    }

    /// The range of values worth showing, with a margin, and whether values beyond it are left out.
    ///
    /// A scene that diverges ends in numbers that would flatten everything before. So where curves go beyond `sane` from where they began, and a
    /// thousand times as far as they went in the first tenth, which no motion does that ends well, only three times that first tenth, and at least
    /// a tenth of `sane`, is shown.
    #[must_use]
    pub fn range(&self, sane: f64) -> (Range<f64>, bool) {
        let start = (0..self.curves()).find_map(|curve| self.curve(curve).next()).map_or(0.0, |(_, low, _)| low);
        let reach_until = |span: usize| {
            let values = self.extremes[..span * self.curves].iter().filter(|extremes| is_there(extremes));
            values.map(|(low, high)| (low - start).abs().max((high - start).abs())).fold(0.0, f64::max)
        };
        let (first, whole) = (reach_until(self.spans.div_ceil(10)), reach_until(self.spans));
        let limit = if whole > sane && whole > 1000.0 * first { (3.0 * first).max(0.1 * sane) } else { f64::INFINITY };
        let shown = |value: &f64| (value - start).abs() <= limit;
        let values = || self.extremes.iter().filter(|extremes| is_there(extremes)).flat_map(|(low, high)| [*low, *high]);
        let (low, high) = values().filter(shown).fold((start, start), |(low, high), value| (low.min(value), high.max(value)));
        let margin = if high > low { 0.05 * (high - low) } else { start.abs().max(1e-3) };
        (low - margin..high + margin, values().any(|value| !shown(&value)))
    }
}

#[inline]
fn take_in((low, high): &mut (f64, f64), value: f64) {
    if value.is_finite() {
        (*low, *high) = (low.min(value), high.max(value));
    }
}

fn is_there((low, high): &(f64, f64)) -> bool {
    low <= high
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
