//! Messages and their replies: which reply is the newest, how long replies take, and how the device's force differs from the force that was asked for.

use core::time::Duration;
use std::collections::VecDeque;

use cohaptic_device::{Verdict, ZeroCause};
use cohaptic_units::Instant;
use hdrhistogram::Histogram;

use crate::axes::{Triple, length};
use crate::protocol::Flaw;

/// Report of the exchanges of a device.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct Report {
    /// Replies with a reading.
    pub readings: u64,
    /// Readings per second between the first and the last; 0 with fewer than two.
    pub per_second: f64,
    /// Half of the replies took at most this time.
    pub p50: Duration,
    /// 99 of 100 replies took at most this time.
    pub p99: Duration,
    /// Longest time of a reply.
    pub max: Duration,
    /// Replies that took longer than the exchange of the configuration.
    pub late: u64,
    /// Root mean square of the force asked for minus the force that the device says to apply \[N\]; `None` if the device does not say.
    pub force_rms: Option<f64>,
    /// Dropped replies, by flaw in the order of [`Flaw::ALL`].
    pub flaws: [u64; Flaw::ALL.len()],
    /// Replies to messages before the latest, not used because a newer reply was to come.
    pub older: u64,
    /// Replies without a message.
    pub unasked: u64,
    /// Messages given up, whose reply did not come.
    pub lost: u64,
    /// Connections to the service that were opened.
    pub connections: u64,
    /// Times at which an armed device was disarmed.
    pub losses: u64,
    /// Messages with a zero force, by cause in the order of [`ZeroCause::ALL`].
    pub zeroed: [u64; ZeroCause::ALL.len()],
    /// Forces shortened to the largest force.
    pub limited: u64,
    /// Forces with a change shortened to the fastest change.
    pub slewed: u64,
    /// Length of the largest force sent \[N\].
    pub largest_force: f64,
}

impl Report {
    /// Returns the ticks of one exchange that 99 of 100 replies fit in, at least 1.
    ///
    /// # Panics
    ///
    /// If `tick` is zero.
    #[must_use]
    pub fn exchange_every(&self, tick: Duration) -> u64 {
        u64::try_from(self.p99.as_nanos().div_ceil(tick.as_nanos())).unwrap_or(u64::MAX).max(1)
    }
}

/// Form of a reply, by which a reply finds its message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Form {
    /// With the configuration of the device: the reply to the marked message, if a message is marked.
    Full,
    /// Without the configuration.
    Plain,
    /// Without the device, or not readable: the reply to any message.
    Unknown,
}

/// Messages without a reply, and the statistics of replies.
///
/// Replies have no number, and come in the order of their messages. A reply may be missing, or come twice. So messages that follow a doubt ask for the
/// configuration of the device, and are marked: a reply with a configuration answers the marked message, and all messages before are over.
#[derive(Clone, Debug)]
pub(super) struct Exchanges {
    /// Messages whose reply has not come: the instant, and whether the message is marked.
    outstanding: VecDeque<(Instant, bool)>,
    /// Instant of the latest message.
    pub(super) sent: Option<Instant>,
    /// Force of the latest message \[N\].
    asked: Triple,
    /// Times of replies \[ns\].
    times: Histogram<u64>,
    first: Option<Instant>,
    last: Option<Instant>,
    /// Sum of squared differences of forces \[N²\], and their number.
    differences: (f64, u64),
    pub(super) report: Report,
}

impl Exchanges {
    pub(super) fn new() -> Self {
        // Times up to a minute, to three digits. A longer time is noted as a minute.
        let times = Histogram::new_with_max(60_000_000_000, 3).expect("the bounds are in order");
        Self {
            outstanding: VecDeque::new(),
            sent: None,
            asked: [0.0; 3],
            times,
            first: None,
            last: None,
            differences: (0.0, 0),
            report: Report::default(),
        }
    }

    /// Begins a connection: the service speaks first.
    pub(super) fn begin(&mut self, now: Instant) {
        self.outstanding = VecDeque::from([(now, false)]);
        self.sent = None;
    }

    pub(super) fn is_outstanding(&self) -> bool {
        !self.outstanding.is_empty()
    }

    /// Notes a message with the force `force` \[N\]. `marked`: whether the message asks for the configuration to
    /// end a doubt.
    pub(super) fn send(&mut self, now: Instant, force: Triple, verdict: Option<Verdict>, marked: bool) {
        self.outstanding.push_back((now, marked));
        self.sent = Some(now);
        self.asked = force;
        let report = &mut self.report;
        report.largest_force = report.largest_force.max(length(force));
        match verdict {
            Some(Verdict::Zero(cause)) => report.zeroed[cause.index()] += 1,
            Some(Verdict::Out(changes)) => {
                report.limited += u64::from(changes.limited);
                report.slewed += u64::from(changes.slewed);
            }
            None => {}
        }
    }

