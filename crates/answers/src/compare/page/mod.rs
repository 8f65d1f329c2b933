//! The page `compare.html` with all figures of a comparison.

mod layout;
mod panels;
mod scale;
mod tables;

use cohaptic_picture::Picture;
use cohaptic_picture::page::{Html, Page};
use cohaptic_scene::{Measure, Scope};
use cohaptic_units::print::Counted;

use super::figures::Shown;
use super::{Finished, words};
use crate::page::{made_by, scene_text};
use layout::Layout;
use panels::{Outcome, Sheet};
use scale::Scale;

/// Origin of the numbers, shown on the page.
#[derive(Clone, PartialEq, Debug)]
pub struct PageSource<'a> {
    /// Description of each strategy, and the parameters with the values in the scene, in words.
    pub strategies: Vec<(&'static str, String)>,
    /// Command for making the page.
    pub command: String,
    /// Command of the campaign with the same table of runs.
    pub campaign: String,
    /// Text of the scene.
    pub scene: &'a str,
}

/// Returns the page. The bytes of the page depend on the scene, the runs and the strategies alone.
#[must_use]
pub fn html(finished: &Finished, source: &PageSource<'_>) -> String {
    let sheet = Sheet { finished, layout: Layout::of(finished.keys()) };
    let comparison = &finished.comparison;
    let strategies = comparison.strategies.len();
    let mut page = Page::new(format!("{}: {strategies} strategies side by side", finished.title)).with(Html::paragraph(sum(finished)));
    page = page.with(Html::heading(2, "Strategies")).with(tables::strategies(finished, &source.strategies));
    let refusals = words::refusals(finished);
    if !refusals.is_empty() {
        let items = refusals.into_iter().map(|(reason, count)| Html::text(&format!("{reason} ({})", Counted(count, "combination"))));
        page = page.with(Html::paragraph("Refused, so that nothing was run:")).with(Html::list(items));
    }
    page = page.with(Html::heading(2, "Differences to the first strategy")).with(Html::paragraph(DIFFERENCES)).with(tables::overview(finished));
    page = page.with(Html::heading(2, "Stability")).with(stability(&sheet));
    if comparison.has_task() {
        page = page.with(Html::heading(2, "Task")).with(task(&sheet));
    }
    page = page.with(measures(&sheet));
    page = page.with(Html::heading(2, "How the numbers are made")).with(Html::list(NOTES.map(Html::text)));
    page = page.with(made_by(&source.command));
    page = page.with(Html::paragraph(Html::text("The table of runs is that of ").and(Html::code(&source.campaign)).and(".")));
    page.with(scene_text(source.scene)).html()
}

/// Text above the table of differences.
const DIFFERENCES: &str = "At how many combinations of the other keys a measure is lower (▼) and higher (▲) than with the first strategy, where the whole interval of the paired difference is \
    on that side of zero. Lower is better for discrepancy, force, settling and energy.";

/// Notes about the origin of the numbers.
const NOTES: [&str; 6] = [
    "A run counts as diverged where a number is not finite any more, and where two copies are more than 1 m apart at some instant. No mean has it.",
    "A mean is that of the other runs, if they have the measure: a strategy whose hardest runs diverge is judged by the easier ones, so look at the diverged runs first.",
    "± and bands reach over the interval of 95 % of the mean (Student).",
    "Every strategy has the same seeds, and so the same hands, losses and delays. A difference is the mean over the seeds of which neither run diverged, with its own interval of 95 %.",
    "An interval is for one comparison. Of twenty intervals around no difference, one lies beside zero.",
    "A verdict is that of the analysis where it takes less than a second and leaves nothing out (spectral-radius, mean-square), else of two runs, one of them with a small disturbance (two-runs).",
];

/// Returns the number of runs, in words.
fn sum(finished: &Finished) -> String {
    let keys: Vec<&str> = finished.keys().iter().map(cohaptic_campaign::Variation::key).collect();
    let (runs, each) = (finished.report.runs, finished.plan.runs_of_each());
    let over = if keys.is_empty() {
        String::new()
    } else {
        format!(" at {} of {}", Counted(finished.comparison.others(), "combination"), keys.join(" and "))
    };
    format!("{}, {each} of each strategy{over}, with the same seeds for all.", Counted(runs, "run"))
}

