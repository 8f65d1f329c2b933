//! Outages: spans during which a link takes no packet. Outages are scheduled, random, or begin at an idle link.

use alloc::format;
use alloc::string::String;
use alloc::string::ToString as _;
use alloc::vec::Vec;
use cohaptic_units::print::{Counted, Span};
use core::fmt;
use core::time::Duration;

use cohaptic_units::Instant;

use crate::laws::sojourn::SOJOURN;
use crate::laws::sojourn::Sojourn;
use crate::parameters::{Form, Key, Table, optional, required, usual};
use crate::random::{Purpose, Stream};

/// One outage. Packets offered at `from` or later, but before `to`, are dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Outage {
    /// First instant with the link down.
    pub from: Instant,
    /// First instant with the link up again.
    pub to: Instant,
}

/// Outages of a link. The link is down whenever a scheduled, a random or an idle outage covers the instant.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Outages {
    /// Scheduled outages in the order of time. No outage is empty, and no two overlap.
    scheduled: Vec<Outage>,
    random: Option<RandomOutages>,
    idle: Option<IdleOutages>,
}

/// Random failures and repairs in turn. The link begins up.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct RandomOutages {
    /// Law of the spans with the link up.
    pub up: Sojourn,
    /// Law of the spans with the link down.
    pub down: Sojourn,
}

/// Outages of a link after a while without packets (a dial-up line, a sleeping radio). The link comes up again after another while.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct IdleOutages {
    /// Time without a packet before the link goes down. A packet dropped by an outage does not count as sent.
    pub after: Duration,
    /// Length of each outage. If nothing is sent after an outage, the link goes down again `after` its end.
    pub down: Duration,
}

/// Reason for the refusal of outages. The index counts from zero in the order given.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum OutagesError {
    /// The outage ends before its begin, or at the instant of its begin.
    Empty {
        /// Index of the outage.
        index: usize,
        /// Begin of the outage.
        from: Instant,
        /// End of the outage.
        to: Instant,
    },
    /// The outage begins before the previous outage in the list has ended.
    Overlap {
        /// Index of the outage.
        index: usize,
        /// Begin of the outage.
        from: Instant,
        /// End of the previous outage.
        ended: Instant,
    },
    /// A span of zero length, or a law with the longest span below the shortest span.
    NoTime,
}

impl fmt::Display for OutagesError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty { index, from, to } => write!(f, "outage {index} ends at {to}, which is not after {from} when it begins"),
            Self::Overlap { index, from, ended } => {
                write!(f, "outage {index} begins at {from}, before the one listed before it has ended at {ended}")
            }
            Self::NoTime => f.write_str("a link must be up and down for some time: expected spans above zero, the longest not below the shortest"),
        }
    }
}

impl core::error::Error for OutagesError {}

impl Outages {
    /// Returns scheduled outages, after checking that `outages` are not empty and in the order of time.
    ///
    /// # Errors
    ///
    /// [`OutagesError`] if an outage is empty or the list is not in order of time.
    pub fn new(outages: Vec<Outage>) -> Result<Self, OutagesError> {
        let mut ended = Instant::ZERO;
        for (index, &Outage { from, to }) in outages.iter().enumerate() {
            if to <= from {
                return Err(OutagesError::Empty { index, from, to });
            }
            // Outages may touch: the end of one may be the begin of the next.
            if from < ended {
                return Err(OutagesError::Overlap { index, from, ended });
            }
            ended = to;
        }
        Ok(Self { scheduled: outages, ..Self::default() })
    }

    /// Returns these outages with random failures in addition.
    ///
    /// # Errors
    ///
    /// [`OutagesError::NoTime`] if a span is zero or its bounds are out of order.
    pub fn with_random(self, random: RandomOutages) -> Result<Self, OutagesError> {
        let sound = random.up.is_sound() && random.down.is_sound();
        if sound { Ok(Self { random: Some(random), ..self }) } else { Err(OutagesError::NoTime) }
    }

