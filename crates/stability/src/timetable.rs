//! The events of one frame in their order: samplings, deliveries and ticks of all nodes.
//!
//! A frame is the period of all events: the least common multiple of all periods of sending, of exchanges with devices, of drifting clocks and of the patterns
//! of links.
//! Events within a frame have the order of a simulation: at one instant first samplings, then deliveries, then ticks, each in the order of nodes. The
//! frame begins so late that all peers have started and all samples in flight belong to the pattern.

use std::time::Duration;

use cohaptic_peer::Clock;
use cohaptic_scene::Scene;

use crate::AnalysisError;
use crate::network::LinkTiming;

/// Largest number of ticks in a frame; a longer frame is refused.
const MOST_EVENTS: u128 = 20_000_000;

/// Clock of a node, with the ticks of its samplings.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NodeClock {
    /// Clock of the node's ticks.
    pub clock: Clock,
    /// Offset of the samplings in ticks: the node samples at each tick k with (k − phase) a multiple of `every`.
    pub(crate) phase: u64,
    /// Number of ticks from one sampling to the next.
    pub every: u64,
    /// Number of ticks from one exchange with the device to the next; tick 0 has an exchange.
    pub exchange: u64,
}

impl NodeClock {
    /// Returns the clock of the peer with the index `place`.
    #[must_use]
    pub fn of(scene: &Scene, place: usize) -> Self {
        let spec = &scene.peers[place];
        let every = scene.coordination.update.as_nanos() / spec.clock.tick.as_nanos();
        Self { clock: spec.clock, phase: spec.phase, every: u64::try_from(every).unwrap_or(u64::MAX), exchange: u64::from(spec.exchange.every) }
    }

    /// Returns the tick of `to`, counted from its first tick in the frame, at the arrival of the first sample of the frame after `delay`. Also returns the
    /// longest delay with an arrival at the same tick.
    pub fn arrival(&self, to: &Self, delay: Duration) -> (usize, Duration) {
        let (phase, every) = (i128::from(self.phase), i128::from(self.every));
        let sent = self.instant(phase + self.first_number() * every);
        let tick = to.first_tick(sent.saturating_add(i128::try_from(delay.as_nanos()).unwrap_or(i128::MAX)));
        let longest = Duration::from_nanos(u64::try_from(to.instant(tick) - sent).unwrap_or(u64::MAX));
        (usize::try_from(tick - to.first_tick(0)).unwrap_or(usize::MAX), longest)
    }

    /// Returns the number of the first sample of the frame, counted from the start of the clock.
    fn first_number(&self) -> i128 {
        let (first, every) = (self.first_tick(0) - i128::from(self.phase), i128::from(self.every));
        first.div_euclid(every) + i128::from(first.rem_euclid(every) != 0)
    }

    /// Returns the rate of the clock in parts per billion of true time: 10⁹ plus the drift. Instants on the clock are divided by this number.
    fn speed(&self) -> u128 {
        u128::from(1_000_000_000_u64.saturating_add_signed(self.clock.drift.parts_per_billion()))
    }

    /// Returns the smallest number of periods of sending with a total of whole nanoseconds, as (span \[ns\], number). `None` if the numbers overflow.
    fn repeats(&self) -> Option<(u128, u128)> {
        self.repeats_after(self.every)
    }

    /// Returns the smallest number of periods of `ticks` ticks with a total of whole nanoseconds, as (span \[ns\], number). `None` if the numbers overflow.
    fn repeats_after(&self, ticks: u64) -> Option<(u128, u128)> {
        let period = self.clock.tick.as_nanos().checked_mul(u128::from(ticks))?.checked_mul(1_000_000_000)?;
        let common = gcd(period, self.speed());
        Some((period / common, self.speed() / common))
    }

