//! Token bucket: a mean rate with bursts (the filter of `tc-tbf`).
//!
//! A bucket of B bytes fills at the rate R. The oldest waiting packet leaves as soon as the bucket holds its size, and takes its size from the bucket. For
//! any departures i … k therefore sᵢ + … + sₖ ≤ B + R·(tₖ − tᵢ). With a peak bucket the same holds for the peak rate and a smaller size.
//!
//! Unlike a serialiser, a bucket with credit lets a packet pass at once: a bucket limits the amount of a burst, not its speed.

use super::limit::words_of_limit;
use alloc::collections::VecDeque;
use alloc::format;
use alloc::string::String;
use core::time::Duration;

use cohaptic_units::{Bytes, Instant, Rate};

use super::bottleneck::giga_bits;
use super::framing::SIGNED_SIZE;
use super::limit::{LIMIT, Waiting};
use super::{Framing, QueueLimit};
use crate::fates::fate::DropCause;
use crate::packet::{Carried, Exit, Output, Outputs};
use crate::parameters::{Form, Key, NONE, Table, optional, required, usual};

/// Configuration of a token bucket and the queue before it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TokenBucket {
    /// Rate of filling.
    pub rate: Rate,
    /// Size of the bucket. The bucket begins full. A packet beyond this size can never leave and is dropped.
    pub burst: Bytes,
    /// Second bucket, against the speed of a burst.
    pub peak: Option<Peak>,
    /// Bytes taken from the bucket by a packet beyond the packet's bytes.
    pub framing: Framing,
    /// Limit of the queue. `None` sets no limit.
    pub limit: Option<QueueLimit>,
}

/// Bucket of the peak rate.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Peak {
    /// Rate of filling.
    pub rate: Rate,
    /// Size of the bucket: at least one packet of the largest size.
    pub burst: Bytes,
}

/// State of a bucket. Amounts are in 10⁻⁹ bit.
#[derive(Clone, Copy, Debug)]
struct Bucket {
    /// Rate of new tokens.
    rate: Rate,
    /// Greatest number of tokens in the bucket.
    size: u128,
    /// Tokens in the bucket at `since`; at most `size`.
    tokens: u128,
    since: Instant,
}

impl Bucket {
    /// Returns a bucket that is full at `now`.
    fn full(now: Instant, rate: Rate, burst: Bytes) -> Self {
        let size = giga_bits(burst);
        Self { rate, size, tokens: size, since: now }
    }

    /// Adds the new tokens until `now`.
    fn fill(&mut self, now: Instant) {
        // Tokens beyond the size of the bucket are lost.
        // Whole amounts of 10⁻⁹ bit keep the sum of tokens exact over any number of packets.
        let came = self.rate.bits_sent(now.saturating_duration_since(self.since));
        self.tokens = self.tokens.saturating_add(came).min(self.size);
        self.since = self.since.max(now);
    }

    /// Returns the first instant with `needed` tokens in the bucket, if no packet takes tokens before. `needed` is at most the bucket's size.
    fn holds_at(&self, needed: u128) -> Instant {
        self.since.saturating_add(self.rate.transmission_time(needed.saturating_sub(self.tokens)))
    }
}

/// Stage with the buckets and the waiting packets.
#[derive(Clone, Debug)]
pub(crate) struct TokenBucketStage<T> {
    config: TokenBucket,
    mean: Bucket,
    peak: Option<Bucket>,
    waiting: VecDeque<Carried<T>>,
    /// Bytes of the waiting packets, framing not counted. Wider than [`Bytes`], because a sum of [`Bytes`] would saturate.
    waiting_bytes: u128,
}

impl<T> TokenBucketStage<T> {
    /// Returns a stage with full buckets.
    pub(crate) fn new(now: Instant, config: TokenBucket) -> Self {
        let mean = Bucket::full(now, config.rate, config.burst);
        let peak = config.peak.map(|peak| Bucket::full(now, peak.rate, peak.burst));
        Self { config, mean, peak, waiting: VecDeque::new(), waiting_bytes: 0 }
    }

