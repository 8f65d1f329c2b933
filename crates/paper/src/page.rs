//! An HTML page with all results: first the answer in plain words, then each claim with its numbers and its figures.

use cohaptic_picture::page::{Html, Mark, Page, Table as HtmlTable};

use crate::table::{FAILS, Table};
use crate::{Claim, Figure, Reproduction, Verdict};

/// Returns the page.
#[must_use]
pub fn html(reproduction: &Reproduction) -> String {
    let claims = &reproduction.claims;
    let contents = claims.iter().fold(HtmlTable::new().column("claim").column("in the paper").column("verdict"), |table, claim| {
        table.row([Html::link(claim.id, claim.claim), claim.paper.into(), short(&claim.verdict)])
    });
    let mut page = Page::new("Average-position coordination, computed again")
        .with(Html::paragraph(
            "R. Rakhsha and D. Constantinescu, “Average-Position Coordination for Distributed Multi-User Networked Haptic Cooperation”, Journal of Human-Robot \
             Interaction 4(3), 2015, propose the strategy AP, and compare it with PD. This page computes each figure and each claim of the paper again.",
        ))
        .with(Html::heading(2, "Does AP do what the paper says?"))
        .with(answer(claims))
        .with(Html::list(by_verdict(claims)))
        .with(Html::paragraph(advice(claims)))
        .with(Html::table(&contents))
        .with(Html::heading(2, "How to read this page"))
        .with(Html::facts(symbols()));
    let mut topic = None;
    let mut shown: Vec<&str> = Vec::new();
    for claim in claims {
        if topic != Some(claim.topic) {
            page = page.with(Html::heading(2, claim.topic.words()));
            topic = Some(claim.topic);
        }
        page = page.with(claim_on_page(claim, &reproduction.figures, &mut shown));
    }
    // Each figure belongs to a claim. A figure without a claim is shown all the same.
    let rest = reproduction.figures.iter().filter(|figure| !shown.contains(&figure.id.as_str()));
    rest.fold(page, |page, figure| page.with(figure_on_page(figure))).html()
}

/// Returns the paper's claims with a verdict of one kind.
fn of_kind(claims: &[Claim], kind: fn(&Verdict) -> bool) -> impl Iterator<Item = &Claim> {
    claims.iter().filter(move |claim| !claim.is_own && kind(&claim.verdict))
}

const fn holds(verdict: &Verdict) -> bool {
    matches!(verdict, Verdict::Holds)
}

const fn holds_in_part(verdict: &Verdict) -> bool {
    matches!(verdict, Verdict::HoldsWhere(_))
}

const fn fails(verdict: &Verdict) -> bool {
    matches!(verdict, Verdict::FailsAt(_))
}

/// Returns the answer to the question of the page, in numbers of claims.
fn answer(claims: &[Claim]) -> Html {
    let count = |kind| of_kind(claims, kind).count();
    let (good, partly, bad) = (count(holds), count(holds_in_part), count(fails));
    let word = match (partly, bad) {
        (0, 0) => "Yes",
        (_, 0) => "Mostly",
        _ if good + partly > 0 => "In part",
        _ => "No",
    };
    let all = good + partly + bad;
    let numbers = format!(
        "Of {all} claims of the paper, {good} hold in everything that was computed, {partly} hold under some conditions, and {bad} {} refuted by a scene or by the figures.",
        if bad == 1 { "is" } else { "are" }
    );
    said(&format!("{word}."), &numbers)
}

