//! What happens in one frame, in which order: sampling, deliveries and ticks of every node.
//!
//! A frame is the span after which everything repeats: the least common multiple of all periods of sending, of drifting clocks and of the patterns of
//! links. The order within it is that of a simulation: at one instant first samples, then deliveries, then ticks, each by place. It begins at an
//! instant late enough that every peer has begun and everything in flight belongs to the pattern.

use std::time::Duration;

use cohaptic_peer::Clock;
use cohaptic_scene::Scene;

use crate::AnalysisError;
use crate::network::LinkTiming;

/// More events than this in a frame are refused.
const MOST_EVENTS: u128 = 20_000_000;

/// When a node ticks and samples.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NodeClock {
    /// When the node ticks.
    pub clock: Clock,
    /// It samples at ticks k with (k − phase) a multiple of `every`.
    pub(crate) phase: u64,
    /// How many ticks there are from one sample to the next.
    pub every: u64,
}

impl NodeClock {
    /// Returns the clock of the peer in that place of a scene.
    #[must_use]
    pub fn of(scene: &Scene, place: usize) -> Self {
        let spec = &scene.peers[place];
        let every = scene.coordination.update.as_nanos() / spec.clock.tick.as_nanos();
        Self { clock: spec.clock, phase: spec.phase, every: u64::try_from(every).unwrap_or(u64::MAX) }
    }

    /// At which tick of `to`, counted from its first one in the frame, the first sample of the frame is there if it takes `delay`; and the longest
    /// delay for which it is there at that tick.
    pub fn arrival(&self, to: &Self, delay: Duration) -> (usize, Duration) {
        let (phase, every) = (i128::from(self.phase), i128::from(self.every));
        let sent = self.instant(phase + self.first_number() * every);
        let tick = to.first_tick(sent.saturating_add(i128::try_from(delay.as_nanos()).unwrap_or(i128::MAX)));
        let longest = Duration::from_nanos(u64::try_from(to.instant(tick) - sent).unwrap_or(u64::MAX));
        (usize::try_from(tick - to.first_tick(0)).unwrap_or(usize::MAX), longest)
    }

    /// The number of the first sample of the frame, counted from the clock's own beginning.
    fn first_number(&self) -> i128 {
        let (first, every) = (self.first_tick(0) - i128::from(self.phase), i128::from(self.every));
        first.div_euclid(every) + i128::from(first.rem_euclid(every) != 0)
    }

    /// 10⁹ + drift, the denominator of the instants.
    fn speed(&self) -> u128 {
        u128::from(1_000_000_000_u64.saturating_add_signed(self.clock.drift.parts_per_billion()))
    }

    /// The shortest whole number of periods of sending that takes a whole number of nanoseconds: how long \[ns\] and how many; `None` beyond measure.
    fn repeats(&self) -> Option<(u128, u128)> {
        let sending = self.clock.tick.as_nanos().checked_mul(u128::from(self.every))?.checked_mul(1_000_000_000)?;
        let common = gcd(sending, self.speed());
        Some((sending / common, self.speed() / common))
    }

    /// The instant of tick k \[ns\], for negative k too, as if the clock had always run.
    fn instant(&self, tick: i128) -> i128 {
        let local = i128::try_from(self.clock.tick.as_nanos()).unwrap_or(i128::MAX) * tick;
        let offset = i128::try_from(self.clock.offset.as_nanos()).unwrap_or(i128::MAX);
        offset + (local * 1_000_000_000).div_euclid(i128::try_from(self.speed()).unwrap_or(i128::MAX))
    }

    /// Time that the clock shows at a tick of its own, at the instant to which [`instant`](Self::instant) rounds that tick \[ns\].
    fn local(&self, at: i128) -> i64 {
        let tick = i128::try_from(self.clock.tick.as_nanos()).unwrap_or(i128::MAX);
        let offset = i128::try_from(self.clock.offset.as_nanos()).unwrap_or(i128::MAX);
        let speed = i128::try_from(self.speed()).unwrap_or(i128::MAX);
        // Ticks are much further apart than the nanosecond by which an instant is rounded.
        let number = (2 * (at - offset) * speed / 1_000_000_000 + tick).div_euclid(2 * tick);
        i64::try_from(number * tick).unwrap_or(i64::MAX)
    }

