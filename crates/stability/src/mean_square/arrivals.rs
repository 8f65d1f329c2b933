//! At which of the receiver's ticks a sample may be taken in, and with which probability.
//!
//! What a receiver holds of a sender is the newest sample that has arrived. Let n be a sample sent at s, with G(x) the probability that it has arrived x
//! after it was sent; at a tick t its *hazard* is the probability that it arrives there if it has not arrived before,
//!
//! ```text
//! (G(t − s) − G(t₋ − s)) / (1 − G(t₋ − s)),    t₋ the tick before.
//! ```
//!
//! To take in, at each tick, sample n with its hazard, independently of everything else, gives n the right law: it is not held after t with probability
//! Π(1 − hazard) = 1 − G. That it may be taken in twice does not matter, because the second time changes nothing. What does matter is that a sample older than
//! the one held must not be taken in. Where every sample has its last possible tick before, or at, the first one of the next sample, that cannot
//! happen, and the hazards are all there is. Otherwise it must be known *which* sample is held, as far as that decides whether one that may yet arrive is
//! newer. If a is the newest sample that has arrived, then none after a has, so the hazards of those after a hold given a: the *place*
//! r = max(a − lo, 0), with lo the oldest sample that may arrive yet, is a Markov chain.

/// The probability that a sample has arrived that number of nanoseconds after it was sent.
pub(crate) trait Arrival {
    /// Zero before it can arrive; not decreasing.
    fn within(&self, nanos: i128) -> f64;
    /// No sample arrives sooner than this.
    fn least(&self) -> i128;
}

/// When the samples of a link may be taken in, in a frame that repeats.
#[derive(Clone, PartialEq, Debug)]
pub struct Hazards {
    /// For each tick of the receiver: the samples and their hazards, oldest first; samples are numbered from the first of this frame.
    pub at: Vec<Vec<Hazard>>,
    /// How many places there are; one if no sample overtakes another.
    pub(crate) places: usize,
    /// Whether a sample has more than one tick at which it may arrive.
    pub(crate) spread: bool,
    /// The oldest sample that may arrive at or after each tick, and after the last.
    oldest: Vec<i64>,
    /// The newest that may have arrived by the tick before each, and by the last.
    newest: Vec<i64>,
    /// For each sample of the frame: the number of its first tick, counted from the first tick of the frame, and the probability that it has arrived by that
    /// tick and by each one after it, up to its last.
    arrived: Vec<(i64, Vec<f64>)>,
}

/// A sample that may be taken in at a tick.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hazard {
    /// The number of the sample, counted from the first of the frame.
    pub sample: i64,
    /// The probability that the sample is taken in at the tick, if it was not before.
    pub hazard: f64,
}

/// The samples that matter at a tick.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Window {
    /// The oldest sample that may arrive at the tick or later.
    pub(crate) before: i64,
    /// The oldest sample that may arrive later.
    pub(crate) after: i64,
    /// The newest sample that may have arrived by the tick.
    pub(crate) newest: i64,
    /// Places at the beginning of the tick.
    pub(crate) places: usize,
}

/// What may happen at a tick: from one place to another, taking in a sample or none.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Outcome {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) take: Option<i64>,
    pub(crate) probability: f64,
}

/// More ticks than this between the first and the last at which a sample may arrive are refused.
const MOST_TICKS: usize = 1_000_000;

