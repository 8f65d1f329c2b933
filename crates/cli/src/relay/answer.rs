//! Answer of `cohaptic relay`, as a JSON document and as text.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use cohaptic_realtime::Wish;
use cohaptic_relay::{Form, IntakeCounts, LinkReport, PortReport, Report};
use cohaptic_units::print::{Counted, Span};
use serde::Serialize;

use super::setup::Setup;
use crate::document_schema::{document, lateness};
use crate::realtime::{ConfiguredDelay, carried, counts, late, notes};

/// Returns the answer of `cohaptic relay --json`. `asked` holds the configured delays, indexed as the links of the report.
pub(super) fn document(setup: &Setup, report: &Report, asked: &[ConfiguredDelay], is_interrupted: bool) -> impl Serialize {
    let totals = Totals::of(report);
    document! {
        title: setup.title.as_str(),
        form: match setup.config.form {
            Form::Mesh(_) => "mesh",
            Form::Proxy(_) => "proxy",
        },
        duration_s: report.elapsed.as_secs_f64(),
        ending: if is_interrupted { "interrupted" } else { "complete" },
        valid: report.validity.is_valid(),
        packets: totals.packets,
        dropped: totals.dropped,
        release_error_us: lateness(&report.release.summary()),
        clamped_us: lateness(&report.clamped.summary()),
        links: report.links.iter().zip(asked).map(|(link, asked)| link_document(link, asked)).collect::<Vec<_>>(),
        ports: report.ports.iter().map(port_document).collect::<Vec<_>>(),
        refused: refused(&report.intake).into_iter().collect::<BTreeMap<_, _>>(),
        in_flight: document! { packets: report.held.0, bytes: report.held.1.get() },
        unsent: totals.unsent,
        clients_without_socket: report.without_socket,
        granted: report.prepared.granted.iter().copied().map(Wish::name).collect::<Vec<_>>(),
        refused_wishes: report.prepared.refused.iter().map(ToString::to_string).collect::<Vec<_>>(),
    }
}

fn link_document(link: &LinkReport, asked: &ConfiguredDelay) -> impl Serialize + use<> {
    document! {
        #[serde(flatten)]
        link: cohaptic_answers::link(link.from.clone(), link.to.clone(), &link.stats),
        asked_mean_delay_s: asked.first.map(|delay| delay.as_secs_f64()),
        changes: asked.changes,
        delivered_bytes: link.counts.delivered_bytes,
        overload: link.counts.overload,
        undeliverable: link.counts.undeliverable,
    }
}

fn port_document(port: &PortReport) -> impl Serialize + use<> {
    document! {
        name: port.name.clone(),
        address: port.address.map(|address| address.to_string()),
        received: port.counts.received,
        sent: port.counts.sent,
        send_failures: port.counts.failures.by_reason().into_iter().collect::<BTreeMap<_, _>>(),
        oversized: port.counts.oversized,
        receive_errors: port.counts.receive_errors,
        receive_buffer_bytes: port.receive_buffer,
        kernel_drops: port.kernel_drops,
    }
}