    /// Takes a packet. Returns the packet if the packet may leave at once; otherwise the packet waits, or is dropped into `outputs`.
    pub(crate) fn offer(&mut self, now: Instant, packet: Carried<T>, outputs: &mut Outputs<T>) -> Option<Carried<T>> {
        let needed = self.needed(&packet);
        if needed > self.largest() {
            outputs.push(Output { packet, exit: Exit::Dropped(now, DropCause::Mtu) });
            return None;
        }
        // Packets leave in order, so a packet may leave at once only if no packet waits.
        if self.waiting.is_empty() {
            self.fill(now);
            if self.pay(needed) {
                return Some(packet);
            }
        }
        let size = packet.info.size;
        if !self.admits(now, size) {
            outputs.push(Output { packet, exit: Exit::Dropped(now, DropCause::QueueFull) });
            return None;
        }
        self.waiting_bytes += u128::from(size.get());
        self.waiting.push_back(packet);
        None
    }

    /// Returns the instant at which the oldest waiting packet may leave, or `None` if no packet waits.
    pub(crate) fn next_at(&self) -> Option<Instant> {
        let needed = self.needed(self.waiting.front()?);
        let mean = self.mean.holds_at(needed);
        // A packet leaves when both buckets have enough, so the later instant counts.
        Some(self.peak.map_or(mean, |peak| mean.max(peak.holds_at(needed))))
    }

    /// Returns the packet leaving `now`. `now` is the instant returned by [`next_at`](Self::next_at).
    pub(crate) fn release(&mut self, now: Instant) -> Option<Carried<T>> {
        self.fill(now);
        let packet = self.waiting.pop_front()?;
        self.waiting_bytes -= u128::from(packet.info.size.get());
        let paid = self.pay(self.needed(&packet));
        // No instant lies beyond the end of time, so a packet with a later departure leaves at the end, perhaps without enough tokens.
        debug_assert!(paid || now == Instant::MAX, "what waits fits into the buckets, and is released when they hold it");
        Some(packet)
    }

    /// Changes rates, sizes and limit. Tokens stay, up to the size of the new bucket; a new peak bucket is full. A waiting packet too large for the new buckets
    /// could never leave and is dropped.
    pub(crate) fn reconfigure(&mut self, now: Instant, config: TokenBucket, outputs: &mut Outputs<T>) {
        // Tokens before the change came at the old rates.
        self.fill(now);
        let change = |old: Bucket, rate, burst| {
            let size = giga_bits(burst);
            Bucket { rate, size, tokens: old.tokens.min(size), since: old.since }
        };
        self.mean = change(self.mean, config.rate, config.burst);
        self.peak = config.peak.map(|peak| match self.peak {
            Some(old) => change(old, peak.rate, peak.burst),
            None => Bucket::full(now, peak.rate, peak.burst),
        });
        self.config = config;
        let largest = self.largest();
        for packet in core::mem::take(&mut self.waiting) {
            if self.needed(&packet) > largest {
                self.waiting_bytes -= u128::from(packet.info.size.get());
                outputs.push(Output { packet, exit: Exit::Dropped(now, DropCause::Mtu) });
            } else {
                self.waiting.push_back(packet);
            }
        }
    }

    /// Returns all waiting packets in order.
    pub(crate) fn dismantle(self) -> impl Iterator<Item = Carried<T>> {
        self.waiting.into_iter()
    }

    /// Returns the tokens of the largest packet with any chance to leave.
    fn largest(&self) -> u128 {
        self.peak.map_or(self.mean.size, |peak| peak.size.min(self.mean.size))
    }

    /// Returns the tokens for a packet.
    fn needed(&self, packet: &Carried<T>) -> u128 {
        giga_bits(self.config.framing.on_the_line(packet.info.size))
    }