impl Hazards {
    /// The hazards of samples sent and ticks made at those instants \[ns\] of a frame, each list in order and not empty; `None` if a sample may take too
    /// long.
    pub(crate) fn new(frame: u64, sends: &[u64], ticks: &[u64], arrival: &impl Arrival) -> Option<Self> {
        let frame = i128::from(frame);
        let count = i128::try_from(ticks.len()).ok()?;
        let tick = |number: i128| -> Option<i128> {
            let place = usize::try_from(number.rem_euclid(count)).ok()?;
            Some(i128::from(*ticks.get(place)?) + frame * number.div_euclid(count))
        };
        let final_probability = arrival.within(i128::MAX);
        let mut at: Vec<Vec<Hazard>> = vec![Vec::new(); ticks.len()];
        // The first and the last tick of each sample of the frame, counted on over frames.
        let mut spans: Vec<(i128, i128)> = Vec::with_capacity(sends.len());
        let mut arrived = Vec::with_capacity(sends.len());
        for (sample, sent) in sends.iter().enumerate() {
            let sent = i128::from(*sent);
            let earliest = sent + arrival.least();
            let frames = earliest.div_euclid(frame);
            let in_frame = ticks.partition_point(|tick| i128::from(*tick) < earliest - frames * frame);
            let mut number = frames * count + i128::try_from(in_frame).ok()?;
            let (mut before, mut first, mut steps) = (0.0, None, 0);
            let mut reached = Vec::new();
            let last = loop {
                let now = arrival.within(tick(number)? - sent);
                let hazard = if before < 1.0 { (now - before) / (1.0 - before) } else { 0.0 };
                if hazard > 0.0 {
                    let place = usize::try_from(number.rem_euclid(count)).ok()?;
                    let frames = i64::try_from(number.div_euclid(count)).ok()?;
                    let sample = i64::try_from(sample).ok()? - frames * i64::try_from(sends.len()).ok()?;
                    at[place].push(Hazard { sample, hazard: hazard.min(1.0) });
                    first.get_or_insert(number);
                }
                before = now;
                if first.is_some() {
                    reached.push(now);
                }
                if now >= final_probability {
                    break number;
                }
                number += 1;
                steps += 1;
                if steps > MOST_TICKS {
                    return None;
                }
            };
            spans.push((first.unwrap_or(last), last));
            arrived.push((i64::try_from(first.unwrap_or(last)).ok()?, reached));
        }
        for hazards in &mut at {
            hazards.sort_unstable_by_key(|hazard| hazard.sample);
        }
        let shift = i128::try_from(sends.len()).ok()?;
        let numbered = || spans.iter().zip(0_i128..);
        let (mut oldest, mut newest) = (Vec::new(), Vec::new());
        for number in 0..=count {
            let old = numbered().map(|((_, last), sample)| sample - (last - number).div_euclid(count) * shift).min()?;
            let new = numbered().map(|((first, _), sample)| sample + (number - 1 - first).div_euclid(count) * shift).max()?;
            oldest.push(i64::try_from(old).ok()?);
            newest.push(i64::try_from(new).ok()?);
        }
        let places = oldest.iter().zip(&newest).map(|(oldest, newest)| reach(*oldest, *newest)).max()? + 1;
        let spread = spans.iter().any(|(first, last)| first != last);
        Some(Self { at, places, spread, oldest, newest, arrived })
    }

    /// How many samples of earlier frames may be taken in.
    pub fn depth(&self) -> usize {
        self.at.iter().flatten().map(|hazard| usize::try_from(-hazard.sample).unwrap_or(0)).max().unwrap_or(0)
    }

    /// Returns the samples that matter at a tick.
    pub(crate) fn window(&self, tick: usize) -> Window {
        let (before, after) = (self.oldest[tick], self.oldest[tick + 1]);
        Window { before, after, newest: self.newest[tick + 1], places: reach(before, self.newest[tick]) + 1 }
    }

    /// Returns the probabilities that a sample has arrived by the tick before a tick of the frame, and by that tick.
    pub(crate) fn arrived(&self, sample: i64, tick: usize) -> (f64, f64) {
        let (sends, ticks) = (i64::try_from(self.arrived.len()).unwrap_or(1), i64::try_from(self.at.len()).unwrap_or(1));
        let (first, reached) = &self.arrived[usize::try_from(sample.rem_euclid(sends)).unwrap_or(0)];
        // The tick as the sample of the frame counts it that is sent as this one is.
        let tick = i64::try_from(tick).unwrap_or(i64::MAX) - sample.div_euclid(sends) * ticks;
        let by = |tick: i64| usize::try_from(tick - first).map_or(0.0, |place| reached.get(place).or_else(|| reached.last()).copied().unwrap_or(0.0));
        (by(tick - 1), by(tick))
    }

    /// What may happen at a tick, from every place that can be reached.
    pub(crate) fn outcomes(&self, tick: usize) -> Vec<Outcome> {
        let (before, after) = (self.oldest[tick], self.oldest[tick + 1]);
        let place = |sample: i64| usize::try_from(sample - after).unwrap_or(0);
        let mut outcomes = Vec::new();
        for from in 0..=reach(before, self.newest[tick]) {
            let held = before + i64::try_from(from).unwrap_or(i64::MAX);
            let mut left = 1.0;
            for Hazard { sample, hazard, .. } in self.at[tick].iter().rev().copied() {
                // Place 0 is that of all samples up to the oldest.
                if sample < held || (sample == held && from > 0) {
                    break;
                }
                outcomes.push(Outcome { from, to: place(sample), take: Some(sample), probability: left * hazard });
                left *= 1.0 - hazard;
            }
            outcomes.push(Outcome { from, to: place(held), take: None, probability: left });
        }
        outcomes
    }
}

fn reach(oldest: i64, newest: i64) -> usize {
    usize::try_from(newest - oldest).unwrap_or(0)
}