    /// Returns these outages with outages of an idle link in addition.
    ///
    /// # Errors
    ///
    /// [`OutagesError::NoTime`] if a span is zero.
    pub fn with_idle(self, idle: IdleOutages) -> Result<Self, OutagesError> {
        if idle.after.is_zero() || idle.down.is_zero() { Err(OutagesError::NoTime) } else { Ok(Self { idle: Some(idle), ..self }) }
    }

    /// Returns the random failures, if there are any.
    #[must_use]
    pub const fn random(&self) -> Option<RandomOutages> {
        self.random
    }

    /// Returns the outages of an idle link, if there are any.
    #[must_use]
    pub const fn idle(&self) -> Option<IdleOutages> {
        self.idle
    }

    /// Returns whether the link is never down.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.scheduled.is_empty() && self.random.is_none() && self.idle.is_none()
    }

    /// Returns whether a scheduled outage covers `now`. The link is down at the first instant of an outage, and up at its end.
    #[must_use]
    #[inline]
    pub(crate) fn scheduled_at(&self, now: Instant) -> bool {
        // Outages are ordered and do not overlap, so only the first outage with an end after `now` can cover `now`.
        let next = self.scheduled.partition_point(|outage| outage.to <= now);
        self.scheduled.get(next).is_some_and(|outage| outage.from <= now)
    }

    /// Returns the scheduled outages in the order of time.
    #[must_use]
    pub fn scheduled(&self) -> &[Outage] {
        &self.scheduled
    }
}

/// Stage with the answer whether the link is up.
#[derive(Clone, Debug)]
pub(crate) struct OutageStage {
    outages: Outages,
    /// Index of the present span of random failures. The link is up during spans with an even index. The index is also the address of the span's random
    /// numbers.
    span: u64,
    span_ends: Instant,
    /// Instant of the last accepted packet, or the instant of configuring outages of the idle link.
    last_taken: Instant,
}

impl OutageStage {
    /// Returns the stage at the begin of time, or `None` if the link is never down.
    pub(crate) fn new(outages: Outages, draws: Stream) -> Option<Self> {
        Self::reconfigured(None, Instant::ZERO, outages, draws)
    }

    /// Returns the stage with the outages `outages` from `now` on, or `None` if there was no stage and there are no outages. A link with random failures keeps
    /// its present span. A link without random failures so far begins up. A link without idle outages so far counts as used `now`.
    pub(crate) fn reconfigured(before: Option<Self>, now: Instant, outages: Outages, draws: Stream) -> Option<Self> {
        if before.is_none() && outages.is_empty() {
            return None;
        }
        let begin = Self { outages: Outages::default(), span: 0, span_ends: Instant::MAX, last_taken: now };
        let mut stage = before.unwrap_or(begin);
        // A link with idle outages from now on has not been idle before.
        if stage.outages.idle.is_none() {
            stage.last_taken = now;
        }
        if let (None, Some(random)) = (stage.outages.random, outages.random) {
            // A link with earlier random failures continues with the next even index, so no span is drawn twice and the link begins up.
            if stage.span_ends < Instant::MAX {
                stage.span += 2 - stage.span % 2;
            }
            stage.span_ends = now.saturating_add(drawn(random.up, draws, stage.span));
        }
        stage.outages = outages;
        Some(stage)
    }

    /// Returns whether the link is down for a packet offered `now`, not before earlier calls' `now`. A packet at a link that is up counts as sent.
    pub(crate) fn is_down(&mut self, now: Instant, draws: Stream) -> bool {
        let mut down = self.outages.scheduled_at(now);
        if let Some(random) = self.outages.random {
            while self.span_ends <= now {
                self.span += 1;
                // Spans up and down alternate, and each is drawn once, so the spans do not depend on the instants of packets.
                let law = if self.span.is_multiple_of(2) { random.up } else { random.down };
                self.span_ends = self.span_ends.saturating_add(drawn(law, draws, self.span));
                // The sum saturates at the end of time. Without this exit a packet at the end of time would draw spans for ever.
                if self.span_ends == Instant::MAX {
                    break;
                }
            }
            down |= self.span % 2 == 1;
        }
        if let Some(IdleOutages { after, down: length }) = self.outages.idle {
            // An idle link is up for `after` and down for `length`, again and again, since the last accepted packet.
            let cycle = after.saturating_add(length).as_nanos();
            let idle = now.saturating_duration_since(self.last_taken).as_nanos();
            down |= idle % cycle >= after.as_nanos();
            if !down {
                self.last_taken = now;
            }
        }
        down
    }
}

