//! Arrivals of cross packets, one after the other.

use alloc::boxed::Box;
use alloc::collections::BinaryHeap;
use alloc::vec::Vec;
use core::cmp::Reverse;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant};

use super::{CrossRecording, CrossTraffic, OnOff, Poisson, Source, giga_bits};
use crate::fates::stats::CrossCounts;
use crate::random::{Purpose, Stream, unit};

/// Cross-traffic of one link: the next packet, and the counts. The stage stays without a configuration too, so that no random number is drawn twice if
/// cross-traffic comes back.
#[derive(Clone, Debug)]
pub(crate) struct CrossStage {
    /// Configuration in force, or `None` if no further packet comes.
    config: Option<CrossTraffic>,
    /// Random numbers of the link. Cross-traffic draws at addresses of its own.
    draws: Stream,
    arrivals: Arrivals,
    /// Instant and size of the next packet, or `None` if no further packet comes before the end of time.
    next: Option<(Instant, Bytes)>,
    /// Random numbers below this number are drawn: gaps of Poisson traffic, or spans of each source.
    drawn: u64,
    /// Counts up to the latest event of the queue.
    counts: CrossCounts,
    /// Counts at the latest packet of the link.
    met: CrossCounts,
}

/// State of the source of the cross packets.
#[derive(Clone, Debug)]
enum Arrivals {
    Nothing,
    Poisson {
        /// Mean distance of packets \[ns\].
        mean_nanos: f64,
        size: Bytes,
    },
    OnOff(Box<Sources>),
    Recorded {
        recording: CrossRecording,
        /// Index of the packet after `next`.
        index: usize,
    },
}

impl CrossStage {
    /// Returns the stage with the configuration `config` from `now` on, or `None` without a configuration now and before. An unchanged configuration goes on;
    /// a changed configuration begins anew.
    pub(crate) fn reconfigured(before: Option<Box<Self>>, now: Instant, config: Option<CrossTraffic>, draws: Stream) -> Option<Box<Self>> {
        let mut stage = match (before, &config) {
            (None, None) => return None,
            (None, Some(_)) => Box::new(Self {
                config: None,
                draws,
                arrivals: Arrivals::Nothing,
                next: None,
                drawn: 0,
                counts: CrossCounts::default(),
                met: CrossCounts::default(),
            }),
            (Some(stage), _) => stage,
        };
        if stage.config != config {
            stage.begin(now, config);
        }
        Some(stage)
    }

    fn begin(&mut self, now: Instant, config: Option<CrossTraffic>) {
        // Spans drawn before are never drawn again.
        if let Arrivals::OnOff(sources) = &self.arrivals {
            self.drawn = sources.drawn();
        }
        (self.arrivals, self.next) = match config.as_ref().map(|config| &config.0) {
            None => (Arrivals::Nothing, None),
            Some(&Source::Poisson(Poisson { rate, size })) => {
                #[expect(clippy::cast_precision_loss, reason = "a mean")]
                let mean_nanos = giga_bits(size) as f64 / rate.as_bits_per_sec() as f64;
                // The law of the gaps has no memory, so the time until the first packet has the same law.
                (Arrivals::Poisson { mean_nanos, size }, Some((now, size)))
            }
            Some(Source::OnOff(on_off)) => (Arrivals::OnOff(Box::new(Sources::new(*on_off, now, self.draws, self.drawn))), None),
            Some(Source::Recorded(recording)) => (Arrivals::Recorded { recording: recording.clone(), index: recording.first_from(now) }, None),
        };
        self.config = config;
        self.advance();
    }

    /// Returns the instant of the next packet, or `None` if no further packet comes.
    #[inline]
    pub(crate) fn next_at(&self) -> Option<Instant> {
        self.next.map(|(at, _)| at)
    }

