//! Time of a transfer over TCP: over the held-out packets, over the fitted link, and over the simpler predictions.
//!
//! A client connects, and a server sends 10⁶ bytes as soon as it accepts; both ways of the connection have the same link. The time is that from the first
//! packet to the last byte. TCP is that of [`cohaptic_tcp`], which the test kit has too. Each figure is the median of 101 connections.
//!
//! The loop over segments compiles the generic link, so it is in this crate, which is optimised in all builds.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Duration;

use cohaptic_tcp::{Connection, Segment, TcpConfig};
use cohaptic_units::{Bytes, Instant, Probability};
use cohaptic_wan::law::Empirical;
use cohaptic_wan::{Between, Delay, Distribution, Fate, GilbertElliott, Jitter, Link, LinkConfig, LinkName, Loss, PathTrace};
use serde::Serialize;

use super::hold_out::Figures;
use super::{Measurement, Measurements};

/// Bytes that the server sends.
const BYTES: usize = 1_000_000;
/// Number of connections, with the seeds 1 to 101.
const CONNECTIONS: u32 = 101;

/// Median time of a transfer \[s\]; `None` if half of the connections end without all bytes, or if no link can be made.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Transfers {
    /// Over the held-out packets: a packet has the fate of the latest held-out packet that was sent before.
    pub measured: Option<f64>,
    /// Over the fitted link.
    pub best: Option<f64>,
    /// Over independent losses and delays with the figures of the first part.
    pub independent: Option<f64>,
    /// Over losses in runs and independent delays with the figures of the first part.
    pub gilbert: Option<f64>,
    /// Over the packets of the first part, as over the held-out packets.
    pub replay: Option<f64>,
}

impl Transfers {
    /// Measures transfers over the fitted link `config`, over the parts `first` and `rest`, and over links with the figures of the first part.
    #[must_use]
    pub fn of(config: &LinkConfig, first: &Measurements, rest: &Measurements, figures: &Figures) -> Self {
        // Packets overtake each other in all columns or in none: the fitted link says which.
        let like_fitted = || LinkConfig { order: config.order, ..LinkConfig::default() };
        let drawn = |loss: Loss| {
            let link = LinkConfig { delay: drawn(first)?, loss, ..like_fitted() };
            median_s(&link, Duration::ZERO)
        };
        let replayed = |part: &Measurements| {
            let trace = replayed(part)?;
            let length = trace.period()?;
            median_s(&LinkConfig { trace: Some(trace), ..like_fitted() }, length)
        };
        let independent = Probability::new(figures.loss).map_or(Loss::None, Loss::Independent);
        Self {
            measured: replayed(rest),
            best: median_s(config, Duration::ZERO),
            independent: drawn(independent),
            gilbert: drawn(in_runs(figures)),
            replay: replayed(first),
        }
    }
}

/// Returns losses in runs without memory, with the share and the mean run of `figures`.
fn in_runs(figures: &Figures) -> Loss {
    let again = |mean_run: f64| 1.0 / mean_run;
    // A share of 1 has no packet that ends a run, and gets r from its run alone. The share lost is p/(p + r).
    let chain = figures.mean_run.and_then(|mean_run| {
        let r = again(mean_run);
        let p = (r * figures.loss / (1.0 - figures.loss)).min(1.0);
        Some(GilbertElliott { p: Probability::new(p).ok()?, r: Probability::new(r).ok()?, h: Probability::ZERO, k: Probability::ONE })
    });
    chain.map_or(Loss::None, Loss::GilbertElliott)
}

/// Returns independent delays with the law of the measured ones.
fn drawn(part: &Measurements) -> Option<Delay> {
    let mut delays: Vec<f64> = part.packets().iter().filter_map(|packet| packet.delay_s).collect();
    delays.sort_by(f64::total_cmp);
    // A law has a greatest number of values. Every n-th of the sorted delays is nearly the same law.
    let every = delays.len().div_ceil(Empirical::MOST).max(1);
    let law = Empirical::new(delays.into_iter().step_by(every).collect()).ok()?;
    let [mean, sd] = [law.mean(), law.sd()].map(|seconds| Duration::try_from_secs_f64(seconds).ok());
    Delay::with_jitter(mean?, Jitter::new(sd?, Distribution::Empirical(Arc::new(law)))).ok()
}