    /// Adds the new tokens until `now` to both buckets.
    fn fill(&mut self, now: Instant) {
        self.mean.fill(now);
        if let Some(peak) = &mut self.peak {
            peak.fill(now);
        }
    }

    /// Takes `needed` tokens from both buckets and returns true, or returns false if a bucket holds too few.
    fn pay(&mut self, needed: u128) -> bool {
        // Both buckets are asked before either pays, so a refusal takes no tokens.
        let there = self.mean.tokens >= needed && self.peak.is_none_or(|peak| peak.tokens >= needed);
        if there {
            self.mean.tokens -= needed;
            if let Some(peak) = &mut self.peak {
                peak.tokens -= needed;
            }
        }
        there
    }

    /// Returns whether the limit admits another packet of `size`.
    fn admits(&self, now: Instant, size: Bytes) -> bool {
        let Some(limit) = self.config.limit else { return true };
        let time = match limit {
            QueueLimit::Time(_) => self.turn_of(size).saturating_duration_since(now),
            QueueLimit::Packets(_) | QueueLimit::Bytes(_) => Duration::ZERO,
        };
        limit.admits(Waiting { packets: self.waiting.len() as u64, bytes: self.waiting_bytes, time }, size)
    }

    /// Returns the instant of departure of another packet of `size` at the present rates. A packet needs no time to leave a bucket, so this is also the
    /// packet's turn.
    fn turn_of(&self, size: Bytes) -> Instant {
        let (mut mean, mut peak) = (self.mean, self.peak);
        let mut turn = mean.since;
        // Copies of the buckets replay the departures of all waiting packets, and then of the new packet.
        for size in self.waiting.iter().map(|packet| packet.info.size).chain([size]) {
            let needed = giga_bits(self.config.framing.on_the_line(size));
            turn = mean.holds_at(needed).max(peak.map_or(Instant::ZERO, |peak| peak.holds_at(needed)));
            for bucket in [Some(&mut mean), peak.as_mut()].into_iter().flatten() {
                bucket.fill(turn);
                bucket.tokens = bucket.tokens.saturating_sub(needed);
            }
        }
        turn
    }
}

/// Parameter of the bucket.
pub(crate) const KEYS: [Key; 1] = [usual(
    "token-bucket",
    Form::AnyOf(const { &[Form::Table(&TOKEN_BUCKET), NONE] }),
    "\"none\"",
    "Limit on the average rate, and on bursts above it",
)];
static TOKEN_BUCKET: Table = Table::of(&[&[
    required("rate", Form::Rate, "Rate at which the bucket fills").expecting("how fast the bucket fills, a rate such as \"1Mbit\""),
    required("burst", Form::Size, "Bytes that the bucket holds").expecting("what the bucket holds, a size such as \"10kB\""),
    optional("peak", Form::Table(&PEAK), "Second, smaller bucket, which limits the rate of a burst"),
    usual("limit", LIMIT, "\"unlimited\"", "Largest number of packets or bytes, or longest wait, for tokens"),
    usual("overhead", SIGNED_SIZE, "\"0B\"", "Bytes that each packet takes beyond its own size"),
]]);
static PEAK: Table = Table::of(&[&[
    required("rate", Form::Rate, "Rate at which a burst leaves").expecting("how fast a burst leaves, a rate such as \"2Mbit\""),
    required("burst", Form::Size, "Bytes that the second bucket holds, at least those of the largest packet")
        .expecting("at least the largest packet, a size such as \"1500B\""),
]]);

