//! Cross-traffic: packets of other senders that share the queue and the transmitter of a link.
//!
//! ```text
//! packets of the link ──┐
//!                       ├──► [ waiting … ] ──► transmitter ──► packets of the link go on to propagation
//! cross packets ────────┘    one queue                         cross packets end here
//! ```
//!
//! Cross packets keep the limit and the discipline of the queue like the packets of the link, and end behind the transmitter. They do not react: a source sends
//! the same packets whatever the queue does with them, unlike a program with TCP, which would slow down after a drop. Nobody outside of the queue sees a cross
//! packet, so cross packets are computed only when a packet of the link can meet them, each at its own instant.

mod arrivals;
mod recording;

use alloc::format;
use alloc::string::String;
use core::fmt;
use core::time::Duration;

use cohaptic_units::print::{Counted, Span};
use cohaptic_units::{Bytes, Rate};

use super::{Bottleneck, Service, giga_bits};
use crate::parameters::{Form, Key, NONE, Quantity, Table, optional, required, usual};

pub(crate) use arrivals::CrossStage;
pub use recording::{CrossRecording, CrossRecordingError};

/// Cross-traffic of a bottleneck, checked when made.
#[derive(Clone, PartialEq, Debug)]
pub struct CrossTraffic(Source);

/// Source of the cross packets.
#[derive(Clone, PartialEq, Debug)]
enum Source {
    Poisson(Poisson),
    OnOff(OnOff),
    Recorded(CrossRecording),
}

/// Packets of one size at independent, exponentially distributed distances. Before a transmitter of constant rate without a limit, the waits have the law of
/// the queue M/D/1 (Erlang 1909).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Poisson {
    /// Mean rate of the packets, framing not counted.
    pub rate: Rate,
    /// Size of each packet, above zero.
    pub size: Bytes,
}

/// Independent sources that send during random spans and are silent between them. Both kinds of spans have Pareto laws of one shape a, with the minimum
/// mean·(a − 1)/a. Spans of infinite variance give traffic with a long memory: the variance of the mean rate over a block of time falls with the power 1 − a of
/// the length of the block (Taqqu, Willinger and Sherman 1997).
///
/// Every source is stationary from the beginning: the first span is the rest of a span in progress. A source sends one packet each time its spans of sending
/// have grown by the time of a packet at the peak rate.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct OnOff {
    /// Number of sources.
    pub sources: u32,
    /// Rate of one source while the source sends, framing not counted.
    pub peak: Rate,
    /// Size of each packet, above zero.
    pub size: Bytes,
    /// Mean span of sending, at least the time of one packet at the peak rate.
    pub on: Duration,
    /// Mean span of silence, above zero.
    pub off: Duration,
    /// Shape a of both laws, above 1 and below 2: means are finite, variances are not.
    pub shape: f64,
}

/// Reason for the refusal of cross-traffic.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum CrossTrafficError {
    /// The packets have no bytes.
    NoBytes,
    /// A source sends more than one packet per nanosecond, the resolution of instants.
    TooDense,
    /// The shape is not between 1 and 2, both excluded.
    Shape(f64),
    /// The mean span of silence is zero.
    NoSilence,
    /// The mean span of sending is shorter than one packet at the peak rate, so that most spans would send nothing.
    ShortBursts {
        /// Time of a packet at the peak rate.
        packet: Duration,
    },
}

impl fmt::Display for CrossTrafficError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoBytes => f.write_str("cross packets without bytes: expected a size above zero such as \"1500B\""),
            Self::TooDense => f.write_str("more than one cross packet per nanosecond: expected a lower rate or a larger size"),
            Self::Shape(shape) => {
                write!(f, "a Pareto law of shape {shape}: expected a shape above 1 (below, spans have no mean) and below 2 (above, no long memory)")
            }
            Self::NoSilence => f.write_str("sources that are never silent: expected a mean span of silence above zero"),
            Self::ShortBursts { packet } => {
                write!(f, "a packet takes {} at the peak rate: expected a mean span of sending of at least this time", Span(*packet))
            }
        }
    }
}

impl core::error::Error for CrossTrafficError {}

impl CrossTraffic {
    /// Returns cross-traffic of one Poisson source.
    ///
    /// # Errors
    ///
    /// [`CrossTrafficError`] if packets have no bytes, or come more often than once per nanosecond.
    pub fn poisson(poisson: Poisson) -> Result<Self, CrossTrafficError> {
        check_packets(poisson.rate, poisson.size)?;
        Ok(Self(Source::Poisson(poisson)))
    }