/// Returns the measured packets as a recording that begins anew after its end. `None` for delays below zero, which no link has.
fn replayed(part: &Measurements) -> Option<PathTrace> {
    let packets = part.packets();
    let (begin, end) = (packets.first()?, packets.last()?);
    let mut text = "t,delay\n".to_owned();
    let mut row = |sent_s: f64, delay_s: Option<f64>| {
        let delay = delay_s.map_or_else(String::new, |delay_s| format!("{delay_s:.9}"));
        // Writing to a `String` cannot fail.
        let _ = writeln!(text, "{:.9},{delay}", sent_s - begin.sent_s);
    };
    packets.iter().for_each(|Measurement { sent_s, delay_s }| row(*sent_s, *delay_s));
    // The last packet holds for the mean gap. The row that ends the recording never holds itself.
    #[expect(clippy::cast_precision_loss, reason = "a count of packets")]
    let gaps = (packets.len() - 1).max(1) as f64;
    row(end.sent_s + (end.sent_s - begin.sent_s) / gaps, None);
    PathTrace::parse(&text, Between::Steps, true).ok()
}

/// Returns the median time of transfers over a link in both ways \[s\]. Connections begin at instants of the link that divide `length` evenly.
fn median_s(config: &LinkConfig, length: Duration) -> Option<f64> {
    let mut times: Vec<Option<Duration>> = (0..CONNECTIONS).map(|number| transfer(config, length, number)).collect();
    // A connection that never ends is longer than all others.
    times.sort_by_key(|time| time.unwrap_or(Duration::MAX));
    times[times.len() / 2].map(|time| time.as_secs_f64())
}

/// Direction of a connection.
struct Way {
    link: Link<Segment<'static>>,
    /// Instant of the link at which the connection begins.
    ahead: Duration,
}

impl Way {
    /// Hands all that an end of the connection sends at `now` to the link. Returns `None` if time went back, which it never does.
    fn send(&mut self, now: Instant, from: &mut Connection) -> Option<()> {
        while let Some(segment) = from.poll_transmit(now) {
            self.link.handle_packet(now.saturating_add(self.ahead), Bytes::new(segment.packet_length() as u64), segment).ok()?;
        }
        Some(())
    }

    fn next(&self) -> Option<Instant> {
        self.link.poll_timeout().map(|at| Instant::ZERO.saturating_add(at.saturating_duration_since(Instant::ZERO.saturating_add(self.ahead))))
    }

    /// Returns the segments that arrive at `now`.
    fn arrived(&mut self, now: Instant) -> Vec<Segment<'static>> {
        if self.link.handle_timeout(now.saturating_add(self.ahead)).is_err() {
            return Vec::new();
        }
        std::iter::from_fn(|| self.link.poll_event()).filter(|event| matches!(event.fate, Fate::Delivered(_))).map(|event| event.payload).collect()
    }
}

