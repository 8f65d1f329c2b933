//! Rows as one page of HTML: no scripts, nothing from elsewhere, so that it can be opened from a folder or sent by mail.

use std::fmt::Write as _;

use cohaptic_picture::escape;

use crate::groups::{Group, groups};
use crate::numbers::short;
use crate::{Row, Subject, plots};

/// How the page looks: in light and in dark, on a wide screen and on a narrow one.
const STYLE: &str = "\
:root { color-scheme: light dark; --ground: #fff; --ink: #1b1b1b; --line: #bbb; --warning: #9b1c1c; }
@media (prefers-color-scheme: dark) { :root { --ground: #16181b; --ink: #e6e6e6; --line: #555; --warning: #ff8f8f; } }
body { margin: 0; background: var(--ground); color: var(--ink); font: 1rem/1.5 system-ui, sans-serif; }
main { max-width: 64rem; margin: 0 auto; padding: 1rem; }
h1, h2, h3 { line-height: 1.25; }
a { color: inherit; }
section, figure { margin: 0 0 2rem; padding: 0; border-top: 1px solid var(--line); }
p.warning { color: var(--warning); font-weight: 600; }
.wide { overflow-x: auto; }
.wide svg { width: 100%; min-width: 40rem; height: auto; }
table { border-collapse: collapse; margin: 1rem 0; font-size: .9rem; }
th, td { text-align: left; vertical-align: top; padding: .25rem .75rem .25rem 0; border-bottom: 1px solid var(--line); }
th.number, td.number { text-align: right; font-variant-numeric: tabular-nums; }
tbody th { font-weight: 400; }
";

/// What stands at the head of the page besides the rows: where and when they were measured is not known here.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct About {
    /// A line for people, such as the machine and the command; empty if there is none.
    pub line: String,
    /// Whether the measurement was ended before it was done.
    pub partial: bool,
}

/// The page.
#[must_use]
pub fn html(rows: &[Row], about: &About) -> String {
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>Speed against error</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n\
         <h1>Speed against error</h1>\n<p>What each method costs and how wrong it is, on the same work. Costs are processor time unless their unit says otherwise, and differ from run to run; \
         errors are against the reference named with them. In the pictures both scales are logarithmic: further left is cheaper, further down more exact.</p>\n"
    );
    if !about.line.is_empty() {
        let _ = writeln!(page, "<p>{}</p>", escape(&about.line));
    }
    if about.partial {
        page.push_str("<p class=\"warning\">The measurement was interrupted: this is what was measured until then.</p>\n");
    }
    let groups = groups(rows);
    let present: Vec<Subject> = Subject::ALL.into_iter().filter(|subject| groups.iter().any(|group| group.subject == *subject)).collect();
    page.push_str("<ul>\n");
    for subject in &present {
        let _ = writeln!(page, "<li><a href=\"#{0}\">{0}</a></li>", subject.name());
    }
    page.push_str("</ul>\n");
    for subject in present {
        let _ = writeln!(page, "<section id=\"{0}\">\n<h2>{0}</h2>", subject.name());
        for group in groups.iter().filter(|group| group.subject == subject) {
            write_group(&mut page, group);
        }
        page.push_str("</section>\n");
    }
    page.push_str("</main>\n</body>\n</html>\n");
    page
}

fn write_group(page: &mut String, group: &Group<'_>) {
    let _ = writeln!(page, "<figure>\n<h3>{}</h3>", escape(&group.title()));
    for reference in group.references() {
        let _ = writeln!(page, "<p>Against: {}</p>", escape(reference));
    }
    let own: Vec<Row> = group.rows.iter().map(|row| (*row).clone()).collect();
    for plot in plots(&own) {
        let _ = writeln!(page, "<div class=\"wide\">{}</div>\n<figcaption>{}</figcaption>", plot.svg, escape(&plot.caption));
    }
    let _ = write!(
        page,
        "<div class=\"wide\">\n<table>\n<thead><tr><th scope=\"col\">method</th><th scope=\"col\">setting</th><th scope=\"col\" class=\"number\">{}</th>\
         <th scope=\"col\" class=\"number\">error: {}</th><th scope=\"col\">note</th></tr></thead>\n<tbody>\n",
        escape(group.cost_unit),
        escape(group.error_unit)
    );
    for row in &group.rows {
        let _ = writeln!(
            page,
            "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"number\">{}</td><td class=\"number\">{}</td><td>{}</td></tr>",
            escape(&row.method),
            escape(&row.setting),
            short(row.cost),
            short(row.error),
            escape(&row.note)
        );
    }
    page.push_str("</tbody>\n</table>\n</div>\n</figure>\n");
}
