//! A relay in words.

use std::fmt::Write as _;

use cohaptic_relay::{LinkReport, PortReport, Report};
use cohaptic_units::print::Counted;

use super::document::{Totals, refused};
use super::setup::Setup;
use crate::realtime::{ConfiguredDelay, carried, counts, lasted, late, notes};

/// So many links are named.
const MOST_LINKS: usize = 64;

/// So many of those over which nothing went.
const MOST_IDLE: usize = 8;

pub(super) fn describe(setup: &Setup, report: &Report, asked: &[ConfiguredDelay]) -> String {
    let mut text = format!("{}\n", setup.title);
    // Writing to a string does not fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "  {line}");
    };
    let Totals { packets, dropped, sent, unsent } = Totals::of(report);
    let held = report.held.0;
    line(format!(
        "{} came in within {}, {sent} sent on, {dropped} dropped, {held} on the way at the end",
        Counted(packets, "datagram"),
        lasted(report.elapsed)
    ));
    line(format!("the run is {}", report.validity));
    if report.release.count() > 0 {
        line(format!("release error: {}", late(&report.release.summary())));
    }
    if report.clamped.count() > 0 {
        line(format!("{} of them were offered to their link late: {}", report.clamped.count(), late(&report.clamped.summary())));
    }
    links(&report.links, asked, &mut line);
    if let Some(refused) = counts(&refused(report)) {
        line(format!("dropped at the door: {refused}"));
    }
    if report.without_socket > 0 {
        line(format!("sent away, because no socket could be had (`ulimit -n`): {}", Counted(report.without_socket, "client")));
    }
    if unsent > 0 {
        line(format!("{unsent} had come out of their links and were not sent yet"));
    }
    report.ports.iter().for_each(|port| at(port, &mut line));
    if let Some(refused) = small_buffer(&report.ports) {
        line(refused);
    }
    text.push_str(&notes(&report.prepared));
    text
}

fn links(links: &[LinkReport], asked: &[ConfiguredDelay], line: &mut impl FnMut(String)) {
    let was_used = |link: &LinkReport| link.stats.offered() + link.counts.overload > 0;
    let (used, idle): (Vec<_>, Vec<_>) = links.iter().zip(asked).partition(|(link, _)| was_used(link));
    for (LinkReport { from, to, stats, counts }, asked) in used.iter().take(MOST_LINKS) {
        let beside = [("overload", counts.overload), ("undeliverable", counts.undeliverable)];
        line(format!("{from} -> {to}: {}", carried(stats, asked, &beside)));
    }
    if used.len() > MOST_LINKS {
        line(format!("... and {}: --json has all", Counted(used.len() - MOST_LINKS, "more link")));
    }
    if used.is_empty() {
        line("nothing went over any link".to_owned());
    } else if idle.len() <= MOST_IDLE {
        idle.iter().for_each(|(LinkReport { from, to, .. }, _)| line(format!("{from} -> {to}: nothing offered")));
    } else {
        line(format!("nothing went over {} other links", idle.len()));
    }
}

/// What went wrong at a port, if anything did.
fn at(port: &PortReport, line: &mut impl FnMut(String)) {
    let mut all = port.counts.failures.by_reason().map(|(reason, count)| (reason, count)).to_vec();
    all.extend([("oversized", port.counts.oversized), ("errors on reading", port.counts.receive_errors)]);
    if let Some(failed) = counts(&all) {
        line(format!("at the port {}: not sent or not taken: {failed}", port.name));
    }
    match port.kernel_drops {
        Some(0) => {}
        Some(dropped) => line(format!("at the port {}: {dropped} dropped by the kernel before they were read: its buffer was full", port.name)),
        None => line(format!("at the port {}: the system does not tell how many the kernel dropped", port.name)),
    }
}

/// What the system let wait at a port, where it is less than was asked for.
fn small_buffer(ports: &[PortReport]) -> Option<String> {
    // The kernel grants twice what is asked for.
    let wanted = 2 * cohaptic_realtime::udp::EndpointConfig::default().receive_buffer;
    let least = ports.iter().map(|port| port.receive_buffer).filter(|granted| *granted > 0).min()?;
    (least < wanted).then(|| {
        format!(
            "the system lets {least} bytes wait at a port, {wanted} were asked for: more makes kernel drops rarer; allow it with `sysctl \
             net.core.rmem_max={}` or CAP_NET_ADMIN",
            wanted / 2
        )
    })
}
