//! The JSON document of a relay.

use std::collections::BTreeMap;

use cohaptic_realtime::Wish;
use cohaptic_relay::{Form, LinkReport, PortReport, Report};
use serde::Serialize;

use super::setup::Setup;
use crate::documents::{Counters, LatenessDocument, LinkDocument};
use crate::realtime::ConfiguredDelay;

/// What `cohaptic relay --json` prints.
#[derive(Serialize)]
pub(super) struct RelayDocument {
    title: String,
    form: &'static str,
    duration_s: f64,
    ending: &'static str,
    valid: bool,
    packets: u64,
    dropped: u64,
    release_error_us: LatenessDocument,
    clamped_us: LatenessDocument,
    links: Vec<RelayLink>,
    ports: Vec<PortDocument>,
    refused: BTreeMap<&'static str, u64>,
    in_flight: Held,
    unsent: u64,
    clients_without_socket: u64,
    granted: Vec<&'static str>,
    refused_wishes: Vec<String>,
}

#[derive(Serialize)]
struct RelayLink {
    #[serde(flatten)]
    link: LinkDocument,
    asked_mean_delay_s: Option<f64>,
    changes: u64,
    delivered_bytes: u64,
    overload: u64,
    undeliverable: u64,
}

#[derive(Serialize)]
struct PortDocument {
    name: String,
    address: Option<String>,
    received: u64,
    sent: u64,
    send_failures: BTreeMap<&'static str, u64>,
    oversized: u64,
    receive_errors: u64,
    receive_buffer_bytes: usize,
    kernel_drops: Option<u64>,
}

#[derive(Serialize)]
struct Held {
    packets: u64,
    bytes: u64,
}

impl RelayDocument {
    pub(super) fn new(setup: &Setup, report: &Report, asked: &[ConfiguredDelay], is_interrupted: bool) -> Self {
        let totals = Totals::of(report);
        Self {
            title: setup.title.clone(),
            form: match setup.config.form {
                Form::Mesh(_) => "mesh",
                Form::Proxy(_) => "proxy",
            },
            duration_s: report.elapsed.as_secs_f64(),
            ending: if is_interrupted { "interrupted" } else { "complete" },
            valid: report.validity.is_valid(),
            packets: totals.packets,
            dropped: totals.dropped,
            release_error_us: LatenessDocument::new(&report.release.summary()),
            clamped_us: LatenessDocument::new(&report.clamped.summary()),
            links: report.links.iter().zip(asked).map(|(link, asked)| RelayLink::new(link, asked)).collect(),
            ports: report.ports.iter().map(PortDocument::new).collect(),
            refused: refused(report).into_iter().collect(),
            in_flight: Held { packets: report.held.0, bytes: report.held.1.get() },
            unsent: totals.unsent,
            clients_without_socket: report.without_socket,
            granted: report.prepared.granted.iter().copied().map(Wish::name).collect(),
            refused_wishes: report.prepared.refused.iter().map(ToString::to_string).collect(),
        }
    }
}

impl RelayLink {
    fn new(link: &LinkReport, asked: &ConfiguredDelay) -> Self {
        Self {
            link: LinkDocument { from: link.from.clone(), to: link.to.clone(), counters: Counters::new(&link.stats) },
            asked_mean_delay_s: asked.first.map(|delay| delay.as_secs_f64()),
            changes: asked.changes,
            delivered_bytes: link.counts.delivered_bytes,
            overload: link.counts.overload,
            undeliverable: link.counts.undeliverable,
        }
    }
}

impl PortDocument {
    fn new(port: &PortReport) -> Self {
        Self {
            name: port.name.clone(),
            address: port.address.map(|address| address.to_string()),
            received: port.counts.received,
            sent: port.counts.sent,
            send_failures: port.counts.failures.by_reason().into_iter().collect(),
            oversized: port.counts.oversized,
            receive_errors: port.counts.receive_errors,
            receive_buffer_bytes: port.receive_buffer,
            kernel_drops: port.kernel_drops,
        }
    }
}

/// What was turned away at the door, by cause.
pub(super) fn refused(report: &Report) -> [(&'static str, u64); 4] {
    let intake = &report.intake;
    [("stranger", intake.strangers), ("to-itself", intake.to_itself), ("no-room", intake.no_room), ("overload", intake.overload)]
}

/// Sums over everything.
pub(super) struct Totals {
    /// What came in, whatever became of it.
    pub(super) packets: u64,
    /// What was dropped by the relay, by its links, or by the kernel on the way out; not what the kernel dropped before anybody saw it.
    pub(super) dropped: u64,
    pub(super) sent: u64,
    /// What had come out of its link and was not sent when the run ended.
    pub(super) unsent: u64,
}

impl Totals {
    pub(super) fn of(report: &Report) -> Self {
        let intake = &report.intake;
        let at_the_door = intake.overload + intake.strangers + intake.to_itself + intake.no_room;
        let over_links = |count: fn(&LinkReport) -> u64| -> u64 { report.links.iter().map(count).sum() };
        let over_ports = |count: fn(&PortReport) -> u64| -> u64 { report.ports.iter().map(count).sum() };
        let undeliverable = over_links(|link| link.counts.undeliverable);
        let (sent, failed) = (over_ports(|port| port.counts.sent), over_ports(|port| port.counts.failures.in_all()));
        let delivered = over_links(|link| link.stats.delivered());
        Self {
            packets: intake.offered + at_the_door,
            dropped: at_the_door + over_links(|link| link.stats.dropped_in_all()) + undeliverable + failed,
            sent,
            unsent: delivered.saturating_sub(undeliverable + sent + failed),
        }
    }
}
