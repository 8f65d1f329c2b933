//! An HTML page with all results.

use cohaptic_picture::page::{Html, Mark, Page, Table};

use crate::{Claim, Figure, Reproduction, Verdict};

/// Returns the page.
#[must_use]
pub fn html(reproduction: &Reproduction) -> String {
    let about = "Every figure and claim of R. Rakhsha and D. Constantinescu, “Average-Position Coordination for Distributed Multi-User Networked Haptic Cooperation”, \
                 Journal of Human-Robot Interaction 4(3), 2015, computed anew. ρ is the spectral radius of the relative motion over a frame of 8 ms: below 1 a disturbance \
                 dies out. Where the printed parameters do not give the printed numbers, this page says so.";
    let summary = reproduction.claims.iter().map(|claim| Html::link(claim.id, claim.claim).and(": ").and(short(&claim.verdict)));
    let mut page =
        Page::new("Average-position coordination, again").with(Html::paragraph(about)).with(Html::heading(2, "Claims")).with(Html::list(summary));
    for claim in &reproduction.claims {
        page = page.with(claim_on_page(claim));
    }
    page = page.with(Html::heading(2, "Figures"));
    for figure in &reproduction.figures {
        page = page.with(figure_on_page(figure));
    }
    page.html()
}

/// Returns a verdict in a word or two, readable without colours.
fn short(verdict: &Verdict) -> Html {
    match verdict {
        Verdict::Holds => Html::mark(Mark::Good, "holds"),
        Verdict::HoldsWhere(_) => Html::mark(Mark::Partly, "holds in part"),
        Verdict::FailsAt(_) => Html::mark(Mark::Bad, "fails"),
    }
}

fn claim_on_page(claim: &Claim) -> Html {
    let facts = [("The paper", claim.paper.into()), ("Ours", claim.ours.as_str().into()), ("Verdict", claim.verdict.to_string().into())];
    let mut content = Html::heading(3, Html::text(claim.claim).and(" ").and(short(&claim.verdict))).and(Html::facts(facts));
    if let Some(scene) = &claim.scene {
        let how = claim.how.as_deref().unwrap_or_default();
        content = content.and(Html::details("The scene that shows it", Html::paragraph(how).and(Html::preformatted(scene))));
    }
    Html::section(claim.id, content)
}

fn figure_on_page(figure: &Figure) -> Html {
    let head = figure.table.head.iter().fold(Table::new(), |table, name| table.column(name.as_str()));
    let table = figure.table.rows.iter().fold(head, |table, row| table.row(row.iter().map(|cell| Html::text(cell))));
    let content =
        Html::heading(3, figure.title.as_str()).and(Html::picture(&figure.svg)).and(Html::caption(figure.caption.as_str())).and(Html::table(&table));
    Html::figure(&figure.id, content)
}

/// Writes a share as a percentage.
pub(crate) fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Writes shares as percentages, separated by commas.
pub(crate) fn percents(shares: &[f64]) -> String {
    let all: Vec<String> = shares.iter().map(|share| format!("{:.1}", 100.0 * share)).collect();
    format!("{} %", all.join(", "))
}

/// Writes a time \[s\], or words for a missing time.
pub(crate) fn seconds(time: Option<f64>) -> String {
    time.map_or_else(|| "not reached".to_owned(), |time| format!("{time:.3} s"))
}
