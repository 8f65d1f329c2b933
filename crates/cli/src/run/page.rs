//! `run.html`: the results of a run on one page, with the scene, the pictures, the measures and the tables of links.

use std::collections::BTreeMap;

use cohaptic_answers::OutcomeDocument;
use cohaptic_answers::page::{self, MOST_ROWS, made_by, more_rows, scene_text};
use cohaptic_harness::check::Outcome;
use cohaptic_harness::measures::MeasuredValue;
use cohaptic_harness::task::{TaskResult, task_words};
use cohaptic_harness::{Ending, Summary};
use cohaptic_picture::page::{Html, Page, Table};
use cohaptic_scene::{Scene, scene_content_of_text};
use cohaptic_units::print::{Counted, SixDigits, Span};
use cohaptic_wan::{DropCause, LinkName, LinkStats};

use super::answer::{angle_text, diverged, length, packets};
use super::command_line;
use crate::arguments::RunArguments;
use crate::expectations::{BARS, cells, columns};
use crate::failure::Failure;
use crate::{input, output};

/// Returns the page as HTML. The text depends only on the scene and on the command line, so that equal runs give equal bytes.
pub(super) fn html(
    arguments: &RunArguments,
    scene: &Scene,
    overrides: &[String],
    (summary, measured, task): (&Summary, &[MeasuredValue], Option<&TaskResult>),
    outcomes: &[Outcome],
    pictures: &[(&'static str, String)],
) -> Result<String, Failure> {
    let path = &arguments.scene.scene;
    // The page shows the file as written, and names the overrides apart.
    let text = input::text(path)?;
    let content = input::with(path, |text, file| scene_content_of_text(text, file, overrides))?;
    let mut page =
        Page::new(scene.title.as_str()).with(ending(scene, summary)).with(Html::facts(facts(arguments, scene, overrides, (summary, task))));
    page = page.with(made_by(&command_line(arguments)));
    page = page.with(section("Expectations", expectations(scene, outcomes))).with(measures(scene, measured)).with(Html::heading(2, "Pictures"));
    for (file, svg) in pictures {
        page = page.with(Html::figure(file, Html::picture(svg)));
    }
    page = page.with(Html::heading(2, "Peers")).with(peers(scene, summary)).with(Html::heading(2, "Links")).with(links(summary));
    let edits = edits(&content.keys);
    if !edits.is_empty() {
        page = page.with(Html::heading(2, "Timeline")).with(Html::table(&edits));
    }
    Ok(page.with(scene_text(&text)).html())
}

/// Returns a section of the page, or nothing if the section would be empty.
pub(super) fn section(heading: &str, content: Html) -> Html {
    if content == Html::default() { content } else { Html::heading(2, heading).and(content) }
}

/// Returns a warning if the run diverged or was interrupted, otherwise nothing.
pub(super) fn ending(scene: &Scene, summary: &Summary) -> Html {
    match summary.ending {
        Ending::Complete | Ending::Diverged(_) => diverged(summary).map_or_else(Html::default, |why| Html::warning(format!("DIVERGED: {why}."))),
        Ending::Interrupted(_) => Html::warning(format!("INTERRUPTED after {} of {}.", Span(summary.duration), Span(scene.duration))),
    }
}

/// Returns the facts about the run, each with its name.
pub(super) fn facts<'a>(
    arguments: &RunArguments,
    scene: &Scene,
    overrides: &[String],
    (summary, task): (&Summary, Option<&TaskResult>),
) -> Vec<(&'a str, Html)> {
    let mut facts = vec![
        ("Simulated", format!("{}, {}", Span(summary.duration), Counted(summary.ticks, "tick")).into()),
        ("Largest discrepancy between two copies", length(summary.max_discrepancy).into()),
        ("Packets", packets(summary).into()),
        ("Scene", Html::code(&output::path(input::named(&arguments.scene.scene)))),
        ("Seed", scene.seed.to_string().into()),
        ("Fingerprint of the scene", Html::code(&scene.clone().fingerprint().to_string())),
    ];
    if let Some(angle) = summary.max_rotation_discrepancy {
        // Beside the largest discrepancy, the other distance between copies.
        facts.insert(2, ("Largest angle between two copies", angle_text(angle).into()));
    }
    if let Some(task) = task {
        // The task is what the scene is about, so its outcome comes first after the length of the run.
        facts.insert(1, ("Task", task_words(task, scene).into()));
    }
    facts.extend(page::overrides(overrides));
    facts
}

/// Returns the expectations of the scene with their outcomes; empty if the scene expects nothing.
pub(super) fn expectations(scene: &Scene, outcomes: &[Outcome]) -> Html {
    let Some(expect) = &scene.expect else { return Html::default() };
    let mut content = Html::default();
    if !outcomes.is_empty() {
        let table = outcomes.iter().fold(columns(), |table, outcome| table.row(cells(&OutcomeDocument::new(outcome))));
        content = content.and(Html::paragraph(BARS)).and(Html::table(&table));
    }
    if let Some(stable) = expect.stable {
        let word = if stable { "stable" } else { "unstable" };
        content = content.and(Html::paragraph(
            Html::text(&format!("The scene is expected to be {word}, which one run cannot tell: ")).and(Html::code("cohaptic check")).and(" can."),
        ));
    }
    content
}

/// Returns the section of measures; empty if the scene measures nothing.
pub(crate) fn measures(scene: &Scene, measured: &[MeasuredValue]) -> Html {
    if measured.is_empty() {
        return Html::default();
    }
    let head = Table::new().column("measure").number("value").column("unit").column("meaning");
    let table = measured.iter().take(MOST_ROWS).fold(head, |table, MeasuredValue { name, value }| {
        let value = value.map_or_else(|| "–".to_owned(), |value| SixDigits(value).to_string());
        table.row([Html::code(&name.text(scene)), value.into(), name.measure.unit().into(), name.measure.about().into()])
    });
    Html::heading(2, "Measures").and(Html::table(&table))
}

/// Returns the table of the peers at the end of the run.
pub(crate) fn peers(scene: &Scene, summary: &Summary) -> Html {
    let axes = ["x", "y", "z"].into_iter().take(scene.axes.count());
    let head = axes.clone().fold(Table::new().column("peer"), |table, axis| table.number(format!("{axis} at the end [mm]")));
    let head = axes.fold(head, |table, axis| table.number(format!("velocity along {axis} [mm/s]")));
    let head = head.number("samples too late").number("samples refused");
    let shown = summary.peers.iter().take(MOST_ROWS).fold(head, |table, peer| {
        let millimetres = |value: &f64| Html::text(&number(1e3 * value));
        let motion = peer.position.iter().chain(&peer.velocity).map(millimetres);
        let counts = [peer.stale_samples, peer.refused_samples].map(|count| Html::text(&count.to_string()));
        table.row(std::iter::once(Html::text(&peer.name)).chain(motion).chain(counts))
    });
    Html::table(&shown).and(more_rows(summary.peers.len() as u64, "peers", "trajectory.csv"))
}

/// Returns the table of the links and access lines at the end of the run.
pub(crate) fn links(summary: &Summary) -> Html {
    let name = |peer: usize| &summary.peers[peer].name;
    let access = summary.access_lines.iter().map(|line| {
        let link = if line.uplink { LinkName::uplink(name(line.peer)) } else { LinkName::downlink(name(line.peer)) };
        (link, line.stats)
    });
    let between = summary.links.iter().map(|link| (LinkName::between(name(link.from), name(link.to)), link.stats));
    let shown: Vec<(LinkName, LinkStats)> = access.chain(between).take(MOST_ROWS).collect();
    // Only for the choice of the columns: a packet over an access line counts twice.
    let mut total = summary.links.total();
    summary.access_lines.iter().for_each(|line| total.add(&line.stats, 1));
    // Causes without a drop are left out, because their columns would make the table wide.
    let causes: Vec<DropCause> = DropCause::ALL.into_iter().filter(|cause| total.dropped(*cause) > 0).collect();
    let head = Table::new().column("link").number("offered").number("copies").number("delivered");
    let head = causes.iter().fold(head, |table, cause| table.number(format!("dropped: {}", cause.name())));
    let head = head.number("on the way at the end").number("mean delay [ms]");
    let table = shown.iter().fold(head, |table, (link, stats)| {
        let counts = [stats.offered(), stats.duplicated(), stats.delivered()].into_iter().chain(causes.iter().map(|cause| stats.dropped(*cause)));
        let delay = stats.mean_delay().map_or_else(|| "–".to_owned(), |delay| number(1e3 * delay.as_secs_f64()));
        let cells = counts.chain([stats.in_flight()]).map(|count| count.to_string()).chain([delay]);
        table.row(std::iter::once(link.as_str().to_owned()).chain(cells).map(|cell| Html::text(&cell)))
    });
    Html::table(&table).and(more_rows(summary.links.len() + summary.access_lines.len() as u64, "links", "links.csv"))
}

/// Formats a number with three decimals, or with a power of ten if its magnitude is below 0.001 or at least 10⁷.
fn number(value: f64) -> String {
    if value == 0.0 || (1e-3..1e7).contains(&value.abs()) { format!("{value:.3}") } else { format!("{value:.3e}") }
}

/// Returns the table of the changes during the run, taken from keys of the scene such as `timeline.0.set.loss`.
pub(crate) fn edits(keys: &BTreeMap<String, String>) -> Table {
    // Sorted by number, because as texts 10 comes before 2.
    let mut changes: BTreeMap<usize, (String, Vec<String>)> = BTreeMap::new();
    for (key, value) in keys {
        let Some((number, key)) = key.strip_prefix("timeline.").and_then(|rest| rest.split_once('.')) else { continue };
        let Ok(number) = number.parse() else { continue };
        let (at, effects) = changes.entry(number).or_default();
        // The key `at` of a change is the instant. All further keys are effects of the change.
        if key == "at" { at.clone_from(value) } else { effects.push(format!("{key} = {value}")) }
    }
    let head = Table::new().column("at").column("change");
    // Values are TOML, and a text has quotes there.
    changes.into_values().fold(head, |table, (at, effects)| table.row([Html::text(at.trim_matches('"')), Html::text(&effects.join(", "))]))
}
