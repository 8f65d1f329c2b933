//! Page of `cohaptic check --page`: all checked scenes with their expectations.

use cohaptic_picture::page::{Html, Mark, Page};

use super::Checked;
use crate::expectations::{BARS, cells, columns, verdict};

/// Returns the page as HTML: a list of the scenes, then one section per scene with one row per expectation.
pub(super) fn html(scenes: &[Checked], overrides: &[String]) -> String {
    let failed = scenes.iter().filter(|scene| !scene.passed).count();
    let outcomes = || scenes.iter().flat_map(|scene| &scene.expectations);
    let missed = outcomes().filter(|outcome| !outcome.passed).count();
    let sum = format!("{} passed, {failed} failed. Of {} expectations {missed} are not met.", scenes.len() - failed, outcomes().count());
    let mut page = Page::new("Scenes against their expectations").with(Html::paragraph(sum));
    if !overrides.is_empty() {
        let set: Vec<String> = overrides.iter().map(|key| format!("--set {key}")).collect();
        page = page.with(Html::paragraph(Html::text("With ").and(Html::code(&set.join(" "))).and(".")));
    }
    page = page.with(Html::paragraph(BARS));
    let link = |(number, scene): (usize, &Checked)| Html::link(&anchor(number), scene.file.as_str()).and(": ").and(short(scene));
    page = page.with(Html::list(scenes.iter().enumerate().map(link)));
    for (number, scene) in scenes.iter().enumerate() {
        page = page.with(Html::section(&anchor(number), section(scene)));
    }
    page.html()
}

fn anchor(number: usize) -> String {
    format!("scene-{}", number + 1)
}

fn short(scene: &Checked) -> Html {
    if scene.passed && !scene.expects { Html::mark(Mark::Partly, "nothing was compared") } else { verdict(scene.passed) }
}

fn section(scene: &Checked) -> Html {
    let mut content = Html::heading(3, Html::text(&scene.file).and(" ").and(short(scene)));
    if scene.passed && !scene.expects {
        content = content.and(Html::paragraph("The scene has no [expect]."));
    }
    if !scene.expectations.is_empty() {
        content = content.and(Html::table(&scene.expectations.iter().fold(columns(), |table, outcome| table.row(cells(outcome)))));
    }
    // Preformatted, because a message with a place in a file has several lines, and the lines must stay aligned.
    for failure in &scene.failures {
        content = content.and(Html::preformatted(failure));
    }
    for note in &scene.notes {
        content = content.and(Html::paragraph(format!("Note: {note}")));
    }
    content
}