    /// Returns the instant of tick k \[ns\]. Negative k are allowed, as if the clock had always run.
    fn instant(&self, tick: i128) -> i128 {
        // True time is offset + local·10⁹/(10⁹ + drift), rounded down as the clock of a simulated peer does.
        let local = i128::try_from(self.clock.tick.as_nanos()).unwrap_or(i128::MAX) * tick;
        let offset = i128::try_from(self.clock.offset.as_nanos()).unwrap_or(i128::MAX);
        offset + (local * 1_000_000_000).div_euclid(i128::try_from(self.speed()).unwrap_or(i128::MAX))
    }

    /// Returns the time shown by the clock at one of its ticks \[ns\]. `at` is the tick's instant as rounded by [`instant`](Self::instant).
    fn local(&self, at: i128) -> i64 {
        let tick = i128::try_from(self.clock.tick.as_nanos()).unwrap_or(i128::MAX);
        let offset = i128::try_from(self.clock.offset.as_nanos()).unwrap_or(i128::MAX);
        let speed = i128::try_from(self.speed()).unwrap_or(i128::MAX);
        // Rounding an instant moves the instant by at most a nanosecond, far less than half a tick, so the nearest tick is the right tick.
        let number = (2 * (at - offset) * speed / 1_000_000_000 + tick).div_euclid(2 * tick);
        i64::try_from(number * tick).unwrap_or(i64::MAX)
    }

    /// Returns the number of the first tick at or after the instant `at` \[ns\].
    fn first_tick(&self, at: i128) -> i128 {
        let span = i128::try_from(self.clock.tick.as_nanos()).unwrap_or(i128::MAX) * 1_000_000_000;
        let speed = i128::try_from(self.speed()).unwrap_or(i128::MAX);
        let offset = i128::try_from(self.clock.offset.as_nanos()).unwrap_or(i128::MAX);
        // The quotient is within one tick of the answer. The loop decides by instants rounded to nanoseconds.
        let mut tick = ((at - offset) * speed).div_euclid(span) - 1;
        while self.instant(tick) < at {
            tick += 1;
        }
        tick
    }
}

/// An event of a frame.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Event {
    /// The node samples its copy and sends. Samples of this frame are numbered from 0.
    Sample {
        /// The node.
        node: usize,
    },
    /// From now on `to` holds a sample of `from`. Samples of this frame have the numbers 0, 1, …; −1 is the last sample of the frame before.
    Deliver {
        /// The sender.
        from: usize,
        /// The receiver.
        to: usize,
        /// The number of the sample.
        sample: i64,
    },
    /// The node computes its forces and moves to its next tick.
    Tick {
        /// The node.
        node: usize,
        /// Instant of the tick, since the beginning of the frame \[ns\].
        at: u64,
        /// Span until the node's next tick.
        span: Duration,
        /// `true` if the node exchanges with its device at this tick.
        exchanges: bool,
    },
}

/// Events of one frame, with the samples of earlier frames needed in the frame.
#[derive(Clone, PartialEq, Debug)]
pub struct Timetable {
    /// Length of the frame.
    pub frame: Duration,
    /// Events of the frame, in order.
    pub events: Vec<Event>,
    /// Number of samples sent in a frame, indexed by node.
    pub sent: Vec<usize>,
    /// Number of samples of earlier frames still needed, indexed by sending node.
    pub depth: Vec<usize>,
    /// Samples held at the beginning of the frame and used before the first delivery, as (receiver, sender, number of the sample).
    pub held: Vec<(usize, usize, i64)>,
    /// Clocks of the nodes, indexed by node.
    pub clocks: Vec<NodeClock>,
}

/// Events at which nodes use held samples.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum UseOfHeld {
    /// Nodes use held samples at ticks, to compute forces.
    Ticks,
    /// Nodes use held samples at ticks and at samplings. A sampling precedes the deliveries of the same instant.
    SamplesAndTicks,
}

impl Timetable {
    /// Returns an upper bound of the age of the samples used in the frame \[s\].
    pub(crate) fn oldest(&self) -> f64 {
        // `depth` samples span `depth / sent` frames, rounded up. One more frame passes until the sample's last use in this frame.
        let frames = self.depth.iter().zip(&self.sent).map(|(depth, sent)| depth.div_ceil((*sent).max(1)) + 1).max().unwrap_or(1);
        self.frame.as_secs_f64() * crate::rounding::real(frames)
    }