/// Returns a sentence per kind of verdict, with the claims in plain words.
fn by_verdict(claims: &[Claim]) -> Vec<Html> {
    let sentence = |mark: Mark, words: &str, kind: fn(&Verdict) -> bool| {
        let joined = of_kind(claims, kind).map(|claim| Html::link(claim.id, claim.short)).reduce(|text, next| text.and("; ").and(next))?;
        Some(Html::mark(mark, words).and(" ").and(joined).and("."))
    };
    [
        sentence(Mark::Good, "It is so that", holds),
        sentence(Mark::Partly, "It depends whether", holds_in_part),
        sentence(Mark::Bad, "It is not so in general that", fails),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Returns the meaning of the answer for somebody with a choice between the strategies.
fn advice(claims: &[Claim]) -> &'static str {
    let is = |id: &str, kind: fn(&Verdict) -> bool| claims.iter().any(|claim| claim.id == id && kind(&claim.verdict));
    match (is("less-viscous", holds), is("region-contains", holds)) {
        (true, true) => "So for the same gains, choose AP: the object feels less viscous, and nothing that is stable with PD is lost.",
        (true, false) => {
            "So for the same gains AP gives the less viscous object, but it need not be stable where PD is. Ask cohaptic stability point for your own gains, delays and \
             number of users before you rely on either."
        }
        (false, _) => {
            "Ask cohaptic stability point and cohaptic admittance for your own gains, delays and number of users before you rely on either."
        }
    }
}

/// Returns the symbols of the page with their meanings.
fn symbols() -> [(&'static str, Html); 6] {
    [
        ("AP, PD", "The strategies. AP pulls each copy of the object to the average of the others, PD to each of the others.".into()),
        ("N", "Number of users. Each has a copy of the object.".into()),
        ("KT, BT; KC, BC", "Stiffness [N/m] and damping [N·s/m] of the coordination between copies, and of the coupling between a device and its copy.".into()),
        (
            "ρ",
            "Spectral radius of the relative motion over a frame of 8 ms, the time from one sample to the next. Below 1 every disturbance dies out: the scene is stable."
                .into(),
        ),
        (
            "a reading",
            "The paper leaves open whether a delay is one way or a round trip, and whether a copy in the figures has the mass mO/N or mO. Each combination is a reading.".into(),
        ),
        (FAILS, "A number for which the claim fails.".into()),
    ]
}

/// Returns a verdict in a word or two, readable without colours.
fn short(verdict: &Verdict) -> Html {
    match verdict {
        Verdict::Holds => Html::mark(Mark::Good, "holds"),
        Verdict::HoldsWhere(_) => Html::mark(Mark::Partly, "holds in part"),
        Verdict::FailsAt(_) => Html::mark(Mark::Bad, "fails"),
    }
}

/// Returns the places where a claim holds or fails; `None` for a claim without exception.
fn place(verdict: &Verdict) -> Option<Html> {
    let parts = |text: &str| {
        // A verdict joins its conditions with semicolons.
        let parts: Vec<&str> = text.split("; ").collect();
        if parts.len() == 1 { Html::paragraph(text) } else { Html::list(parts.into_iter().map(Html::text)) }
    };
    match verdict {
        Verdict::Holds => None,
        Verdict::HoldsWhere(text) => Some(Html::paragraph(Html::strong("It holds where")).and(parts(text))),
        Verdict::FailsAt(text) => Some(Html::paragraph(Html::strong("It fails at")).and(parts(text))),
    }
}

/// Returns a paragraph with a word at the begin.
fn said(word: &str, text: &str) -> Html {
    Html::paragraph(Html::strong(word).and(" ").and(text))
}

fn claim_on_page(claim: &Claim, figures: &[Figure], shown: &mut Vec<&str>) -> Html {
    let from = if claim.is_own { "The paper, which does not claim this" } else { "The paper" };
    let mut text = said(&format!("{from} ({}):", claim.paper), claim.says).and(said("Here:", &claim.ours));
    text = text.and(place(&claim.verdict).unwrap_or_default());
    if !claim.why.is_empty() && !holds(&claim.verdict) {
        text = text.and(said("Why they differ:", claim.why));
    }
    let scene = Html::paragraph(claim.how.as_str())
        .and(Html::preformatted(&claim.commands.lines().map(broken).collect::<Vec<_>>().join("\n")))
        .and(Html::details(&format!("The scene, {}.toml", claim.id), Html::preformatted(&claim.scene)));
    let scene = Html::paragraph(Html::strong("The scene that shows it")).and(scene);
    // One narrow table stands beside the words. Several stand beside each other below the words, and wide ones below each other.
    let (wide, narrow): (Vec<_>, Vec<_>) = claim.tables.iter().partition(|table| table.head.len() > 5);
    let wide = wide.into_iter().fold(Html::default(), |html, table| html.and(table_on_page(table)));
    let narrow: Vec<Html> = narrow.into_iter().map(table_on_page).collect();
    let (text, scene) = match narrow.len() {
        0 => (text, scene),
        1 => (Html::beside(std::iter::once(text.and(scene)).chain(narrow)), Html::default()),
        _ => (text.and(Html::beside(narrow)), scene),
    };
    let mut content = Html::heading(3, Html::text(claim.claim).and(" ").and(short(&claim.verdict)));
    content = content.and(text).and(wide);
    for id in claim.figures {
        let Some(figure) = figures.iter().find(|figure| figure.id == *id) else { continue };
        // Several claims may share a figure. The figure is drawn once.
        content = if shown.contains(id) {
            content.and(Html::paragraph(Html::text("See ").and(Html::link(id, figure.title.as_str())).and(".")))
        } else {
            shown.push(*id);
            content.and(figure_on_page(figure))
        };
    }
    Html::section(claim.id, content.and(scene))
}

/// Breaks a long command before its options, as a shell takes it.
fn broken(command: &str) -> String {
    if command.chars().count() > 60 { command.replace(" --", " \\\n    --") } else { command.to_owned() }
}

fn table_on_page(table: &Table) -> Html {
    let is_number = |place: usize| {
        // The first letter of a number is a digit or a sign.
        let cells = table.rows.iter().filter_map(|row| row.get(place));
        // A column without cells is text: `all` is true of no cells.
        cells.clone().count() > 0 && cells.into_iter().all(|cell| cell.starts_with(|letter: char| letter.is_ascii_digit() || "+-−".contains(letter)))
    };
    let head = table.groups.iter().fold(HtmlTable::new().titled(table.title.as_str()), |html, (name, columns)| html.group(name.as_str(), *columns));
    let head = table.head.iter().enumerate().fold(
        head,
        |html, (place, name)| {
            if is_number(place) { html.number(name.as_str()) } else { html.column(name.as_str()) }
        },
    );
    let cell = |text: &String| if text.ends_with(FAILS) { Html::mark(Mark::Bad, text) } else { Html::text(text) };
    let html = table.rows.iter().fold(head, |html, row| html.row(row.iter().map(cell)));
    Html::table(&html)
}

fn figure_on_page(figure: &Figure) -> Html {
    let caption = Html::strong(&format!("{}.", figure.title)).and(" ").and(figure.caption.as_str());
    Html::figure(&figure.id, Html::picture(&figure.svg).and(Html::caption(caption)))
}
