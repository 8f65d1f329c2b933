//! `report.html`: means with intervals, differences to the first condition, and curves over trials, as a page without scripts and without external content.

use cohaptic_picture::page::{Html, Page, Table};
use cohaptic_picture::{Axis, Fill, Line, Look, Marker, Panel, Picture, Region, Size};
use cohaptic_scene::{Measure, Scope};
use cohaptic_units::print::{Counted, SixDigits};

use crate::analysis::{Analysed, Analysis};
use crate::folder::StudyFolder;
use crate::model::{Order, Study};
use crate::statistics::LEAST_UNITS;
use crate::tables::KeptTrial;
use crate::text_table;

/// Half of the height of the bar of an interval, in rows.
const HALF_BAR: f64 = 0.16;

/// Notes about the origin of the numbers.
const NOTES: [&str; 6] = [
    "A group is the unit: its value in a condition is the mean over its valid trials without practice, and a repeated trial counts in place of the repeated one.",
    "Intervals are those of Cousineau and Morey, 95 %: the values less the mean of their group, plus the mean of all, with the factor √(C/(C − 1)) for C conditions. They \
     leave out the differences between groups, and are made for comparing conditions, not for saying how other people would do.",
    "p is that of the two-sided sign flip test of the differences between groups: exact up to 20 groups, and of 10⁶ drawn flips above.",
    "p after Holm is corrected for the number of differences of the measure.",
    "d is the mean difference over the standard deviation of the differences.",
    "A trial that timed out counts as its timeout in task_time_s, which makes a mean too small, not too large: look at the share of such trials first.",
];

impl StudyFolder {
    /// Returns the report as a page. The bytes depend on what is kept alone.
    pub(crate) fn report(&self, trials: &[KeptTrial], analysis: &Analysis) -> String {
        let study = self.study();
        let mut page = Page::new(study.title.clone());
        if self.is_dry() {
            page = page.with(Html::warning("A dry run: modelled persons played, and answers were drawn evenly. Nothing here is about people."));
        }
        for warning in analysis.warnings(study) {
            page = page.with(Html::warning(warning));
        }
        page = page.with(Html::paragraph(self.sessions(trials))).with(Html::heading(2, "Conditions")).with(conditions(study));
        // Without a complete session every section would only say that no group has a value.
        if analysis.units > 0 {
            page = page.with(Html::heading(2, "Measures"));
            page = analysis.measures.iter().fold(page, |page, measure| page.with(section(study, measure)));
            if !analysis.questions.is_empty() {
                page = page.with(Html::heading(2, "Questions"));
                page = analysis.questions.iter().fold(page, |page, question| page.with(section(study, question)));
            }
        }
        page = page.with(Html::heading(2, "How the numbers are made")).with(Html::list(NOTES.map(Html::text)));
        page.with(Html::heading(2, "Study")).with(Html::details("The text of the study", Html::preformatted(&study.text))).html()
    }

    /// Says how many sessions and trials there are.
    fn sessions(&self, trials: &[KeptTrial]) -> String {
        let study = self.study();
        let (complete, size) = (self.complete(), study.group_size());
        // All kept trials are counted, also those of sessions that are not complete: the analysis counts fewer.
        let valid = trials.iter().filter(|trial| trial.ended.faults.is_empty()).count();
        let not_done = self.groups().len() - complete;
        let more = if not_done > 0 { format!(" {} not complete, and not analysed.", Counted(not_done, "session")) } else { String::new() };
        format!(
            "{} of {} with {} each are complete. {valid} of {} are valid, practice included.{more}",
            complete,
            Counted(study.groups, "session"),
            Counted(size, "person"),
            Counted(trials.len(), "trial"),
        )
    }
}