    /// The first tick at or after an instant.
    fn first_tick(&self, at: i128) -> i128 {
        let span = i128::try_from(self.clock.tick.as_nanos()).unwrap_or(i128::MAX) * 1_000_000_000;
        let speed = i128::try_from(self.speed()).unwrap_or(i128::MAX);
        let offset = i128::try_from(self.clock.offset.as_nanos()).unwrap_or(i128::MAX);
        // Within one tick of the answer; the rounding of instants decides.
        let mut tick = ((at - offset) * speed).div_euclid(span) - 1;
        while self.instant(tick) < at {
            tick += 1;
        }
        tick
    }
}

/// Something that happens.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Event {
    /// The node samples its copy and sends. Samples of this frame are numbered from 0.
    Sample {
        /// The node.
        node: usize,
    },
    /// From now on `to` holds that sample of `from`: from 0 if it is of this frame, −1 is the last one of the frame before.
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
        /// The instant after the frame's beginning \[ns\].
        at: u64,
        /// How long until the next tick.
        span: Duration,
    },
}

/// One frame.
#[derive(Clone, PartialEq, Debug)]
pub struct Timetable {
    /// How long the frame is.
    pub frame: Duration,
    /// What happens in it, in order.
    pub events: Vec<Event>,
    /// How many samples each node sends in a frame.
    pub sent: Vec<usize>,
    /// How many samples of the frames before are still needed of each node.
    pub depth: Vec<usize>,
    /// What each node holds of each other at the beginning of the frame, if it is used before the first delivery: (to, from, sample).
    pub held: Vec<(usize, usize, i64)>,
    /// The clocks of the nodes.
    pub clocks: Vec<NodeClock>,
}

/// At which events nodes use the samples that they hold.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum UseOfHeld {
    /// When they compute forces.
    Ticks,
    /// Also when they sample, before the deliveries of the same instant.
    SamplesAndTicks,
}

impl Timetable {
    /// No sample that is used in the frame is older \[s\].
    pub(crate) fn oldest(&self) -> f64 {
        let frames = self.depth.iter().zip(&self.sent).map(|(depth, sent)| depth.div_ceil((*sent).max(1)) + 1).max().unwrap_or(1);
        self.frame.as_secs_f64() * crate::rounding::real(frames)
    }

    /// The frame of nodes that send to each other over those links: (from, to, timing).
    ///
    /// # Errors
    ///
    /// [`AnalysisError::NoFrame`] or [`AnalysisError::FrameTooLong`] where clocks do not meet soon enough.
    pub fn new(clocks: &[NodeClock], links: &[(usize, usize, LinkTiming)]) -> Result<Self, AnalysisError> {
        Self::with_use_of_held(clocks, links, UseOfHeld::Ticks)
    }