    /// Takes a reply. Returns the instant of the message if the reply answers the latest message; else the reply is older than the next one.
    pub(super) fn answer(&mut self, form: Form) -> Option<Instant> {
        let marked = self.outstanding.iter().position(|(_, marked)| *marked);
        // Number of messages before the answered message. A plain reply never answers a marked message: such a reply is late or doubled.
        let before = match form {
            Form::Full => Some(marked.unwrap_or(0)),
            Form::Plain if marked == Some(0) => None,
            Form::Plain | Form::Unknown => Some(0),
        };
        let answered = before.and_then(|before| self.outstanding.drain(..=before.min(self.outstanding.len().checked_sub(1)?)).next_back());
        let Some((sent, _)) = answered else {
            self.report.unasked += 1;
            return None;
        };
        self.report.lost += before.unwrap_or(0) as u64;
        if self.is_outstanding() {
            self.report.older += 1;
            return None;
        }
        Some(sent)
    }

    /// Gives up the messages without a reply.
    pub(super) fn give_up(&mut self) {
        self.report.lost += self.outstanding.len() as u64;
        self.outstanding.clear();
    }

    /// Notes a reading, the reply to the message at `sent`. `force`: force that the device says to apply \[N\].
    /// `exchange`: time above which the reply is late.
    pub(super) fn note(&mut self, now: Instant, sent: Instant, force: Option<Triple>, exchange: Duration) {
        self.report.readings += 1;
        self.report.late += u64::from(now.saturating_duration_since(sent) > exchange);
        self.first.get_or_insert(now);
        self.last = Some(now);
        self.times.saturating_record(u64::try_from(now.saturating_duration_since(sent).as_nanos()).unwrap_or(u64::MAX));
        if let Some(force) = force {
            let off = length(core::array::from_fn(|axis| self.asked[axis] - force[axis]));
            self.differences = (self.differences.0 + off * off, self.differences.1 + 1);
        }
    }

    /// Returns the report up to now.
    pub(super) fn report(&self) -> Report {
        let at = |quantile| Duration::from_nanos(self.times.value_at_quantile(quantile));
        let span = self.first.zip(self.last).map_or(Duration::ZERO, |(first, last)| last.saturating_duration_since(first)).as_secs_f64();
        #[expect(clippy::cast_precision_loss, reason = "a rate and a mean are shown to some digits")]
        let (readings, count) = (self.report.readings as f64, self.differences.1 as f64);
        Report {
            per_second: if span > 0.0 { (readings - 1.0) / span } else { 0.0 },
            p50: at(0.5),
            p99: at(0.99),
            max: Duration::from_nanos(self.times.max()),
            force_rms: (count > 0.0).then(|| (self.differences.0 / count).sqrt()),
            ..self.report
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(micros: u64) -> Instant {
        Instant::from_nanos(1000 * micros)
    }

    #[test]
    fn a_report_has_rate_times_and_forces() {
        let mut exchanges = Exchanges::new();
        // A hundred exchanges each 2 ms, of which one took 1.5 ms and the others 300 µs.
        for count in 0..100 {
            exchanges.send(at(2000 * count), [0.0, 0.5, 0.0], None, false);
            let sent = exchanges.answer(Form::Plain).unwrap();
            let took = if count == 50 { 1500 } else { 300 };
            exchanges.note(at(2000 * count + took), sent, Some([0.0, 0.5, if count % 2 == 0 { 0.2 } else { 0.0 }]), Duration::from_millis(1));
        }
        let report = exchanges.report();
        assert!((report.per_second - 500.0).abs() < 1.0, "{report:?}");
        let near = |found: Duration, micros: f64| (found.as_secs_f64() * 1e6 / micros - 1.0).abs() < 2e-3;
        assert!(near(report.p50, 300.0) && near(report.p99, 300.0) && near(report.max, 1500.0), "{report:?}");
        // Half of the differences are 0.2 N.
        assert!((report.force_rms.unwrap() - 0.2 / 2_f64.sqrt()).abs() < 1e-12, "{report:?}");
        assert_eq!((report.exchange_every(Duration::from_millis(1)), report.late), (1, 1));
        assert_eq!(Report { p99: Duration::from_micros(4300), ..report }.exchange_every(Duration::from_millis(1)), 5);
        assert_eq!(Exchanges::new().report(), Report::default());
    }

    #[test]
    fn only_the_reply_to_the_latest_message_counts() {
        let mut exchanges = Exchanges::new();
        let send = |exchanges: &mut Exchanges, micros| exchanges.send(at(micros), [0.0; 3], None, false);
        send(&mut exchanges, 0);
        send(&mut exchanges, 1);
        assert_eq!([0; 3].map(|_| exchanges.answer(Form::Plain)), [None, Some(at(1)), None]);
        send(&mut exchanges, 2);
        exchanges.give_up();
        let report = exchanges.report();
        assert_eq!((report.older, report.unasked, report.lost, exchanges.is_outstanding()), (1, 1, 1, false));
    }

    #[test]
    fn a_configuration_answers_the_marked_message() {
        let mut exchanges = Exchanges::new();
        // The reply to the message at 0 is lost.
        exchanges.send(at(0), [0.0; 3], None, false);
        exchanges.send(at(1), [0.0; 3], None, true);
        assert_eq!(exchanges.answer(Form::Full), Some(at(1)));
        assert_eq!(exchanges.report().lost, 1);
        // A second reply to the message before does not answer a marked message; an unreadable reply may.
        exchanges.send(at(2), [0.0; 3], None, true);
        assert_eq!([Form::Plain, Form::Unknown].map(|form| exchanges.answer(form)), [None, Some(at(2))]);
    }
}
