//! Ticks of a receiver at which a sample may be taken in, and the probability of each.
//!
//! A receiver holds the newest sample that has arrived from a sender. Let n be a sample sent at s, and G(x) the probability that n has arrived by the time x
//! after its sending. The *hazard* of n at a tick t is the probability that n arrives by t, given that n has not arrived by the tick before:
//!
//! ```text
//! (G(t − s) − G(t₋ − s)) / (1 − G(t₋ − s)),    t₋ the tick before.
//! ```
//!
//! Taking in sample n at each tick with its hazard, independently of everything else, gives n the right law: the probability that n has not been taken in
//! by t is Π(1 − hazard) = 1 − G. In this model n may be taken in twice, but the second time changes nothing. A sample older than the held sample, however,
//! must not be taken in. If the last possible tick of every sample is not after the first possible tick of the next sample, no older sample arrives
//! later, and the hazards suffice. Otherwise the model must know *which* sample is held, as far as the held sample decides whether a sample that may still
//! arrive is newer. If a is the newest arrived sample, then no sample after a has arrived, so the hazards of the samples after a hold given a.
//! Hence the *place* r = max(a − lo, 0), with lo the oldest sample that may still arrive, is a Markov chain.

/// Law of the time from the sending of a sample to its arrival \[ns\].
pub(crate) trait Arrival {
    /// Returns the probability of arrival within `nanos` nanoseconds after the sending of a sample. Zero below the least time, and not decreasing. The limit is
    /// below 1 if samples can be lost.
    fn within(&self, nanos: i128) -> f64;
    /// Returns a lower bound of the time from sending to arrival \[ns\].
    fn least(&self) -> i128;
}

/// Ticks at which the samples of a link may be taken in, with their hazards, in a periodic frame.
#[derive(Clone, PartialEq, Debug)]
pub struct Hazards {
    /// Samples and hazards, oldest sample first. Indexed by the receiver's tick. Sample 0 is the first sample sent in this frame.
    pub at: Vec<Vec<Hazard>>,
    /// Largest number of places at any tick; 1 if no sample overtakes another.
    pub(crate) places: usize,
    /// True if any sample has several possible ticks of arrival.
    pub(crate) spread: bool,
    /// Oldest sample with a possible arrival at or after a tick. Indexed by tick; the last entry belongs to the first tick of the next frame.
    oldest: Vec<i64>,
    /// Newest sample with a possible arrival before a tick. Indexed by tick; the last entry belongs to the first tick of the next frame.
    newest: Vec<i64>,
    /// For each sample of the frame, the number of the first tick at which the sample may arrive, counted from the first tick of the frame, and the
    /// probabilities of an arrival by that tick and by each later tick, up to the last possible tick.
    arrived: Vec<(i64, Vec<f64>)>,
}

/// Sample that may be taken in at a tick.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hazard {
    /// Number of the sample. Sample 0 is the first sample sent in the frame; samples of earlier frames are negative.
    pub sample: i64,
    /// Probability of an arrival at the tick, given no arrival at an earlier tick.
    pub hazard: f64,
}

/// Range of the samples under way or held around a tick.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Window {
    /// Number of the oldest sample with a possible arrival at the tick or later. This sample has place 0 at the beginning of the tick.
    pub(crate) before: i64,
    /// Number of the oldest sample with a possible arrival after the tick. This sample has place 0 at the end of the tick.
    pub(crate) after: i64,
    /// Number of the newest sample with a possible arrival by the end of the tick.
    pub(crate) newest: i64,
    /// Number of places at the beginning of the tick.
    pub(crate) places: usize,
}

/// Possible transition of a link's chain at a tick: from state `from` to state `to`, with the sample taken in, if any. Without a chain of losses the
/// states are the places.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct Outcome {
    pub(crate) from: usize,
    pub(crate) to: usize,
    pub(crate) take: Option<i64>,
    pub(crate) probability: f64,
}

/// Largest number of ticks between the first and the last possible arrival of a sample.
const MOST_TICKS: usize = 1_000_000;

