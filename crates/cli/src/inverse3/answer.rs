//! Parts of the answers of `cohaptic inverse3` and of sessions with Inverse3s: structures of the JSON documents, and the same values as lines of text.

use std::collections::BTreeMap;
use std::time::Duration;

use cohaptic_device::ZeroCause;
use cohaptic_inverse3::client::{Report, Snapshot};
use cohaptic_inverse3::protocol::Flaw;
use cohaptic_inverse3::socket::Summary;
use cohaptic_units::print::Counted;
use serde::Serialize;

use crate::device_text::{self, Triple};
use crate::document_schema::micros;
use crate::realtime::counts;

/// Report of the exchanges with a service.
#[derive(Clone, Serialize)]
pub(crate) struct Exchanges {
    readings: u64,
    readings_per_s: f64,
    reply_p50_us: f64,
    reply_p99_us: f64,
    reply_max_us: f64,
    late: u64,
    /// Ticks of 1 ms, or of the peer, that 99 of 100 replies fit in.
    exchange_every: u64,
    force_rms_n: Option<f64>,
    dropped: BTreeMap<&'static str, u64>,
    older: u64,
    unasked: u64,
    lost: u64,
    connections: u64,
    losses: u64,
    forces: Forces,
}

/// Forces that went out: the largest, and the number of changes per kind of change.
#[derive(Clone, Serialize)]
struct Forces {
    largest_n: f64,
    limited: u64,
    slewed: u64,
    zeroed: BTreeMap<&'static str, u64>,
}

impl Exchanges {
    /// Returns the report for a peer that ticks each `tick`.
    pub(crate) fn of(report: &Report, tick: Duration) -> Self {
        let named = |counts: Vec<(&'static str, u64)>| counts.into_iter().filter(|(_, count)| *count > 0).collect();
        Self {
            readings: report.readings,
            readings_per_s: report.per_second,
            reply_p50_us: micros(report.p50),
            reply_p99_us: micros(report.p99),
            reply_max_us: micros(report.max),
            late: report.late,
            exchange_every: report.exchange_every(tick),
            force_rms_n: report.force_rms,
            dropped: named(Flaw::ALL.map(Flaw::name).into_iter().zip(report.flaws).collect()),
            older: report.older,
            unasked: report.unasked,
            lost: report.lost,
            connections: report.connections,
            losses: report.losses,
            forces: Forces {
                largest_n: report.largest_force,
                limited: report.limited,
                slewed: report.slewed,
                zeroed: named(ZeroCause::ALL.map(ZeroCause::name).into_iter().zip(report.zeroed).collect()),
            },
        }
    }

    /// Returns the report as lines of text.
    pub(crate) fn lines(&self) -> Vec<String> {
        let words = |all: &BTreeMap<&'static str, u64>| {
            counts(&all.iter().map(|(name, count)| (*name, *count)).collect::<Vec<_>>()).unwrap_or_else(|| "none".to_owned())
        };
        let Self { readings_per_s, reply_p50_us, reply_p99_us, reply_max_us, exchange_every, late, .. } = self;
        let mut lines = vec![
            format!("{readings_per_s:.0} exchanges per second, {late} late"),
            format!("replies take {reply_p50_us:.0} µs (p50), {reply_p99_us:.0} µs (p99), {reply_max_us:.0} µs at most"),
            format!("99 of 100 replies fit in exchange-every = {exchange_every}"),
            format!(
                "replies dropped: {}; {} older, {} unasked, {} lost; {}, disarmed {}",
                words(&self.dropped),
                self.older,
                self.unasked,
                self.lost,
                Counted(self.connections, "connection"),
                Counted(self.losses, "time")
            ),
        ];
        if let Some(rms) = self.force_rms_n {
            lines.push(format!("the device's force differs from the force asked for by {rms:.3} N (RMS)"));
        }
        let Forces { largest_n, limited, slewed, zeroed } = &self.forces;
        lines.push(format!("largest force {largest_n:.3} N; limited {limited}, slowed {slewed}; set to zero: {}", words(zeroed)));
        lines
    }
}

/// Identity of a device and of its service.
#[derive(Clone, Serialize)]
pub(super) struct Identity {
    pub(super) simulated: bool,
    device: Option<String>,
    service_version: Option<String>,
    hears_events: bool,
    /// The obstacle, in words; `None` if the service answers.
    error: Option<String>,
}

impl Identity {
    pub(super) fn of(summary: &Summary, simulated: bool) -> Self {
        Self {
            simulated,
            device: summary.device.clone(),
            service_version: summary.version.map(|version| version.to_string()),
            hears_events: summary.hears_events,
            error: summary.refusal.map(|refusal| refusal.to_string()).or_else(|| summary.error.clone()),
        }
    }

    /// Returns the name of the device in texts for people.
    pub(super) fn name(&self) -> String {
        let device = self.device.as_ref().map_or_else(|| "no Inverse3".to_owned(), |id| format!("Inverse3 {id}"));
        let version = self.service_version.as_ref().map_or_else(String::new, |version| format!(", service {version}"));
        format!("{}{device}{version}", if self.simulated { "simulated " } else { "" })
    }

    pub(super) fn lines(&self) -> Vec<String> {
        let events = "no events of the service arrive: nobody here hears of an emergency brake";
        let events = (self.device.is_some() && !self.hears_events).then(|| events.to_owned());
        self.error.iter().map(|error| format!("ERROR: {error}")).chain(events).collect()
    }
}

/// State of a device in the view of the client.
#[derive(Clone, Serialize)]
pub(super) struct Seen {
    pub(super) phase: &'static str,
    pub(super) position_m: Option<Triple>,
    pub(super) velocity_m_s: Option<Triple>,
    pub(super) force_n: Triple,
}

impl Seen {
    pub(super) fn of(snapshot: &Snapshot) -> Self {
        Self {
            phase: snapshot.phase.name(),
            position_m: snapshot.reading.map(|(reading, _)| reading.position),
            velocity_m_s: snapshot.reading.map(|(reading, _)| reading.velocity),
            force_n: snapshot.force,
        }
    }
}

/// Returns the state as lines of text, with the way to forces.
pub(super) fn seen(snapshot: &Snapshot) -> Vec<String> {
    let place = snapshot.reading.map(|(reading, _)| format!("the cursor is at {} from the origin", device_text::place(reading.position)));
    let hint = snapshot.phase.hint();
    let hint = if hint.is_empty() { String::new() } else { format!(": {hint}") };
    place.into_iter().chain([format!("phase: {}{hint}", snapshot.phase.name())]).collect()
}
