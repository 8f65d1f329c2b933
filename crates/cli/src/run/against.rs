//! `run.html` of a run with `--against`: scene and variant on the same page.

use std::collections::{BTreeMap, BTreeSet};

use cohaptic_answers::page::{MOST_ROWS, made_by, scene_text};
use cohaptic_harness::Summary;
use cohaptic_harness::check::Outcome;
use cohaptic_harness::measures::MeasuredValue;
use cohaptic_harness::task::TaskResult;
use cohaptic_picture::page::{Html, Page, Table};
use cohaptic_scene::{Scene, scene_content_of_text};
use cohaptic_units::print::SixDigits;

use super::command_line;
use super::page::{edits, ending, expectations, facts, links, peers, section};
use crate::arguments::RunArguments;
use crate::failure::Failure;
use crate::input;

/// Results of a run for a page.
#[derive(Clone, Copy)]
pub(super) struct Shown<'a> {
    pub(super) scene: &'a Scene,
    /// Overrides of the scene, with the overrides of `--against` last.
    pub(super) overrides: &'a [String],
    pub(super) summary: &'a Summary,
    pub(super) measured: &'a [MeasuredValue],
    pub(super) task: Option<&'a TaskResult>,
    pub(super) outcomes: &'a [Outcome],
    /// Pictures with the names of their files.
    pub(super) pictures: &'a [(&'static str, String)],
}

impl Shown<'_> {
    /// Returns the page of this run alone.
    pub(super) fn page(&self, arguments: &RunArguments) -> Result<String, Failure> {
        let Self { scene, overrides, summary, measured, task, outcomes, pictures } = *self;
        super::page::html(arguments, scene, overrides, (summary, measured, task), outcomes, pictures)
    }
}

/// Cell without a value.
const NOTHING: &str = "–";

/// Returns the page as HTML: of the run of the scene, and of the run of the variant. The text depends only on the scenes and on the command line.
pub(super) fn html(arguments: &RunArguments, runs: [Shown<'_>; 2]) -> Result<String, Failure> {
    let path = &arguments.scene.scene;
    let text = input::text(path)?;
    let content = |shown: &Shown<'_>| input::with(path, |text, file| scene_content_of_text(text, file, shown.overrides));
    let timelines = [edits(&content(&runs[0])?.keys), edits(&content(&runs[1])?.keys)];
    let timeline = |number: usize| if timelines[number].is_empty() { Html::default() } else { Html::table(&timelines[number]) };
    let mut page = Page::new(runs[0].scene.title.as_str()).with(each(&runs, |_, shown| ending(shown.scene, shown.summary)));
    page = page.with(compared_facts(arguments, &runs)).with(made_by(&command_line(arguments)));
    page = page.with(section("Measures", compared_measures(&runs))).with(section("Pictures", pictures(&runs)));
    page = page.with(section("Expectations", each(&runs, |_, shown| expectations(shown.scene, shown.outcomes))));
    page = page.with(section("Peers", each(&runs, |_, shown| peers(shown.scene, shown.summary))));
    page = page
        .with(section("Links", each(&runs, |_, shown| links(shown.summary))))
        .with(section("Timeline", each(&runs, |number, _| timeline(number))));
    Ok(page.with(scene_text(&text)).html())
}

/// Places the contents of both runs below each other, each under the title of the scene. A run without content is left out.
fn each(runs: &[Shown<'_>; 2], content: impl Fn(usize, &Shown<'_>) -> Html) -> Html {
    let with_title = |(number, shown): (usize, &Shown<'_>)| {
        let content = content(number, shown);
        if content == Html::default() { content } else { Html::heading(3, shown.scene.title.as_str()).and(content) }
    };
    runs.iter().enumerate().map(with_title).fold(Html::default(), Html::and)
}

/// Returns the names without repetitions, in the order of first occurrence.
fn each_once<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut seen = BTreeSet::new();
    names.filter(|name| seen.insert(*name)).collect()
}

/// Returns the facts as a table with a column for each run.
fn compared_facts(arguments: &RunArguments, runs: &[Shown<'_>; 2]) -> Html {
    let facts = runs.each_ref().map(|shown| facts(arguments, shown.scene, shown.overrides, (shown.summary, shown.task)));
    let head = runs.iter().fold(Table::new().column(""), |table, shown| table.column(shown.scene.title.as_str()));
    let value = |facts: &[(&str, Html)], name: &str| {
        facts.iter().find(|(known, _)| *known == name).map_or_else(|| NOTHING.into(), |(_, value)| value.clone())
    };
    // The variant can have facts beyond the facts of the scene, such as overrides.
    let names = each_once(facts.iter().flatten().map(|(name, _)| *name)).into_iter();
    Html::table(&names.fold(head, |table, name| table.row(std::iter::once(Html::text(name)).chain(facts.iter().map(|facts| value(facts, name))))))
}

/// Returns the table of measures with a column of values for each run; empty if both scenes measure nothing.
fn compared_measures(runs: &[Shown<'_>; 2]) -> Html {
    // The variant can have other measures than the scene, so that values are found by the names of measures.
    let named = |shown: &Shown<'_>| shown.measured.iter().map(|measured| (measured.name.text(shown.scene), *measured)).collect::<Vec<_>>();
    let measured = runs.each_ref().map(named);
    let by_name = measured.each_ref().map(|measured| measured.iter().cloned().collect::<BTreeMap<String, MeasuredValue>>());
    let head = runs.iter().fold(Table::new().column("measure"), |table, shown| table.number(shown.scene.title.as_str()));
    let names = each_once(measured.iter().flatten().map(|(name, _)| name.as_str())).into_iter().take(MOST_ROWS);
    let table = names.fold(head.column("unit").column("meaning"), |table, name| {
        let found = by_name.each_ref().map(|values| values.get(name));
        let value = |measured: Option<&MeasuredValue>| measured.and_then(|measured| measured.value);
        let values = found.map(|measured| Html::text(&value(measured).map_or_else(|| NOTHING.to_owned(), |value| SixDigits(value).to_string())));
        // Unit and meaning are the same in both runs, so the first run with the measure tells both.
        let words = found.into_iter().flatten().take(1).flat_map(|measured| [measured.name.measure.unit(), measured.name.measure.about()]);
        table.row(std::iter::once(Html::code(name)).chain(values).chain(words.map(Html::text)))
    });
    if table.is_empty() { Html::default() } else { Html::table(&table) }
}

/// Returns the pictures of both runs. Pictures of the same kind stand below each other.
fn pictures(runs: &[Shown<'_>; 2]) -> Html {
    let mut all = Html::default();
    for file in each_once(runs.iter().flat_map(|shown| shown.pictures).map(|(file, _)| *file)) {
        // The files of the variant lie in the folder `against`.
        for (shown, folder) in runs.iter().zip(["", "against/"]) {
            for (_, svg) in shown.pictures.iter().filter(|(known, _)| *known == file) {
                all = all.and(Html::figure(&format!("{folder}{file}"), Html::picture(svg)));
            }
        }
    }
    all
}