impl Hazards {
    /// Computes the hazards of a link. `frame` is the length of the frame \[ns\]; `sends` and `ticks` are the instants \[ns\] within the frame at which samples
    /// are sent and the receiver ticks, both ascending and not empty. Returns `None` if a sample may take longer than [`MOST_TICKS`] ticks.
    pub(crate) fn new(frame: u64, sends: &[u64], ticks: &[u64], arrival: &impl Arrival) -> Option<Self> {
        let frame = i128::from(frame);
        let count = i128::try_from(ticks.len()).ok()?;
        // Returns the instant \[ns\] of the tick with a number that counts on over frames, negative numbers included.
        let tick = |number: i128| -> Option<i128> {
            let place = usize::try_from(number.rem_euclid(count)).ok()?;
            Some(i128::from(*ticks.get(place)?) + frame * number.div_euclid(count))
        };
        // Below 1 if samples can be lost. A sample at this probability does not arrive later.
        let final_probability = arrival.within(i128::MAX);
        let mut at: Vec<Vec<Hazard>> = vec![Vec::new(); ticks.len()];
        // First and last possible tick of each sample of the frame. The numbers count on over frames.
        let mut spans: Vec<(i128, i128)> = Vec::with_capacity(sends.len());
        let mut arrived = Vec::with_capacity(sends.len());
        for (sample, sent) in sends.iter().enumerate() {
            let sent = i128::from(*sent);
            let earliest = sent + arrival.least();
            // The search begins at the first tick not before `earliest`. Earlier ticks have hazard 0, so skipping the ticks changes no result.
            let frames = earliest.div_euclid(frame);
            let in_frame = ticks.partition_point(|tick| i128::from(*tick) < earliest - frames * frame);
            let mut number = frames * count + i128::try_from(in_frame).ok()?;
            let (mut before, mut first, mut steps) = (0.0, None, 0);
            let mut reached = Vec::new();
            let last = loop {
                let now = arrival.within(tick(number)? - sent);
                // A sample with G = 1 before this tick has surely arrived. The quotient would be 0/0.
                let hazard = if before < 1.0 { (now - before) / (1.0 - before) } else { 0.0 };
                if hazard > 0.0 {
                    // The frame repeats: a sample that arrives some frames after its sending is, at that tick of this frame, a sample of an earlier frame.
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
        // Each sample recurs in every frame with its number raised by `shift`. The oldest recurrence still under way at tick `number` is the first recurrence
        // whose last tick is not before `number`, and the newest possible arrival is the last recurrence whose first tick is before `number`.
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

    /// Returns the number of samples of earlier frames in the sender's state. All of these samples may be taken in during this frame.
    pub fn depth(&self) -> usize {
        self.at.iter().flatten().map(|hazard| usize::try_from(-hazard.sample).unwrap_or(0)).max().unwrap_or(0)
    }

    /// Returns the range of the samples under way or held around a tick of the frame.
    pub(crate) fn window(&self, tick: usize) -> Window {
        let (before, after) = (self.oldest[tick], self.oldest[tick + 1]);
        Window { before, after, newest: self.newest[tick + 1], places: reach(before, self.newest[tick]) + 1 }
    }

    /// Returns two probabilities: of an arrival of the sample by the tick before `tick`, and of an arrival by `tick`.
    pub(crate) fn arrived(&self, sample: i64, tick: usize) -> (f64, f64) {
        let (sends, ticks) = (i64::try_from(self.arrived.len()).unwrap_or(1), i64::try_from(self.at.len()).unwrap_or(1));
        let (first, reached) = &self.arrived[usize::try_from(sample.rem_euclid(sends)).unwrap_or(0)];
        // `arrived` lists samples of the frame only. The recurrence of this sample within the frame sees the tick shifted by as many frames.
        let tick = i64::try_from(tick).unwrap_or(i64::MAX) - sample.div_euclid(sends) * ticks;
        // Before the first possible tick the probability is 0. After the last listed tick the last probability stays.
        let by = |tick: i64| usize::try_from(tick - first).map_or(0.0, |place| reached.get(place).or_else(|| reached.last()).copied().unwrap_or(0.0));
        (by(tick - 1), by(tick))
    }

    /// Returns the outcomes of a tick from every reachable place, for a link without a chain of losses.
    pub(crate) fn outcomes(&self, tick: usize) -> Vec<Outcome> {
        let (before, after) = (self.oldest[tick], self.oldest[tick + 1]);
        let place = |sample: i64| usize::try_from(sample - after).unwrap_or(0);
        let mut outcomes = Vec::new();
        for from in 0..=reach(before, self.newest[tick]) {
            let held = before + i64::try_from(from).unwrap_or(i64::MAX);
            // Newest sample first: a sample is taken in if the sample arrives and no newer sample does. `left` is the probability of no newer arrival.
            let mut left = 1.0;
            for Hazard { sample, hazard, .. } in self.at[tick].iter().rev().copied() {
                // Place 0 stands for all samples up to the oldest sample under way. The oldest sample itself may therefore still arrive, and only from place 0.
                if sample < held || (sample == held && from > 0) {
                    break;
                }
                outcomes.push(Outcome { from, to: place(sample), take: Some(sample), probability: left * hazard });
                left *= 1.0 - hazard;
            }
            // No hazard came true: the held sample stays, and only the count of places moves to the oldest sample after the tick.
            outcomes.push(Outcome { from, to: place(held), take: None, probability: left });
        }
        outcomes
    }
}

/// Returns the largest place if `oldest` is the oldest sample under way and `newest` the newest possible arrival; 0 if `newest` is not after `oldest`.
fn reach(oldest: i64, newest: i64) -> usize {
    usize::try_from(newest - oldest).unwrap_or(0)
}