/// Returns the section of stability: verdicts as a picture, and diverged runs.
fn stability(sheet: &Sheet<'_>) -> Html {
    let drawn = is_drawn(sheet);
    // Without drawn panels the tables stand alone: too many keys vary for a picture.
    let picture = sheet.stability().filter(|_| drawn).map_or_else(Html::default, |picture| figure("stability", &picture, ""));
    // A single panel would show no more than the table.
    let diverged = if !sheet.any_diverged() {
        Html::paragraph("No run diverged.")
    } else if drawn && sheet.layout.panels() > 1 {
        let caption = "Share of the runs that diverged, with Wilson's interval of 95 %.";
        figure(Outcome::Diverged.name(), &sheet.shares(Outcome::Diverged), caption)
    } else {
        Html::default()
    };
    picture.and(Html::details("Verdicts and diverged runs", tables::stability(sheet.finished))).and(diverged)
}

/// Returns the section of the task: the shares of runs in which it was done.
fn task(sheet: &Sheet<'_>) -> Html {
    let about = "How many runs ended with the task done, with Wilson's interval of 95 %. The mean task time counts these runs only.";
    // A single panel stands among the measures.
    let picture = if is_drawn(sheet) && sheet.layout.panels() > 1 {
        figure(Outcome::Done.name(), &sheet.shares(Outcome::Done), "Share of the runs whose task was done, with Wilson's interval of 95 %.")
    } else {
        Html::default()
    };
    Html::paragraph(about).and(picture).and(Html::details("Runs whose task was done", tables::done(sheet.finished)))
}

/// Returns whether the comparison is drawn at all.
fn is_drawn(sheet: &Sheet<'_>) -> bool {
    sheet.layout.undrawn(sheet.finished.keys()).is_none()
}

/// Draws the pictures of a comparison with a task, each with the name of its file: the shares of runs whose task was done, and the measures of the task that
/// belong to the run as a whole. Draws nothing without a task, and nothing if too many keys vary for a picture.
#[must_use]
pub fn pictures(finished: &Finished) -> Vec<(String, Picture)> {
    let sheet = Sheet { finished, layout: Layout::of(finished.keys()) };
    let comparison = &finished.comparison;
    if !comparison.has_task() || !is_drawn(&sheet) {
        return Vec::new();
    }
    let is_shown = |name: &str| Measure::ALL.iter().any(|measure| measure.is_of_task() && measure.scope() == Scope::Run && measure.name() == name);
    let measures = comparison.measures.iter().enumerate().filter(|(_, measure)| is_shown(&measure.name));
    let measures = measures.map(|(place, measure)| (measure.name.as_str(), sheet.measure(place, &Scale::of(comparison, place))));
    let done = (Outcome::Done.name(), sheet.shares(Outcome::Done));
    std::iter::once(done).chain(measures).map(|(name, picture)| (format!("{name}.svg"), picture)).collect()
}

/// Returns the section of measures: a section per measure, or common pictures of all measures if each measure needs a single panel.
fn measures(sheet: &Sheet<'_>) -> Html {
    let Finished { comparison, .. } = sheet.finished;
    let scales: Vec<Scale> = (0..comparison.measures.len()).map(|measure| Scale::of(comparison, measure)).collect();
    let undrawn = sheet.layout.undrawn(sheet.finished.keys());
    // The reason for missing pictures stands once, at the head of the section.
    let mut content = Html::heading(2, "Measures");
    if let Some(why) = &undrawn {
        content = content.and(Html::paragraph(why.as_str()));
    }
    let each = sheet.layout.panels() > 1;
    // A measure with a single panel needs no section with a picture.
    if undrawn.is_none() && !each {
        let pictures = sheet.all(&scales);
        let cut = if scales.iter().any(|scale| scale.is_cut) { CUT } else { "" };
        // The caption about cut values stands once, below the last picture.
        let last = pictures.len().saturating_sub(1);
        for (number, picture) in pictures.iter().enumerate() {
            content = content.and(figure("", picture, if number == last { cut } else { "" }));
        }
    }
    for (place, measure) in comparison.measures.iter().enumerate() {
        let shown = Shown::of(comparison, place);
        let about = Html::paragraph(format!("{}.", measure.about));
        let table = tables::measure(sheet.finished, place, &shown);
        let section = if undrawn.is_none() && each {
            let picture = figure("", &sheet.measure(place, &scales[place]), if scales[place].is_cut { CUT } else { "" });
            Html::heading(3, shown.title.as_str()).and(about).and(picture).and(Html::details(&format!("Table of {}", shown.head()), table))
        } else {
            Html::details(&shown.head(), about.and(table))
        };
        content = content.and(Html::section(&measure.name, section));
    }
    content
}

/// Caption of a picture whose axis ends before the largest values.
const CUT: &str = "What lies far beyond the other means is cut off.";

fn figure(name: &str, picture: &Picture, caption: &str) -> Html {
    let content = Html::picture(&picture.svg());
    Html::figure(name, if caption.is_empty() { content } else { content.and(Html::caption(caption)) })
}