/// Returns the time of one transfer; `None` if the connection ends before.
fn transfer(config: &LinkConfig, length: Duration, number: u32) -> Option<Duration> {
    let way =
        |from: &str, to: &str, ahead: Duration| Way { link: Link::new(u64::from(number) + 1, &LinkName::between(from, to), config.clone()), ahead };
    let ahead = length * number / CONNECTIONS;
    // Half of the recording lies between the two ways, so that they do not meet the same bad second at once.
    let (mut up, mut down) = (way("client", "server", ahead + length / 2), way("server", "client", ahead));
    let tcp = TcpConfig::default();
    let mut now = Instant::ZERO;
    let mut client = Connection::connect(now, tcp.clone(), ([10, 0, 0, 1], 50_000).into(), ([10, 0, 0, 2], 80).into(), 1).ok()?;
    let mut server: Option<Connection> = None;
    let (mut block, mut left, mut received) = (vec![0; 65_536], BYTES, 0);
    loop {
        if let Some(server) = &mut server {
            while left > 0
                && let Ok(count) = server.write(&block[..left.min(65_536)])
            {
                left -= count;
            }
            down.send(now, server)?;
        }
        while let Ok(count @ 1..) = client.read(&mut block) {
            received += count;
        }
        if received == BYTES {
            return Some(now.saturating_duration_since(Instant::ZERO));
        }
        up.send(now, &mut client)?;
        let timers = [client.poll_timeout(), server.as_ref().and_then(Connection::poll_timeout)];
        // Without a timer and without a packet on the way nothing ever happens again: an end has given up.
        now = [up.next(), down.next()].into_iter().chain(timers).flatten().min()?;
        for segment in up.arrived(now) {
            match &mut server {
                Some(server) => server.handle_segment(now, &segment),
                None => server = Some(Connection::accept(now, tcp.clone(), &segment, 2).ok()?),
            }
        }
        for segment in down.arrived(now) {
            client.handle_segment(now, &segment);
        }
        client.handle_timeout(now);
        if let Some(server) = &mut server {
            server.handle_timeout(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn constant(ms: u64) -> LinkConfig {
        LinkConfig { delay: Delay::constant(Duration::from_millis(ms)), ..LinkConfig::default() }
    }

    fn packets(delays: impl Iterator<Item = Option<f64>>) -> Measurements {
        let packets = (0..).zip(delays).map(|(number, delay_s)| Measurement { sent_s: f64::from(number) * 0.01, delay_s });
        Measurements::new(packets.collect()).unwrap()
    }

    /// The handshake takes three ways of 50 ms until the server accepts. 691 segments of 1448 bytes leave in seven flights of 10, 20, 40 … 640, one a round trip,
    /// and the last one arrives 50 ms after it left: 0.15 + 6·0.1 + 0.05 s.
    #[test]
    fn a_constant_delay_gives_the_time_of_the_flights() {
        assert_eq!(median_s(&constant(50), Duration::ZERO), Some(0.8));
        // Half the delay, half the time.
        assert_eq!(median_s(&constant(25), Duration::ZERO), Some(0.4));
    }

    /// The same delays as a recording give the same time, wherever in the recording a connection begins.
    #[test]
    fn a_recording_of_constant_delays_gives_the_same_time() {
        let trace = replayed(&packets((0..60).map(|_| Some(0.05)))).unwrap();
        assert_eq!(trace.period(), Some(Duration::from_millis(600)));
        let length = trace.period().unwrap();
        assert_eq!(median_s(&LinkConfig { trace: Some(trace), ..LinkConfig::default() }, length), Some(0.8));
    }

    /// A way that is dead for a second in ten: of connections of 0.8 s one in about three meets it, so the median does not, and the connection that begins in the
    /// dead second does.
    #[test]
    fn a_connection_meets_its_part_of_a_recording() {
        let trace = replayed(&packets((0..1_000).map(|number| (number >= 100).then_some(0.05)))).unwrap();
        let length = trace.period().unwrap();
        let config = LinkConfig { trace: Some(trace), ..LinkConfig::default() };
        assert_eq!(median_s(&config, length), Some(0.8));
        assert!(transfer(&config, length, 0).unwrap() > Duration::from_secs(1));
        // 5 s before the client's way down is dead, its way up is.
        assert!(transfer(&config, length, 51).unwrap() > Duration::from_secs(1));
    }

    #[test]
    fn a_dead_link_has_no_time() {
        let dead = LinkConfig { loss: Loss::Independent(Probability::ONE), ..constant(50) };
        assert_eq!(median_s(&dead, Duration::ZERO), None);
        assert!(replayed(&packets([Some(-0.001), Some(0.02)].into_iter())).is_none());
    }

    /// Runs with the share and the mean length asked for.
    #[test]
    fn runs_have_share_and_mean_length() {
        let figures = |loss: f64, mean_run: Option<f64>| Figures {
            mean_s: 0.02,
            quantiles_s: [0.02; 2],
            wasserstein_s: None,
            autocorrelation: [None; 3],
            loss,
            mean_run,
            longer_runs: None,
        };
        let Loss::GilbertElliott(chain) = in_runs(&figures(0.02, Some(1.25))) else { panic!("no chain") };
        assert!((chain.mean_loss().unwrap() - 0.02).abs() < 1e-12 && (chain.r.get() - 0.8).abs() < 1e-12, "{chain:?}");
        assert_eq!(in_runs(&figures(0.0, None)), Loss::None);
    }

    /// Slow seconds come together: a recording of the first part shows it, and independent delays, of which each flight of packets has slow ones, do not.
    #[test]
    fn delays_without_order_are_another_connection() {
        let delay = |number: u32| Some(if (number / 500).is_multiple_of(2) { 0.02 } else { 0.08 });
        let part = packets((0..10_000).map(delay));
        let figures = Figures {
            mean_s: 0.05,
            quantiles_s: [0.08; 2],
            wasserstein_s: None,
            autocorrelation: [None; 3],
            loss: 0.0,
            mean_run: None,
            longer_runs: None,
        };
        let found = Transfers::of(&constant(50), &part, &part, &figures);
        assert_eq!((found.measured, found.best), (found.replay, Some(0.8)));
        assert_eq!(found.independent, found.gilbert);
        // In a second of 20 ms a connection takes 0.32 s, in one of 80 ms 1.28 s.
        let (recorded, independent) = (found.measured.unwrap(), found.independent.unwrap());
        assert!((0.32..=1.28).contains(&recorded) && (independent - recorded).abs() > 0.02, "{found:?}");
    }
}