    /// Returns the frame of nodes with the links `links`. Each link is (sending node, receiving node, timing).
    ///
    /// # Errors
    ///
    /// [`AnalysisError::NoFrame`] or [`AnalysisError::FrameTooLong`] if the clocks and patterns do not meet soon enough.
    pub fn new(clocks: &[NodeClock], links: &[(usize, usize, LinkTiming)]) -> Result<Self, AnalysisError> {
        Self::with_use_of_held(clocks, links, UseOfHeld::Ticks)
    }

    /// Like [`Timetable::new`], for nodes that use held samples at the events `uses`.
    ///
    /// # Errors
    ///
    /// As for [`Timetable::new`].
    pub fn with_use_of_held(clocks: &[NodeClock], links: &[(usize, usize, LinkTiming)], uses: UseOfHeld) -> Result<Self, AnalysisError> {
        let frame = frame(clocks, links)?;
        let end = i128::try_from(frame).map_err(|_| AnalysisError::NoFrame)?;
        let mut events: Vec<(i128, u8, usize, usize, i64, Event)> = Vec::new();
        let mut first_tick_at = Vec::with_capacity(clocks.len());
        let (mut sent, mut first_sample) = (Vec::new(), Vec::new());
        for (node, clock) in clocks.iter().enumerate() {
            let first = clock.first_tick(0);
            first_tick_at.push(clock.instant(first));
            let (phase, every) = (i128::from(clock.phase), i128::from(clock.every));
            let mut count = 0;
            let mut tick = first;
            // The second entry of a key, the step, orders events of one instant: 0 samplings, 1 deliveries, 2 ticks.
            loop {
                let at = clock.instant(tick);
                if at >= end {
                    break;
                }
                if (tick - phase).rem_euclid(every) == 0 {
                    events.push((at, 0, node, 0, 0, Event::Sample { node }));
                    count += 1;
                }
                let span = Duration::from_nanos(u64::try_from(clock.instant(tick + 1) - at).map_err(|_| AnalysisError::NoFrame)?);
                let (since_begin, exchanges) =
                    (u64::try_from(at).map_err(|_| AnalysisError::NoFrame)?, tick.rem_euclid(i128::from(clock.exchange)) == 0);
                events.push((at, 2, node, 0, 0, Event::Tick { node, at: since_begin, span, exchanges }));
                tick += 1;
            }
            sent.push(count);
            first_sample.push(clock.first_number());
        }
        let mut depth = vec![0; clocks.len()];
        let mut held = Vec::new();
        for (from, to, timing) in links {
            let (from, to) = (*from, *to);
            let arrivals = arrivals(&clocks[from], &clocks[to], timing, first_sample[from], end);
            let mut need = |sample: i64| depth[from] = depth[from].max(usize::try_from(-sample).unwrap_or(0));
            // The sample held at the beginning of the frame is used if the node ticks before the first arrival. A node samples right before its tick.
            let is_used_before = |at: i128| match uses {
                UseOfHeld::Ticks => at > first_tick_at[to],
                UseOfHeld::SamplesAndTicks => at >= first_tick_at[to],
            };
            if arrivals.new.first().is_none_or(|(at, _)| is_used_before(*at))
                && let Some(sample) = arrivals.before
            {
                held.push((to, from, sample));
                need(sample);
            }
            for (at, sample) in arrivals.new {
                need(sample);
                events.push((at, 1, from, to, sample, Event::Deliver { from, to, sample }));
            }
        }
        // All keys differ, so an unstable sort gives one order only.
        events.sort_unstable_by_key(|(at, step, node, to, sample, _)| (*at, *step, *node, *to, *sample));
        let events = events.into_iter().map(|(.., event)| event).collect();
        Ok(Self {
            frame: Duration::from_nanos(u64::try_from(frame).map_err(|_| AnalysisError::NoFrame)?),
            events,
            sent,
            depth,
            held,
            clocks: clocks.to_vec(),
        })
    }
}

