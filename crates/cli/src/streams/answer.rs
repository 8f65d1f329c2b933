//! Answer of `cohaptic relay --tcp`, as a JSON document and as text.

use std::fmt::Write as _;

use cohaptic_streams::{Counts, LineReport, ProxyReport, Report};
use cohaptic_units::Bytes;
use cohaptic_units::print::{Counted, Span};
use serde::Serialize;

use super::setup::Setup;
use crate::document_schema::{document, lateness};
use crate::realtime::{ConfiguredDelay, counts, late};

/// Returns the answer of `cohaptic relay --tcp --json`. `asked` holds the configured delays, indexed by line.
pub(super) fn document(setup: &Setup, report: &Report, asked: &[ConfiguredDelay], is_interrupted: bool) -> impl Serialize {
    let proxies = report.proxies.iter().zip(asked.chunks(2)).map(|(proxy, asked)| proxy_document(setup, proxy, asked));
    document! {
        title: setup.title.as_str(),
        duration_s: report.elapsed.as_secs_f64(),
        ending: if is_interrupted { "interrupted" } else { "complete" },
        valid: report.validity.is_valid(),
        release_error_us: lateness(&report.release.summary()),
        proxies: proxies.collect::<Vec<_>>(),
        open: report.open,
        held_bytes: report.held.get(),
    }
}

fn proxy_document(setup: &Setup, proxy: &ProxyReport, asked: &[ConfiguredDelay]) -> impl Serialize + use<> {
    let Counts { opened, refused, ended, reset, closed_after, reset_after, cut_after } = proxy.counts;
    let [client, server] = setup.ends(&proxy.name);
    let ways = [(client.clone(), server.clone()), (server, client)];
    let lines = proxy.lines.iter().zip(ways).zip(asked).map(|((line, (from, to)), asked)| line_document(line, from, to, asked));
    document! {
        name: proxy.name.clone(),
        listen: proxy.listen.to_string(),
        to: proxy.to.to_string(),
        connections: document! {
            opened: opened,
            refused: refused,
            ended: ended,
            reset: reset,
            close_after: closed_after,
            reset_after: reset_after,
            cut_after: cut_after,
        },
        lines: lines.collect::<Vec<_>>(),
    }
}

fn line_document(line: &LineReport, from: String, to: String, asked: &ConfiguredDelay) -> impl Serialize + use<> {
    document! {
        from: from,
        to: to,
        received_bytes: line.bytes.received,
        sent_bytes: line.bytes.sent,
        lost_bytes: line.bytes.lost,
        pieces: line.pieces.delivered(),
        mean_delay_s: line.pieces.mean_delay().map(|delay| delay.as_secs_f64()),
        asked_mean_delay_s: asked.first.map(|delay| delay.as_secs_f64()),
        changes: asked.changes,
    }
}

pub(super) fn describe(setup: &Setup, report: &Report, asked: &[ConfiguredDelay]) -> String {
    let mut text = format!("{}\n", setup.title);
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "  {line}");
    };
    let opened: u64 = report.proxies.iter().map(|proxy| proxy.counts.opened).sum();
    let open = if report.open > 0 { format!(", {} open at the end", report.open) } else { String::new() };
    let held = if report.held.get() > 0 { format!(", {} held", report.held) } else { String::new() };
    line(format!("{} in {}{open}{held}", Counted(opened, "connection"), Span::measured(report.elapsed)));
    line(format!("the run is {}", report.validity));
    if report.release.count() > 0 {
        line(format!("release error: {}", late(&report.release.summary())));
    }
    for (proxy, asked) in report.proxies.iter().zip(asked.chunks(2)) {
        let name = if setup.is_pair { String::new() } else { format!("{} ({} -> {}): ", proxy.name, proxy.listen, proxy.to) };
        line(format!("{name}{}", ends_of(&proxy.counts)));
        let [client, server] = setup.ends(&proxy.name);
        for ((report, asked), (from, to)) in proxy.lines.iter().zip(asked).zip([(&client, &server), (&server, &client)]) {
            line(format!("{from} -> {to}: {}", carried(report, asked)));
        }
    }
    if !report.validity.is_valid() {
        line("what to do: this machine was too busy to be on time. End other programs, or accept more lateness with --tolerance".to_owned());
    }
    text
}

/// Says how the connections of a proxy ended.
fn ends_of(found: &Counts) -> String {
    let Counts { opened, refused, ended, reset, closed_after, reset_after, cut_after } = *found;
    let ends = [
        ("ended", ended),
        ("reset by an end", reset),
        ("refused by the program", refused),
        ("by close-after", closed_after),
        ("by reset-after", reset_after),
        ("by cut-after", cut_after),
    ];
    match (opened, counts(&ends)) {
        (0, _) => "no client connected".to_owned(),
        (_, None) => "no connection has ended".to_owned(),
        (_, Some(ends)) => format!("connections: {ends}"),
    }
}

/// Says what a line carried: `5000B received, 5000B sent; mean delay 24.031 ms, asked 24.000 ms`.
fn carried(line: &LineReport, asked: &ConfiguredDelay) -> String {
    let mut text = format!("{} received, {} sent", Bytes::new(line.bytes.received), Bytes::new(line.bytes.sent));
    if line.bytes.lost > 0 {
        let _ = write!(text, ", {} lost", Bytes::new(line.bytes.lost));
    }
    if let Some(delays) = asked.beside(&line.pieces) {
        let _ = write!(text, "; {delays}");
    }
    text
}