    /// [`Timetable::new`] for nodes that use what they hold at those events.
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
                events.push((at, 2, node, 0, 0, Event::Tick { node, at: u64::try_from(at).map_err(|_| AnalysisError::NoFrame)?, span }));
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
            // The sample held when the frame begins matters if the node ticks before anything arrives. It samples before that.
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

/// When each node samples and ticks in a frame \[ns\].
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Instants {
    pub(crate) sends: Vec<Vec<u64>>,
    pub(crate) ticks: Vec<Vec<u64>>,
    pub(crate) clocks: Vec<NodeClock>,
}

impl Instants {
    /// Returns those of a frame.
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
                    // A node samples at a tick of its own.
                    if std::mem::take(&mut sampled[node]) {
                        sends[node].push(at);
                    }
                    ticks[node].push(at);
                }
            }
        }
        Self { sends, ticks, clocks: timetable.clocks.clone() }
    }

    /// The age of a sample at an instant of the frame at which its holder ticks \[s\]: what the clock of the holder shows less what that of the sender showed,
    /// and at least zero. Clocks of one drift show the same ages in every frame.
    #[expect(clippy::cast_precision_loss, reason = "a span of at most some frames is far below 2^53 ns")]
    pub fn age(&self, (to, from): (usize, usize), sample: i64, at: u64, frame: Duration) -> f64 {
        let now = self.local(to, i64::try_from(at).unwrap_or(i64::MAX));
        now.saturating_sub(self.local(from, self.sent_at(from, sample, frame))).max(0) as f64 * 1e-9
    }

    /// Time that the clock of a node shows at a tick of its own, counted from the beginning of the frame, before which the clock shows less than zero \[ns\].
    pub(crate) fn local(&self, node: usize, at: i64) -> i64 {
        self.clocks[node].local(i128::from(at))
    }

    /// When a sample of a node was sent, before the beginning of the frame too \[ns\]: from 0 if it is of this frame, −1 is the last one of the frame before.
    pub(crate) fn sent_at(&self, node: usize, sample: i64, frame: Duration) -> i64 {
        let whole = |number: u128| i64::try_from(number).unwrap_or(i64::MAX);
        let sends = &self.sends[node];
        let count = i64::try_from(sends.len()).unwrap_or(1).max(1);
        let place = usize::try_from(sample.rem_euclid(count)).unwrap_or(0);
        sends.get(place).map_or(0, |at| whole(u128::from(*at))) + sample.div_euclid(count) * whole(frame.as_nanos())
    }
}

/// What arrives on one link.
struct Arrivals {
    /// The newest sample that has arrived before the frame; `None` if none ever does.
    before: Option<i64>,
    /// What replaces it, at the receiver's ticks at or after the arrivals.
    new: Vec<(i128, i64)>,
}

/// What arrives in the frame from 0 to `end`; samples are numbered from the frame's first one, `first` in the sender's own count.
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
    // Far enough back that whatever is older has been replaced by the time the frame begins.
    let period = sent_at(1) - sent_at(0);
    let back = i128::try_from(longest).unwrap_or(0) / period.max(1) + 2 * i128::try_from(pattern).unwrap_or(1) + 3;
    let mut arriving: Vec<(i128, i128)> = Vec::new();
    let mut number = first - back;
    // Samples that are still on the way at the end of the frame are not looked at: a delay of an hour has half a million of them.
    let latest = end - i128::try_from(shortest).unwrap_or(0);
    while sent_at(number) < latest {
        if let Some(delay) = delay(number) {
            arriving.push((to.instant(to.first_tick(sent_at(number) + delay)), number));
        }
        number += 1;
    }
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
    // Of several that arrive at one tick only the newest is ever used.
    let mut used: Vec<(i128, i64)> = Vec::with_capacity(new.len());
    for (at, sample) in new {
        match used.last_mut() {
            Some(last) if last.0 == at => last.1 = sample,
            _ => used.push((at, sample)),
        }
    }
    Arrivals { before, new: used }
}

/// The length of the frame \[ns\].
fn frame(clocks: &[NodeClock], links: &[(usize, usize, LinkTiming)]) -> Result<u128, AnalysisError> {
    let mut frame = 1_u128;
    for clock in clocks {
        let (span, _) = clock.repeats().ok_or(AnalysisError::NoFrame)?;
        frame = lcm(frame, span).ok_or(AnalysisError::NoFrame)?;
    }
    for (from, _, timing) in links {
        if let LinkTiming::Pattern(pattern) = timing {
            let clock = &clocks[*from];
            // The samples in one repetition of the clock, taken as often as the pattern needs.
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

fn lcm(a: u128, b: u128) -> Option<u128> {
    (a / gcd(a, b)).checked_mul(b)
}
