//! Rows as one page of HTML.

use cohaptic_picture::Size;
use cohaptic_picture::page::{Html, Page, Table};

use crate::groups::{Group, groups};
use crate::numbers::short;
use crate::{Row, Subject, plots};

/// Facts about a measurement for the head of the page, which the rows do not contain.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct About {
    /// A line for readers, such as the machine and the command; empty without such a line.
    pub line: String,
    /// `true` if the measurement ended early.
    pub partial: bool,
}

/// Returns the page, with plots of this size.
#[must_use]
pub fn html(rows: &[Row], about: &About, size: Size) -> String {
    let first = "What each method costs and how wrong it is, on the same work. Costs are processor time unless their unit says otherwise, and differ from run to run; \
                 errors are against the reference named with them. In the pictures both scales are logarithmic: further left is cheaper, further down more exact.";
    let mut page = Page::new("Speed against error").with(Html::paragraph(first));
    if !about.line.is_empty() {
        page = page.with(Html::paragraph(about.line.as_str()));
    }
    if about.partial {
        page = page.with(Html::warning("The measurement was interrupted: these rows were measured until then."));
    }
    let groups = groups(rows);
    // Only subjects with rows get a section and a link.
    let present: Vec<Subject> = Subject::ALL.into_iter().filter(|subject| groups.iter().any(|group| group.subject == *subject)).collect();
    page = page.with(Html::list(present.iter().map(|subject| Html::link(subject.name(), subject.name()))));
    for subject in present {
        let own = groups.iter().filter(|group| group.subject == subject);
        let content = own.fold(Html::heading(2, subject.name()), |content, group| content.and(figure(group, size)));
        page = page.with(Html::section(subject.name(), content));
    }
    page.html()
}

/// Returns the plots and the table of a group.
fn figure(group: &Group<'_>, size: Size) -> Html {
    let mut content = Html::heading(3, group.title());
    for reference in group.references() {
        content = content.and(Html::paragraph(format!("Against: {reference}")));
    }
    // The same plots as in the files, made from this group alone.
    let own: Vec<Row> = group.rows.iter().map(|row| (*row).clone()).collect();
    for plot in plots(&own, size) {
        content = content.and(Html::picture(&plot.svg)).and(Html::caption(plot.caption));
    }
    let head = Table::new().column("method").column("setting").number(group.cost_unit).number(format!("error: {}", group.error_unit)).column("note");
    let table = group.rows.iter().fold(head, |table, row| {
        table.row([
            row.method.as_str().into(),
            row.setting.as_str().into(),
            short(row.cost).into(),
            short(row.error).into(),
            row.note.as_str().into(),
        ])
    });
    Html::figure("", content.and(Html::table(&table)))
}
