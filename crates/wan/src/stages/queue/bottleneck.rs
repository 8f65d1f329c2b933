//! Bottleneck: a queue before a serialiser, first in first out unless the discipline has several queues.
//!
//! ```text
//! offered ──► [ waiting … ] ──► transmitter, 8·(size with framing)/R per packet ──► propagation
//!             limit counts these    the packet in service is not counted
//! ```
//!
//! At most R·t plus one packet leaves in any window t, because the service time is rounded up. A departure at an instant makes room for a packet offered at the
//! same instant. If the rate changes during a transmission, the bits already sent stay sent, and only the remaining bits take the new rate.

mod stage;

use alloc::format;
use alloc::string::String;
use alloc::string::ToString as _;
use core::time::Duration;

use cohaptic_units::print::Span;
use cohaptic_units::{Bytes, Instant, Rate};

pub(crate) use stage::{BottleneckStage, Queued};

use super::codel::CODEL;
use super::dualpi2::DUALPI2;
use super::fq_codel::FQ_CODEL;
use super::framing::{CELLS, SIGNED_SIZE};
use super::limit::{LIMIT, words_of_limit};
use super::pie::PIE;
use super::red::RED;
use super::{CoDel, DeliveryTrace, DualPi2, FqCoDel, Framing, Pie, QueueLimit, Red};
use crate::parameters::{Form, Key, NONE, Table, UNLIMITED, optional, required, usual};

/// Configuration of a serialiser and the queue before it.
#[derive(Clone, PartialEq, Debug)]
pub struct Bottleneck {
    /// Speed of the serialiser.
    pub service: Service,
    /// Bytes transmitted with a packet beyond the packet's bytes.
    pub framing: Framing,
    /// Limit of the queue. `None` sets no limit.
    pub limit: Option<QueueLimit>,
    /// Choice of dropped packets.
    pub discipline: Discipline,
}

/// Speed of the transmitter.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Service {
    /// Constant rate.
    Rate(Rate),
    /// Opportunities to send at the instants of a recording.
    Recorded(DeliveryTrace),
}

/// Choice of dropped packets of a queue. Every discipline also keeps the limit of the queue.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Discipline {
    /// Drops the newest packet when the queue is full.
    #[default]
    TailDrop,
    /// Drops the oldest waiting packets when the queue is full, until the newest packet fits.
    HeadDrop,
    /// Drops some of the newest packets before the queue is full.
    Red(Red),
    /// Drops some of the oldest packets after waits have exceeded a target for an interval.
    CoDel(CoDel),
    /// Has a queue per flow, served in turn, with CoDel for each. A full queue drops the oldest packets of the longest queue.
    FqCoDel(FqCoDel),
    /// Drops some of the newest packets, with a probability that follows the delay of the queue.
    Pie(Pie),
    /// Has a queue for packets of scalable senders, with many marks and short waits, and a queue for all other packets, with few marks or drops. A full queue
    /// drops the newest packet.
    DualPi2(DualPi2),
}

impl Bottleneck {
    /// Returns a bottleneck of the given rate with an unlimited queue.
    #[must_use]
    pub fn at_rate(rate: Rate) -> Self {
        Self { service: Service::Rate(rate), framing: Framing::default(), limit: None, discipline: Discipline::default() }
    }

    /// Returns the transmission time of RED's mean packet \[s\]: the unit of the decay of RED's average.
    pub(crate) fn time_of_mean_packet(&self, red: &Red) -> f64 {
        match &self.service {
            Service::Rate(rate) => rate.serialisation_time(self.framing.on_the_line(red.mean_packet())).as_secs_f64(),
            #[expect(clippy::cast_precision_loss, reason = "a decay")]
            // An opportunity has a variable distance to the next one, so the mean rate of the recording stands for the rate.
            Service::Recorded(trace) => red.mean_packet().get() as f64 * 8.0 / trace.mean_rate(),
        }
    }

    /// Returns the bits sent by a transmitter of constant rate after a span, in 10⁻⁹ bit; 0 for a transmitter with a recording, because such a transmitter
    /// sends at its opportunities.
    pub(super) fn bits_sent(&self, span: Duration) -> u128 {
        match &self.service {
            Service::Rate(rate) => rate.bits_sent(span),
            Service::Recorded(_) => 0,
        }
    }

    /// Returns the time from `now` until the end of transmission of a packet with `left` bits remaining at `since`, and of `waiting` bits after the packet (all
    /// in 10⁻⁹ bit): the wait of the newest packet.
    pub(super) fn time_to_send(&self, (since, left): (Instant, u128), waiting: u128, now: Instant) -> Duration {
        match &self.service {
            Service::Rate(rate) => {
                let sent = rate.bits_sent(now.saturating_duration_since(since));
                rate.transmission_time(left.saturating_sub(sent) + waiting)
            }
            Service::Recorded(trace) => {
                // Each opportunity sends a fixed number of bytes, and even an empty packet needs one opportunity.
                let needed = (left + waiting).div_ceil(giga_bits(trace.bytes())).max(1);
                let done = u64::try_from(needed).ok().and_then(|needed| trace.nth_after(now, needed));
                done.unwrap_or(Instant::MAX).saturating_duration_since(now)
            }
        }
    }
}