impl TokenBucket {
    /// Returns the bucket in words.
    pub(crate) fn words(&self) -> String {
        let peak = self.peak.map_or_else(String::new, |peak| format!(", peak {} in bursts of {}", peak.rate, peak.burst));
        let framing = self.framing.words();
        format!("queue ({}) before a token bucket of {} at {}{peak}{framing}", words_of_limit(self.limit), self.burst, self.rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packet::{Marks, Packet};

    /// Returns a bucket of 100 bytes that fills by a byte per microsecond.
    fn bucket(peak: Option<Peak>) -> TokenBucketStage<char> {
        let rate = Rate::bits_per_sec(8_000_000).unwrap();
        TokenBucketStage::new(Instant::ZERO, TokenBucket { rate, burst: Bytes::new(100), peak, framing: Framing::default(), limit: None })
    }

    fn micros(t: u64) -> Instant {
        Instant::from_nanos(t * 1_000)
    }

    /// Offers packets of `size` bytes at the microseconds `offers`. Returns the microseconds of their departures, and the number of dropped packets.
    fn departures(mut stage: TokenBucketStage<char>, offers: &[u64], size: u64) -> (Vec<u64>, usize) {
        let (mut left, mut outputs) = (Vec::new(), Vec::new());
        let mut pass = |stage: &mut TokenBucketStage<char>, until: Instant| {
            while let Some(at) = stage.next_at().filter(|at| *at <= until) {
                left.extend(stage.release(at).map(|_| at.as_nanos() / 1_000));
            }
            left.len()
        };
        let mut at_once = Vec::new();
        for &t in offers {
            pass(&mut stage, micros(t));
            let packet = Packet::new(0, Bytes::new(size).into(), Marks::default(), 'x');
            at_once.extend(stage.offer(micros(t), packet, &mut outputs).map(|_| t));
        }
        pass(&mut stage, Instant::MAX);
        at_once.extend(left);
        at_once.sort_unstable();
        (at_once, outputs.len())
    }

    #[test]
    fn credit_passes_at_once_and_the_rest_at_the_rate() {
        // The credit of 100 bytes lets two packets leave at once. The third leaves when 20 more bytes have come.
        assert_eq!(departures(bucket(None), &[0, 0, 0, 0, 500], 40), (vec![0, 0, 20, 60, 500], 0));
    }

    #[test]
    fn a_peak_spreads_the_burst() {
        let peak = Peak { rate: Rate::bits_per_sec(16_000_000).unwrap(), burst: Bytes::new(40) };
        assert_eq!(departures(bucket(Some(peak)), &[0, 0, 0], 40), (vec![0, 20, 40], 0));
    }

    /// The credit of 100 bytes lets two packets leave at once. The third packet leaves at 20 µs, the fourth at 60 µs, and a fifth would leave at 100 µs. With
    /// a peak of a byte in 2 µs packets leave at 0, 80, 160 …, though the mean bucket would let them leave sooner.
    #[test]
    fn no_packet_waits_longer_than_a_limit_in_time() {
        let limit = |micros| Some(QueueLimit::Time(Duration::from_micros(micros)));
        let with = |peak, limit| {
            let mut stage = bucket(peak);
            stage.config.limit = limit;
            stage
        };
        assert_eq!(departures(with(None, limit(60)), &[0, 0, 0, 0, 0], 40), (vec![0, 0, 20, 60], 1));
        assert_eq!(departures(with(None, limit(59)), &[0, 0, 0, 0, 0], 40), (vec![0, 0, 20], 2));
        let peak = Peak { rate: Rate::bits_per_sec(4_000_000).unwrap(), burst: Bytes::new(40) };
        assert_eq!(departures(with(Some(peak), limit(160)), &[0, 0, 0, 0, 0], 40), (vec![0, 80, 160], 2));
    }

    #[test]
    fn what_would_leave_past_the_end_of_time_leaves_at_it() {
        let mut stage = bucket(None);
        stage.config.rate = Rate::bits_per_sec(1).unwrap();
        stage.reconfigure(Instant::from_nanos(u64::MAX - 1), stage.config, &mut Vec::new());
        assert_eq!(departures(stage, &[u64::MAX / 1000; 3], 60), (vec![u64::MAX / 1000; 3], 0));
    }

    #[test]
    fn what_no_bucket_holds_is_dropped() {
        assert_eq!(departures(bucket(None), &[0, 1], 101), (vec![], 2));
    }
}