/// Returns a length drawn from `law` with the random numbers of the span `span`.
fn drawn(law: Sojourn, draws: Stream, span: u64) -> Duration {
    let mut draws = draws.packet(span).draws(Purpose::Outage);
    law.draw(|| draws.next_word())
}

/// Parameter of outages.
pub(crate) const KEYS: [Key; 1] = [usual("outage", OUTAGE, "[]", "Times at which the link is down: a list of spans, or a table")];
/// Parameters of a span of time.
pub(crate) static SPAN: Table = Table::of(&[&[
    required("from", Form::Duration, "Beginning of the span, since the beginning of the scene").expecting("a time such as \"1s\""),
    required("to", Form::Duration, "End of the span, since the beginning of the scene").expecting("a time such as \"2s\""),
]]);
const OUTAGE: Form = Form::AnyOf(&[Form::List(&Form::Table(&SPAN)), Form::Table(&OUTAGE_TABLE)]);
static OUTAGE_TABLE: Table = Table::of(&[&[
    usual("scheduled", Form::List(&Form::Table(&SPAN)), "[]", "Spans in order, none within another"),
    optional("random", Form::Table(&RANDOM_OUTAGE), "Random outages; the link is up at first"),
    optional("idle", Form::Table(&IDLE_OUTAGE), "Outages after a time in which no packet was sent"),
]]);
static RANDOM_OUTAGE: Table =
    Table::of(&[&[required("up", SOJOURN, "Time for which the link is up"), required("down", SOJOURN, "Time for which the link is down")]]);
static IDLE_OUTAGE: Table = Table::of(&[&[
    required("after", Form::PositiveDuration, "Time without a packet after which the link goes down")
        .expecting("how long nothing must be sent, a duration such as \"10s\""),
    required("down", Form::PositiveDuration, "Time for which the link is then down")
        .expecting("how long the link is down then, a duration such as \"2s\""),
]]);