    /// Returns the next packet if it comes by `until`, with its random word for queues, and counts the packet as offered.
    #[inline]
    pub(crate) fn take(&mut self, until: Instant) -> Option<(Instant, Bytes, impl Fn() -> u64 + use<>)> {
        let (at, size) = self.next.filter(|(at, _)| *at <= until)?;
        self.advance();
        let (draws, number) = (self.draws, self.counts.offered);
        self.counts.offered += 1;
        self.counts.bytes += size.get();
        Some((at, size, move || draws.packet(number).more(Purpose::CrossTraffic).next_word()))
    }

    /// Counts a dropped cross packet.
    pub(crate) const fn count_drop(&mut self) {
        self.counts.dropped += 1;
    }

    /// Notes that a packet of the link has met the queue: the counts up to now are reported from now on.
    pub(crate) const fn meet(&mut self) {
        self.met = self.counts;
    }

    /// Returns the counts at the latest packet of the link. The counts do not depend on how often the stage is asked to catch up between two packets.
    pub(crate) const fn reported(&self) -> CrossCounts {
        self.met
    }

    /// Moves on to the packet after `next`.
    #[inline]
    fn advance(&mut self) {
        self.next = match &mut self.arrivals {
            Arrivals::Nothing => None,
            Arrivals::Poisson { mean_nanos, size } => {
                let uniform = unit(self.draws.packet(self.drawn).first(Purpose::CrossTraffic));
                self.drawn += 1;
                // 1 − u lies in (0, 1], so the logarithm is finite.
                let gap = nanos(-libm::log(1.0 - uniform) * *mean_nanos);
                self.next.and_then(|(at, _)| at.checked_add(gap)).map(|at| (at, *size))
            }
            Arrivals::OnOff(sources) => sources.next(),
            Arrivals::Recorded { recording, index } => {
                *index += 1;
                recording.packet(*index - 1)
            }
        };
    }
}

/// On-off sources, the earliest packet first.
#[derive(Clone, Debug)]
struct Sources {
    config: OnOff,
    draws: Stream,
    /// Next packet of each source, by instant; packets of one instant come in the order of sources.
    order: BinaryHeap<Reverse<(Instant, u32)>>,
    sources: Vec<OnOffSource>,
}

/// Source between two packets.
#[derive(Clone, Debug)]
struct OnOffSource {
    /// Latest instant considered: the latest packet, or the begin of a span of sending.
    at: Instant,
    /// End of the span of sending at `at`.
    end: Instant,
    /// Part of the next packet that earlier time of sending has paid for \[10⁻⁹ bit\].
    paid: u128,
    /// Address of the next random number.
    number: u64,
}

/// Distance of the addresses of two sources. Poisson gaps have the addresses below.
const SOURCE: u64 = 1 << 40;

impl Sources {
    /// Returns stationary sources from `now` on. `drawn` random numbers of each source are used up.
    fn new(config: OnOff, now: Instant, draws: Stream, drawn: u64) -> Self {
        let mut sources = Self { config, draws, order: BinaryHeap::new(), sources: Vec::new() };
        for place in 0..config.sources {
            // The address depends on the place of a source, not on the number of sources, so a further source leaves the other sources as they are.
            let mut source = OnOffSource { at: now, end: now, paid: 0, number: (u64::from(place) + 1) * SOURCE + drawn };
            let [state, phase] = [source.draw(draws), source.draw(draws)];
            let (on, off) = (config.on.as_secs_f64(), config.off.as_secs_f64());
            #[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a random part of a packet")]
            let paid = (phase * giga_bits(config.size) as f64) as u128;
            source.paid = paid;
            let uniform = source.draw(draws);
            if state < on / (on + off) {
                source.end = now.saturating_add(residual(config.on, config.shape, uniform));
            } else {
                source.begin_span(&config, draws, residual(config.off, config.shape, uniform));
            }
            sources.order.extend(source.next(&config, draws).map(|at| Reverse((at, place))));
            sources.sources.push(source);
        }
        sources
    }