/// Instants of the samplings and ticks in a frame \[ns\], indexed by node.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Instants {
    pub(crate) sends: Vec<Vec<u64>>,
    pub(crate) ticks: Vec<Vec<u64>>,
    pub(crate) clocks: Vec<NodeClock>,
}

impl Instants {
    /// Returns the instants of the samplings and ticks in the frame of `timetable`.
    #[must_use]
    pub fn of(timetable: &Timetable) -> Self {
        let nodes = timetable.clocks.len();
        let (mut sends, mut ticks) = (vec![Vec::new(); nodes], vec![Vec::new(); nodes]);
        let mut sampled = vec![false; nodes];
        for event in &timetable.events {
            match *event {
                Event::Sample { node } => sampled[node] = true,
                Event::Deliver { .. } => {}
                Event::Tick { node, at, .. } => {
                    // A node samples only at its own ticks.
                    if std::mem::take(&mut sampled[node]) {
                        sends[node].push(at);
                    }
                    ticks[node].push(at);
                }
            }
        }
        Self { sends, ticks, clocks: timetable.clocks.clone() }
    }

    /// Returns the age of a sample of `from` at a tick of the holder `to`, at the instant `at` of the frame \[s\]: the time on the clock of the holder minus
    /// the time on the clock of the sender at the sending, and at least zero. Clocks of equal drift show the same ages in every frame.
    #[expect(clippy::cast_precision_loss, reason = "a span of at most some frames is far below 2^53 ns")]
    pub fn age(&self, (to, from): (usize, usize), sample: i64, at: u64, frame: Duration) -> f64 {
        let now = self.local(to, i64::try_from(at).unwrap_or(i64::MAX));
        now.saturating_sub(self.local(from, self.sent_at(from, sample, frame))).max(0) as f64 * 1e-9
    }

    /// Returns the time shown by the clock of a node at the instant `at` of one of its ticks \[ns\]. Times are counted from the beginning of the frame, so
    /// the clock shows less than zero before the frame.
    pub(crate) fn local(&self, node: usize, at: i64) -> i64 {
        self.clocks[node].local(i128::from(at))
    }

    /// Returns the instant of sending of a sample of a node, since the beginning of the frame \[ns\]; negative for samples of earlier frames. `sample` is
    /// the number of the sample: samples of this frame count from 0, and −1 is the last sample of the frame before.
    pub(crate) fn sent_at(&self, node: usize, sample: i64, frame: Duration) -> i64 {
        let whole = |number: u128| i64::try_from(number).unwrap_or(i64::MAX);
        let sends = &self.sends[node];
        let count = i64::try_from(sends.len()).unwrap_or(1).max(1);
        let place = usize::try_from(sample.rem_euclid(count)).unwrap_or(0);
        // The frame repeats: sample n + count is sent one frame after sample n.
        sends.get(place).map_or(0, |at| whole(u128::from(*at))) + sample.div_euclid(count) * whole(frame.as_nanos())
    }
}

/// Samples arriving on one link in a frame.
struct Arrivals {
    /// Newest sample arrived before the frame, or `None` without an arrival before.
    before: Option<i64>,
    /// Newer samples as (instant \[ns\], number), each at the receiver's first tick at or after its arrival.
    new: Vec<(i128, i64)>,
}