impl Outages {
    /// Returns the kinds of outages in words, or `None` if the link is never down.
    pub(crate) fn words(&self) -> Option<String> {
        let mut kinds = Vec::new();
        if !self.scheduled.is_empty() {
            kinds.push(Counted(self.scheduled.len(), "outage").to_string());
        }
        kinds.extend(self.random.map(|random| format!("random outages (up {}, down {})", random.up.words(), random.down.words())));
        kinds.extend(self.idle.map(|idle| format!("an outage of {} after {} without a packet", Span(idle.down), Span(idle.after))));
        (!kinds.is_empty()).then(|| kinds.join(" and "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outage(from: u64, to: u64) -> Outage {
        Outage { from: Instant::from_nanos(from), to: Instant::from_nanos(to) }
    }

    #[test]
    fn a_link_is_down_from_the_first_instant_and_up_at_the_last() {
        let outages = Outages::new(vec![outage(10, 20), outage(20, 30), outage(50, 60)]).unwrap();
        let down: Vec<u64> = (0..70).filter(|&t| outages.scheduled_at(Instant::from_nanos(t))).collect();
        assert_eq!(down, (10..30).chain(50..60).collect::<Vec<_>>());
    }

    #[test]
    fn an_outage_that_is_empty_or_out_of_order_is_refused() {
        assert!(matches!(Outages::new(vec![outage(10, 10)]), Err(OutagesError::Empty { index: 0, .. })));
        assert!(matches!(Outages::new(vec![outage(10, 20), outage(15, 30)]), Err(OutagesError::Overlap { index: 1, .. })));
    }

    /// The link is up for 30 ms and down for 10 ms on average, and is observed every 0.1 ms for 1000 s: it is down for a quarter of the time. Over about 25 000
    /// cycles the fraction has a relative standard error of √(1/25 000)·√2·0.75 (both spans exponential): 0.0017 of 0.25.
    #[test]
    fn random_failures_take_their_share() {
        let millis = Duration::from_millis;
        let random = RandomOutages { up: Sojourn::Exponential(millis(30)), down: Sojourn::Exponential(millis(10)) };
        let draws = Stream::new(4, b"outage");
        let mut stage = OutageStage::new(Outages::default().with_random(random).unwrap(), draws).unwrap();
        let seen = 10_000_000_u64;
        let down = (0..seen).filter(|n| stage.is_down(Instant::from_nanos(n * 100_000), draws)).count();
        assert!((down as f64 / seen as f64 - 0.25).abs() < 4.5 * 0.0017, "{down}");
    }

    #[test]
    fn an_idle_link_goes_down_and_up_until_somebody_finds_it_up() {
        let nanos = Duration::from_nanos;
        let outages = Outages::default().with_idle(IdleOutages { after: nanos(10), down: nanos(5) }).unwrap();
        let draws = Stream::new(0, b"");
        let mut stage = OutageStage::new(outages, draws).unwrap();
        let down: Vec<u64> = [0, 9, 18, 28, 32, 33, 44, 63, 67].into_iter().filter(|t| stage.is_down(Instant::from_nanos(*t), draws)).collect();
        // The link takes packets at 0, 9 and 18. It is down from 28 to 33, and takes the packet at 33. It is then down from 43 to 48, up to 58, down to 63,
        // and takes the packet at 63.
        assert_eq!(down, [28, 32, 44]);
    }

    #[test]
    fn a_link_that_begins_to_fail_again_draws_new_spans() {
        let random = RandomOutages { up: Sojourn::Exponential(Duration::from_millis(30)), down: Sojourn::Exponential(Duration::from_millis(10)) };
        let (draws, random) = (Stream::new(4, b"outage"), Outages::default().with_random(random).unwrap());
        let mut stage = None;
        let ends: std::collections::BTreeSet<Instant> = (0..100)
            .map(|_| {
                let failing = OutageStage::reconfigured(stage.take(), Instant::ZERO, random.clone(), draws).unwrap();
                let ends = failing.span_ends;
                stage = OutageStage::reconfigured(Some(failing), Instant::ZERO, Outages::default(), draws);
                ends
            })
            .collect();
        assert_eq!(ends.len(), 100);
        assert_eq!(
            OutageStage::new(random, draws).unwrap().span_ends,
            Instant::ZERO.saturating_add(drawn(Sojourn::Exponential(Duration::from_millis(30)), draws, 0))
        );
    }

    #[test]
    fn a_link_that_begins_to_sleep_was_used_just_now() {
        let nanos = Duration::from_nanos;
        let idle = Outages::default().with_idle(IdleOutages { after: nanos(10), down: nanos(5) }).unwrap();
        let draws = Stream::new(0, b"");
        let mut stage = OutageStage::reconfigured(None, Instant::from_nanos(12), idle, draws).unwrap();
        assert!(!stage.is_down(Instant::from_nanos(13), draws));
        assert!(stage.is_down(Instant::from_nanos(23), draws));
    }

    #[test]
    fn no_time_is_refused() {
        let zero = IdleOutages { after: Duration::ZERO, down: Duration::from_secs(1) };
        assert_eq!(Outages::default().with_idle(zero), Err(OutagesError::NoTime));
        let never =
            RandomOutages { up: Sojourn::Fixed(Duration::from_secs(1)), down: Sojourn::Uniform(Duration::from_secs(2), Duration::from_secs(1)) };
        assert_eq!(Outages::default().with_random(never), Err(OutagesError::NoTime));
    }
}
