//! The page `live.html` of a session: the results, the lateness, and the command for a replay.

use std::path::Path;

use cohaptic_answers::page::{self, AnswerPage, Origin};
use cohaptic_harness::Ending;
use cohaptic_harness::task::task_words;
use cohaptic_live::Report;
use cohaptic_picture::page::{Html, Table};
use cohaptic_realtime::{LatenessSummary, Wish};
use cohaptic_scene::Scene;
use cohaptic_units::print::{Counted, Span};

use crate::arguments::LiveArguments;
use crate::document_schema::micros;
use crate::run::answer::{diverged, length, packets};
use crate::run::page::{links, measures, peers};
use crate::shell::CommandLine;
use crate::{input, output};

/// Scene of a session, as read before the session.
#[derive(Clone, Copy)]
pub(super) struct Played<'a> {
    pub(super) scene: &'a Scene,
    pub(super) text: &'a str,
    /// Overrides of the scene, with the overrides of `--for`.
    pub(super) overrides: &'a [String],
    /// Changes by the scene during the session.
    pub(super) timeline: &'a Table,
}

/// Returns the page as HTML. `path`: file of the scene.
pub(super) fn html(arguments: &LiveArguments, path: &Path, played: &Played<'_>, report: &Report) -> String {
    let Played { scene, text, overrides, timeline } = *played;
    let summary = &report.summary;
    let mut warnings: Vec<String> = diverged(summary).into_iter().map(|why| format!("DIVERGED: {why}")).collect();
    if !report.validity.is_valid() {
        warnings.push(format!("the session is {}", report.validity));
    }
    let lasted = Span(summary.duration);
    let ticks = Counted(summary.ticks, "tick");
    let lasted = match summary.ending {
        Ending::Complete | Ending::Diverged(_) => format!("the session lasted {lasted}, {ticks}"),
        Ending::Interrupted(_) => format!("the session was ended after {} of {}, {ticks}", Span::measured(summary.duration), Span(scene.duration)),
    };
    // A session that is not valid has a warning above, with the numbers.
    let valid = if report.validity.is_valid() { ", and was on time (valid)" } else { "" };
    let mut sentences = vec![
        format!("{lasted}{valid}"),
        format!("the largest discrepancy between two copies is {}", length(summary.max_discrepancy)),
        packets(summary),
    ];
    let task = report.task.as_ref().map(|task| format!("the task: {}", task_words(task, scene)));
    sentences.extend(task);
    let tables = Html::heading(2, "Lateness").and(Html::table(&lateness(report))).and(measures(scene, &report.measures));
    let mut tables = tables.and(Html::heading(2, "Peers")).and(peers(scene, summary)).and(attached(scene, report));
    tables = tables.and(Html::heading(2, "Links")).and(links(summary));
    if !timeline.is_empty() {
        tables = tables.and(Html::heading(2, "Timeline")).and(Html::table(timeline));
    }
    // DIR stands for the folder of `--out`, because the text of a page must not depend on the folder.
    let replay = CommandLine::new("run", path, overrides).option("--inputs", ["DIR/inputs.csv"]).text();
    tables = tables.and(Html::heading(2, "Again in virtual time")).and(Html::preformatted(&replay));
    let page = AnswerPage {
        title: format!("{}: live session", scene.title),
        warnings,
        sentences,
        asked: vec![("Seed", scene.seed.to_string().into()), ("Fingerprint of the scene", Html::code(&scene.clone().fingerprint().to_string()))],
        tables,
        notes: notes(report),
    };
    let pictures: Vec<(&str, &str)> = report.pictures.iter().map(|(name, svg)| (*name, svg.as_str())).collect();
    let file = output::path(input::named(path));
    page.html(&Origin { command: &command_line(arguments, path, report), file: &file, overrides, scene: text, pictures: &pictures })
}

/// Returns the command of the session, with all options that affect the session.
fn command_line(arguments: &LiveArguments, path: &Path, report: &Report) -> String {
    let real_time = &arguments.real_time;
    CommandLine::new("live", path, &arguments.overrides.set)
        .option("--for", arguments.length.map(Span))
        .option("--tolerance", real_time.pace.tolerance.map(Span))
        .flag("--spin", real_time.pace.spin)
        .flag("--no-priority", real_time.pace.no_priority)
        // Without peers in other programs, nothing listens.
        .option("--listen", report.admission.as_ref().map(|_| arguments.listen))
        .option("--key-file", arguments.key_file.as_deref().map(output::path))
        .flag("--allow-remote", real_time.allow_remote)
        .out()
        .text()
}

/// Returns the table of the lateness of ticks, and of datagrams to other programs if there were any.
fn lateness(report: &Report) -> Table {
    let head = Table::new().column("of").number("count");
    let head = ["half within [ms]", "99 % within [ms]", "99.9 % within [ms]", "worst [ms]"].into_iter().fold(head, Table::number);
    let rows = [("ticks", &report.ticks), ("datagrams to other programs", &report.releases)];
    // Without peers in other programs there are no releases, and no row.
    rows.into_iter().filter(|(_, summary)| summary.count > 0).fold(head, |table, (name, summary)| {
        let LatenessSummary { count, p50, p99, p999, max, .. } = *summary;
        let spans = [p50, p99, p999, max].map(|span| format!("{:.3}", micros(span) / 1e3));
        table.row([name.to_owned(), count.to_string()].into_iter().chain(spans).map(Html::from))
    })
}

/// Returns the table of the attached peers; nothing if all peers are simulated.
fn attached(scene: &Scene, report: &Report) -> Html {
    let head =
        Table::new().column("peer").column("kind").number("joined").number("samples taken").number("late").number("out of order").number("refused");
    // Only peers attached from outside have a seat.
    let peers = scene.peers.iter().zip(&report.seats).filter_map(|(peer, seat)| seat.as_ref().map(|seat| (peer, seat)));
    let table = peers.take(page::MOST_ROWS).fold(head, |table, (peer, seat)| {
        let counts = [seat.joined, seat.taken, seat.late, seat.out_of_order, seat.refused].map(|count| Html::text(&count.to_string()));
        table.row([Html::text(&peer.name), peer.kind.name().into()].into_iter().chain(counts))
    });
    if table.is_empty() { Html::default() } else { Html::heading(3, "Attached from outside").and(Html::table(&table)) }
}

/// Returns the wishes granted and refused by the system, and the numbers of refused datagrams by cause.
fn notes(report: &Report) -> Vec<String> {
    let granted: Vec<&str> = report.prepared.granted.iter().copied().map(Wish::name).collect();
    let granted = (!granted.is_empty()).then(|| format!("granted by the system: {}", granted.join(", ")));
    let refused = report.prepared.refused.iter().map(ToString::to_string);
    let door = report.admission.as_ref().and_then(|(door, _)| {
        let refused: Vec<String> = door.refusals().filter(|(_, count)| *count > 0).map(|(cause, count)| format!("{count} {cause}")).collect();
        (!refused.is_empty()).then(|| format!("datagrams refused: {}", refused.join(", ")))
    });
    granted.into_iter().chain(refused).chain(door).collect()
}
