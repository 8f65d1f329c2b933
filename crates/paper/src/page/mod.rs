//! One page of HTML that shows it all: no scripts, nothing from elsewhere, so that it can be opened from a folder or sent by mail.

mod style;

use std::fmt::Write as _;

use cohaptic_picture::escape;

use crate::{Claim, Figure, Reproduction, Table, Verdict};

/// The page.
#[must_use]
pub fn html(reproduction: &Reproduction) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>Average-position coordination, again</title>\n<style>\n{}</style>\n</head>\n<body>\n<main>\n\
         <h1>Average-position coordination, again</h1>\n\
         <p>Every figure and claim of R. Rakhsha and D. Constantinescu, “Average-Position Coordination for Distributed Multi-User Networked Haptic Cooperation”, Journal of \
         Human-Robot Interaction 4(3), 2015, computed anew. ρ is the spectral radius of the relative motion over a frame of 8 ms: below 1 a disturbance dies out. Where the printed \
         parameters do not give the printed numbers, this page says so.</p>\n",
        style::STYLE
    );
    page.push_str("<h2 id=\"claims\">Claims</h2>\n<ul class=\"summary\">\n");
    for claim in &reproduction.claims {
        let _ = writeln!(page, "<li><a href=\"#{}\">{}</a>: {}</li>", claim.id, escape(claim.claim), short(&claim.verdict));
    }
    page.push_str("</ul>\n");
    for claim in &reproduction.claims {
        write_claim(&mut page, claim);
    }
    page.push_str("<h2 id=\"figures\">Figures</h2>\n");
    for figure in &reproduction.figures {
        write_figure(&mut page, figure);
    }
    page.push_str("</main>\n</body>\n</html>\n");
    page
}

/// The first word or two, which also say the verdict without colour.
fn short(verdict: &Verdict) -> &'static str {
    match verdict {
        Verdict::Holds => "<b class=\"holds\">holds</b>",
        Verdict::HoldsWhere(_) => "<b class=\"partly\">holds in part</b>",
        Verdict::FailsAt(_) => "<b class=\"fails\">fails</b>",
    }
}

fn write_claim(page: &mut String, claim: &Claim) {
    let _ = write!(
        page,
        "<section id=\"{}\">\n<h3>{} {}</h3>\n<dl>\n<dt>The paper</dt><dd>{}</dd>\n<dt>Ours</dt><dd>{}</dd>\n<dt>Verdict</dt><dd>{}</dd>\n</dl>\n",
        claim.id,
        escape(claim.claim),
        short(&claim.verdict),
        escape(claim.paper),
        escape(&claim.ours),
        escape(&claim.verdict.to_string())
    );
    if let Some(scene) = &claim.scene {
        let how = claim.how.as_deref().unwrap_or_default();
        let _ =
            write!(page, "<details>\n<summary>The scene that shows it</summary>\n<p>{}</p>\n<pre>{}</pre>\n</details>\n", escape(how), escape(scene));
    }
    page.push_str("</section>\n");
}

fn write_figure(page: &mut String, figure: &Figure) {
    // Beyond the declaration of a document of its own, an SVG stands in a page as it is.
    let svg = figure.svg.find("<svg").map_or("", |start| &figure.svg[start..]);
    let _ = write!(
        page,
        "<figure id=\"{}\">\n<h3>{}</h3>\n<div class=\"wide\">{svg}</div>\n<figcaption>{}</figcaption>\n",
        figure.id,
        escape(&figure.title),
        escape(&figure.caption)
    );
    write_table(page, &figure.table);
    page.push_str("</figure>\n");
}

fn write_table(page: &mut String, table: &Table) {
    page.push_str("<div class=\"wide\">\n<table>\n<thead><tr>");
    for cell in &table.head {
        let _ = write!(page, "<th scope=\"col\">{}</th>", escape(cell));
    }
    page.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        page.push_str("<tr>");
        for (column, cell) in row.iter().enumerate() {
            let (open, close) = if column == 0 { ("<th scope=\"row\">", "</th>") } else { ("<td>", "</td>") };
            let _ = write!(page, "{open}{}{close}", escape(cell));
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</tbody>\n</table>\n</div>\n");
}