    /// Returns cross-traffic of on-off sources.
    ///
    /// # Errors
    ///
    /// [`CrossTrafficError`] if packets have no bytes or come more often than once per nanosecond, if the shape is out of range, if a span takes no time, or if
    /// the mean span of sending is shorter than a packet.
    pub fn on_off(on_off: OnOff) -> Result<Self, CrossTrafficError> {
        check_packets(on_off.peak, on_off.size)?;
        // NaN compares as false, and so is refused too.
        if !(on_off.shape > 1.0 && on_off.shape < 2.0) {
            return Err(CrossTrafficError::Shape(on_off.shape));
        }
        if on_off.off.is_zero() {
            return Err(CrossTrafficError::NoSilence);
        }
        let packet = on_off.peak.serialisation_time(on_off.size);
        if on_off.on < packet {
            return Err(CrossTrafficError::ShortBursts { packet });
        }
        Ok(Self(Source::OnOff(on_off)))
    }

    /// Returns the cross-traffic of a recording.
    #[must_use]
    pub const fn recorded(recording: CrossRecording) -> Self {
        Self(Source::Recorded(recording))
    }

    /// Returns whether the packets are random. A recording is not.
    #[must_use]
    pub const fn is_random(&self) -> bool {
        !matches!(self.0, Source::Recorded(_))
    }

    /// Returns the mean rate in the long run \[bit/s\], framing not counted; 0 for a recording, because a recording ends.
    fn mean_rate(&self) -> f64 {
        match &self.0 {
            Source::Poisson(poisson) => bits_per_second(poisson.rate),
            Source::OnOff(on_off) => {
                let (on, off) = (on_off.on.as_secs_f64(), on_off.off.as_secs_f64());
                f64::from(on_off.sources) * bits_per_second(on_off.peak) * (on / (on + off))
            }
            Source::Recorded(_) => 0.0,
        }
    }

    /// Returns the share of the time that the transmitter of `bottleneck` would need for the cross packets alone, framing included. At 1 and above, a queue
    /// without a limit grows without end.
    #[must_use]
    #[expect(clippy::cast_precision_loss, reason = "a ratio")]
    pub fn load(&self, bottleneck: &Bottleneck) -> f64 {
        let size = match &self.0 {
            Source::Poisson(poisson) => poisson.size,
            Source::OnOff(on_off) => on_off.size,
            Source::Recorded(_) => return 0.0,
        };
        let rate = match &bottleneck.service {
            Service::Rate(rate) => bits_per_second(*rate),
            Service::Recorded(trace) => trace.mean_rate(),
        };
        let framed = bottleneck.framing.on_the_line(size).get() as f64 / size.get() as f64;
        self.mean_rate() * framed / rate
    }

    /// Returns the cross-traffic in words.
    pub(crate) fn words(&self) -> String {
        match &self.0 {
            Source::Poisson(Poisson { rate, size }) => format!("Poisson, {rate} in packets of {size}"),
            Source::OnOff(OnOff { sources, peak, size, on, off, shape }) => format!(
                "{}, {peak} in packets of {size} for {}, then silent for {} on average, Pareto of shape {shape}",
                Counted(u64::from(*sources), "on-off source"),
                Span(*on),
                Span(*off)
            ),
            Source::Recorded(recording) => format!("a recording of {}", Counted(recording.packets() as u64, "packet")),
        }
    }
}

/// Refuses packets without bytes, and packets more often than once per nanosecond.
fn check_packets(rate: Rate, size: Bytes) -> Result<(), CrossTrafficError> {
    if size == Bytes::ZERO {
        return Err(CrossTrafficError::NoBytes);
    }
    // Arrivals more often than the clock ticks would all come at one instant, and time would never pass.
    if giga_bits(size) < u128::from(rate.as_bits_per_sec()) {
        return Err(CrossTrafficError::TooDense);
    }
    Ok(())
}

#[expect(clippy::cast_precision_loss, reason = "a rate, for ratios and means")]
const fn bits_per_second(rate: Rate) -> f64 {
    rate.as_bits_per_sec() as f64
}

/// Number of sources, at most. A source takes 64 bytes of memory.
const MOST_SOURCES: u64 = 65_536;

