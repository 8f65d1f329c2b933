//! Report of `cohaptic exec` in words.

use std::fmt::Write as _;

use cohaptic_exec::{Outcome, Plan};
use cohaptic_units::print::{Counted, Span};

use crate::realtime::{ConfiguredDelay, carried, counts, late, notes};

/// Describes the run: its commands, and what passed each link.
pub(super) fn describe(plan: &Plan, outcome: &Outcome) -> String {
    let report = &outcome.report;
    let mut text = String::new();
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "{line}");
    };
    for (host, status) in plan.hosts.iter().zip(&outcome.statuses) {
        let command: Vec<_> = host.command.iter().map(|word| word.to_string_lossy()).collect();
        let ended = status.map_or_else(|| "was ended".to_owned(), |status| format!("ended with status {status}"));
        line(format!("{}: {} {ended}", host.name, command.join(" ")));
    }
    let packets: u64 = report.links.iter().map(|link| link.stats.offered()).sum();
    line(format!("  {} in {}", Counted(packets, "packet"), Span::measured(report.elapsed)));
    line(format!("  the run is {}", report.validity));
    if report.release.count > 0 {
        line(format!("  release error: {}", late(&report.release)));
    }
    for link in &report.links {
        let asked = ConfiguredDelay::of(plan.links.between(link.from, link.to));
        let ends = format!("{} -> {}", report.nodes[link.from], report.nodes[link.to]);
        line(format!("  {ends}: {}", carried(&link.stats, &asked, &[])));
        if !link.dropped.is_empty() {
            line(format!("  {ends} dropped packets = {:?}", link.dropped));
        }
    }
    let untaken =
        [("to nobody in this network", report.untaken.no_host), ("malformed", report.untaken.malformed), ("overload", report.untaken.overload)];
    if let Some(untaken) = counts(&untaken) {
        line(format!("  packets that took no link: {untaken}"));
    }
    for (node, refused) in report.nodes.iter().zip(&report.refused).filter(|(_, refused)| **refused > 0) {
        line(format!("  {} that {node} did not take", Counted(*refused, "packet")));
    }
    text.push_str(&notes(&report.prepared, report.validity));
    text
}