/// Returns an idle span of the transmitter as a number of mean packets with the transmission time `mean_packet` \[s\] each. Returns zero if a mean packet takes
/// no time.
pub(crate) fn idle_packets(idle: Duration, mean_packet: f64) -> f64 {
    if mean_packet > 0.0 { idle.as_secs_f64() / mean_packet } else { 0.0 }
}

/// Returns `bytes` in 10⁻⁹ bit, the unit of [`Rate::transmission_time`].
pub(crate) fn giga_bits(bytes: Bytes) -> u128 {
    u128::from(bytes.get()) * 8_000_000_000
}

/// Parameters of the transmitter and of the queue before the transmitter.
pub(crate) const KEYS: [Key; 4] = [
    usual("rate", Form::AnyOf(&[Form::Rate, UNLIMITED]), "\"unlimited\"", "Rate at which packets are sent, in bits per second"),
    optional(
        "queue",
        Form::Table(&QUEUE),
        "Packets that may wait for the line, and the choice of those that are dropped. Needs rate or a recorded line",
    ),
    usual("overhead", SIGNED_SIZE, "\"0B\"", "Bytes that each packet takes beyond its own size. Needs rate or a recorded line"),
    usual(
        "cells",
        Form::AnyOf(const { &[Form::Table(&CELLS), NONE] }),
        "\"none\"",
        "Cells in which packets travel, always whole ones. Needs rate or a recorded line",
    ),
];
static QUEUE: Table = Table::of(&[&[
    required("limit", LIMIT, "Largest number of packets or bytes, or longest wait, in the queue"),
    usual(
        "discipline",
        Form::AnyOf(const { &[Form::Words(&DISCIPLINES), Form::Table(&DISCIPLINE)] }),
        "\"tail-drop\"",
        "Choice of the packets that are dropped",
    ),
]]);
const DISCIPLINES: [(&str, &str); 7] = [
    ("tail-drop", "the newest when the queue is full"),
    ("head-drop", "the oldest when the queue is full"),
    ("codel", "the oldest when they wait too long for too long"),
    ("fq-codel", "a queue per flow, served in turn, with codel for each; the oldest of the longest when full"),
    ("pie", "some of the newest, the more the longer the delay of the queue is above a target"),
    ("dualpi2", "a queue for packets of scalable senders, with marks, beside a queue for all others, with fewer marks and drops"),
    ("red", "some of the newest, the more the longer the queue is on average; needs a limit in bytes"),
];
static DISCIPLINE: Table = Table::of(&[&[
    optional("codel", Form::Table(&CODEL), "Drops of the oldest packets when they wait longer than the target for an interval"),
    optional("fq-codel", Form::Table(&FQ_CODEL), "A queue per flow, served in turn, with codel for each"),
    optional("pie", Form::Table(&PIE), "Drops of some of the newest packets, with a probability that keeps the delay of the queue near a target"),
    optional(
        "dualpi2",
        Form::Table(&DUALPI2),
        "A queue for packets with ECT(1), the L queue, beside a queue for all others, the C queue, with coupled marks and drops",
    ),
    optional("red", Form::Table(&RED), "Drops of some of the newest packets while the average queue is above min, and of all above max"),
]]);

impl Bottleneck {
    /// Returns the queue and the transmitter in words.
    pub(crate) fn words(&self) -> String {
        let discipline = match self.discipline {
            Discipline::TailDrop => String::new(),
            Discipline::HeadDrop => ", head-drop".into(),
            Discipline::Red(_) => ", RED".into(),
            Discipline::CoDel(codel) => format!(", CoDel {} in {}", Span(codel.target), Span(codel.interval)),
            Discipline::FqCoDel(FqCoDel { codel, .. }) => format!(", FQ-CoDel {} in {}", Span(codel.target), Span(codel.interval)),
            Discipline::Pie(pie) => format!(", PIE {}", Span(pie.target)),
            Discipline::DualPi2(dualpi2) => format!(", DualPI2 {} and {}", Span(dualpi2.target), Span(dualpi2.step_thresh)),
        };
        let service = match &self.service {
            Service::Rate(rate) => rate.to_string(),
            Service::Recorded(trace) => format!("a recorded line of {:.3} Mbit/s on average", trace.mean_rate() / 1e6),
        };
        format!("queue ({}{discipline}) before {service}{}", words_of_limit(self.limit), self.framing.words())
    }
}