/// Parameter of the cross-traffic.
pub(crate) const KEYS: [Key; 1] = [usual(
    "cross-traffic",
    Form::AnyOf(const { &[Form::Table(&CROSS_TRAFFIC), NONE] }),
    "\"none\"",
    "Packets of other senders that share the queue and the line, and end behind the line. They do not react to delay or drops. Needs rate or a recorded line",
)];
static CROSS_TRAFFIC: Table = Table::of(&[&[
    optional("poisson", Form::Table(&POISSON), "Packets of one size at independent, exponentially distributed distances"),
    optional("on-off", Form::Table(&ON_OFF), "Sources that send and are silent in turn, for spans with Pareto laws"),
    optional("trace", Form::File, "CSV with the columns t (seconds since the start of the run) and bytes: a row for each packet"),
]]);
const PACKET_SIZE: Key = usual("size", Form::Size, "\"1500B\"", "Size of each packet");
static POISSON: Table = Table::of(&[&[
    required("rate", Form::Rate, "Mean rate of the packets").expecting("the mean rate of the packets, a rate such as \"6Mbit\""),
    PACKET_SIZE,
]]);
static ON_OFF: Table = Table::of(&[&[
    required("sources", Form::Integer(1, MOST_SOURCES), "Number of independent sources").expecting("the number of sources, {}"),
    required("peak", Form::Rate, "Rate of one source while it sends").expecting("the rate of one source while it sends, a rate such as \"2Mbit\""),
    PACKET_SIZE,
    required("on", Form::PositiveDuration, "Mean span of sending").expecting("the mean span of sending, a duration such as \"200ms\""),
    required("off", Form::PositiveDuration, "Mean span of silence").expecting("the mean span of silence, a duration such as \"800ms\""),
    usual("shape", Form::Number(Quantity::positive("")), "1.5", "Shape of the Pareto laws, above 1 and below 2: the lower, the longer the memory"),
]]);

#[cfg(test)]
mod tests {
    use super::*;

    fn rate(bits: u64) -> Rate {
        Rate::bits_per_sec(bits).unwrap()
    }

    fn on_off() -> OnOff {
        let ms = Duration::from_millis;
        OnOff { sources: 4, peak: rate(12_000_000), size: Bytes::new(1500), on: ms(20), off: ms(60), shape: 1.5 }
    }

    #[test]
    fn what_makes_no_sense_is_refused() {
        let poisson = |bits, size| CrossTraffic::poisson(Poisson { rate: rate(bits), size: Bytes::new(size) });
        assert_eq!(poisson(1, 0), Err(CrossTrafficError::NoBytes));
        assert_eq!(poisson(8_000_000_001, 1), Err(CrossTrafficError::TooDense));
        assert!(poisson(8_000_000_000, 1).is_ok());
        for shape in [1.0, 2.0, 0.5, f64::NAN] {
            assert!(matches!(CrossTraffic::on_off(OnOff { shape, ..on_off() }), Err(CrossTrafficError::Shape(_))), "{shape}");
        }
        assert_eq!(CrossTraffic::on_off(OnOff { off: Duration::ZERO, ..on_off() }), Err(CrossTrafficError::NoSilence));
        let packet = Duration::from_millis(1);
        assert_eq!(CrossTraffic::on_off(OnOff { on: Duration::from_nanos(999_999), ..on_off() }), Err(CrossTrafficError::ShortBursts { packet }));
        assert!(CrossTraffic::on_off(OnOff { on: packet, ..on_off() }).is_ok());
    }

    /// Four sources that send 12 Mbit/s a quarter of the time are 12 Mbit/s. With 300 bytes of framing for 1500 bytes, the load is a fifth more.
    #[test]
    fn the_load_counts_framing() {
        let traffic = CrossTraffic::on_off(on_off()).unwrap();
        assert_eq!(traffic.mean_rate(), 12e6);
        let mut line = Bottleneck::at_rate(rate(24_000_000));
        assert_eq!(traffic.load(&line), 0.5);
        line.framing.overhead = 300;
        assert!((traffic.load(&line) - 0.6).abs() < 1e-15);
        let poisson = CrossTraffic::poisson(Poisson { rate: rate(24_000_000), size: Bytes::new(1500) }).unwrap();
        assert_eq!(poisson.load(&Bottleneck::at_rate(rate(24_000_000))), 1.0);
    }

    #[test]
    fn words_have_every_number() {
        let words = |traffic: Result<CrossTraffic, CrossTrafficError>| traffic.unwrap().words();
        assert_eq!(words(CrossTraffic::poisson(Poisson { rate: rate(6_000_000), size: Bytes::new(1500) })), "Poisson, 6Mbit in packets of 1500B");
        assert_eq!(
            words(CrossTraffic::on_off(on_off())),
            "4 on-off sources, 12Mbit in packets of 1500B for 20ms, then silent for 60ms on average, Pareto of shape 1.5"
        );
    }
}