    /// Returns the earliest packet, and looks for the next packet of its source.
    fn next(&mut self) -> Option<(Instant, Bytes)> {
        let Self { config, draws, order, sources } = self;
        let mut first = order.peek_mut()?;
        let Reverse((at, place)) = *first;
        match sources[place as usize].next(config, *draws) {
            // The entry takes its new place in the heap when `first` goes out of scope.
            Some(next) => *first = Reverse((next, place)),
            None => _ = alloc::collections::binary_heap::PeekMut::pop(first),
        }
        Some((at, config.size))
    }

    /// Returns a number above the random numbers that any source has drawn.
    fn drawn(&self) -> u64 {
        self.sources.iter().map(|source| source.number % SOURCE).max().unwrap_or(0)
    }
}

impl OnOffSource {
    /// Returns the instant of the next packet, or `None` beyond the end of time.
    fn next(&mut self, config: &OnOff, draws: Stream) -> Option<Instant> {
        // Each packet takes the time of sending of one packet at the peak rate, whatever spans this time lies in. Counting bits in whole numbers keeps the mean
        // rate exact over any number of packets.
        let mut needed = giga_bits(config.size).saturating_sub(self.paid);
        loop {
            let time = config.peak.transmission_time(needed);
            let left = self.end.saturating_duration_since(self.at);
            if time <= left {
                self.at = self.at.checked_add(time)?;
                // The time is rounded up, so it pays for a bit of the packet after this packet too.
                self.paid = config.peak.bits_sent(time) - needed;
                return Some(self.at);
            }
            // `time` is rounded up and above `left`, so the packet needs more than `left` can send.
            needed -= config.peak.bits_sent(left);
            let off = pareto(config.off, config.shape, self.draw(draws));
            self.at = self.end;
            self.begin_span(config, draws, off);
            if self.at == Instant::MAX {
                return None;
            }
        }
    }

    /// Moves to the next span of sending, after silence of `off`.
    fn begin_span(&mut self, config: &OnOff, draws: Stream, off: Duration) {
        let on = pareto(config.on, config.shape, self.draw(draws));
        self.at = self.at.saturating_add(off);
        self.end = self.at.saturating_add(on);
    }

    /// Returns the next uniform number in [0, 1).
    fn draw(&mut self, draws: Stream) -> f64 {
        self.number += 1;
        unit(draws.packet(self.number - 1).first(Purpose::CrossTraffic))
    }
}

/// Returns the quantile of the Pareto law of a mean and a shape a: minimum·(1 − p)^(−1/a), with the minimum mean·(a − 1)/a.
fn pareto(mean: Duration, shape: f64, p: f64) -> Duration {
    nanos(minimum(mean, shape) * libm::pow(1.0 - p, -1.0 / shape))
}

/// Returns the quantile of the rest of a Pareto span in progress at a random instant, with the density (1 − F)/mean of the equilibrium law: P(≤ t) = t/mean
/// below the minimum, and 1 − (minimum/t)^(a − 1)/a above.
fn residual(mean: Duration, shape: f64, p: f64) -> Duration {
    let minimum = minimum(mean, shape);
    let at_minimum = (shape - 1.0) / shape;
    nanos(if p < at_minimum { p / at_minimum * minimum } else { minimum * libm::pow(shape * (1.0 - p), -1.0 / (shape - 1.0)) })
}

/// Returns the minimum of a Pareto law \[ns\].
#[expect(clippy::cast_precision_loss, reason = "a span enters a random law as a real number")]
fn minimum(mean: Duration, shape: f64) -> f64 {
    mean.as_nanos() as f64 * (shape - 1.0) / shape
}

/// Rounds a span to nanoseconds.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "not negative; saturates beyond 584 years")]
fn nanos(nanos: f64) -> Duration {
    Duration::from_nanos(libm::rint(nanos) as u64)
}

#[cfg(test)]
mod tests;