/// Returns the numbers of datagrams refused on arrival, by cause.
pub(super) fn refused(intake: &IntakeCounts) -> [(&'static str, u64); 4] {
    [("stranger", intake.strangers), ("to-itself", intake.to_itself), ("no-room", intake.no_room), ("overload", intake.overload)]
}

/// Sums over all links and ports of a relay.
struct Totals {
    /// Received datagrams, including datagrams dropped later.
    packets: u64,
    /// Datagrams dropped by the relay, by the links, or by the kernel on sending. Drops by the kernel before reading are not counted.
    dropped: u64,
    sent: u64,
    /// Datagrams between the end of a link and the sending socket at the end of the run.
    unsent: u64,
}

impl Totals {
    fn of(report: &Report) -> Self {
        let intake = &report.intake;
        let at_the_door = intake.overload + intake.strangers + intake.to_itself + intake.no_room;
        let over_links = |count: fn(&LinkReport) -> u64| -> u64 { report.links.iter().map(count).sum() };
        let over_ports = |count: fn(&PortReport) -> u64| -> u64 { report.ports.iter().map(count).sum() };
        let undeliverable = over_links(|link| link.counts.undeliverable);
        let (sent, failed) = (over_ports(|port| port.counts.sent), over_ports(|port| port.counts.failures.in_all()));
        let delivered = over_links(|link| link.stats.delivered());
        Self {
            // Refused datagrams arrived, too, but were never offered.
            packets: intake.offered + at_the_door,
            dropped: at_the_door + over_links(|link| link.stats.dropped_in_all()) + undeliverable + failed,
            sent,
            // Each delivered datagram is undeliverable, sent, failed, or still unsent.
            unsent: delivered.saturating_sub(undeliverable + sent + failed),
        }
    }
}

/// Largest number of links with traffic in the text.
const MOST_LINKS: usize = 64;

/// Largest number of links without traffic in the text.
const MOST_IDLE: usize = 8;

pub(super) fn describe(setup: &Setup, report: &Report, asked: &[ConfiguredDelay]) -> String {
    let mut text = format!("{}\n", setup.title);
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "  {line}");
    };
    let Totals { packets, dropped, sent, unsent } = Totals::of(report);
    let held = report.held.0;
    line(format!(
        "{} arrived in {}: {sent} sent on, {dropped} dropped, {held} on the way at the end",
        Counted(packets, "datagram"),
        Span::measured(report.elapsed)
    ));
    line(format!("the run is {}", report.validity));
    if report.release.count() > 0 {
        line(format!("release error: {}", late(&report.release.summary())));
    }
    if report.clamped.count() > 0 {
        line(format!("{} came to their link late: {}", Counted(report.clamped.count(), "datagram"), late(&report.clamped.summary())));
    }
    links(&report.links, asked, &mut line);
    if let Some(refused) = counts(&refused(&report.intake)) {
        line(format!("dropped on arrival: {refused}"));
    }
    if report.without_socket > 0 {
        line(format!("turned away because the system gave no socket (raise `ulimit -n`): {}", Counted(report.without_socket, "client")));
    }
    if unsent > 0 {
        line(format!("{} had left their links and were not sent yet", Counted(unsent, "datagram")));
    }
    report.ports.iter().for_each(|port| at(port, &mut line));
    if let Some(refused) = small_buffer(&report.ports) {
        line(refused);
    }
    text.push_str(&notes(&report.prepared, report.validity));
    text
}

fn links(links: &[LinkReport], asked: &[ConfiguredDelay], line: &mut impl FnMut(String)) {
    let was_used = |link: &LinkReport| link.stats.offered() + link.counts.overload > 0;
    // In a large mesh most links are idle, so the used links come first.
    let (used, idle): (Vec<_>, Vec<_>) = links.iter().zip(asked).partition(|(link, _)| was_used(link));
    for (LinkReport { from, to, stats, counts }, asked) in used.iter().take(MOST_LINKS) {
        let beside = [("overload", counts.overload), ("undeliverable", counts.undeliverable)];
        line(format!("{from} -> {to}: {}", carried(stats, asked, &beside)));
    }
    if used.len() > MOST_LINKS {
        line(format!("... and {}: --json has all", Counted(used.len() - MOST_LINKS, "more link")));
    }
    // Few idle links are named, because an idle link may be a mistake in the setup. Many are only counted.
    if used.is_empty() {
        line("nothing went over any link".to_owned());
    } else if idle.len() <= MOST_IDLE {
        idle.iter().for_each(|(LinkReport { from, to, .. }, _)| line(format!("{from} -> {to}: nothing offered")));
    } else {
        line(format!("nothing went over {} other links", idle.len()));
    }
}

/// Adds lines about failures at a port: unsent and unread datagrams, and drops by the kernel.
fn at(port: &PortReport, line: &mut impl FnMut(String)) {
    let mut all = port.counts.failures.by_reason().map(|(reason, count)| (reason, count)).to_vec();
    all.extend([("oversized", port.counts.oversized), ("errors on reading", port.counts.receive_errors)]);
    if let Some(failed) = counts(&all) {
        line(format!("at the port {}: not sent or not read: {failed}", port.name));
    }
    match port.kernel_drops {
        Some(0) => {}
        Some(dropped) => line(format!("at the port {}: {dropped} dropped by the kernel before they were read: its buffer was full", port.name)),
        None => line(format!("at the port {}: the system does not tell how many the kernel dropped", port.name)),
    }
}

/// Returns a line about the smallest receive buffer of the ports, if the system granted less than the relay asked for.
fn small_buffer(ports: &[PortReport]) -> Option<String> {
    // Linux reports twice the requested size, because the kernel reserves memory for bookkeeping.
    let wanted = 2 * cohaptic_realtime::udp::EndpointConfig::default().receive_buffer;
    let least = ports.iter().map(|port| port.receive_buffer).filter(|granted| *granted > 0).min()?;
    (least < wanted).then(|| {
        format!(
            "the buffer of a port holds {least} bytes, and {wanted} were asked for; a larger buffer makes drops by the kernel rarer: allow it with `sysctl \
             net.core.rmem_max={}` or CAP_NET_ADMIN",
            wanted / 2
        )
    })
}