impl Analysis {
    /// Returns the pictures of all measures and questions, each with its name.
    pub(crate) fn pictures<'a>(&'a self, study: &'a Study) -> impl Iterator<Item = (&'a str, Picture)> {
        let drawn = self.measures.iter().chain(&self.questions).filter(|measure| !measure.rows.is_empty());
        // The name of a question ends in a description.
        drawn.map(|measure| (measure.name.split(' ').next().unwrap_or_default(), picture(study, measure)))
    }

    /// Returns the means of all measures and questions as lines of text, a line per condition below the names of the columns.
    #[must_use]
    pub fn mean_lines(&self, study: &Study) -> Vec<String> {
        let head = ["measure", "condition", "mean ± interval", "timed out"].map(str::to_owned);
        let rows = self.measures.iter().chain(&self.questions).flat_map(|measure| {
            measure.means.iter().zip(&study.conditions).enumerate().map(|(place, (mean, condition))| {
                let timed_out = measure.timed_out.get(place).copied().flatten().filter(|share| share.count > 0);
                let timed_out = timed_out.map(|share| format!("{} of {}", share.count, share.of)).unwrap_or_default();
                [measure.name.clone(), condition.label.clone(), with_interval(mean.mean, mean.half_width), timed_out]
            })
        });
        text_table::lines(&std::iter::once(head).chain(rows).collect::<Vec<_>>())
    }

    /// Returns what a reader must know before any number, in sentences.
    #[must_use]
    pub fn warnings(&self, study: &Study) -> Vec<String> {
        let mut warnings = Vec::new();
        let (units, differences) = (self.units, study.conditions.len().saturating_sub(1));
        if units > 0 && differences > 0 {
            // Holm multiplies the smallest p by the number of differences, so no corrected p is below this product.
            let least = least_p(units);
            #[expect(clippy::cast_precision_loss, reason = "few conditions")]
            let corrected = least * differences as f64;
            if units < LEAST_UNITS {
                warnings.push(format!(
                    "With {} the sign flip test has no p under 0.05, whatever the people do: expected at least {LEAST_UNITS}.",
                    Counted(units, "group")
                ));
            } else if corrected >= 0.05 {
                warnings.push(format!(
                    "With {} the least p is {least}, and {} after Holm's correction for {}: no corrected p under 0.05 exists. More groups or fewer conditions change that.",
                    Counted(units, "group"),
                    SixDigits(corrected),
                    Counted(differences, "difference"),
                ));
            }
        }
        // An unequal use of the rows mixes the effect of the order into the differences between conditions.
        let rows = study.order_rows();
        if study.order == Order::Williams && !study.groups.is_multiple_of(rows) {
            warnings.push(format!(
                "{} do not use each of the {rows} rows of the order equally often: expected a multiple of {rows}.",
                Counted(study.groups, "group")
            ));
        }
        warnings
    }
}

/// Returns the least p of a sign flip test of so many differences.
fn least_p(units: usize) -> f64 {
    // The observed signs and their mirror image are two of 2ⁿ choices. Drawn flips end at 10⁻⁶, which no warning depends on.
    libm::exp2(1.0 - f64::from(u32::try_from(units).unwrap_or(u32::MAX)))
}

fn conditions(study: &Study) -> Html {
    let head = study.factors.iter().fold(Table::new().column("condition"), |table, factor| table.column(factor.key.as_str()));
    let table = study.conditions.iter().enumerate().fold(head, |table, (place, condition)| {
        let values = condition.texts.iter().map(|text| Html::text(text));
        let first = if place == 0 { " (the first)" } else { "" };
        table.row(std::iter::once(Html::text(&format!("{}{first}", place + 1))).chain(values))
    });
    Html::table(&table)
}

/// Returns the section of a measure or of a question.
fn section(study: &Study, measure: &Analysed) -> Html {
    let mut content = Html::heading(3, measure.name.as_str());
    if let Some(about) = about(&measure.name) {
        content = content.and(Html::paragraph(about));
    }
    if measure.left_out > 0 {
        let said = format!("{} without a value in some condition left out.", Counted(measure.left_out, "group"));
        content = content.and(Html::paragraph(said));
    }
    if measure.rows.is_empty() {
        return Html::section(&measure.name, content.and(Html::paragraph("No group has a value in every condition.")));
    }
    // A picture per panel fits the width of a phone, and on wider screens both stand side by side.
    let narrow = |panel: Panel| Html::picture(&Picture::new("").aspect(0.5).size(Size::ONE_COLUMN).panel(panel).svg());
    content = content.and(Html::figure("", Html::beside(panels(study, measure).into_iter().map(narrow))));
    Html::section(&measure.name, content.and(figures(study, measure)))
}

/// Returns the description of a measure; `None` for a question.
fn about(name: &str) -> Option<String> {
    // The last dot separates the name of the peer from the measure, because names of measures have no dot.
    let of_peer = name.strip_prefix("peers.").and_then(|rest| rest.rsplit_once('.')).map(|(_, name)| name);
    let is_it = |measure: &&Measure| measure.name() == of_peer.unwrap_or(name) && (measure.scope() == Scope::Peer) == of_peer.is_some();
    Measure::ALL.iter().find(is_it).map(|measure| format!("{}.", measure.about()))
}