/// Returns the samples arriving in the frame from 0 to `end` \[ns\]. Samples are numbered from the first sample of the frame. The sender's own count gives
/// this sample the number `first`.
fn arrivals(from: &NodeClock, to: &NodeClock, timing: &LinkTiming, first: i128, end: i128) -> Arrivals {
    let sent_at = |number: i128| from.instant(i128::from(from.phase) + number * i128::from(from.every));
    let delay = |number: i128| match timing {
        LinkTiming::Constant(delay) => i128::try_from(delay.as_nanos()).ok(),
        LinkTiming::Pattern(pattern) => {
            let place = number.rem_euclid(i128::try_from(pattern.len()).unwrap_or(1));
            let delay = pattern.get(usize::try_from(place).unwrap_or(0)).copied().flatten();
            delay.and_then(|delay| i128::try_from(delay.as_nanos()).ok())
        }
    };
    let (shortest, longest, pattern) = match timing {
        LinkTiming::Constant(delay) => (delay.as_nanos(), delay.as_nanos(), 1),
        LinkTiming::Pattern(pattern) => {
            let delays = || pattern.iter().flatten().map(Duration::as_nanos);
            (delays().min().unwrap_or(0), delays().max().unwrap_or(0), pattern.len())
        }
    };
    // The search begins early enough: at the beginning of the frame all older samples have been replaced.
    let period = sent_at(1) - sent_at(0);
    let back = i128::try_from(longest).unwrap_or(0) / period.max(1) + 2 * i128::try_from(pattern).unwrap_or(1) + 3;
    let mut arriving: Vec<(i128, i128)> = Vec::new();
    let mut number = first - back;
    // Samples still on the way at the end of the frame are not looked at: a delay of an hour has half a million of them.
    let latest = end - i128::try_from(shortest).unwrap_or(0);
    while sent_at(number) < latest {
        if let Some(delay) = delay(number) {
            arriving.push((to.instant(to.first_tick(sent_at(number) + delay)), number));
        }
        number += 1;
    }
    // Arrivals in the order of time. A sample older than an earlier arrival is never held, since a peer holds the newest sample.
    arriving.sort_unstable();
    let relative = |number: i128| i64::try_from(number - first).unwrap_or(i64::MIN);
    let (mut newest, mut before, mut new) = (None, None, Vec::new());
    for (at, number) in arriving {
        if newest.is_some_and(|newest| number <= newest) || at >= end {
            continue;
        }
        newest = Some(number);
        if at < 0 {
            before = Some(relative(number));
        } else {
            new.push((at, relative(number)));
        }
    }
    // If several samples arrive at one tick, only the newest is used.
    let mut used: Vec<(i128, i64)> = Vec::with_capacity(new.len());
    for (at, sample) in new {
        match used.last_mut() {
            Some(last) if last.0 == at => last.1 = sample,
            _ => used.push((at, sample)),
        }
    }
    Arrivals { before, new: used }
}

/// Returns the length of the frame \[ns\].
fn frame(clocks: &[NodeClock], links: &[(usize, usize, LinkTiming)]) -> Result<u128, AnalysisError> {
    let mut frame = 1_u128;
    for clock in clocks {
        for ticks in [clock.every, clock.exchange] {
            let (span, _) = clock.repeats_after(ticks).ok_or(AnalysisError::NoFrame)?;
            frame = lcm(frame, span).ok_or(AnalysisError::NoFrame)?;
        }
    }
    for (from, _, timing) in links {
        if let LinkTiming::Pattern(pattern) = timing {
            let clock = &clocks[*from];
            // The pattern repeats after a whole number of its length, the clock after `samples`. Both repeat together after their least common multiple.
            let (span, samples) = clock.repeats().ok_or(AnalysisError::NoFrame)?;
            let pattern = pattern.len() as u128;
            let times = pattern / gcd(pattern, samples);
            frame = lcm(frame, span.checked_mul(times).ok_or(AnalysisError::NoFrame)?).ok_or(AnalysisError::NoFrame)?;
        }
    }
    let ticks: u128 = clocks.iter().map(|clock| frame / clock.clock.spans().0.as_nanos().max(1)).sum();
    if ticks > MOST_EVENTS {
        return Err(AnalysisError::FrameTooLong { frame: Duration::from_nanos(u64::try_from(frame).unwrap_or(u64::MAX)) });
    }
    Ok(frame)
}

fn gcd(a: u128, b: u128) -> u128 {
    if b == 0 { a } else { gcd(b, a % b) }
}

// Dividing first keeps the product in range whenever the result is in range.
fn lcm(a: u128, b: u128) -> Option<u128> {
    (a / gcd(a, b)).checked_mul(b)
}