/// Returns the table of means and differences.
fn figures(study: &Study, measure: &Analysed) -> Html {
    let has_trials = measure.timed_out.iter().any(Option::is_some);
    let head = Table::new().column("condition").number("mean ± interval");
    let head = if has_trials { head.number("timed out") } else { head };
    let head = head.number("less the first").number("d").number("p").number("p after Holm");
    let table = study.conditions.iter().enumerate().fold(head, |table, (place, condition)| {
        let mean = measure.means.get(place);
        let mean = mean.map(|mean| with_interval(mean.mean, mean.half_width)).unwrap_or_default();
        let timed_out = has_trials.then(|| measure.timed_out[place].map(|share| format!("{} of {}", share.count, share.of)).unwrap_or_default());
        let difference = place.checked_sub(1).and_then(|place| measure.differences.get(place));
        let cells = difference.map_or_else(Default::default, |difference| {
            let effect = difference.effect.map(|effect| format!("{effect:.2}")).unwrap_or_default();
            let estimate = with_interval(difference.estimate.mean, difference.estimate.half_width);
            [estimate, effect, p_text(difference.p), p_text(difference.p_holm)]
        });
        let cells = std::iter::once(mean).chain(timed_out).chain(cells);
        table.row(std::iter::once(Html::text(&condition.label)).chain(cells.map(Html::from)))
    });
    Html::table(&table)
}

/// Returns a number with the half width of its interval, both with four significant digits of the larger one.
pub(crate) fn with_interval(mean: f64, half_width: Option<f64>) -> String {
    match half_width {
        Some(half) => format!("{} ± {}", short(mean), short(half)),
        None => short(mean),
    }
}

/// Returns a number with four significant digits.
pub(crate) fn short(number: f64) -> String {
    // The text rounds in decimal. Division and multiplication by a power of ten would add errors of their own.
    let rounded: f64 = format!("{number:.3e}").parse().unwrap_or(number);
    SixDigits(rounded).to_string()
}

pub(crate) fn p_text(p: f64) -> String {
    if p < 0.0001 { "< 0.0001".to_owned() } else { format!("{p:.4}") }
}

/// Draws the panels of a measure or of a question below each other.
fn picture(study: &Study, measure: &Analysed) -> Picture {
    panels(study, measure).into_iter().fold(Picture::new("").aspect(0.5), Picture::panel)
}

/// Draws the means with their intervals, a row per condition, and the curves over trials.
fn panels(study: &Study, measure: &Analysed) -> Vec<Panel> {
    let count = study.conditions.len();
    // The first condition is uppermost.
    let names: Vec<&str> = study.conditions.iter().rev().map(|condition| condition.label.as_str()).collect();
    let mut rows = Panel::new(Axis::new(measure.name.as_str()), Axis::new("").categories(names)).titled("Means and their intervals");
    for (condition, mean) in measure.means.iter().enumerate() {
        let y = place(count - 1 - condition);
        // A single group has no interval, and equal values have an interval of width zero: the mark stands alone then.
        if let Some(half) = mean.half_width.filter(|half| *half > 0.0) {
            let (low, high) = (mean.mean - half, mean.mean + half);
            let bar = vec![(low, y - HALF_BAR), (high, y - HALF_BAR), (high, y + HALF_BAR), (low, y + HALF_BAR)];
            rows = rows.with(Region::new([bar], Fill::Deep(condition)));
        }
        rows = rows.with(Line::new([(mean.mean, y)], Look::of(condition)).marks_only(Marker::of(condition)));
    }
    // A curve of one trial would repeat the means, and a question has no trials.
    if measure.curves.is_empty() || study.trials < 2 {
        return vec![rows];
    }
    let curves = measure.curves.iter().zip(&study.conditions).enumerate().map(|(condition, (curve, about))| {
        let points = curve.iter().enumerate().map(|(trial, value)| (place(trial), *value));
        Line::new(points, Look::of(condition)).named(about.label.as_str()).marked(Marker::of(condition))
    });
    let numbers: Vec<String> = (1..=study.trials).map(|trial| trial.to_string()).collect();
    let trials = Axis::new("trial").categories(numbers.iter().map(String::as_str));
    vec![rows, Panel::new(trials, Axis::new(measure.name.as_str())).titled("Means over trials").with_all(curves)]
}

fn place(number: usize) -> f64 {
    f64::from(u32::try_from(number).unwrap_or(u32::MAX))
}
